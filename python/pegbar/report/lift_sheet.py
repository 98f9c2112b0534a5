"""A lifted drawing to look at: drawing, clip and result, as in figure 7 of the 2009 paper, and the result turned."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.report.align_overlay import LEFT, MIDDLE, RIGHT
from pegbar.report.canvas import Canvas
from pegbar.report.contact_sheet import over_paper
from pegbar.scene.alignment import Alignment
from pegbar.scene.body import bones_between
from pegbar.scene.orthographic import OrthographicCamera

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]
_SIDE = 260
_TURNS = (0, 45, 90, 135)


def lift_row(picture: Picture, alignment: Alignment, markers: Floats, names: Sequence[str], frame: int) -> Picture:
    """Return one row (260, W, 3) uint8 for a drawing: it, the clip, and the lifted markers from four directions.

    ``markers`` (N, 3) are the lifted ones of ``names``. The first direction is the drawing's own camera's, level; then
    the figure is turned by 45 degrees each time.
    """
    height = _SIDE
    small = over_paper(cv2.resize(picture, (round(picture.shape[1] * height / picture.shape[0]), height)))
    known = [alignment.names.index(name) for name in names]
    back = -alignment.cameras[frame].rotation[2]
    azimuth = float(np.degrees(np.arctan2(back[0], back[2])))
    cells = [small, _stick(alignment.clip[frame, known], tuple(names), azimuth, "clip")]
    cells += [_stick(markers, tuple(names), azimuth + turn, f"result {turn}") for turn in _TURNS]
    return np.concatenate(cells, axis=1)


def _stick(points: Floats, names: tuple[str, ...], azimuth: float, label: str) -> Picture:
    canvas = Canvas(_SIDE, _SIDE, (250, 250, 246, 255))
    known = np.isfinite(points).all(axis=1)
    middle = (points[known].min(axis=0) + points[known].max(axis=0)) / 2
    size = 0.8 * _SIDE / max(float(np.ptp(points[known], axis=0).max()), 0.1)
    view = OrthographicCamera.from_angles(azimuth, 0, size, (_SIDE / 2, _SIDE / 2))
    places = view.project(points - middle)
    # Far limbs first.
    bones = sorted(bones_between(names), key=lambda bone: -float(view.depth(points[list(bone)] - middle).mean()))
    for start, end in bones:
        side = LEFT if names[end].startswith("left") else RIGHT if names[end].startswith("right") else MIDDLE
        canvas.polyline(places[[start, end]], 4.0, side)
    canvas.text((6, 14), label, 9, (110, 110, 110))
    return over_paper(canvas.image())
