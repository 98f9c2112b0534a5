"""A lifted drawing to look at: drawing, clip and result, as in figure 7 of the 2009 paper, and the result turned."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.report.align_overlay import LEFT, MIDDLE, RIGHT
from pegbar.report.canvas import Canvas
from pegbar.scene.alignment import Alignment
from pegbar.scene.body import bones_between
from pegbar.scene.lifted import Lifted
from pegbar.scene.orthographic import OrthographicCamera

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]
_SIDE = 260
_TURNS = (0, 45, 90, 135)
_ROWS = 12
_GREY, _PAPER = (110, 110, 110), (250, 250, 246, 255)


def lift_sheet(
    picture: Callable[[int], Picture], labels: Sequence[str], alignment: Alignment, lifted: Lifted
) -> Picture:
    """Return rows of (260, W, 3) uint8 for at most 12 drawings: the drawing, the clip, the result from four directions.

    The result is the posed skeleton, broad, and the lifted markers, thin: bones that are not as long as drawn part
    from them. The first direction is the drawing's own camera's, level; then the figure is turned by 45 degrees each
    time. ``picture`` gives a drawing's picture by its place, ``labels`` (F) name the drawings.
    """
    count = len(labels)
    chosen = np.unique(np.linspace(0, count - 1, min(_ROWS, count)).round().astype(int)).tolist()
    names = lifted_names(lifted)
    posed = lifted.motion.markers(names)
    rows = [_row(picture(i), labels[i], alignment, lifted, (names, posed[i]), i) for i in chosen]
    return np.concatenate(rows)


def lifted_names(lifted: Lifted) -> tuple[str, ...]:
    """Return the markers that the posed skeleton has too."""
    return tuple(name for name in lifted.names if name in {*lifted.motion.known_markers, *lifted.motion.names})


def azimuth_of(alignment: Alignment, frame: int) -> float:
    """Return where the drawing's camera stands, in degrees about the vertical."""
    back = -alignment.cameras[frame].rotation[2]
    return float(np.degrees(np.arctan2(back[0], back[2])))


def draw_bones(canvas: Canvas, places: Floats, depths: Floats, names: tuple[str, ...], width: float) -> None:
    """Draw the bones between ``places`` (N, 2) of markers ``names``, far ones (``depths`` (N,)) first."""
    for start, end in sorted(bones_between(names), key=lambda bone: -float(depths[list(bone)].mean())):
        side = LEFT if names[end].startswith("left") else RIGHT if names[end].startswith("right") else MIDDLE
        canvas.polyline(places[[start, end]], width, side)


def _row(
    picture: Picture,
    label: str,
    alignment: Alignment,
    lifted: Lifted,
    posed: tuple[tuple[str, ...], Floats],
    frame: int,
) -> Picture:
    small = cv2.resize(
        picture, (round(picture.shape[1] * _SIDE / picture.shape[0]), _SIDE), interpolation=cv2.INTER_AREA
    )
    drawn = Canvas(max(small.shape[1], 90), _SIDE, (255, 255, 255, 255))
    drawn.paste(small, 0, 0)
    drawn.text((6, 16), f"drawing {label}", 10, (20, 20, 20))
    azimuth = azimuth_of(alignment, frame)
    known = [alignment.names.index(name) for name in lifted.names]
    cells = [drawn.image()[..., :3], _stick("clip", azimuth, (lifted.names, alignment.clip[frame, known], 4.0))]
    figures = ((*posed, 5.0), (lifted.names, lifted.markers[frame], 1.5))
    cells += [_stick("result" if turn == 0 else f"turned {turn}", azimuth + turn, *figures) for turn in _TURNS]
    return np.concatenate(cells, axis=1)


def _stick(label: str, azimuth: float, *figures: tuple[tuple[str, ...], Floats, float]) -> Picture:
    """Stick figures (names, places (N, 3), pen) in one cell; the first says how large and where."""
    canvas = Canvas(_SIDE, _SIDE, _PAPER)
    points = figures[0][1]
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    size = 0.8 * _SIDE / max(float(np.ptp(points, axis=0).max()), 0.1)
    view = OrthographicCamera.from_angles(azimuth, 0, size, (_SIDE / 2, _SIDE / 2))
    for names, places, width in figures:
        draw_bones(canvas, view.project(places - middle), view.depth(places - middle), names, width)
    canvas.text((6, 16), label, 10, _GREY)
    return canvas.image()[..., :3]
