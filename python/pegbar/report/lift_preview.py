"""A lifted drawing as an animation to look at: the result over the drawing, and turning on its floor."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.report.canvas import Canvas
from pegbar.report.lift_sheet import azimuth_of, draw_bones, lifted_names
from pegbar.scene.alignment import Alignment
from pegbar.scene.lifted import Lifted
from pegbar.scene.orthographic import OrthographicCamera

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]
_SIDE = 320
#: Degrees that the turntable looks down, and metres between the lines of its floor.
_DOWN, _TILE = 12.0, 0.5
_LINE, _INK = (214, 214, 204), (70, 70, 70)


def preview_frames(
    picture: Callable[[int], Picture], labels: Sequence[str], alignment: Alignment, lifted: Lifted, shown: Sequence[int]
) -> Iterator[Picture]:
    """Yield pictures (320, W, 3) uint8: the drawing, faded, under the posed skeleton; and that, turning once about.

    ``picture`` gives a drawing's picture by its place, ``labels`` (F) name the drawings, ``shown`` (T,) says which of
    them is seen in each frame. On the turntable the floor's lines are half a metre apart and stand still in the world,
    so that feet that slide are seen to.
    """
    names = lifted_names(lifted)
    posed = lifted.motion.markers(names)
    overlays: dict[int, Picture] = {}
    size = _scale(posed)
    for place, frame in enumerate(shown):
        if frame not in overlays:
            overlays = {frame: _overlay(picture(frame), labels[frame], alignment, posed, names, frame)}
        azimuth = azimuth_of(alignment, frame) + 360 * place / len(shown)
        yield np.concatenate([overlays[frame], _turntable(posed, names, frame, azimuth, size)], axis=1)


def _overlay(
    picture: Picture, label: str, alignment: Alignment, posed: Floats, names: tuple[str, ...], frame: int
) -> Picture:
    scale = _SIDE / picture.shape[0]
    width = max(round(picture.shape[1] * scale), 1)
    kind = cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC
    canvas = Canvas(width, _SIDE, (255, 255, 255, 255))
    canvas.paste(cv2.resize(picture, (width, _SIDE), interpolation=kind), 0, 0)
    canvas.polygon([(-1, -1), (width, -1), (width, _SIDE), (-1, _SIDE)], (255, 255, 255, 120))
    camera = alignment.cameras[frame]
    # A picture k times larger has its pixel centres at k p + (k - 1) / 2.
    seen = scale * camera.project(posed[frame]) + (scale - 1) / 2
    draw_bones(canvas, seen, camera.depth(posed[frame]), names, 4.0)
    known = [alignment.names.index(name) for name in names]
    for mark, guessed in zip(alignment.markers[frame, known], alignment.estimated[frame, known], strict=True):
        canvas.circle(scale * mark + (scale - 1) / 2, 3.0, _INK, width=1.0 if guessed else None)
    canvas.text((6, 16), f"drawing {label}", 10, (20, 20, 20))
    return canvas.image()[..., :3]


def _scale(posed: Floats) -> float:
    """Pixels a metre, so that the tallest pose of (F, N, 3) fits from all around."""
    tall = float(np.ptp(posed[..., 1], axis=1).max())
    middle = posed.mean(axis=1, keepdims=True)
    wide = 2 * float(np.linalg.norm((posed - middle)[..., ::2], axis=2).max())
    return 0.8 * _SIDE / max(tall, wide, 0.1)


def _turntable(posed: Floats, names: tuple[str, ...], frame: int, azimuth: float, size: float) -> Picture:
    canvas = Canvas(_SIDE, _SIDE, (250, 250, 246, 255))
    view = OrthographicCamera.from_angles(azimuth, _DOWN, size, (_SIDE / 2, 0.88 * _SIDE))
    floor = min(float(posed[..., 1].min()), 0.0)
    middle = posed[frame].mean(axis=0) * [1.0, 0.0, 1.0] + [0.0, floor, 0.0]
    tiles = _TILE * np.arange(-4, 5)
    for axis in (0, 2):
        offset = _TILE * np.round(middle[axis] / _TILE) - middle[axis]
        across = _TILE * np.round(middle[2 - axis] / _TILE) - middle[2 - axis]
        for tile in tiles:
            ends = np.zeros((2, 3))
            ends[:, axis] = tile + offset
            ends[:, 2 - axis] = tiles[0] + across, tiles[-1] + across
            canvas.polyline(view.project(ends), 1.0, _LINE)
    places = posed[frame] - middle
    draw_bones(canvas, view.project(places), view.depth(places), names, 5.0)
    return canvas.image()[..., :3]
