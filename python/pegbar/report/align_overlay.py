"""An alignment to look at: drawing, projected clip and the drawn joints, and the joints in 3D from the side."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pegbar.report.canvas import Canvas
from pegbar.scene.alignment import Alignment
from pegbar.scene.body import limbs_between

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]
# Left is blue and right is red, as in `pegbar motion plot`; what has no side is grey.
LEFT, RIGHT, MIDDLE = (40, 90, 220), (215, 50, 40), (110, 110, 110)
_GHOST = 110
_READABLE = 540


def align_overlay(picture: Picture, alignment: Alignment, frame: int, label: str) -> Picture:
    """Return a drawing with what was found for it, and the same joints in 3D beside it, (H, W + H, 4) uint8.

    A drawing with sides shorter than 540 pixels is enlarged, by a whole number, so that lines and words can be read.

    On the drawing, faded: broad pale lines are the clip seen by the camera, thin lines the drawn joints; a ring is a
    joint that the drawing hides. On the right the drawn joints in 3D (thin) and the clip (broad) from the side, the
    camera to the left, the floor as a line. ``label`` is written above.
    """
    times = max(1, -(-_READABLE // max(picture.shape[:2])))
    picture = np.ascontiguousarray(picture.repeat(times, axis=0).repeat(times, axis=1))
    height, width = picture.shape[:2]
    canvas = Canvas(width + height, height, (255, 255, 255, 255))
    canvas.paste(picture, 0, 0)
    canvas.polygon([(-1, -1), (width, -1), (width, height), (-1, height)], (255, 255, 255, 140))
    canvas.polygon([(width, -1), (width + height, -1), (width + height, height), (width, height)], (244, 244, 240))
    unit = max(height, width) / 540
    seen, drawn = (
        times * places + (times - 1) / 2
        for places in (alignment.cameras[frame].project(alignment.clip[frame]), alignment.markers[frame])
    )
    _skeleton(canvas, alignment, seen, 5 * unit, _GHOST)
    _skeleton(canvas, alignment, drawn, 1.5 * unit, 255)
    _dots(canvas, drawn, alignment.estimated[frame], unit)
    _from_the_side(canvas, alignment, frame, width, height, unit)
    canvas.text((6 * unit, 16 * unit), label, 10 * unit, (20, 20, 20))
    return canvas.image()


def _from_the_side(canvas: Canvas, alignment: Alignment, frame: int, left: int, height: int, unit: float) -> None:
    camera = alignment.cameras[frame]
    forward = camera.rotation[2] * (1, 0, 1)
    forward = forward / max(float(np.linalg.norm(forward)), 1e-9)
    points = alignment.positions[frame]
    middle = points[np.isfinite(points).all(axis=1)].mean(axis=0)
    size = 0.4 * height / max(float(np.nanmax(np.abs(alignment.positions[..., 1] - middle[1]))), 0.3)

    def seen(world: Floats) -> Floats:
        away = (world - middle) @ np.stack([forward, [0.0, -1.0, 0.0]], axis=1)
        places: Floats = size * away + (left + height / 2, height / 2)
        return places

    floor = seen(np.stack([middle - forward * 9, middle + forward * 9]) * (1, 0, 1))
    floor[:, 0] = left, left + height
    canvas.polyline(floor, unit, (150, 150, 140))
    _skeleton(canvas, alignment, seen(alignment.clip[frame]), 5 * unit, _GHOST)
    _skeleton(canvas, alignment, seen(points), 1.5 * unit, 255)
    canvas.text((left + 6 * unit, 16 * unit), "camera this way <", 8 * unit, (120, 120, 120))


def _skeleton(canvas: Canvas, alignment: Alignment, places: Floats, width: float, alpha: int) -> None:
    order = {name: index for index, name in enumerate(alignment.names)}
    for limb in limbs_between(alignment.names):
        line = places[[order[limb.start], order[limb.end]]]
        if np.isfinite(line).all() and np.abs(line).max() < 15000:
            color = LEFT if limb.name.startswith("left") else RIGHT if limb.name.startswith("right") else MIDDLE
            canvas.polyline(line, width, (*color, alpha))


def _dots(canvas: Canvas, places: Floats, hollow: NDArray[np.bool_], unit: float) -> None:
    for place, ring in zip(places, hollow, strict=True):
        if np.isfinite(place).all() and np.abs(place).max() < 15000:
            canvas.circle(place, 3 * unit, (20, 20, 20), width=unit if ring else None)
