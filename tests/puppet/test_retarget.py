import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pegbar import DegenerateError
from pegbar.puppet.drawn_pose import drawn_pose
from pegbar.puppet.retarget import body_scale, facing_turn, retarget
from pegbar.puppet.root_path import follow, ground_poses, horizontal_path
from tests.puppets import arm_puppet, turned_poses


def lengths(poses):
    return np.linalg.norm(np.diff(poses, axis=1), axis=2)


def moved(puppet, **marks):
    """The puppet with some marks elsewhere."""
    places = puppet.marks.copy()
    for name, mark in marks.items():
        places[puppet.names.index(name)] = mark
    return puppet.changed(marks=places)


def test_the_drawn_pose_is_seen_at_the_marks():
    puppet = moved(arm_puppet(), left_hand=(210, 60), left_elbow=(160, 110))
    pose = puppet.pose + np.array([[0, 0, 0], [0, 0, 0.3], [0, 0, 0.7]])
    drawn = drawn_pose(puppet.changed(pose=pose))
    assert np.allclose(puppet.camera.project(drawn), puppet.marks)


def test_a_picture_of_the_clip_s_own_pose_has_its_depth():
    puppet = arm_puppet(distance=6.0)
    pose = turned_poses(puppet, [40.0])[0]
    puppet = puppet.changed(pose=pose, marks=puppet.camera.project(pose))
    assert np.allclose(drawn_pose(puppet), pose, atol=0.01)


def test_a_limb_of_another_pose_is_as_long_as_its_partner():
    base = arm_puppet(distance=6.0)
    names = ("left_hip", "left_knee", "right_hip", "right_knee")
    marks = np.array([[140.0, 100.0], [140.0, 150.0], [160.0, 100.0], [160.0, 180.0]])
    pose = base.camera.unproject(marks, np.full(4, 6.0))
    pose[1] += [0, 0.0, -0.5]
    pose[3] += [0.4, 0.2, 0.0]
    puppet = base.changed(
        names=names,
        marks=marks,
        bones=np.array([[0, 1], [0, 2], [2, 3]]),
        drives={name: name for name in names},
        pose=pose,
        joint_handles=np.full(4, -1),
        bone_layer=np.zeros(3, np.int64),
    )
    drawn = drawn_pose(puppet)
    assert np.allclose(puppet.camera.project(drawn), marks)
    assert drawn[1, 2] < drawn[0, 2] - 0.2
    left, right = (np.linalg.norm(drawn[b] - drawn[a]) for a, b in ((0, 1), (2, 3)))
    assert left == pytest.approx(right, rel=0.15)


def test_the_pose_in_which_the_picture_was_recognised_is_as_drawn():
    puppet = moved(arm_puppet(), left_hand=(240, 80))
    rest = drawn_pose(puppet)
    poses = turned_poses(puppet, [0.0, 30.0, 80.0])
    found = retarget(puppet, rest, poses, puppet.pose)
    assert np.allclose(found[0], rest)
    assert np.allclose(lengths(found), lengths(rest[None]))
    # The forearm stays as far above its line as it was drawn, seen from the front.
    assert found[1, 2, 1] - found[1, 1, 1] == pytest.approx(rest[2, 1] - rest[1, 1], rel=0.25)


def test_a_limb_drawn_in_another_pose_follows_the_clip():
    puppet = moved(arm_puppet(), left_hand=(150, 20))
    rest = drawn_pose(puppet)
    poses = turned_poses(puppet, [0.0, 50.0])
    follows = retarget(puppet, rest, poses, puppet.pose)
    assert np.allclose(follows[:, 2, 1], follows[:, 1, 1], atol=1e-9)
    stays = retarget(puppet, rest, poses, puppet.pose, keep="always")
    assert np.allclose(stays[0], rest)
    never = retarget(moved(arm_puppet(), left_hand=(240, 80)), rest, poses, puppet.pose, keep="never")
    assert np.allclose(never[:, 2, 1], never[:, 1, 1], atol=1e-9)


