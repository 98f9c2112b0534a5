import numpy as np
import pytest

from pegbar.sample.dancer import FRAMES, LIFTED, dance, pony_tail, pose
from pegbar.sample.skeleton import NAMES, OFFSETS, PARENTS, reach_leg, swing, unit

BONES = [(parent, child) for child, parent in enumerate(PARENTS) if parent >= 0]


@pytest.fixture(scope="module")
def phrase():
    return dance()


def lengths(positions):
    parents, children = np.transpose(BONES)
    return np.linalg.norm(positions[:, children] - positions[:, parents], axis=2)


def test_bones_are_constant_in_the_clip_and_stretch_in_the_drawings_only(phrase):
    rest = np.linalg.norm(OFFSETS[1:], axis=1)
    np.testing.assert_allclose(lengths(phrase.clip.positions), np.broadcast_to(rest, (FRAMES, len(rest))), atol=1e-12)
    ratio = lengths(phrase.drawn) / rest
    assert ratio.min() >= 0.88
    assert ratio.max() <= 1.13
    for name in ("chest", "left_elbow", "right_hand", "left_knee", "right_foot"):
        bone = ratio[:, NAMES.index(name) - 1]
        assert bone.min() < 0.96, name
        assert bone.max() > 1.05, name
    for name in ("head", "left_toe", "right_finger", "left_hip"):
        np.testing.assert_allclose(ratio[:, NAMES.index(name) - 1], 1, atol=1e-12)


def test_rotations_carry_the_bones(phrase):
    clip = phrase.clip
    turned = np.einsum("fjxy,jy->fjx", clip.rotations[:, [a for a, _ in BONES]], OFFSETS[[b for _, b in BONES]])
    want = np.array([clip.positions[:, b] - clip.positions[:, a] for a, b in BONES]).swapaxes(0, 1)
    np.testing.assert_allclose(turned, want, atol=1e-12)
    identity = clip.rotations @ np.swapaxes(clip.rotations, -1, -2)
    np.testing.assert_allclose(identity, np.broadcast_to(np.eye(3), identity.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(clip.rotations), 1, atol=1e-12)


def test_a_human_of_human_height():
    rest = np.zeros((len(NAMES), 3))
    for child, parent in enumerate(PARENTS):
        rest[child] = OFFSETS[child] + (rest[parent] if parent >= 0 else 0)
    crown = rest[NAMES.index("head"), 1] + 0.12
    assert 1.6 < crown - rest[:, 1].min() + 0.02 < 1.8
    for name in NAMES:
        if name.startswith("left_"):
            twin = rest[NAMES.index(name.replace("left", "right"))]
            np.testing.assert_allclose(rest[NAMES.index(name)] * (-1, 1, 1), twin)


@pytest.mark.parametrize("stretch", [0.0, 1.0])
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_planted_foot_stays_where_it_is(side, stretch):
    positions, _ = pose(np.arange(0, FRAMES, 0.25), stretch)
    start, end = LIFTED[side]
    times = np.arange(0, FRAMES, 0.25)
    toe = positions[:, NAMES.index(f"{side}_toe")]
    planted = (times <= start) | (times >= end)
    assert np.ptp(toe[planted], axis=0).max() < 1e-9
    assert toe[planted, 1].max() == pytest.approx(0.02)
    assert toe[~planted, 1].max() > 0.3
    assert positions[..., 1].min() > 0.019


@pytest.mark.parametrize("stretch", [0.0, 1.0])
def test_the_dance_loops_and_moves_smoothly(stretch):
    times = np.arange(0.0, 2 * FRAMES)
    positions, rotations = pose(times, stretch)
    np.testing.assert_allclose(positions[:FRAMES], positions[FRAMES:], atol=1e-9)
    np.testing.assert_allclose(rotations[:FRAMES], rotations[FRAMES:], atol=1e-9)
    tails = pony_tail(times)
    np.testing.assert_allclose(tails[:FRAMES], tails[FRAMES:], atol=1e-9)
    speed = np.linalg.norm(np.diff(positions, axis=0), axis=2) * 24
    assert speed.max() < 12
    change = np.linalg.norm(np.diff(positions, n=2, axis=0), axis=2)
    assert change.max() < 0.25
    assert speed[:, NAMES.index("left_hand")].max() > 2


def test_an_arm_crosses_in_front_and_behind_and_one_reaches_to_the_camera(phrase):
    drawn = phrase.drawn
    chest = drawn[:, NAMES.index("chest")]
    front = phrase.clip.rotations[:, NAMES.index("chest"), :, 2]
    for side in ("left", "right"):
        ahead = ((drawn[:, NAMES.index(f"{side}_hand")] - chest) * front).sum(axis=1)
        assert ahead.max() > 0.25, side
        assert ahead.min() < -0.1, side
    reach = drawn[:, NAMES.index("left_hand")] - drawn[:, NAMES.index("left_shoulder")]
    assert (reach[:, 2] / np.linalg.norm(reach, axis=1)).max() > 0.9


def test_more_frames_are_the_same_dance(phrase):
    np.testing.assert_allclose(dance(96).drawn[::2], phrase.drawn, atol=1e-12)
    with pytest.raises(ValueError, match="^frames: "):
        dance(0)


def test_a_leg_reaches_its_foot_or_stretches_towards_it():
    hip, pole = np.zeros((2, 3)), np.array([[0.0, 0, 1], [0, 0, 1]])
    ankle = np.array([[0.1, -0.6, 0.1], [0.0, -2.0, 0.0]])
    upper, lower = reach_leg(hip, ankle, pole, np.full(2, 0.4), np.full(2, 0.4))
    knee = 0.4 * -upper[..., 1]
    foot = knee + 0.4 * -lower[..., 1]
    np.testing.assert_allclose(foot, [[0.1, -0.6, 0.1], [0, -0.8, 0]], atol=1e-4)
    assert knee[0, 2] > 0.1
    np.testing.assert_allclose(np.linalg.det(upper), 1)


def test_a_swing_is_the_smallest_rotation_onto_a_direction():
    rest, aims = np.array([1.0, 0, 0]), unit(np.array([[0.0, 1, 0], [1, 2, -3], [-0.9, 0.1, 0.2], [1, 0, 0]]))
    rotations = swing(rest, aims)
    np.testing.assert_allclose(rotations @ rest, aims, atol=1e-12)
    angles = np.arccos((np.trace(rotations, axis1=1, axis2=2) - 1) / 2)
    np.testing.assert_allclose(angles, np.arccos(aims @ rest), atol=1e-7)
