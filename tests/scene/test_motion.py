import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pegbar import Motion
from tests.skeletons import SCHEMES, person


def moving(names=("Hips", "Spine"), frames=5, **fields):
    places = np.arange(frames * len(names) * 3, dtype=float).reshape(frames, len(names), 3)
    turns = np.broadcast_to(np.eye(3), (frames, len(names), 3, 3))
    parents = fields.pop("parents", tuple(range(-1, len(names) - 1)))
    return Motion(tuple(names), parents, places, turns, fields.pop("frame_rate", 24.0), **fields)


def standing(turn=None, **fields):
    """One frame of a person, turned as a whole."""
    names, parents, rest = person()
    matrix = np.eye(3) if turn is None else turn.as_matrix()
    turns = np.broadcast_to(matrix, (1, len(names), 3, 3))
    return Motion(tuple(names), tuple(parents), (rest @ matrix.T)[None], turns, 30.0, **fields)


def test_joints_and_canonical_markers_are_found():
    motion = moving()
    got = motion.markers(["Spine", "pelvis", "Hips"])
    np.testing.assert_array_equal(got, motion.positions[:, [1, 0, 0]])
    assert motion.markers([]).shape == (5, 0, 3)
    assert motion.joint_map == {"pelvis": "Hips", "chest": "Spine"}
    np.testing.assert_array_equal(motion.markers(motion.names), motion.positions)


def test_a_joint_of_a_markers_name_is_that_joint():
    motion = moving(("pelvis", "Hips"))
    np.testing.assert_array_equal(motion.markers(["pelvis"])[:, 0], motion.positions[:, 0])


@pytest.mark.parametrize(
    ("names", "problem"),
    [
        (
            ["spine"],
            r"no joint is called 'spine' \(did you mean 'Spine'\?\); there are Hips, Spine; markers pelvis, chest",
        ),
        (["left_hip"], "the clip has no joint for left_hip"),
        (["pelvis", "pelvsi"], r"no joint is called 'pelvsi' \(did you mean 'pelvis'\?\)"),
        (["xyz"], "no joint is called 'xyz'; there are"),
        ("Hips", "want several names, got the text 'Hips'"),
    ],
)
def test_an_unknown_name_says_what_there_is(names, problem):
    with pytest.raises(ValueError, match=f"^names: {problem}"):
        moving().markers(names)


def test_head_and_hands_are_in_the_middle_of_skull_and_hand():
    turn = Rotation.from_euler("xyz", [20, 130, -40], degrees=True)
    tip = np.array([0, 0.2, 0.05])
    motion = standing(turn, ends={"head": tip})
    names, _, rest = person()
    palm = (rest[names.index("left wrist")] + rest[names.index("left finger")]) / 2
    np.testing.assert_allclose(motion.markers(["left_hand"])[0, 0], turn.apply(palm), atol=1e-12)
    np.testing.assert_allclose(
        motion.markers(["right_hand"], centres=False)[0, 0], turn.apply(rest[names.index("right wrist")]), atol=1e-12
    )
    # The file's own joint "head" is that joint; under another name the marker is its skull's middle.
    np.testing.assert_array_equal(motion.markers(["head"])[0, 0], motion.positions[0, names.index("head")])
    other = dataclasses.replace(
        motion, names=tuple("Head" if name == "head" else name for name in names), ends={"Head": tip}
    )
    skull = rest[names.index("head")] + tip / 2
    np.testing.assert_allclose(other.markers(["head"])[0, 0], turn.apply(skull), atol=1e-12)


def test_a_hand_beyond_the_wrist_stays_where_it_is():
    names = ["LeftArm", "LeftForeArm", "LeftWrist", "LeftHand", "LeftFinger"]
    motion = moving(names)
    np.testing.assert_array_equal(motion.markers(["left_hand"])[:, 0], motion.positions[:, 3])
    # A hand's joint in the wrist's place is at the wrist.
    at_wrist = moving(names)
    at_wrist.positions[:, 3] = at_wrist.positions[:, 2]
    half = (at_wrist.positions[:, 2] + at_wrist.positions[:, 4]) / 2
    np.testing.assert_allclose(at_wrist.markers(["left_hand"])[:, 0], half)


def test_given_joints_win_and_an_empty_name_takes_one_away():
    motion = moving(joints={"pelvis": "Spine", "chest": "", "left_hand": "Hips"})
    assert motion.joint_map == {"pelvis": "Spine", "left_hand": "Hips"}
    np.testing.assert_array_equal(motion.markers(["pelvis"])[:, 0], motion.positions[:, 1])
    with pytest.raises(ValueError, match="the clip has no joint for chest"):
        motion.markers(["chest"])


