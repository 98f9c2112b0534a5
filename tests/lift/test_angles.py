import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pegbar import Motion, read_motion
from pegbar.lift.angles import joint_angles
from pegbar.lift.turning import best_rotation, steady_swing, swing
from tests.motions import NAMES, swaying

CANONICAL = ("pelvis", "head", "left_hip", "left_knee", "left_foot", "right_hip")


def apart(a, b):
    """Angles in radians between rotations (..., 3, 3)."""
    return Rotation.from_matrix((np.swapaxes(a, -1, -2) @ b).reshape(-1, 3, 3)).magnitude()


@pytest.mark.parametrize("names", [NAMES, CANONICAL, ("pelvis", "left_foot")])
def test_the_clips_own_markers_give_the_clip(names):
    motion = swaying()
    again = joint_angles(motion.markers(names), names, motion)
    assert apart(again.rotations, motion.rotations).max() < 1e-6
    np.testing.assert_allclose(again.positions, motion.positions, atol=1e-6)


def test_another_dance_of_the_same_body_is_met_exactly():
    clip, other = swaying(seed=0), swaying(seed=5)
    again = joint_angles(other.positions, NAMES, clip)
    # All but the pelvis's children are reached by swings; those need the pelvis's own rotation.
    np.testing.assert_allclose(again.positions, other.positions, atol=1e-5)
    lengths = np.linalg.norm(again.positions[:, 5] - again.positions[:, 4], axis=1)
    np.testing.assert_allclose(lengths, lengths[0])


def test_rigid_motion_of_all_markers_is_that_motion_of_the_skeleton():
    motion = swaying()
    turn, shift = Rotation.from_rotvec([0.3, 2.5, -0.4]).as_matrix(), np.array([1, 2, 3])
    again = joint_angles(motion.positions @ turn.T + shift, NAMES, motion)
    np.testing.assert_allclose(again.positions, motion.positions @ turn.T + shift, atol=1e-6)
    np.testing.assert_allclose(again.rotations, turn @ motion.rotations, atol=1e-6)


def test_other_lengths_are_met_within_their_error_or_exactly_with_stretch():
    clip, other = swaying(seed=0), swaying(seed=5, stretch=0.2)
    rigid = joint_angles(other.positions, NAMES, clip)
    assert 0.01 < np.linalg.norm(rigid.positions - other.positions, axis=2).max() < 0.6 * 0.2 * 3
    hip, knee = NAMES.index("left_hip"), NAMES.index("left_knee")
    np.testing.assert_allclose(np.linalg.norm(rigid.positions[:, knee] - rigid.positions[:, hip], axis=1), 0.4)
    stretched = joint_angles(other.positions, NAMES, clip, stretch=True)
    np.testing.assert_allclose(stretched.positions, other.positions, atol=1e-9)


def test_the_twist_is_the_clips():
    motion = swaying()
    knee = NAMES.index("left_knee")
    roll = Rotation.from_rotvec([0, -0.7, 0]).as_matrix()
    turned = motion.rotations.copy()
    # The shin lies along its own offset; its roll moves no marker.
    axis = Rotation.from_rotvec(0.7 * np.array([0, -0.4, 0.02]) / np.hypot(0.4, 0.02)).as_matrix()
    turned[:, knee] = turned[:, knee] @ axis
    rolled = dataclasses.replace(motion, rotations=turned)
    again = joint_angles(motion.markers(CANONICAL), CANONICAL, rolled)
    np.testing.assert_allclose(again.rotations[:, knee], turned[:, knee], atol=1e-6)
    assert apart(roll, np.eye(3)).max() > 0.6


def test_a_limb_that_is_drawn_opposite_to_the_clip_does_not_flip():
    frames = 80
    angle = np.linspace(-0.3, 0.3, frames)
    clip = np.tile([[0.0, 0, 0], [0, 1.0, 0]], (frames, 1, 1))
    drawn = clip.copy()
    drawn[:, 1] = np.stack([np.sin(angle), -np.cos(angle), 0.02 * np.cos(9 * angle)], axis=1)
    motion = Motion(("a", "b"), (-1, 0), clip, np.tile(np.eye(3), (frames, 2, 1, 1)), 24.0)
    sharp = swing(clip[:, 1], drawn[:, 1])
    steady = steady_swing(clip[:, 1], drawn[:, 1], np.tile(np.eye(3), (frames, 1, 1)))
    assert apart(sharp[1:], sharp[:-1]).max() > 0.5
    assert apart(steady[1:], steady[:-1]).max() < 0.1
    np.testing.assert_allclose(steady @ [0, 1, 0], drawn[:, 1] / np.linalg.norm(drawn[:, 1], axis=1)[:, None])
    assert joint_angles(drawn, ["a", "b"], motion).positions.shape == (frames, 2, 3)