def test_a_drawn_difference_fades_as_the_clip_leaves_the_pose():
    puppet = moved(arm_puppet(), left_hand=(230, 60))
    rest = drawn_pose(puppet)
    poses = turned_poses(puppet, [0.0, 20.0, 45.0])
    found = retarget(puppet, rest, poses, puppet.pose)
    assert np.allclose(found[0], rest)
    above = found[:, 2, 1] - found[:, 1, 1]
    assert 0.2 * above[0] < above[1] < 0.8 * above[0]
    assert above[2] == pytest.approx(0, abs=1e-9)


def test_no_limb_is_longer_than_its_partner_because_the_actor_s_is_foreshortened():
    base = arm_puppet(distance=6.0)
    names = ("neck", "left_elbow", "left_hand", "right_elbow", "right_hand")
    marks = np.array([[150.0, 100.0], [190.0, 100.0], [230.0, 100.0], [110.0, 100.0], [70.0, 100.0]])
    pose = base.camera.unproject(marks, np.full(5, 6.0))
    pose[4] = pose[3] + [-0.2, 0.0, 0.35]
    # The actor's hand is where it is drawn, but nearer.
    pose[4] = base.camera.unproject(marks[4], 5.6)
    puppet = base.changed(
        names=names,
        marks=marks,
        bones=np.array([[0, 1], [1, 2], [0, 3], [3, 4]]),
        drives={name: name for name in names},
        pose=pose,
        joint_handles=np.full(5, -1),
        bone_layer=np.zeros(4, np.int64),
    )
    drawn = drawn_pose(puppet)
    assert np.allclose(puppet.camera.project(drawn), marks)
    left, right = (np.linalg.norm(drawn[b] - drawn[a]) for a, b in ((1, 2), (3, 4)))
    assert right == pytest.approx(left, rel=0.02)
    # Where both are nearer both are as long as the clip says.
    pose[2] = base.camera.unproject(marks[2], 5.6)
    both = drawn_pose(puppet.changed(pose=pose))
    assert np.linalg.norm(both[2] - both[1]) > 1.5 * left


def test_the_trunk_of_an_animal_stays_whole_and_seen_from_its_side():
    base = arm_puppet(distance=6.0)
    names = ("pelvis", "neck", "left_hip", "left_knee", "left_shoulder", "left_elbow")
    marks = np.array([[100.0, 90], [200.0, 90], [100.0, 110], [100.0, 150], [200.0, 110], [200.0, 150]])
    drawn = base.camera.unproject(marks, np.full(6, 6.0))
    puppet = base.changed(
        names=names,
        marks=marks,
        bones=np.array([[0, 1], [0, 2], [2, 3], [1, 4], [4, 5]]),
        drives={name: name for name in names},
        pose=drawn,
        fitted=False,
        joint_handles=np.full(6, -1),
        bone_layer=np.zeros(5, np.int64),
    )
    person = np.array([[0, 1, 0], [0, 1.5, 0], [0.1, 0.95, 0], [0.1, 0.5, 0], [0.2, 1.4, 0], [0.2, 1.0, 0]], float)
    bow = Rotation.from_euler("z", -20, degrees=True).as_matrix()
    lean = Rotation.from_euler("x", 50, degrees=True).as_matrix()
    clip = np.stack([person, person @ bow.T, person @ lean.T, person])
    # The upper arm points at the camera.
    clip[3, 5] = clip[3, 4] + [0, 0, 0.4]
    rest = drawn_pose(puppet)
    found = retarget(puppet, rest, clip, person)
    assert np.allclose(found[0], rest)
    trunk = found[:, [0, 1, 2, 4]]
    apart = np.linalg.norm(trunk[:, :, None] - trunk[:, None], axis=3)
    assert np.allclose(apart, apart[:1])
    # It tilts in the picture as the person bows, and never out of it.
    assert np.allclose(trunk[:, :, 2], trunk[:1, :, 2])
    slope = found[1, 1] - found[1, 0]
    assert np.degrees(np.arctan2(slope[1], slope[0])) == pytest.approx(-20, abs=1)
    legs = np.linalg.norm((found[:, 5] - found[:, 4])[:, :2], axis=1)
    assert (legs > 0.79 * legs[0]).all()


