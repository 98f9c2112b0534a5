"""Feet that do not slide: two bones that bend."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pegbar import Motion, foot_contacts, read_motion
from pegbar.lift.reach import hold_ends, stand_still
from pegbar.scene.contacts import FEET
from tests.motions import NAMES, PARENTS, swaying

HIP, KNEE, FOOT = (NAMES.index(f"left_{joint}") for joint in ("hip", "knee", "foot"))


def locals_of(motion):
    """Offsets of joints in their parents' axes, (F, J, 3)."""
    parents = np.maximum(motion.parents, 0)
    apart = motion.positions - motion.positions[:, parents]
    return np.einsum("fjki,fjk->fji", motion.rotations[:, parents], apart)[:, 1:]


def test_a_standing_foot_stays_where_it_is_in_the_mean_and_bones_stay_bones():
    motion = swaying(40)
    standing = np.zeros(40, bool)
    standing[12:20] = standing[30:33] = True
    still = stand_still(motion, {"left_foot": standing})
    for run in (slice(12, 20), slice(30, 33)):
        want = motion.positions[run, FOOT].mean(axis=0)
        np.testing.assert_allclose(still.positions[run, FOOT] - want, 0, atol=0.05)
        np.testing.assert_allclose(
            still.positions[run, FOOT], np.tile(still.positions[run.start, FOOT], (run.stop - run.start, 1)), atol=1e-9
        )
    np.testing.assert_allclose(locals_of(still), locals_of(motion), atol=1e-9)
    np.testing.assert_allclose(still.rotations[:, FOOT], motion.rotations[:, FOOT])
    np.testing.assert_allclose(still.positions[:8], motion.positions[:8])
    np.testing.assert_allclose(
        still.positions[:, NAMES.index("head")][36:], motion.positions[:, NAMES.index("head")][36:]
    )
    assert np.linalg.norm(np.diff(still.positions[:, FOOT], axis=0), axis=1).max() < 0.3


def test_held_places_are_met_and_the_body_gives_way_where_a_leg_is_too_short():
    motion = swaying(5)
    near = motion.positions[:, FOOT] + [0.02, 0.03, -0.02]
    held = hold_ends(motion, {"left_foot": near})
    away = np.linalg.norm(held.positions[:, FOOT] - near, axis=1)
    assert away.max() < 1e-9
    far = motion.positions[:, HIP] + np.array([0.0, -2.0, 0.0])
    pulled = hold_ends(motion, {"left_foot": far})
    np.testing.assert_allclose(pulled.positions[:, FOOT], far, atol=1e-9)
    np.testing.assert_allclose(locals_of(pulled), locals_of(motion), atol=1e-9)
    free = np.full((5, 3), np.nan)
    free[2] = near[2]
    part = hold_ends(motion, {"left_foot": free})
    np.testing.assert_array_equal(part.positions[[0, 1, 3, 4]], motion.positions[[0, 1, 3, 4]])


def test_the_knee_stays_on_its_side():
    straight = np.array([[[0.0, 1, 0], [0, 0.5, 0.02], [0, 0, 0]]] * 3)
    straight[1, 1, 2] = 0.0  # quite straight: it bends as the frames beside it do
    names = ("left_hip", "left_knee", "left_foot")
    leg = Motion(names, (-1, 0, 1), straight, np.tile(np.eye(3), (3, 3, 1, 1)), 24.0)
    bent = hold_ends(leg, {"left_foot": straight[:, 2] + [0, 0.2, 0]})
    assert (bent.positions[:, 1, 2] > 0.2).all()
    lonely = Motion(names, (-1, 0, 1), straight[1:2], np.tile(np.eye(3), (1, 3, 1, 1)), 24.0)
    assert np.isfinite(hold_ends(lonely, {"left_foot": straight[1:2, 2] + [0, 0.2, 0]}).positions).all()


def test_a_foot_stands_on_over_the_seam_of_a_loop():
    motion = swaying(30)
    standing = np.zeros(30, bool)
    standing[:4] = standing[26:] = True
    travel = np.array([0.4, 0.0, 0.0])
    still = stand_still(motion, {"left_foot": standing}, travel=travel)
    end = still.positions[26:, FOOT]
    np.testing.assert_allclose(still.positions[:4, FOOT] + travel, np.tile(end[0], (4, 1)), atol=1e-9)
    np.testing.assert_allclose(end, np.tile(end[0], (4, 1)), atol=1e-9)


def test_wrong_names_and_shapes_are_named():
    motion = swaying(4)
    with pytest.raises(ValueError, match="standing"):
        stand_still(motion, {"left_foot": [True]})
    with pytest.raises(ValueError, match="head"):
        hold_ends(motion, {"head": np.zeros((4, 3))})
    with pytest.raises(ValueError, match="right_knee"):
        hold_ends(motion, {"right_foot": np.zeros((4, 3))})
    loose = Motion(NAMES, (*PARENTS[:5], 0, 0), motion.positions, motion.rotations, 24.0)
    with pytest.raises(ValueError, match="hang"):
        hold_ends(loose, {"left_foot": np.zeros((4, 3))})


def test_a_real_walk_stops_sliding(test_data):
    walk = read_motion(test_data / "mocap/bvh/cmu_35_01.bvh").slice(1, None, 5)
    contacts = foot_contacts(walk.markers(FEET), FEET, walk.frame_rate)
    still = stand_still(walk, dict(zip(FEET, contacts.T, strict=True)))
    both = contacts[1:] & contacts[:-1]
    slides = [np.linalg.norm(np.diff(one.markers(FEET), axis=0), axis=2)[both].max() for one in (walk, still)]
    assert slides[0] > 0.02
    assert slides[1] < 1e-9
    np.testing.assert_allclose(locals_of(still), locals_of(walk), atol=1e-9)
    turns = Rotation.from_matrix((np.swapaxes(still.rotations[1:], -1, -2) @ still.rotations[:-1]).reshape(-1, 3, 3))
    assert turns.magnitude().max() < 1.2
