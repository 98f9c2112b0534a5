import dataclasses

import cv2
import numpy as np
import pytest

from pegbar.puppet.check import checked
from pegbar.scene.body import MARKERS
from tests.figures import figure


def moved(name, by, source=None):
    source = source or figure()
    points = source.marks.copy()
    points[MARKERS.index(name)] += by
    return dataclasses.replace(source, marks=points)


def masked(mask, source=None):
    source = source or figure()
    return dataclasses.replace(source, mask=mask, image=np.ascontiguousarray(source.image[..., :3]))


def test_a_good_figure_stays_as_it_is():
    source = figure()
    found = checked(source)
    np.testing.assert_array_equal(found.mask, source.mask)
    np.testing.assert_array_equal(found.marks, source.marks)
    assert found.notes == ()
    np.testing.assert_allclose(found.alpha, source.image[..., 3] / 255)


def test_joints_far_outside_are_all_named_with_their_distance():
    source = moved("left_hand", (60, 0), moved("head", (0, -70)))
    with pytest.raises(ValueError, match=r"head lies \d+ px outside the mask \(nearest: \d+, \d+\); left_hand lies"):
        checked(source)
    with pytest.raises(ValueError, match=r"left_foot lies 5\d\d px"):
        checked(moved("left_foot", (0, 520)))


def test_joints_just_outside_are_put_inside_and_told():
    edge = moved("left_hand", (10, 4))
    found = checked(edge)
    x, y = np.rint(found.marks[MARKERS.index("left_hand")]).astype(int)
    assert found.mask[y, x]
    assert any(note.startswith("left_hand lay") for note in found.notes)
    others = [index for index, name in enumerate(MARKERS) if name != "left_hand"]
    np.testing.assert_array_equal(found.marks[others], edge.marks[others])


def test_an_empty_mask_is_refused():
    with pytest.raises(ValueError, match="the mask is empty"):
        checked(masked(np.zeros_like(figure().mask)))
    with pytest.raises(ValueError, match="pieces: want join or drop"):
        checked(figure(), pieces="glue")


def test_specks_are_filled_and_holes_told():
    mask = figure().mask.copy()
    x, y = np.rint(figure().marks[MARKERS.index("chest")]).astype(int)
    mask[y, x - 12] = False
    mask[y : y + 9, x + 8 : x + 15] = False
    found = checked(masked(mask))
    assert found.mask[y, x - 12]
    assert not found.mask[y + 4, x + 11]
    assert any("has 1 hole, the largest of 63 pixels" in note for note in found.notes)


def test_a_cut_off_hand_is_joined_along_its_bone_but_nothing_is_painted_there():
    source = figure()
    mask = source.mask.copy()
    elbow, hand = (source.marks[MARKERS.index(f"left_{joint}")] for joint in ("elbow", "hand"))
    middle = np.rint((elbow + hand) / 2).astype(int)
    cv2.circle(mask.view(np.uint8), middle.tolist(), 11, 0, -1)
    found = checked(masked(mask))
    assert cv2.connectedComponents(found.mask.view(np.uint8), connectivity=4)[0] == 2
    assert found.mask[middle[1], middle[0]]
    assert found.alpha[middle[1], middle[0]] == 0
    assert any("joined along their bones" in note for note in found.notes)


@pytest.mark.parametrize(("pieces", "kept"), [("join", True), ("drop", False)])
def test_pieces_without_joints_are_joined_or_dropped_as_told(pieces, kept):
    source = figure()
    mask = source.mask.copy()
    mask[20:40, 20:40] = True
    found = checked(masked(mask), pieces=pieces)
    assert found.mask[30, 30] == kept
    assert (found.alpha[30, 30] == 1) == kept
    assert cv2.connectedComponents(found.mask.view(np.uint8), connectivity=4)[0] == 2
    assert any(("joined" if kept else "left out (400 pixels)") in note for note in found.notes)
