import cv2
import numpy as np
import pytest

from pegbar.puppet.parts import bone_distances, bone_way, grow_parts
from pegbar.scene.body import MARKERS
from pegbar.scene.drawing import Limb
from tests.figures import COLORS, animal, figure


def bone_at(source, parts, place):
    x, y = np.rint(place).astype(int)
    return source.names[source.bones[parts.bones[y, x] - 1, 1]]


@pytest.mark.parametrize("source", [figure(), figure(60), animal()], ids=["front", "half", "animal"])
def test_every_pixel_belongs_to_a_bone_that_it_hangs_together_with(source):
    parts = grow_parts(source, source.mask)
    np.testing.assert_array_equal(parts.bones > 0, source.mask)
    for bone in np.unique(parts.bones[parts.bones > 0]):
        assert cv2.connectedComponents((parts.bones == bone).view(np.uint8))[0] == 2
    assert (parts.radii >= 1).all()


def test_the_middle_of_each_limb_is_its_own():
    source = figure()
    parts = grow_parts(source, source.mask)
    for bone, (start, end) in enumerate(source.bones):
        if MARKERS[end].endswith(("elbow", "hand", "knee", "foot", "head")):
            assert bone_at(source, parts, source.marks[[start, end]].mean(axis=0)) == MARKERS[end], bone


def test_an_arm_beside_the_body_is_reached_round_the_gap_not_across():
    down = {"left_elbow": (0.2, 1.15, 0), "left_hand": (0.2, 0.9, 0)}
    source = figure(changes=down)
    mask = source.mask.copy()
    hand = np.rint(source.marks[MARKERS.index("left_hand")]).astype(int)
    elbow = np.rint(source.marks[MARKERS.index("left_elbow")]).astype(int)
    column = hand[0] - 10
    mask[elbow[1] - 5 : hand[1] + 15, column] = False
    parts = grow_parts(source, mask)
    owner = source.names[source.bones[parts.bones[hand[1], column + 2] - 1, 1]]
    assert owner == "left_hand"
    assert source.names[source.bones[parts.bones[hand[1], column - 2] - 1, 1]] not in ("left_hand", "left_elbow")


def test_a_bone_that_leaves_a_bent_limb_goes_along_its_middle():
    mask = np.zeros((60, 60), np.uint8)
    cv2.ellipse(mask, (10, 50), (36, 36), 0, 270, 360, 1, 7)
    inside = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
    way = bone_way(np.array([[12.0, 14.0], [46.0, 48.0]]), inside)
    assert (inside[tuple(way.T)] >= 2).mean() > 0.9
    assert np.abs(np.diff(way, axis=0)).max() == 1
    assert {tuple(way[0]), tuple(way[-1])} == {(14, 12), (48, 46)}
    straight = bone_way(np.array([[12.0, 14.0], [16.0, 14.0]]), inside)
    np.testing.assert_array_equal(straight, [[14, x] for x in range(12, 17)])


def test_a_painted_segmentation_is_taken():
    source = figure(60)
    limbs = tuple(
        Limb(f"{side}_{name}", f"{side}_{start}", f"{side}_{end}", (10 * index + (side == "left"), 200, 9))
        for side in ("left", "right")
        for index, (name, start, end) in enumerate((("upper_arm", "shoulder", "elbow"), ("forearm", "elbow", "hand")))
    )
    limbs += (Limb("torso", "neck", "pelvis", COLORS["torso"]), Limb("head", "neck", "head", (0, 9, 255)))
    painted = np.zeros((*source.mask.shape, 3), np.uint8)
    painted[source.mask] = COLORS["torso"]
    painted[:100][source.mask[:100]] = (0, 9, 255)
    given = figure(60, segmentation=painted, limbs=limbs)
    parts = grow_parts(given, given.mask)
    head = next(bone for bone, pair in enumerate(given.bones) if given.names[pair[1]] == "head")
    assert (parts.bones[:100][given.mask[:100]] == head + 1).all()
    assert not (parts.bones[100:] == head + 1).any()


def test_distances_from_bones():
    points, ends = np.array([[0.0, 3.0], [14.0, 0.0]]), np.array([[[0.0, 0.0], [10.0, 0.0]], [[5.0, 5.0], [5.0, 5.0]]])
    distances, shares = bone_distances(points, ends)
    np.testing.assert_allclose(distances, [[3, np.hypot(5, 2)], [4, np.hypot(9, 5)]])
    assert shares[:, 0].tolist() == [0, 1]
