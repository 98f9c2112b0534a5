from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from pegbar import limb_depth
from pegbar.sample import drawing
from pegbar.sample.annotation import annotate, limbs_of, seen
from pegbar.sample.figure import LABELS, LIMBS, PALETTE
from pegbar.sample.shot import make_scene
from pegbar.sample.skeleton import NAMES

FRAMES = range(0, 48, 3)
OWNER = {color: name for name, color in LABELS.items()} | PALETTE
JOINED = {frozenset((a.name, b.name)) for a in LIMBS for b in LIMBS if {a.start, a.end} & {b.start, b.end}}
WITH_TORSO = ("head", "upper_arm", "thigh")


@pytest.fixture(scope="module")
def scene():
    return make_scene((640, 360))


@pytest.fixture(scope="module")
def frames(scene):
    out = {}
    for index in FRAMES:
        figure = drawing.parts(scene.pose(index), scene.cameras[index], index)
        out[index] = (drawing.drawing(figure, scene.size), drawing.labels(figure, scene.size))
    return out


@cache
def _numbers():
    names = [limb.name for limb in LIMBS]
    return [(np.dot(color, (65536, 256, 1)), names.index(name) + 1) for color, name in OWNER.items()]


def owners(labels):
    """Number of the limb plus one at every pixel."""
    out = np.zeros(labels.shape[:2], np.uint8)
    codes = labels @ np.array([65536, 256, 1])
    for code, number in _numbers():
        out[codes == code] = number
    return out


def test_label_pictures_hold_only_the_palette(frames):
    colors = set()
    for _, labels in frames.values():
        codes = np.unique(labels @ np.array([65536, 256, 1]))
        colors |= {(code >> 16, code >> 8 & 255, code & 255) for code in codes.tolist()}
    assert colors == set(OWNER) | {(0, 0, 0)}


def test_drawings_are_transparent_with_soft_rims_and_lines_outside_the_labels(frames):
    for picture, labels in frames.values():
        alpha, figure = picture[..., 3], labels.any(axis=2)
        assert alpha[0].max() == alpha[:, 0].max() == 0
        assert ((alpha > 0) & (alpha < 255)).sum() > 300
        assert alpha[figure].min() > 100
        outside = (alpha > 0) & ~figure
        assert 0.05 < outside.sum() / figure.sum() < 0.35
        dark = picture[..., :3].max(axis=2) < 90
        assert (dark & outside & (alpha == 255)).sum() > 200


def test_the_figure_stays_in_the_picture_and_hangs_together(frames):
    for picture, _ in frames.values():
        solid = (picture[..., 3] > 127).astype(np.uint8)
        assert not (solid[[0, -1]].any())
        assert not (solid[:, [0, -1]].any())
        _, _, stats, _ = cv2.connectedComponentsWithStats(solid)
        assert stats[1:, 4].max() / solid.sum() > 0.995


def test_visible_markers_lie_on_their_limbs_and_hidden_ones_behind_others(scene, frames):
    shown = []
    for index, (picture, labels) in frames.items():
        pose, view = scene.pose(index), scene.cameras[index]
        visible = seen(pose, view, labels)
        pixels, depths = np.rint(view.project(pose.markers)).astype(int), view.depth(pose.markers)
        for marker, (column, row) in enumerate(pixels):
            limb = OWNER.get(tuple(labels[row, column].tolist()))
            if visible[marker]:
                assert picture[row, column, 3] == 255
                assert limb in limbs_of(NAMES[marker])
            elif limb is not None and limb not in limbs_of(NAMES[marker]):
                ends = [NAMES.index(end) for found in LIMBS if found.name == limb for end in (found.start, found.end)]
                assert depths[ends].min() < depths[marker] + 0.03, (index, NAMES[marker], limb)
        shown.append(visible)
    assert np.mean(shown) > 0.75
    assert np.mean(shown, axis=0)[NAMES.index("head")] > 0.8


def test_of_two_limbs_that_cross_the_nearer_is_painted(scene, frames):
    """Where the axes of two limbs that share no joint cross in the picture, the label is the nearer one's."""
    crossings = 0
    names = [limb.name for limb in LIMBS]
    for index, (_, labels) in frames.items():
        view, markers = scene.cameras[index], scene.dance.drawn[index]
        ends = np.array([[markers[NAMES.index(end)] for end in (limb.start, limb.end)] for limb in LIMBS])
        lines, depths, owner = view.project(ends), view.depth(ends), owners(labels)
        for i in range(len(LIMBS)):
            for j in range(i):
                meeting = cross(lines[i], lines[j])
                related = frozenset((names[i], names[j])) in JOINED or (
                    "torso" in (names[i], names[j]) and any(part in names[i] + names[j] for part in WITH_TORSO)
                )
                if meeting is None or related:
                    continue
                s, t = meeting
                gap = float(np.interp(s, [0, 1], depths[i]) - np.interp(t, [0, 1], depths[j]))
                column, row = np.rint(lines[i, 0] + s * (lines[i, 1] - lines[i, 0])).astype(int)
                if abs(gap) > 0.05 and owner[row, column] in (i + 1, j + 1):
                    assert owner[row, column] == (j if gap > 0 else i) + 1, (index, names[i], names[j], gap)
                    crossings += 1
    assert crossings >= 5


def cross(first, second):
    """Places on two segments where they cross, or None."""
    matrix = np.column_stack([first[1] - first[0], second[0] - second[1]])
    if abs(np.linalg.det(matrix)) < 1e-6:
        return None
    s, t = np.linalg.solve(matrix, second[0] - first[0])
    return (s, t) if 0.05 < s < 0.95 and 0.05 < t < 0.95 else None


def test_depths_of_the_labels_are_those_of_the_dancer(scene, frames):
    """The annotation is enough to compute limb depth, and it is the depth of the 3D limbs."""
    labels = frames[12][1]
    visible = np.ones((len(scene.cameras), len(NAMES)), bool)
    marked = annotate(Path("."), scene.dance.drawn, scene.cameras, visible)
    pairs = marked.limb_markers
    depth = limb_depth(owners(labels), marked.markers[12][pairs], marked.depths[12][pairs])
    assert np.array_equal(np.isfinite(depth), labels.any(axis=2))
    assert depth[np.isfinite(depth)].min() > 3.5
    assert depth[np.isfinite(depth)].max() < 6.5
    back = scene.cameras[12].unproject(marked.markers[12], marked.depths[12])
    np.testing.assert_allclose(back, scene.dance.drawn[12], atol=1e-9)


def test_boxes_stand_on_their_markers(scene):
    visible = np.ones((len(scene.cameras), len(NAMES)), bool)
    marked = annotate(Path("."), scene.dance.drawn, scene.cameras, visible)
    ends = marked.markers[:, marked.limb_markers]
    np.testing.assert_allclose((marked.boxes[:, :, 0] + marked.boxes[:, :, 3]) / 2, ends[:, :, 0], atol=1e-9)
    np.testing.assert_allclose((marked.boxes[:, :, 1] + marked.boxes[:, :, 2]) / 2, ends[:, :, 1], atol=1e-9)


def test_the_pen_trembles_on_every_second_frame(scene):
    pictures = []
    for frame in (6, 7, 8):
        figure = drawing.parts(scene.pose(6), scene.cameras[6], frame)
        pictures.append(drawing.drawing(figure, scene.size))
    assert np.array_equal(pictures[0], pictures[1])
    assert not np.array_equal(pictures[0], pictures[2])
