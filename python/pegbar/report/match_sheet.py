"""A contact sheet of what a search found: drawn poses in the first row, each match's poses at the same moments below."""

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
_CELL, _MARGIN, _WORDS = 220, 22, 300
_PAPER, _GREY, _BLACK = (255, 255, 255, 255), (176, 176, 176), (40, 40, 40)
_COLORS = {"left": (214, 84, 40), "right": (40, 100, 200)}
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
    drawings, None where there is no picture. Left limbs are red, right ones blue; below, the drawn pose is grey behind
    each match's.
    """
    count = len(drawn)
    canvas = Canvas(_WORDS + count * _CELL, (1 + len(rows)) * _CELL, _PAPER)
    scale = _scale(drawn)
    canvas.text((10, 30), "drawn", 12, _BLACK)
    for column in range(count):
        corner = (_WORDS + column * _CELL, 0)
        if pictures[column] is not None:
            canvas.paste(_crop(pictures[column], drawn[column], scale), *corner)
        _figure(canvas, _placed(drawn[column], scale, corner), 2.0)
        canvas.text((corner[0] + 6, _CELL - 6), captions[column], 9, _BLACK)
    for place, row in enumerate(rows, 1):
        top = place * _CELL
        for line, words in enumerate(row.words):
            canvas.text((10, top + 30 + 22 * line), words, 12 if line == 0 else 10, _BLACK)
        size = scale * _likeness(drawn, row.points)
        for column in range(count):
            corner = (_WORDS + column * _CELL, top)
            _figure(canvas, _placed(drawn[column], scale, corner), 5.0, _GREY)
            _figure(canvas, _placed(row.points[column], size, corner), 2.5)
            canvas.text((corner[0] + 6, top + _CELL - 6), row.captions[column], 9, _BLACK)
        canvas.polyline([(0, top), (canvas.size[0], top)], 1, _GREY)
    return over_paper(canvas.image())


def _scale(drawn: Floats) -> float:
    """Sheet pixels a drawn pixel: the largest figure fills its cell."""
    reach = np.nanmax(np.abs(drawn - _middle(drawn)), initial=1e-9)
    return float((_CELL / 2 - _MARGIN) / reach)


def _middle(points: Floats) -> Floats:
    """The middle (n, 1, 2) of each pose's marks."""
    low, high = np.nanmin(points, axis=-2, keepdims=True), np.nanmax(points, axis=-2, keepdims=True)
    middle: Floats = (low + high) / 2
    return middle


def _likeness(drawn: Floats, points: Floats) -> float:
    """How many times larger the limbs are drawn than in ``points``."""
    first, second = (np.array(ends) for ends in zip(*_PAIRS, strict=True))

    def lengths(poses: Floats) -> Floats:
        found: Floats = np.linalg.norm(poses[:, first] - poses[:, second], axis=-1)
        return found

    known = np.isfinite(lengths(drawn)) & np.isfinite(lengths(points))
    return float(lengths(drawn)[known].sum() / max(lengths(points)[known].sum(), 1e-9))


def _placed(pose: Floats, scale: float, corner: tuple[int, int]) -> Floats:
    """A pose (16, 2) in the cell at ``corner``, its middle in the cell's."""
    placed: Floats = (pose - _middle(pose)) * scale + corner + np.array([_CELL / 2, _CELL / 2])
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
