import numpy as np
import pytest

from pegbar import Motion, read_motion
from pegbar.align.retime import retime
from pegbar.scene.mirror import exchanged, mirrored
from tests.motions import swaying


def test_a_mirror_reflects_places_and_exchanges_sides():
    motion = swaying()
    seen = mirrored(motion)
    np.testing.assert_allclose(seen.markers(["right_knee"]), motion.markers(["left_knee"]) * (-1, 1, 1))
    np.testing.assert_allclose(seen.markers(["pelvis"]), motion.markers(["pelvis"]) * (-1, 1, 1))
    np.testing.assert_allclose(np.linalg.det(seen.rotations), 1)
    again = mirrored(seen)
    assert again.names == motion.names
    np.testing.assert_allclose(again.rotations, motion.rotations)
    np.testing.assert_allclose(again.positions, motion.positions)


def test_a_mirrored_skeleton_moves_as_one():
    motion = mirrored(swaying())
    halves = retime(motion, np.arange(0, 6, 0.5), frame_rate=48)
    np.testing.assert_allclose(halves.positions[::2], motion.positions[:6], atol=1e-9)
    np.testing.assert_allclose(halves.markers(["right_knee"])[::2], motion.markers(["right_knee"])[:6], atol=1e-9)


def test_exchanged_sides_change_names_alone():
    motion = swaying()
    named = exchanged(motion)
    np.testing.assert_array_equal(named.markers(["left_hip"]), motion.markers(["right_hip"]))
    np.testing.assert_array_equal(named.positions, motion.positions)


@pytest.mark.parametrize("change", [mirrored, exchanged])
def test_real_joint_names_keep_their_new_meaning(change, test_data):
    motion = read_motion(test_data / "mocap/bvh/cmu_07_01.bvh")
    other = retime(change(motion).slice(1, 40), np.arange(0, 30, 1.5), frame_rate=80)
    want = motion.slice(1, 40).markers(["left_knee", "left_hand"])[[0, 3, 6]]
    sign = (-1, 1, 1) if change is mirrored else (1, 1, 1)
    np.testing.assert_allclose(other.markers(["right_knee", "right_hand"])[[0, 2, 4]], want * sign, atol=1e-9)
    assert isinstance(other, Motion)


def test_optical_points_change_sides_too(test_data):
    motion = read_motion(test_data / "mocap/c3d/cmu_05_13.c3d").slice(100, 110)
    seen = mirrored(motion)
    want = motion.markers(["left_knee", "right_shoulder", "pelvis"]) * (-1, 1, 1)
    np.testing.assert_allclose(seen.markers(["right_knee", "left_shoulder", "pelvis"]), want)
    np.testing.assert_array_equal(exchanged(motion).markers(["left_hip"]), motion.markers(["right_hip"]))