@given(
    st.integers(0, 12),
    *([st.one_of(st.none(), st.integers(-14, 14))] * 2),
    st.one_of(st.none(), st.integers(1, 5)),
    st.one_of(st.none(), st.integers(0, 11)),
)
def test_a_slice_keeps_what_pythons_slices_keep(frames, start, stop, step, rest_frame):
    rest_frame = rest_frame if rest_frame is not None and rest_frame < frames else None
    motion = moving(frames=frames, rest_frame=rest_frame)
    part = motion.slice(start, stop, step)
    np.testing.assert_array_equal(part.positions, motion.positions[start:stop:step])
    assert part.rotations.shape == (*part.positions.shape, 3)
    assert part.frame_rate == 24 / (step or 1)
    kept = list(range(frames))[start:stop:step]
    assert part.rest_frame == (kept.index(rest_frame) if rest_frame in kept else None)
    assert part.joint_map == motion.joint_map


@pytest.mark.parametrize("step", [0, -1])
def test_a_slice_goes_forwards(step):
    with pytest.raises(ValueError, match="^step: want 1 or more"):
        moving().slice(0, 3, step)


@pytest.mark.parametrize(
    ("scheme", "waist"), [("plug-in gait", "ASI RASI LPSI RPSI"), ("cmu markers", "FWT RFWT LBWT RBWT")]
)
def test_optical_markers_give_joint_centres(scheme, waist):
    labels = ["Anna:" + label for label in SCHEMES[scheme][0].split()]
    random = np.random.default_rng(1)
    motion = moving(labels, frames=3, parents=(-1,) * len(labels))
    motion.positions[:] = random.normal(size=motion.positions.shape)
    at = {label.removeprefix("Anna:"): motion.positions[:, place] for place, label in enumerate(labels)}
    means = {
        "pelvis": f"L{waist}",
        "head": "LFHD RFHD LBHD RBHD",
        "neck": "C7 CLAV",
        "chest": "STRN T10",
        "left_wrist": "LWRA LWRB",
        "right_hand": "RWRA RWRB RFIN RFIN",
        "left_knee": "LKNE",
        "right_foot": "RANK",
        "left_shoulder": "LSHO",
    }
    for marker, several in means.items():
        want = np.mean([at[label] for label in several.split()], axis=0)
        np.testing.assert_allclose(motion.markers([marker])[:, 0], want, err_msg=marker)
    assert len([name for name in motion.known_markers if name in motion.derived]) >= 16
    # A joint that is given is taken as it is.
    given = dataclasses.replace(motion, joints={"pelvis": "Anna:C7"})
    np.testing.assert_array_equal(given.markers(["pelvis"])[:, 0], at["C7"])


def test_hip_joints_are_in_the_pelvis_own_axes():
    """Bell and others: 36 % of the pelvis' width to the side, 19 % behind, 30 % below, however the person stands."""
    labels = SCHEMES["plug-in gait"][0].split()
    turn = Rotation.from_euler("yxz", [70, 20, 10], degrees=True)
    motion = moving(labels, frames=1, parents=(-1,) * len(labels))
    for label, place in {
        "LASI": (0.12, 1, 0.1), "RASI": (-0.12, 1, 0.1), "LPSI": (0.05, 1, -0.1), "RPSI": (-0.05, 1, -0.1)
    }.items():  # fmt: skip
        motion.positions[0, labels.index(label)] = turn.apply(place)
    got = turn.inv().apply(motion.markers(["left_hip", "right_hip"])[0])
    np.testing.assert_allclose(got, [[0.36 * 0.24, 1 - 0.072, 0.1 - 0.0456], [-0.36 * 0.24, 1 - 0.072, 0.1 - 0.0456]])


def test_medial_markers_make_knees_and_elbows_middles():
    labels = [*SCHEMES["plug-in gait"][0].split(), "LKNM", "LELBM", "LMED"]
    motion = moving(labels, frames=2, parents=(-1,) * len(labels))
    for marker, pair in {"left_knee": "LKNE LKNM", "left_elbow": "LELB LELBM", "left_foot": "LANK LMED"}.items():
        want = np.mean([motion.positions[:, labels.index(label)] for label in pair.split()], axis=0)
        np.testing.assert_allclose(motion.markers([marker])[:, 0], want)


def test_a_missing_optical_marker_is_missing_in_what_is_made_of_it():
    labels = SCHEMES["plug-in gait"][0].split()
    motion = moving(labels, frames=3, parents=(-1,) * len(labels))
    motion.positions[:] = np.random.default_rng(2).normal(size=motion.positions.shape)
    motion.positions[1, labels.index("LPSI")] = np.nan
    got = motion.markers(["pelvis", "left_hip", "head"])
    assert np.isnan(got[1, :2]).all()
    assert np.isfinite(got[[0, 2]]).all()
    assert np.isfinite(got[:, 2]).all()


def test_points_that_are_no_marker_set_have_no_centres():
    motion = moving(("LKNE", "a", "b"), parents=(-1, -1, -1))
    assert motion.derived == {}
    assert motion.joint_map == {"left_knee": "LKNE"}