def test_swing_is_the_smallest_rotation():
    random = np.random.default_rng(0)
    a, b = random.normal(size=(2, 200, 3))
    a[0], b[0] = [0, 2, 0], [0, -1, 0]
    a[1], b[1] = [0, 0, 0], [1, 0, 0]
    turns = swing(a, b)
    unit = [v / np.maximum(np.linalg.norm(v, axis=1), 1e-30)[:, None] for v in (a, b)]
    np.testing.assert_allclose(np.einsum("fij,fj->fi", turns, unit[0])[2:], unit[1][2:], atol=1e-12)
    angles = np.arccos(np.clip(np.einsum("fi,fi->f", *unit), -1, 1))
    np.testing.assert_allclose(apart(np.eye(3), turns)[2:], angles[2:], atol=1e-6)
    np.testing.assert_allclose(turns[0] @ [0, 1, 0], [0, -1, 0], atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(turns), 1)
    np.testing.assert_allclose(turns[1], np.eye(3))


def test_best_rotation_is_the_least_squares_one_and_keeps_what_is_open():
    random = np.random.default_rng(1)
    source = random.normal(size=(20, 4, 3))
    turn = Rotation.random(20, random_state=2).as_matrix()
    target = np.einsum("fij,fnj->fni", turn, source)
    prior = np.tile(np.eye(3), (20, 1, 1))
    np.testing.assert_allclose(best_rotation(source, target, np.ones(4), prior), turn, atol=1e-5)
    noisy = target + 0.1 * random.normal(size=target.shape)
    weights = np.array([1.0, 2, 0.5, 1])
    for found, a, b in zip(best_rotation(source, noisy, weights, prior), source, noisy, strict=True):
        want = Rotation.align_vectors(b, a, weights)[0].as_matrix()
        np.testing.assert_allclose(found, want, atol=1e-5)
    line = np.tile([[0.0, 1, 0], [0, -2, 0]], (1, 1, 1))
    prior = Rotation.from_rotvec([[0, 0.8, 0]]).as_matrix()
    np.testing.assert_allclose(best_rotation(line, line, np.ones(2), prior), prior, atol=1e-6)


def test_real_clips_come_back_from_their_markers(test_data):
    names = [f"{side}_{part}" for side in ("left", "right") for part in ("shoulder", "elbow", "hand", "hip", "knee")]
    names += ["pelvis", "chest", "neck", "head", "left_foot", "right_foot"]
    clip = read_motion(test_data / "mocap/bvh/cmu_07_01.bvh").slice(1, None, 8)
    other = read_motion(test_data / "mocap/bvh/cmu_35_01.bvh").slice(1, None, 8).slice(0, len(clip.positions))
    clip = clip.slice(0, len(other.positions))
    again = joint_angles(clip.markers(names), names, clip)
    assert apart(again.rotations, clip.rotations).max() < 1e-6
    walked = joint_angles(other.markers(names), names, clip)
    error = np.linalg.norm(walked.markers(names) - other.markers(names), axis=2)
    assert error.mean() < 0.05
    steps = apart(walked.rotations[1:], walked.rotations[:-1]).reshape(len(clip.positions) - 1, -1)
    assert steps.max() < 1.0


def test_wrong_markers_are_named():
    motion = swaying(3)
    with pytest.raises(ValueError, match="markers"):
        joint_angles(motion.positions[:2], NAMES, motion)
    with pytest.raises(ValueError, match="wing"):
        joint_angles(motion.positions[:, :1], ["wing"], motion)
    with pytest.raises(ValueError, match="markers"):
        joint_angles(np.full((3, 1, 3), np.nan), ["pelvis"], motion)
    points = Motion(("a", "b"), (-1, -1), np.zeros((2, 2, 3)), np.tile(np.eye(3), (2, 2, 1, 1)), 24.0)
    with pytest.raises(ValueError, match="skeleton"):
        joint_angles(np.zeros((2, 1, 3)), ["a"], points)
