import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import map_joints
from pegbar.scene.body import MARKERS
from pegbar.scene.joint_names import MIDDLE, SIDED, compact
from pegbar.scene.joints import misspelt_markers
from tests.skeletons import BIPED, SCHEMES, person


def expected(scheme):
    return {marker: name for marker, name in zip(MARKERS, SCHEMES[scheme][1].split(), strict=True) if name != "-"}


def canonical(found):
    return {marker: name for marker, name in found.items() if marker in MARKERS}


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_names_of_every_scheme_are_known(scheme):
    found = map_joints(SCHEMES[scheme][0].split())
    assert canonical(found) == expected(scheme)
    assert [marker for marker in found if marker in MARKERS] == [m for m in MARKERS if m in found]


def test_names_with_spaces_are_known():
    found = map_joints(BIPED)
    assert len(canonical(found)) == 16
    assert found["pelvis"] == "Bip01 Pelvis"
    assert found["chest"] == "Bip01 Spine1"
    assert found["left_shoulder"] == "Bip01 L UpperArm"
    assert found["right_collar"] == "Bip01 R Clavicle"
    assert found["right_foot"] == "Bip01 R Foot"
    assert found["right_toe"] == "Bip01 R Toe0"


@given(
    st.sampled_from([scheme for scheme in SCHEMES if "markers" not in scheme]),
    st.text("abcdlrxyzABCDLR0123456789_-. :|", max_size=12),
    st.sampled_from([str, str.lower, str.upper, str.title, str.swapcase]),
    st.randoms(use_true_random=False),
)
def test_prefix_case_and_order_do_not_matter(scheme, prefix, case, random):
    names = SCHEMES[scheme][0].split()
    random.shuffle(names)
    found = map_joints([prefix + case(name) for name in names])
    assert canonical(found) == {marker: prefix + case(name) for marker, name in expected(scheme).items()}


def test_extra_joints_are_found_beside_the_canonical_ones():
    found = map_joints(SCHEMES["cmu"][0].split())
    extra = {marker: name for marker, name in found.items() if marker not in MARKERS}
    assert extra == {
        "left_collar": "LeftShoulder",
        "left_toe": "LeftToeBase",
        "right_collar": "RightShoulder",
        "right_toe": "RightToeBase",
    }
    assert map_joints(SCHEMES["acclaim"][0].split())["left_wrist"] == "lwrist"
    assert map_joints(SCHEMES["smpl"][0].split())["left_toe"] == "left_foot"


def test_a_shoulder_is_a_collar_bone_only_beside_an_upper_arm():
    assert map_joints(["LeftShoulder", "LeftArm"]) == {"left_shoulder": "LeftArm", "left_collar": "LeftShoulder"}
    assert map_joints(["LeftShoulder", "LeftElbow"]) == {"left_shoulder": "LeftShoulder", "left_elbow": "LeftElbow"}


def test_a_leg_is_the_shin_only_beside_a_thigh():
    assert map_joints(["LeftLeg", "LeftUpLeg"]) == {"left_hip": "LeftUpLeg", "left_knee": "LeftLeg"}
    assert map_joints(["LeftLeg", "LeftFoot"]) == {"left_hip": "LeftLeg", "left_foot": "LeftFoot"}
    assert map_joints(["LeftLeg", "LeftKnee"]) == {"left_hip": "LeftLeg", "left_knee": "LeftKnee"}


def test_what_is_not_found_is_not_there():
    assert map_joints(["Hips", "LeftHand", "tail", "sword"]) == {"pelvis": "Hips", "left_hand": "LeftHand"}
    assert map_joints([]) == {}
    assert map_joints(["a", "b"], [-1, 0]) == {}


def test_words_are_no_others_turned_round():
    """No known form means two things: a side or letter before one word is never another word."""
    meanings = {}
    for side, marks in (("left", ("left", "l")), ("right", ("right", "r"))):
        for word in {word for several in SIDED.values() for word in several}:
            for form in [form for mark in marks for form in (mark + word, word + mark)]:
                assert meanings.setdefault(form, (side, word)) == (side, word)
    assert not set(meanings) & {word for several in MIDDLE.values() for word in several}


def test_the_chest_is_where_arms_and_neck_meet():
    names = ["Hips", "Spine", "Spine1", "Spine2", "Neck", "LeftArm", "RightArm"]
    assert map_joints(names)["chest"] == "Spine2"
    # The arms and the neck hang on Spine1 here: Spine2 is a helper beside them.
    assert map_joints(names, [-1, 0, 1, 2, 2, 2, 2])["chest"] == "Spine1"
    # Where all hang on the pelvis there is no such joint, so the name stays.
    assert map_joints(names, [-1, 0, 1, 2, 0, 0, 0])["chest"] == "Spine2"


