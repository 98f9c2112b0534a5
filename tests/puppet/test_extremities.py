import numpy as np
import pytest

from pegbar.puppet.extremities import Extremities
from pegbar.puppet.performance import Direction, deformed_meshes
from tests.puppets import arm_puppet, handed_puppet, turned_poses

#: The columns of the mesh that are the hand, and their length in pixels.
HAND, LENGTH = slice(16, 21), 40


def hand_poses(puppet, degrees):
    """The arm turned towards the camera, with the shorter bones of `handed_puppet`."""
    poses = turned_poses(puppet, degrees)
    return poses[:, :1] + 0.75 * (poses - poses[:, :1])


def hands(puppet, poses, **options):
    meshes = deformed_meshes(puppet, puppet.pose, poses, Direction(**options))
    return meshes.reshape(len(poses), 5, 21, 2)[:, :, HAND]


def test_a_hand_is_found_and_has_a_bone():
    puppet = handed_puppet()
    ends = Extremities.of_puppet(puppet)
    assert ends.bones.tolist() == [1]
    assert ends.puppet.bones.tolist() == [[0, 1], [1, 2], [2, 3]]
    assert 225 < ends.puppet.marks[3, 0] <= 250
    assert ends.puppet.marks[3, 1] == pytest.approx(99.5, abs=10)
    assert 0.7 <= ends.roundness[0] < 0.85
    owned = ends.puppet.triangle_bone == 2
    assert (puppet.vertices[puppet.triangles[owned]].mean(axis=1)[:, 0] > 200).all()
    assert owned.sum() == 5 * 4 * 2


def test_a_limb_without_anything_beyond_its_joint_has_no_end():
    puppet = arm_puppet()
    ends = Extremities.of_puppet(puppet)
    assert ends.puppet is puppet
    rest, poses = ends.extended(puppet.pose, puppet.pose[None])
    assert np.array_equal(rest, puppet.pose)
    assert np.array_equal(poses, puppet.pose[None])


def test_the_drawn_pose_is_the_picture():
    puppet = handed_puppet()
    mesh = deformed_meshes(puppet, puppet.pose, puppet.pose[None], Direction(inflation=0))[0]
    assert np.allclose(mesh, puppet.vertices, atol=1e-6)


@pytest.mark.parametrize("degrees", [60.0, 80.0, 89.0, 100.0])
def test_a_hand_towards_the_camera_is_no_scrap(degrees):
    puppet = handed_puppet(distance=6.0)
    poses = hand_poses(puppet, [degrees])
    hand = hands(puppet, poses)[0]
    nearer = 6.0 / puppet.camera.depth(poses[0, 2])
    length = np.ptp(hand[..., 0]) / nearer
    assert 0.65 * LENGTH < length < 1.2 * LENGTH
    # The forearm itself is foreshortened as it should be.
    forearm = np.linalg.norm(np.diff(puppet.camera.project(poses[0, 1:]), axis=0))
    assert forearm < 0.75 * 75 * nearer


def test_a_hand_turns_round_without_a_jump():
    puppet = handed_puppet(distance=6.0)
    made = hands(puppet, hand_poses(puppet, np.arange(60.0, 121.0, 2.0)))
    assert np.isfinite(made).all()
    # In one step its end would move by twice its length, which the nearness of the camera makes half as long again.
    assert np.linalg.norm(np.diff(made, axis=0), axis=-1).max() < LENGTH
    assert made[0, 2, -1, 0] > made[0, 2, 0, 0]
    assert made[-1, 2, -1, 0] < made[-1, 2, 0, 0]


def test_a_hand_turns_with_its_arm_in_the_picture():
    # From far away, so that all bones are seen along the same direction.
    puppet = handed_puppet(distance=100.0)
    angle = np.radians(40.0)
    turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    pose = puppet.pose[0] + (puppet.pose - puppet.pose[0]) @ turn.T
    made = deformed_meshes(puppet, puppet.pose, pose[None], Direction(inflation=0))[0]
    centre = puppet.marks[0]
    seen = turn[:2, :2].T
    assert np.allclose(made, centre + (puppet.vertices - centre) @ seen.T, atol=0.02)
