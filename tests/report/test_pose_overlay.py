import numpy as np
import pytest

from pegbar.report.pose_overlay import SIDES, pose_overlay
from pegbar.scene.body import MARKERS

PAPER = np.full((700, 700, 3), 255, np.uint8)


def spread_out():
    """Every marker at its own place of a grid."""
    return np.array([(100 + 130 * column, 100 + 150 * row) for row in range(4) for column in range(4)], float)


def test_limbs_have_their_sides_colours_and_marks_their_discs():
    projected = spread_out()
    image = pose_overlay(PAPER, MARKERS, np.add(projected, (20, 0)), projected)
    limbs = (("left_hip", "left_knee", "left"), ("right_elbow", "right_hand", "right"), ("neck", "head", ""))
    for start, end, side in limbs:
        middle = np.rint(projected[[MARKERS.index(start), MARKERS.index(end)]].mean(axis=0)).astype(int)
        assert image[middle[1], middle[0], :3].tolist() == list(SIDES[side])
    assert image.shape == (700, 700, 4)
    assert image[100, 120, :3].tolist() == [255, 215, 0]


def test_what_is_missing_is_left_out_and_what_is_switched_off_is_grey():
    joints, projected, active = spread_out(), np.full((16, 2), np.nan), np.ones(16, bool)
    joints[0], active[5] = np.nan, False
    image = pose_overlay(PAPER, MARKERS, joints, projected, active=active)
    assert image[100, 100, :3].tolist() == [255] * 3
    assert image[250, 230, :3].tolist() == [150] * 3
    plain = pose_overlay(PAPER, MARKERS, np.full((16, 2), np.nan), projected)
    assert (plain[..., :3] == 255).all()


def test_small_and_transparent_pictures_are_enlarged_over_white():
    picture = np.zeros((96, 128, 4), np.uint8)
    image = pose_overlay(picture, ("pelvis",), [[10.0, 20.0]], [[10.0, 20.0]])
    assert image.shape == (480, 640, 4)
    assert image[102, 52, :3].tolist() == [255, 215, 0]
    assert image[0, 0].tolist() == [255] * 4


def test_wrong_sizes_are_named():
    with pytest.raises(ValueError, match="projected"):
        pose_overlay(PAPER, MARKERS, spread_out(), spread_out()[:5])
    with pytest.raises(ValueError, match="active"):
        pose_overlay(PAPER, MARKERS, spread_out(), spread_out(), active=[True])
