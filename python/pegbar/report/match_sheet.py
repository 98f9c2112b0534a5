"""A contact sheet of what a search found: drawn poses in the first row, each match's at the same moments below."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.report.canvas import Canvas
from pegbar.report.contact_sheet import over_paper
from pegbar.scene.body import LIMBS, MARKERS

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]
_CELL, _MARGIN, _WORDS = 220, 20, 300
# Hair and shoes reach beyond the marks, by this part of the marked figure's size at most: the rest is scenery.
_BEYOND = 0.5
# A channel's difference from the picture's corners that is ink.
_INK = 40
# Below a figure's hips there is room for this part of what is above them: short drawn legs may meet long ones.
_LEGS = 0.7
_PAPER, _GREY, _BLACK = (255, 255, 255, 255), (176, 176, 176), (40, 40, 40)
_COLORS = {"left": (40, 100, 200), "right": (214, 84, 40)}
_HIPS = [MARKERS.index("left_hip"), MARKERS.index("right_hip")]
_PAIRS = [(MARKERS.index(limb.start), MARKERS.index(limb.end)) for limb in LIMBS]


@dataclass(frozen=True, eq=False)
class SheetRow:
    """One match: lines of words beside it, and its canonical markers (n, 16, 2) in the picture, with their captions."""

    words: tuple[str, ...]
    points: Floats
    captions: tuple[str, ...]


def match_sheet(
    drawn: Floats, captions: Sequence[str], pictures: Sequence[Picture | None], rows: Sequence[SheetRow]
) -> Picture:
    """Return the sheet, (H, W, 3) uint8.

    ``drawn`` (n, 16, 2) are the canonical marks of n drawings in pixels, NaN where there is none; ``pictures`` are the
    drawings, None where there is no picture. Left limbs are blue, right ones red; below, the drawn pose is grey behind
    each match's.
    """
    frames = np.stack([_frame(pose, picture) for pose, picture in zip(drawn, pictures, strict=True)])
    scale = float((_CELL - 2 * _MARGIN) / max(np.ptp(frames, axis=1).max(initial=0.0), 1e-9))
    # Where each drawing's pixels come to lie: its figure's frame in the middle of the cell.
    shifts = _CELL / 2 - scale * frames.mean(axis=1)
    placed = drawn * scale + shifts[:, None]
    cells = zip(placed, pictures, captions, shifts, strict=True)
    sheet = [[_words(("drawn",)), *(_drawn_cell(*cell, scale) for cell in cells)]]
    for row in rows:
        size = min(scale * _likeness(drawn, row.points), _largest(row.points, placed))
        matched = zip(placed, row.points, row.captions, strict=True)
        sheet.append([_words(row.words), *(_match_cell(*cell, size) for cell in matched)])
    return np.concatenate([np.concatenate(line, axis=1) for line in sheet])


def _words(lines: Sequence[str]) -> Picture:
    canvas = Canvas(_WORDS, _CELL, _PAPER)
    for line, words in enumerate(lines):
        canvas.text((10, 30 + 22 * line), words, 12 if line == 0 else 10, _BLACK)
    return _finish(canvas)


def _drawn_cell(pose: Floats, picture: Picture | None, caption: str, shift: Floats, scale: float) -> Picture:
    canvas = Canvas(_CELL, _CELL, _PAPER)
    if picture is not None:
        canvas.paste(_crop(picture, shift, scale), 0, 0)
    _figure(canvas, pose, 2.0)
    canvas.text((6, _CELL - 6), caption, 9, _BLACK)
    return _finish(canvas)


def _match_cell(drawn: Floats, points: Floats, caption: str, size: float) -> Picture:
    canvas = Canvas(_CELL, _CELL, _PAPER)
    _figure(canvas, drawn, 5.0, _GREY)
    _figure(canvas, (points - _middle(points)) * size + _middle(drawn), 2.5)
    canvas.text((6, _CELL - 6), caption, 9, _BLACK)
    return _finish(canvas)


def _finish(canvas: Canvas) -> Picture:
    """The cell's picture with a line above."""
    canvas.polyline([(0, 0), (canvas.size[0], 0)], 1, _GREY)
    return over_paper(canvas.image())


