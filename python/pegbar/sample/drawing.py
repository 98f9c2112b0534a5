"""Paints a frame of the dancer and its label picture, the parts from far to near."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pegbar.report.canvas import Canvas
from pegbar.sample.figure import Pose, body
from pegbar.sample.head import head
from pegbar.sample.marks import Axis, Fill, Floats, Part, View
from pegbar.scene.camera import PerspectiveCamera

# What lies over what, whatever the depths: cloth over legs, shoes over leggings, face over neck.
_OVER = {("torso", "skirt"), ("hair", "neck"), ("hair", "head"), ("neck", "head"), ("torso", "neck")} | {
    pair
    for side in ("left", "right")
    for pair in [(f"{side}_thigh", "skirt"), (f"{side}_shin", f"{side}_foot"), (f"{side}_forearm", f"{side}_hand")]
}
_ALWAYS = 100
_JOINED = {
    frozenset(pair)
    for side in ("left_", "right_")
    for pair in [(f"{side}upper_arm", f"{side}forearm"), (f"{side}thigh", f"{side}shin"), (f"{side}upper_arm", "torso")]
}


def parts(pose: Pose, camera: PerspectiveCamera, frame: int) -> list[Part]:
    """The figure's parts from far to near; ``frame`` decides how the pen trembles."""
    view = View(camera, frame)
    return _far_to_near(body(pose, view) + head(pose, view))


def drawing(figure: list[Part], size: tuple[int, int]) -> NDArray[np.uint8]:
    """The coloured drawing (H, W, 4) uint8 on a transparent ground, straight alpha."""
    canvas = Canvas(*size)
    for part in figure:
        for mark in (*part.lines, *part.fills, *part.details):
            if isinstance(mark, Fill):
                canvas.polygon(mark.points, mark.color)
            else:
                canvas.polyline(mark.points, mark.widths, mark.color)
    return canvas.image()


def labels(figure: list[Part], size: tuple[int, int]) -> NDArray[np.uint8]:
    """The label picture (H, W, 3) uint8: flat colours on black, no soft rims, no lines."""
    canvas = Canvas(*size, (0, 0, 0, 255), antialias=False)
    for part in figure:
        for mark in (*part.fills, *part.details):
            if isinstance(mark, Fill) and mark.label is not None:
                canvas.polygon(mark.points, mark.label)
    return np.ascontiguousarray(canvas.image()[..., :3])


def _far_to_near(figure: list[Part]) -> list[Part]:
    """Order of painting: where two parts meet in the picture, the farther one first."""
    count = len(figure)
    behind = np.zeros((count, count))
    for i in range(count):
        for j in range(i + 1, count):
            nearer = _nearer(figure[i], figure[j])
            behind[i, j], behind[j, i] = max(nearer, 0), max(-nearer, 0)
    middle = np.array([part.axis.depths.mean() for part in figure])
    left, order = list(range(count)), []
    while left:
        waiting = behind[np.ix_(left, left)].sum(axis=0)
        # A ring of overlaps has no order: its part with the fewest before it, then the farthest, goes first.
        chosen = min(left, key=lambda index: (waiting[left.index(index)], -middle[index]))
        left.remove(chosen)
        order.append(figure[chosen])
    return order


def _nearer(first: Part, second: Part) -> int:
    """1 where the second part must be painted over the first, -1 the other way, 0 where they do not meet."""
    names = (first.name, second.name)
    if names in _OVER:
        return _ALWAYS
    if names[::-1] in _OVER:
        return -_ALWAYS
    if frozenset(names) in _JOINED:
        bias = 0.03 if "torso" in names else 0.0
        sign = 1 if names[1] != "torso" else -1
        gap = float(first.axis.depths.mean() - second.axis.depths.mean())
        if bias:
            arm, trunk = (first, second) if names[1] == "torso" else (second, first)
            gap = sign * float(_depth_beside(trunk.axis, arm.axis.ends.mean(axis=0)) + bias - arm.axis.depths.mean())
        return 1 if gap >= 0 else -1
    distance, gap = _meet(first.axis, second.axis)
    if distance > 1.3 * (first.axis.radius + second.axis.radius):
        return 0
    return 1 if gap >= 0 else -1


def _depth_beside(axis: Axis, point: Floats) -> float:
    along = axis.ends[1] - axis.ends[0]
    place = np.clip((point - axis.ends[0]) @ along / max(along @ along, 1e-9), 0, 1)
    return float(axis.depths[0] + place * (axis.depths[1] - axis.depths[0]))


def _meet(first: Axis, second: Axis) -> tuple[float, float]:
    """Least distance of two axes in pixels, and how much deeper the first is there."""
    places = np.linspace(0, 1, 17)[:, None]
    a, b = (axis.ends[0] + places * (axis.ends[1] - axis.ends[0]) for axis in (first, second))
    distances = np.hypot(*(a[:, None] - b).transpose(2, 0, 1))
    i, j = np.unravel_index(distances.argmin(), distances.shape)
    z, w = (axis.depths[0] + places[:, 0] * (axis.depths[1] - axis.depths[0]) for axis in (first, second))
    return float(distances[i, j]), float(z[i] - w[j])
