"""A picture with its joint marks and, over it, the skeleton of a pose seen through a camera."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.report.canvas import Canvas, Color
from pegbar.report.contact_sheet import over_paper
from pegbar.scene.body import LIMBS
from pegbar.scene.drawing import Limb

#: The skeleton's colours: the figure's own left, its right, and what has no side.
SIDES: dict[str, Color] = {"left": (0, 110, 255), "right": (230, 60, 0), "": (20, 150, 60)}
_MARK, _OFF = (255, 215, 0), (150, 150, 150)
#: Small pictures are enlarged by a whole factor to about this many pixels.
_SIZE = 640


def pose_overlay(
    picture: ArrayLike,
    names: Sequence[str],
    joints: ArrayLike,
    projected: ArrayLike,
    *,
    active: ArrayLike | None = None,
    limbs: Sequence[Limb] = LIMBS,
    title: str = "",
) -> NDArray[np.uint8]:
    """Draw marks and a projected skeleton over a picture.

    Yellow discs are the marks (grey where switched off), lines the skeleton: blue on the figure's left, red on its
    right, green between. A thin black line joins every mark with its projected joint.

    Parameters
    ----------
    picture : (H, W, 3|4) uint8
        Straight alpha is put over white. Smaller pictures than 640 pixels are enlarged by a whole number.
    names : sequence of N str
        The joints' names; sides are told by "left" and "right" at the beginning.
    joints, projected : (N, 2) float
        Marks and projected joints in the picture's pixels, pixel centres at integers. What is NaN is left out.
    active : (N,) bool, optional
        Which marks count.
    limbs : sequence of Limb
        The skeleton's lines; those with a joint that ``names`` lacks are left out.
    title : str
        Written in the corner.

    Returns
    -------
    (H, W, 4) uint8
    """
    image = over_paper(arrays.image("picture", picture))
    count = len(names)
    marks = arrays.floats("joints", joints, (count, 2), allow="nan")
    seen = arrays.floats("projected", projected, (count, 2), allow="nan")
    counted = np.ones(count, bool) if active is None else arrays.flags("active", active, (count,))
    factor = max(1, _SIZE // max(image.shape[:2]))
    image = np.repeat(np.repeat(image, factor, axis=0), factor, axis=1)
    marks, seen = (factor * points + (factor - 1) / 2 for points in (marks, seen))
    canvas = Canvas(image.shape[1], image.shape[0])
    canvas.paste(image, 0, 0)
    pen = max(image.shape[:2]) / 300
    _skeleton(canvas, list(names), seen, limbs, pen)
    for mark, place, on in zip(marks, seen, counted, strict=True):
        if np.isfinite(mark).all():
            if np.isfinite(place).all():
                canvas.polyline([mark, place], pen / 2, (0, 0, 0))
            canvas.circle(mark, 1.4 * pen, (0, 0, 0))
            canvas.circle(mark, pen, _MARK if on else _OFF)
    if title:
        canvas.text((2 * pen, 7 * pen), title, 4 * pen, (0, 0, 0))
    return canvas.image()


def _skeleton(canvas: Canvas, names: list[str], seen: NDArray[np.float64], limbs: Sequence[Limb], pen: float) -> None:
    for limb in limbs:
        if limb.start not in names or limb.end not in names:
            continue
        ends = seen[[names.index(limb.start), names.index(limb.end)]]
        if np.isfinite(ends).all():
            side = next((side for side in ("left", "right") if limb.end.startswith(side)), "")
            canvas.polyline(ends, 1.8 * pen, (255, 255, 255))
            canvas.polyline(ends, 1.2 * pen, SIDES[side])