WANTED = {
    **{"pelvis": "hips", "chest": "chest", "neck": "neck", "head": "head"},
    **{
        f"{side}_{marker}": f"{side} {joint}"
        for side in ("left", "right")
        for marker, joint in (
            *(("shoulder", "shoulder"), ("elbow", "elbow"), ("hand", "wrist"), ("hip", "hip"), ("knee", "knee")),
            *(("foot", "ankle"), ("collar", "collar"), ("toe", "toe")),
        )
    },
}
TURNS = [
    np.eye(3),
    np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]),
    np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]]),
    np.diag([-1, 1, -1]),
]


@given(st.randoms(use_true_random=False), st.sampled_from(TURNS), st.floats(0.001, 1000))
def test_shape_alone_tells_a_body_whatever_the_order_axes_and_unit(random, turn, unit):
    names, parents, rest = person()
    order = list(range(len(names)))
    random.shuffle(order)
    place = {joint: index for index, joint in enumerate(order)}
    found = map_joints(
        [f"j{index}" for index in range(len(names))],
        [-1 if parents[joint] < 0 else place[parents[joint]] for joint in order],
        rest=rest[order] @ turn.T * unit,
    )
    assert {marker: names[order[int(name[1:])]] for marker, name in found.items()} == WANTED


def test_without_positions_the_first_limb_is_called_left():
    names, parents, _ = person()
    found = map_joints([f"j{index}" for index in range(len(names))], parents)
    assert {marker: names[int(name[1:])] for marker, name in found.items()} == WANTED


def test_spare_joints_of_no_length_are_passed_over():
    names, parents, rest = person()
    names += ["left spare", "right spare"]
    hips = names.index("hips")
    for side in ("left", "right"):
        parents[names.index(f"{side} hip")] = names.index(f"{side} spare")
    found = map_joints(
        [f"j{i}" for i in range(len(names))], [*parents, hips, hips], rest=[*rest, rest[hips], rest[hips]]
    )
    assert {marker: names[int(name[1:])] for marker, name in found.items()} == WANTED


def test_shape_fills_what_names_leave_open_on_the_side_they_tell():
    names, parents, rest = person()
    given = ["x" + str(index) for index in range(len(names))]
    # Names say that the limbs on +X are the right ones: a mirrored skeleton.
    given[names.index("left knee")], given[names.index("right elbow")] = "RightKnee", "LeftElbow"
    found = map_joints(given, parents, rest=rest)
    back = dict(zip(given, names, strict=True))
    assert back[found["right_knee"]] == "left knee"
    assert back[found["right_foot"]] == "left ankle"
    assert back[found["left_shoulder"]] == "right shoulder"
    assert len(canonical(found)) == 16


def test_a_creature_without_arms_has_only_what_its_names_tell():
    assert map_joints(["Hips", "a", "b", "c", "d", "e", "f"], [-1, 0, 1, 2, 0, 4, 5]) == {"pelvis": "Hips"}


@pytest.mark.parametrize("parents", [[1, 0, 1], [-1, -1, -1], [-1, 0, 2], [0, 0, 0]])
def test_what_is_no_tree_leaves_the_names(parents):
    assert map_joints(["Hips", "LeftFoot", "z"], parents) == {"pelvis": "Hips", "left_foot": "LeftFoot"}


@pytest.mark.parametrize(
    ("parents", "rest", "problem"),
    [
        ([-1], None, r"parents: want shape \(2,\)"),
        ([-1, 2], None, r"parents: want values in -1..1, got 2"),
        ([-1, 0], [[0, 0, 0]], r"rest: want shape \(2, 3\)"),
        ([-1, 0], [[0, 0, 0], [np.nan, 0, 0]], r"rest: want finite"),
    ],
)
def test_arguments_that_do_not_fit_are_named(parents, rest, problem):
    with pytest.raises(ValueError, match=f"^{problem}"):
        map_joints(["a", "b"], parents, rest=rest)


def test_a_name_without_letters_is_nothing():
    assert compact("__:--") == ""
    assert map_joints(["", "__", "Hips"]) == {"pelvis": "Hips"}


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("left_elbwo", "left_elbow"),
        ("LeftElbow", "left_elbow"),
        ("Left_Elbow", "left_elbow"),
        ("left-elbow", "left_elbow"),
        # What else people mark, and the markers that a drawing need not have.
        ("tail", None),
        ("left_elbow_tip", None),
        ("left_ear", None),
        ("left_wrist", None),
    ],
)
def test_misspelt_markers_are_told_from_others(name, meant):
    names = [name if marker == "left_elbow" else marker for marker in MARKERS]
    assert misspelt_markers(names) == ({name: meant} if meant else {})
    # Not where the marker itself is there too, or the clip has a joint of that name.
    assert misspelt_markers([*names, "left_elbow"]) == {}
    assert misspelt_markers(names, {name}) == {}
