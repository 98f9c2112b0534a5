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
_CELL, _MARGIN, _WORDS = 220, 30, 300
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
    scale = _scale(drawn)
    sheet = [[_words(("drawn",)), *(_drawn_cell(*cell, scale) for cell in zip(drawn, pictures, captions, strict=True))]]
    for row in rows:
        size = min(scale * _likeness(drawn, row.points), _largest(row.points))
        cells = zip(drawn, row.points, row.captions, strict=True)
        sheet.append([_words(row.words), *(_match_cell(*cell, scale, size) for cell in cells)])
    return np.concatenate([np.concatenate(line, axis=1) for line in sheet])


def _words(lines: Sequence[str]) -> Picture:
    canvas = Canvas(_WORDS, _CELL, _PAPER)
    for line, words in enumerate(lines):
        canvas.text((10, 30 + 22 * line), words, 12 if line == 0 else 10, _BLACK)
    return _finish(canvas)


def _drawn_cell(pose: Floats, picture: Picture | None, caption: str, scale: float) -> Picture:
    canvas = Canvas(_CELL, _CELL, _PAPER)
    if picture is not None:
        canvas.paste(_crop(picture, pose, scale), 0, 0)
    _figure(canvas, _placed(pose, scale), 2.0)
    canvas.text((6, _CELL - 6), caption, 9, _BLACK)
    return _finish(canvas)


def _match_cell(pose: Floats, points: Floats, caption: str, scale: float, size: float) -> Picture:
    canvas = Canvas(_CELL, _CELL, _PAPER)
    drawn = _placed(pose, scale)
    _figure(canvas, drawn, 5.0, _GREY)
    moved = (points - points[_HIPS].mean(axis=0)) * size + drawn[_HIPS].mean(axis=0)
    _figure(canvas, moved if np.isfinite(moved[_HIPS]).all() else _placed(points, size), 2.5)
    canvas.text((6, _CELL - 6), caption, 9, _BLACK)
    return _finish(canvas)


def _finish(canvas: Canvas) -> Picture:
    """The cell's picture with a line above."""
    canvas.polyline([(0, 0), (canvas.size[0], 0)], 1, _GREY)
    return over_paper(canvas.image())


def _largest(points: Floats) -> float:
    """The scale at which figures whose hips are in the middle of their cells still fit."""
    reach = np.nanmax(np.abs(points - points[:, _HIPS].mean(axis=1, keepdims=True)), initial=1e-9)
    return float((_CELL / 2 - _MARGIN / 2) / reach)


def _scale(drawn: Floats) -> float:
    """Sheet pixels a drawn pixel: the largest figure fills its cell."""
    reach = np.nanmax(np.abs(drawn - _middle(drawn)), initial=1e-9)
    return float((_CELL / 2 - _MARGIN) / reach)


def _middle(points: Floats) -> Floats:
    """What goes into the middle of a cell, (n, 1, 2): each pose's hips, or the middle of its marks without them."""
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


def _placed(pose: Floats, scale: float) -> Floats:
    """A pose (16, 2) in a cell, its middle in the cell's."""
    placed: Floats = (pose - _middle(pose)) * scale + np.array([_CELL / 2, _CELL / 2])
    return placed


def _crop(picture: Picture, pose: Floats, scale: float) -> Picture:
    """The part of a drawing about ``pose`` that fills a cell."""
    shift = np.array([_CELL / 2, _CELL / 2]) - _middle(pose)[0] * scale
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