def test_what_no_marker_moves_goes_with_its_parent():
    puppet = arm_puppet().changed(drives={"left_shoulder": "left_shoulder", "left_elbow": "left_elbow"})
    poses = turned_poses(puppet, [0.0, 60.0])
    poses[:, 2] = np.nan
    rest = drawn_pose(puppet)
    found = retarget(puppet, rest, poses, puppet.pose)
    assert np.allclose(lengths(found), lengths(rest[None]))
    first, second = np.diff(found[1], axis=0)
    assert np.allclose(np.cross(first, second), 0, atol=1e-9)
    poses[1, 1] = np.nan
    with pytest.raises(DegenerateError, match="frame 1: .* left_elbow"):
        retarget(puppet, rest, poses, puppet.pose)
    with pytest.raises(ValueError, match="keep"):
        retarget(puppet, rest, poses, puppet.pose, keep="sometimes")


def test_an_upright_turn_of_the_person_is_told_and_unwound():
    base = arm_puppet()
    names = ("left_hip", "right_hip")
    puppet = base.changed(
        names=names,
        marks=base.marks[:2],
        bones=np.array([[0, 1]]),
        drives={name: name for name in names},
        pose=base.pose[:2],
        joint_handles=np.full(2, -1),
        triangle_bone=np.zeros(len(base.triangles), np.int64),
        handle_bone=np.zeros(len(base.handles), np.int64),
        bone_layer=np.zeros(1, np.int64),
    )
    hips = np.array([[0.1, 1, 0], [-0.1, 1, 0]])
    degrees = np.array([10.0, 100.0, 190.0, 260.0])
    turned = np.stack([hips @ Rotation.from_euler("y", angle, degrees=True).as_matrix().T for angle in degrees])
    assert np.allclose(facing_turn(puppet, turned, hips), degrees)
    assert np.allclose(facing_turn(puppet, turned[2:], hips), degrees[2:] - 360)


def test_feet_stand_as_high_as_the_clip_s():
    clip = np.array([[[0, 1.0, 0], [0, 0.1, 0]], [[0, 1.4, 0], [0, 0.5, 0]]])
    drawn = np.array([[0, 2.0, 0], [0, 1.5, 0.0]])
    joints = np.repeat(drawn[None], 2, axis=0) + np.array([[[0, 3, 0]], [[0, 7, 0]]])
    found = ground_poses(joints, clip, drawn, clip[0], scale=0.5)
    assert np.allclose(found[0], drawn)
    assert np.allclose(found[1], drawn + np.array([0, 0.2, 0]))


def test_where_a_figure_goes():
    roots = np.stack([np.linspace(0, 3, 31), np.full(31, 0.9), np.zeros(31)], axis=1)
    assert (horizontal_path(roots, roots[4], 0.5, "in-place") == 0).all()
    assert (horizontal_path(roots, roots[4], 0.5, "auto") == 0).all()
    path = horizontal_path(roots, roots[4], 0.5, "travelling")
    assert np.allclose(path[:, 0], 0.5 * (roots[:, 0] - roots[4, 0]))
    assert (path[:, 1] == 0).all()
    step = horizontal_path(roots * 0.2, roots[4], 0.5, "auto")
    assert np.allclose(step[:, 0], np.linspace(0, 0.3, 31))
    with pytest.raises(ValueError, match="travel"):
        horizontal_path(roots, roots[0], 1, "away")


def test_a_following_camera_is_smooth_and_near():
    path = np.zeros((60, 3))
    path[30:, 0] = 1
    camera = follow(path, 30)
    assert np.abs(np.diff(camera[:, 0])).max() < 0.1
    assert camera[0, 0] == pytest.approx(0, abs=1e-3)
    assert camera[-1, 0] == pytest.approx(1, abs=1e-3)
    assert follow(path[:1], 30).shape == (1, 3)


def test_the_scale_is_that_of_the_legs():
    base = arm_puppet()
    names = ("left_hip", "left_knee", "left_foot")
    puppet = base.changed(names=names, drives={name: name for name in names})
    assert body_scale(puppet, drawn_pose(puppet), 2 * puppet.pose) == pytest.approx(0.5)