def _frame(pose: Floats, picture: Picture | None) -> Floats:
    """The upper left and lower right corner of what a cell shows, (2, 2): a figure, and room for a clip's."""
    low, high = _extent(pose, picture)
    hips = float(_middle(pose)[0, 1])
    return np.array([low, (high[0], max(high[1], hips + _LEGS * (hips - low[1])))])


def _extent(pose: Floats, picture: Picture | None) -> tuple[Floats, Floats]:
    """The upper left and lower right corner of a drawn figure: its marks, and its ink beyond them."""
    low, high = np.nanmin(pose, axis=0), np.nanmax(pose, axis=0)
    if picture is None:
        return low, high
    room = _BEYOND * float((high - low).max())
    height, width = picture.shape[:2]
    left, top = np.clip(np.floor(low - room), 0, (width, height)).astype(int)
    right, bottom = np.clip(np.ceil(high + room) + 1, 0, (width, height)).astype(int)
    rows, columns = np.nonzero(_ink(picture)[top:bottom, left:right])
    if not len(rows):
        return low, high
    first, last = ((int(corner(columns)) + left, int(corner(rows)) + top) for corner in (np.min, np.max))
    return np.minimum(low, first), np.maximum(high, last)


def _ink(picture: Picture) -> NDArray[np.bool_]:
    """Where something is drawn: what is opaque, or of another colour than the picture's corners."""
    if picture.shape[2] == 4 and picture[..., 3].min() < 255:
        return np.asarray(picture[..., 3] > _INK)
    colors = picture[..., :3].astype(int)
    paper = np.median(colors[[0, 0, -1, -1], [0, -1, 0, -1]], axis=0)
    return np.asarray((np.abs(colors - paper) > _INK).any(axis=2))


def _largest(points: Floats, drawn: Floats) -> float:
    """The scale at which figures that stand where the drawn ones stand still fit into their cells."""
    reach, place = points - _middle(points), _middle(drawn)
    # What is beyond the middle has the room up to the border; on the middle itself it has any.
    room = np.where(reach > 0, _CELL - _MARGIN / 2 - place, place - _MARGIN / 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        return max(float(np.nanmin(room / np.abs(reach), initial=np.inf)), 1e-9)


def _middle(points: Floats) -> Floats:
    """Where poses are laid upon each other, (n, 1, 2): their hips, or the middle of their marks without them."""
    low, high = np.nanmin(points, axis=-2, keepdims=True), np.nanmax(points, axis=-2, keepdims=True)
    hips = points[..., _HIPS, :].mean(axis=-2, keepdims=True)
    middle: Floats = np.where(np.isfinite(hips), hips, (low + high) / 2)
    return middle


def _likeness(drawn: Floats, points: Floats) -> float:
    """How many times larger the limbs are drawn than in ``points``."""
    first, second = (np.array(ends) for ends in zip(*_PAIRS, strict=True))

    def lengths(poses: Floats) -> Floats:
        found: Floats = np.linalg.norm(poses[:, first] - poses[:, second], axis=-1)
        return found

    known = np.isfinite(lengths(drawn)) & np.isfinite(lengths(points))
    return float(lengths(drawn)[known].sum() / max(lengths(points)[known].sum(), 1e-9))


def _crop(picture: Picture, shift: Floats, scale: float) -> Picture:
    """The part of a drawing that comes to lie in its cell."""
    matrix = np.array([[scale, 0, shift[0]], [0, scale, shift[1]]])
    paper = over_paper(picture)
    return np.asarray(
        cv2.warpAffine(paper, matrix, (_CELL, _CELL), flags=cv2.INTER_AREA, borderValue=(255, 255, 255)), np.uint8
    )


def _figure(canvas: Canvas, points: Floats, width: float, color: tuple[int, int, int] | None = None) -> None:
    for limb, (first, second) in zip(LIMBS, _PAIRS, strict=True):
        ends = points[[first, second]]
        if np.isfinite(ends).all():
            canvas.polyline(ends, width, color or _COLORS.get(limb.name.split("_")[0], _BLACK))
    hips = points[_HIPS]
    if np.isfinite(hips).all():
        canvas.polyline(hips, width, color or _BLACK)
