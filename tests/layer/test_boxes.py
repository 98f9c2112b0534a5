"""Limb boxes: measured on painted limbs of known width, repaired over time, and on the real drawn walk."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import DegenerateError, collision_volumes, palette_labels, read_annotations
from pegbar.io.frames import read_picture
from pegbar.layer.box_edges import LimbEdges, ink_edges, label_edges
from pegbar.layer.boxes import limb_boxes
from pegbar.report.canvas import Canvas
from tests.oracles.boxes import first_boundary

SIZE = (200, 160)


def limb_picture(ends, first, second, color=(1, 1, 1)):
    """Labels of one tapered limb from `ends` with half widths `first` and `second`."""
    canvas = Canvas(*SIZE, (0, 0, 0, 255), antialias=False)
    a, b = np.array(ends, float)
    left = np.array([(b - a)[1], -(b - a)[0]]) / np.linalg.norm(b - a)
    canvas.polygon([a + first * left, b + second * left, b - second * left, a - first * left], color)
    return canvas.image()[..., 0]


@given(st.floats(0, 6.28), st.floats(4, 25), st.floats(4, 25))
def test_a_painted_limb_has_its_width_whatever_its_direction(turn, first, second):
    middle, half = np.array([100.0, 80.0]), 45 * np.array([np.cos(turn), np.sin(turn)])
    ends = [middle - half, middle + half]
    found = label_edges(limb_picture(ends, first, second), [ends])
    # A pixel and a half where edges run on to the joints, and a share of the taper, since they are drawn to parallel.
    off = 1.6 + 0.06 * abs(first - second)
    np.testing.assert_allclose(found.half_widths[0], [[first, first], [second, second]], atol=off)
    assert (found.trust == 1).all()


def test_left_is_the_left_of_who_walks_along_the_limb():
    labels = np.zeros((40, 60), np.uint8)
    labels[16:30, :] = 1
    up = label_edges(labels, [[[5, 20], [55, 20]]]).half_widths[0]
    np.testing.assert_allclose(up, [[4.5, 9.5], [4.5, 9.5]], atol=0.5)
    back = label_edges(labels, [[[55, 20], [5, 20]]]).half_widths[0]
    np.testing.assert_allclose(back, up[:, ::-1], atol=0.5)


def test_a_limb_behind_another_counts_little_there():
    labels = np.zeros((60, 100), np.uint8)
    labels[20:40, 10:90] = 1
    labels[33:60, 10:90] = 2
    found = label_edges(labels, [[[10, 30], [90, 30]]] * 2)
    assert found.trust[0].tolist() == [1, 0]
    labels[33:60, 50:90] = 0
    labels[20:40, 50:90] = 1
    found = label_edges(labels, [[[10, 30], [90, 30]]])
    np.testing.assert_allclose(found.half_widths[0, :, 1], 9.5, atol=0.5)
    assert 0.3 < found.trust[0, 1] < 0.7


def test_what_covers_a_limb_across_its_middle_does_not_narrow_it():
    labels = np.zeros((60, 100), np.uint8)
    labels[10:50, 10:90] = 1
    labels[24:36, 5:95] = 2
    found = label_edges(labels, [[[10, 30], [90, 30]]])
    np.testing.assert_allclose(found.half_widths[0], [[20.5, 19.5], [20.5, 19.5]], atol=0.6)


def test_ink_is_the_first_dark_pixel_as_the_paper_has_it():
    canvas = Canvas(*SIZE, (255, 255, 255, 255))
    ends = np.array([[50.0, 40.0], [130.0, 110.0]])
    left = np.array([70.0, -80.0]) / np.hypot(70, 80)
    for side in (14, -14):
        canvas.polyline(ends + side * left, 2, (0, 0, 0))
    gray = canvas.image()[..., 0]
    found = ink_edges(gray, [ends])
    np.testing.assert_allclose(found.half_widths, 13.5, atol=1)
    for station in (0.2, 0.5, 0.8):
        along = ends[0] + station * (ends[1] - ends[0])
        assert abs(first_boundary(gray, along, left) - found.half_widths[0].mean()) <= 1


def test_a_stick_figure_is_as_wide_as_its_stroke_and_paper_ends_a_limb():
    gray = np.full((50, 100), 255, np.uint8)
    gray[20:31] = 0
    np.testing.assert_allclose(ink_edges(gray, [[[10, 25], [90, 25]]]).half_widths, 5.5, atol=0.5)
    plain = np.full((50, 100), 255, np.uint8)
    paper = np.ones((50, 100), bool)
    paper[20:31] = False
    np.testing.assert_allclose(ink_edges(plain, [[[10, 25], [90, 25]]], paper=paper).half_widths, 6, atol=0.5)
    assert (ink_edges(plain, [[[10, 25], [90, 25]]]).trust == 0).all()


def test_a_wedge_is_not_inside_out_at_its_tip():
    gray = np.full((100, 120), 255, np.uint8)
    for x in range(10, 100):
        away = max(1, round(1 + 0.33 * (x - 20)))
        gray[[50 - away, 50 + away], x] = 0
    found = ink_edges(gray, [[[10, 50], [90, 50]]])
    assert found.half_widths.min() >= 0.5
    assert found.half_widths[0, 1].min() > 20
    boxes = limb_boxes([found], [[[10, 50], [90, 50]]], [[0, 1]]).boxes
    assert (boxes[0, 0, 0] - boxes[0, 0, 3]) @ (boxes[0, 0, 1] - boxes[0, 0, 2]) > 0


def edges(widths, trust=1.0):
    """Edges of limbs that are `widths` (V) wide to both sides."""
    half = np.broadcast_to(np.asarray(widths, float)[:, None, None], (len(widths), 2, 2))
    return LimbEdges(half, np.full((len(widths), 2), trust))


def straight(frames, limbs=1):
    marks = np.zeros((frames, 2 * limbs, 2))
    marks[:, 1::2, 0] = 50
    return marks, np.arange(2 * limbs).reshape(limbs, 2)


def box_widths(found):
    return np.linalg.norm(found.boxes[:, :, 0] - found.boxes[:, :, 3], axis=2)


def test_an_arm_that_finds_the_torsos_edge_is_noticed_and_mended():
    marks, limbs = straight(24)
    widths = np.full(24, 10.0)
    widths[[5, 6, 7, 15]] = [40, 42, 5, 31]
    found = limb_boxes([edges([w]) for w in widths], marks, limbs)
    assert np.flatnonzero(found.repaired).tolist() == [5, 6, 7, 15]
    np.testing.assert_allclose(box_widths(found), 20)
    assert found.measured[5, 0] == pytest.approx(4, abs=0.3)


def test_squash_and_stretch_is_kept():
    marks, limbs = straight(24)
    widths = 10 * (1 + 0.25 * np.sin(np.arange(24) / 3))
    found = limb_boxes([edges([w]) for w in widths], marks, limbs)
    assert not found.repaired.any()
    np.testing.assert_allclose(box_widths(found)[:, 0], 2 * widths)


def test_a_figure_that_comes_nearer_is_no_mistake_when_its_scale_is_known():
    marks, limbs = straight(60)
    scale = np.linspace(1, 6, 60)
    pictures = [edges([10 * s]) for s in scale]
    assert limb_boxes(pictures, marks, limbs).repaired.any()
    found = limb_boxes(pictures, marks, limbs, scales=scale[:, None])
    assert not found.repaired.any()
    np.testing.assert_allclose(box_widths(found)[:, 0], 20 * scale)


def test_covered_limbs_take_the_width_of_other_drawings_and_never_seen_ones_their_twins():
    marks, limbs = straight(6, 3)
    names = ["left_thigh", "right_thigh", "tail"]
    pictures = [edges([10.0, np.nan, np.nan], 0.0 if frame == 3 else 1.0) for frame in range(6)]
    pictures[3] = edges([2.0, np.nan, np.nan], 0.0)
    found = limb_boxes(pictures, marks, limbs, names=names)
    np.testing.assert_allclose(box_widths(found)[:, :2], 20)
    assert found.repaired.tolist() == [[frame == 3, True, True] for frame in range(6)]
    assert 4 < box_widths(found)[0, 2] < 20


def test_boxes_of_the_user_win():
    marks, limbs = straight(3)
    own = np.full((3, 1, 4, 2), np.nan)
    own[1, 0] = [[0, 3], [50, 4], [50, -4], [0, -3]]
    found = limb_boxes([edges([10.0])] * 3, marks, limbs, given=own)
    assert found.given[:, 0].tolist() == [False, True, False]
    np.testing.assert_array_equal(found.boxes[1], own[1])
    np.testing.assert_allclose(box_widths(found)[[0, 2]], 20)


def test_a_limb_of_no_length_takes_its_neighbours_direction_and_without_any_is_named():
    marks, limbs = straight(3)
    marks[1, 1] = marks[1, 0]
    found = limb_boxes([edges([10.0])] * 3, marks, limbs)
    np.testing.assert_allclose(found.boxes[1, 0], [[0, -10], [0, -10], [0, 10], [0, 10]])
    marks[:, 1] = marks[:, 0]
    with pytest.raises(DegenerateError, match="limb left_shin: it has no length"):
        limb_boxes([edges([10.0])] * 3, marks, limbs, names=["left_shin"])


def test_unknown_markers_leave_unknown_boxes():
    marks, limbs = straight(3)
    marks[1, 0] = np.nan
    found = limb_boxes([edges([10.0])] * 3, marks, limbs)
    assert np.isnan(found.boxes[1]).all()
    assert np.isfinite(found.boxes[[0, 2]]).all()


def test_the_real_walks_boxes_are_steady_and_fill_its_limbs(test_data):
    drawing = read_annotations(test_data / "annotated/morevna_side_walk/annotation.json")
    frames = range(0, 48, 4)
    colors = np.array([limb.color for limb in drawing.limbs], np.uint8)
    pictures = []
    for frame in frames:
        painted = read_picture(drawing.segmentations[frame])
        labels = palette_labels(painted, colors, np.arange(1, len(colors) + 1, dtype=np.uint8)).labels
        pictures.append(label_edges(labels, drawing.markers[frame][drawing.limb_markers]))
    marks = drawing.markers[::4]
    found = limb_boxes(pictures, marks, drawing.limb_markers, names=[limb.name for limb in drawing.limbs])
    widths = box_widths(found)
    spread = widths.max(axis=0) / widths.min(axis=0)
    assert (spread < 1.6).all()
    names = [limb.name for limb in drawing.limbs]
    assert 85 < widths[:, names.index("torso")].mean() < 105
    for side in ("left", "right"):
        assert 25 < widths[:, names.index(f"{side}_shin")].mean() < 40
        assert 25 < widths[:, names.index(f"{side}_upper_arm")].mean() < 60
    points = np.concatenate([marks, np.full((*marks.shape[:2], 1), 5.0)], axis=2)
    matrices = np.stack([camera.matrix for camera in drawing.cameras[::4]])
    points = np.stack(
        [camera.unproject(m, np.full(len(m), 5.0)) for camera, m in zip(drawing.cameras[::4], marks, strict=True)]
    )
    volumes = collision_volumes(found.boxes, matrices, points, drawing.limb_markers)
    assert np.isfinite(volumes.start_radius).all()
