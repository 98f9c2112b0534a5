"""Joint angles on another skeleton, and a skeleton with another figure's proportions."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pegbar import Motion, joint_angles, read_motion
from pegbar.lift.fitting import fit_skeleton
from pegbar.lift.retarget import rest_pose
from pegbar.scene.body import MARKERS
from tests.motions import NAMES, OFFSETS, PARENTS, swaying

RIGS = ("cmu_35_01", "cmu_131_01_max", "ad_fair1_dab", "ad_cmu1_jumping_jacks")


def apart(a, b):
    """Angles in radians between rotations (..., 3, 3)."""
    return Rotation.from_matrix((np.swapaxes(a, -1, -2) @ b).reshape(-1, 3, 3)).magnitude()


def at_rest(motion, offsets=OFFSETS, names=NAMES):
    """``motion`` with the rest pose that ``offsets`` make."""
    rest = np.array(offsets, float)
    for joint, parent in enumerate(PARENTS):
        if parent >= 0:
            rest[joint] += rest[parent]
    joints = dict(zip(NAMES, names, strict=True)) if names != NAMES else {}
    return dataclasses.replace(motion, names=tuple(names), rest=rest, joints=joints)


def another_rig(scale=1.0, turn=None):
    """The same body under other names, without a frame, at rest with its legs apart, larger and facing elsewhere."""
    turn = Rotation.from_rotvec([0, 0.9, 0]).as_matrix() if turn is None else turn
    apart_legs = OFFSETS.copy()
    for joint, angle in (("left_knee", 0.4), ("left_foot", 0.7)):
        place = NAMES.index(joint)
        apart_legs[place] = Rotation.from_rotvec([0, 0, angle]).as_matrix() @ apart_legs[place]
    names = ("root", "back", "skull", "thigh", "shin", "sole", "thigh2")
    empty = Motion(names, PARENTS, np.zeros((0, 7, 3)), np.zeros((0, 7, 3, 3)), 24.0)
    return at_rest(empty, scale * apart_legs @ turn.T, names)


def bones(motion):
    return np.array([np.linalg.norm(motion.positions[:, j] - motion.positions[:, p], axis=1) for j, p in BONES])


BONES = [(joint, parent) for joint, parent in enumerate(PARENTS) if parent >= 0]


def test_the_clips_own_rest_pose_gives_the_clip():
    clip = at_rest(swaying())
    again = joint_angles(clip.positions, NAMES, clip, skeleton=clip)
    assert apart(again.rotations, clip.rotations).max() < 1e-6
    np.testing.assert_allclose(again.positions, clip.positions, atol=1e-9)


def test_a_rig_of_the_same_limbs_in_another_rest_pose_meets_the_markers_exactly():
    clip, rig = at_rest(swaying()), another_rig()
    posed = joint_angles(clip.positions, NAMES, clip, skeleton=rig)
    assert posed.names == rig.names
    np.testing.assert_allclose(posed.positions, clip.positions, atol=1e-5)
    np.testing.assert_allclose(bones(posed), bones(clip))


def test_the_twist_about_a_bone_is_the_clips_on_another_rig():
    clip, rig = at_rest(swaying()), another_rig()
    shin = NAMES.index("left_knee")
    axis = OFFSETS[shin + 1] / np.linalg.norm(OFFSETS[shin + 1])
    rolled = clip.rotations.copy()
    rolled[:, shin] = rolled[:, shin] @ Rotation.from_rotvec(0.6 * axis).as_matrix()
    plain = joint_angles(clip.positions, NAMES, clip, skeleton=rig)
    turned = joint_angles(clip.positions, NAMES, dataclasses.replace(clip, rotations=rolled), skeleton=rig)
    steps = np.swapaxes(plain.rotations[:, shin], -1, -2) @ turned.rotations[:, shin]
    vectors = Rotation.from_matrix(steps).as_rotvec()
    own = rig.rest[shin + 1] - rig.rest[shin]
    np.testing.assert_allclose(vectors, np.tile(0.6 * own / np.linalg.norm(own), (len(vectors), 1)), atol=1e-5)


def test_a_larger_rig_keeps_its_bones_and_points_as_the_markers_do():
    clip, rig = at_rest(swaying()), another_rig(scale=1.5)
    posed = joint_angles(clip.positions, NAMES, clip, skeleton=rig)
    np.testing.assert_allclose(bones(posed), 1.5 * bones(clip))
    hip, knee = NAMES.index("left_hip"), NAMES.index("left_knee")
    error = np.linalg.norm(posed.positions - clip.positions, axis=2)
    # Each joint is off by no more than the bones above it are longer.
    assert (error[:, knee] <= 0.5 * bones(clip)[[hip - 1, knee - 1]].sum(axis=0) + 1e-6).all()
    stretched = joint_angles(clip.positions, NAMES, clip, skeleton=rig, stretch=True)
    # "spine" is no canonical marker, so the rig's back goes where its bones lead it.
    marked = [place for place, name in enumerate(NAMES) if name != "spine"]
    np.testing.assert_allclose(stretched.positions[:, marked], clip.positions[:, marked], atol=1e-9)


def test_points_have_no_twist_but_pose_a_skeleton():
    clip = swaying()
    points = Motion(NAMES, (-1,) * 7, clip.positions, np.tile(np.eye(3), (7, 7, 1, 1)), 24.0)
    rig = at_rest(swaying(1), names=NAMES)
    posed = joint_angles(clip.positions, NAMES, points, skeleton=rig)
    np.testing.assert_allclose(posed.positions, clip.positions, atol=1e-5)
    with pytest.raises(ValueError, match="skeleton"):
        joint_angles(clip.positions, NAMES, points)


def test_markers_that_the_skeleton_lacks_are_left_out_and_too_few_are_named():
    clip, rig = at_rest(swaying()), another_rig()
    headless = dataclasses.replace(rig, joints={**rig.joints, "head": ""})
    posed = joint_angles(clip.positions, NAMES, clip, skeleton=headless)
    feet = [NAMES.index("left_knee"), NAMES.index("left_foot")]
    np.testing.assert_allclose(posed.positions[:, feet], clip.positions[:, feet], atol=1e-5)
    stool = dataclasses.replace(rig, joints=dict.fromkeys(NAMES, "") | {"pelvis": "root"})
    with pytest.raises(ValueError, match=r"skeleton.*pelvis.*want 4"):
        joint_angles(clip.positions, NAMES, clip, skeleton=stool)
    with pytest.raises(ValueError, match="skeleton"):
        joint_angles(clip.positions, NAMES, clip, skeleton=Motion(("a", "b"), (-1, -1), *[np.zeros(0)] * 2, 24.0))
    with pytest.raises(ValueError, match="neither a rest pose nor a frame"):
        rest_pose(dataclasses.replace(rig, rest=None))


def test_fitted_proportions_are_the_figures():
    clip, figure = at_rest(swaying()), swaying(seed=5)
    long = 1.0 + 0.3 * np.array([0, 0, 1, 0, 1, 0, 0])
    places = figure.positions.copy()
    for joint, parent in BONES:
        step = figure.positions[:, joint] - figure.positions[:, parent]
        places[:, joint] = places[:, parent] + long[joint] * step
    fitted = fit_skeleton(clip, places, NAMES)
    posed = joint_angles(places, NAMES, clip, skeleton=fitted)
    np.testing.assert_allclose(posed.positions, places, atol=1e-5)
    # Sides are alike: the right hip is not longer, so neither is the left one.
    np.testing.assert_allclose(fitted.rest, fitted.positions[0])


def test_a_figures_own_skeleton_needs_no_fitting():
    clip = at_rest(swaying())
    fitted = fit_skeleton(clip, clip.positions, NAMES, posed=clip)
    np.testing.assert_allclose(fitted.rest, clip.rest, atol=1e-12)


def test_a_bone_without_length_gets_the_figures():
    names = ("pelvis", "chest", "neck", "head")
    rest = np.array([[0, 1, 0], [0, 1.5, 0], [0, 1.5, 0], [0, 1.7, 0.0]])
    clip = Motion(names, (-1, 0, 1, 2), rest[None], np.tile(np.eye(3), (1, 4, 1, 1)), 24.0, rest=rest)
    drawn = np.array([[[0, 1, 0], [0, 1.5, 0], [0, 1.6, 0], [0, 1.9, 0.0]]])
    np.testing.assert_allclose(fit_skeleton(clip, drawn, names).rest, drawn[0], atol=1e-9)


@pytest.mark.parametrize("rig", RIGS)
def test_real_rigs_follow_a_real_walk_without_flips(rig, test_data):
    clip = read_motion(test_data / "mocap/bvh/cmu_07_01.bvh").slice(1, None, 4)
    target = read_motion(test_data / f"mocap/bvh/{rig}.bvh")
    markers = clip.markers(MARKERS)
    posed = joint_angles(markers, MARKERS, clip, skeleton=target)
    steps, own = (apart(one.rotations[1:], one.rotations[:-1]).max() for one in (posed, clip))
    assert steps < 1.1 * own
    limbs = [("left_hip", "left_knee"), ("left_knee", "left_foot"), ("right_shoulder", "right_elbow")]
    for first, second in limbs:
        lengths = np.linalg.norm(posed.markers([first]) - posed.markers([second]), axis=2)
        assert np.ptp(lengths) < 1e-9
    fitted = fit_skeleton(target, markers, MARKERS, posed=posed)
    closer = joint_angles(markers, MARKERS, clip, skeleton=fitted)
    before, after = (np.linalg.norm(one.markers(MARKERS) - markers, axis=2).mean() for one in (posed, closer))
    assert after < 0.6 * before < 0.05
