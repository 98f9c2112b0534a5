import numpy as np
import pytest

from pegbar.scene.body import MARKERS
from pegbar.scene.drawn_skeleton import drawn_skeleton, limb_chains
from tests.figures import animal, marks


def skeleton(without=(), drives=None, names=MARKERS):
    points = dict(zip(MARKERS, marks(), strict=True))
    kept = [name for name in names if name not in without]
    places = np.array([points[name] for name in kept])
    return drawn_skeleton(kept, places, np.ones(len(kept), bool), {}, drives)


def chains(found):
    return [[found.names[found.bones[bone, 1]] for bone in chain] for chain in limb_chains(found.names, found.bones)]


def test_a_person_is_a_tree_from_the_pelvis():
    found = skeleton()
    assert found.names[0] == "pelvis"
    assert found.drives == {name: name for name in MARKERS}
    seen = {0}
    for parent, child in found.bones:
        assert parent in seen
        seen.add(child)
    assert len(seen) == 16
    assert sorted(chains(found)) == sorted(
        [[f"{side}_{a}", f"{side}_{b}"] for side in ("left", "right") for a, b in (("elbow", "hand"), ("knee", "foot"))]
    )


def test_missing_joints_are_bridged_and_told():
    points = marks()
    points[MARKERS.index("left_elbow")] = np.nan
    found = drawn_skeleton(MARKERS, points, np.ones(16, bool), {})
    assert "left_elbow" not in found.names
    assert found.notes == ("no left_elbow is marked",)
    pairs = {tuple(found.names[joint] for joint in bone) for bone in found.bones}
    assert ("left_shoulder", "left_hand") in pairs


def test_pelvis_and_neck_are_found_between_their_pairs():
    found = skeleton(without=("pelvis", "neck", "chest"))
    places = dict(zip(found.names, found.marks, strict=True))
    np.testing.assert_allclose(places["neck"], (places["left_shoulder"] + places["right_shoulder"]) / 2)
    assert any("midway" in note for note in found.notes)
    with pytest.raises(ValueError, match="want a pelvis, or a left_hip and a right_hip"):
        skeleton(without=("pelvis", "left_hip"))


def test_an_animals_front_legs_are_moved_by_arms_and_hang_on_the_neck():
    found = animal()
    assert found.drives["left_hip_f"] == "left_shoulder"
    assert found.drives["right_foot_f"] == "right_hand"
    assert found.drives["left_knee_b"] == "left_knee"
    assert "tail" not in found.drives
    parents = {found.names[child]: found.names[parent] for parent, child in found.bones}
    assert parents["left_hip_f"] == "neck"
    assert parents["left_hip_b"] == "pelvis"
    assert ["tail"] in chains(found)


def test_limbs_without_telling_names_go_by_where_they_are():
    points = dict(zip(MARKERS, marks(), strict=True))
    extra = {"a1": points["neck"] + [30, 10], "a2": points["neck"] + [50, 30], "a3": points["neck"] + [70, 50]}
    names = [*MARKERS, *extra]
    places = np.array([*points.values(), *extra.values()])
    parents = {"a1": "neck", "a2": "a1", "a3": "a2"}
    found = drawn_skeleton(names, places, np.ones(len(names), bool), parents)
    assert [found.drives[name] for name in extra] == ["left_shoulder", "left_elbow", "left_hand"]


def test_what_moves_a_joint_can_be_told():
    found = skeleton(drives={"left_hand": "right_hand", "head": ""})
    assert found.drives["left_hand"] == "right_hand"
    assert "head" not in found.drives
    with pytest.raises(ValueError, match="map: the figure has no joint 'paw'"):
        skeleton(drives={"paw": "left_hand"})
    with pytest.raises(ValueError, match="map: no marker is called 'wing'"):
        skeleton(drives={"head": "wing"})


def test_a_ring_is_refused():
    points = marks()
    names = [*MARKERS, "a", "b"]
    places = np.concatenate([points, points[:2]])
    with pytest.raises(ValueError, match="a, b hang on each other in a ring"):
        drawn_skeleton(names, places, np.ones(18, bool), {"a": "b", "b": "a"})
