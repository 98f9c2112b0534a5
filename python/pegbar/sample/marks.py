"""What a drawn part is made of: filled outlines and pen strokes, from spheres and rings seen by a camera.

The pen goes round every piece of a part before the pieces are filled, so its inner half and the lines between pieces
disappear: what stays is a line around the whole part, outside its colour. The hand that holds the pen trembles a
little, anew on every second frame.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.scene.camera import PerspectiveCamera

Floats = NDArray[np.float64]
Color = tuple[int, ...]

INK: Color = (52, 34, 48)
LINE = 0.0115
"""Width of the pen's visible half together with its hidden half, in metres at the figure."""


class Fill(NamedTuple):
    """A filled outline; ``label`` is its colour in the label picture, None for paint on what is filled already."""

    points: Floats
    color: Color
    label: Color | None = None


class Stroke(NamedTuple):
    """A pen line with a width at each point."""

    points: Floats
    widths: Floats
    color: Color


class Axis(NamedTuple):
    """Where a part lies, for the order of painting: two ends in pixels, their depths, half its width in pixels."""

    ends: Floats
    depths: Floats
    radius: float


@dataclass
class Part:
    """A piece of the figure that is painted at once. ``limb`` is the limb whose label it carries."""

    name: str
    limb: str
    axis: Axis
    lines: list[Stroke] = field(default_factory=list)
    fills: list[Fill] = field(default_factory=list)
    details: list[Fill | Stroke] = field(default_factory=list)


class View:
    """A camera with the pen of one frame."""

    def __init__(self, camera: PerspectiveCamera, frame: int) -> None:
        self.camera = camera
        self.tremble = frame // 2

    def scale(self, points: Floats) -> Floats:
        """Pixels a metre at ``points`` (..., 3)."""
        return np.asarray(self.camera.focal_length / self.camera.depth(points))

    def axis(self, points: Floats, radius: float) -> Axis:
        """The axis of a part between two ``points`` (2, 3) with half a width in metres."""
        return Axis(self.camera.project(points), self.camera.depth(points), radius * float(self.scale(points).mean()))

    def discs(self, centers: Floats, radii: Floats) -> tuple[Floats, Floats]:
        """Spheres ``centers`` (n, 3), ``radii`` (n,) in metres as discs in pixels."""
        return self.camera.project(centers), radii * self.scale(centers)

    def pen(self, points: Floats, seed: int, *, weight: Floats | float = 1.0, closed: bool = True) -> Stroke:
        """An ink line through ``points`` (n, 2) with a tremble of its own for every ``seed``."""
        metre = self.camera.focal_length / 5.0
        size = LINE * metre
        at = along(points)
        period = at[-1] + float(np.hypot(*(points[0] - points[-1]))) if closed else 0.0
        wave = _tremble(seed * 7919 + self.tremble, at / metre, period / metre)
        normal = _normals(points, closed)
        moved = points + normal * (0.16 * size * wave[0])[:, None]
        return Stroke(moved, np.maximum(size * (1.0 + 0.28 * wave[1]) * weight, 0.0), INK)


def outline(centers: Floats, radii: Floats) -> Floats:
    """Convex outline (m, 2) around discs in pixels, evenly spaced; starts at the disc with the least index."""
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    rim = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    return hull((centers[:, None] + radii[:, None, None] * rim).reshape(-1, 2))


def hull(points: Floats, spacing: float = 2.0) -> Floats:
    """Convex outline (m, 2) around ``points`` (n, 2), with a vertex at least every ``spacing`` pixels."""
    corners = cv2.convexHull(points.astype(np.float32))[:, 0].astype(np.float64)
    return resample(np.concatenate([corners, corners[:1]]), spacing)[:-1]


def resample(points: Floats, spacing: float) -> Floats:
    """Points evenly along the polyline ``points`` (n, 2), ends kept."""
    at = along(points)
    count = max(int(np.ceil(at[-1] / spacing)), 2)
    wanted = np.linspace(0, at[-1], count + 1)
    return np.column_stack([np.interp(wanted, at, points[:, 0]), np.interp(wanted, at, points[:, 1])])


def smooth(points: Floats, spacing: float = 1.5) -> Floats:
    """A smooth line through ``points`` (n, 2): Catmull-Rom, resampled."""
    padded = np.concatenate([2 * points[:1] - points[1:2], points, 2 * points[-1:] - points[-2:-1]])
    t = np.linspace(0, 1, 8, endpoint=False)[:, None]
    pieces = []
    for a, b, c, d in zip(padded, padded[1:], padded[2:], padded[3:], strict=False):
        pieces.append(0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * (b - c) + d - a) * t**3))
    return resample(np.concatenate([*pieces, points[-1:]]), spacing)


def along(points: Floats) -> Floats:
    """Distance of every vertex from the first, along the polyline."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _normals(points: Floats, closed: bool) -> Floats:
    around = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    tangent = around if closed else np.gradient(points, axis=0)
    normal: Floats = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    return np.asarray(normal / np.maximum(np.hypot(*tangent.T), 1e-9)[:, None])


def _tremble(seed: int, at: Floats, period: float) -> Floats:
    """Two smooth waves (2, n) within -1..1 at places ``at`` (n,) metres; a closed line's waves close."""
    random = np.random.default_rng(seed)
    lengths = np.array([0.31, 0.17, 0.083])
    if period > 0:
        lengths = period / np.maximum(np.rint(period / lengths), 1)
    phases = random.uniform(0, 2 * np.pi, (2, 3))
    waves = np.sin(2 * np.pi * at / lengths[:, None] + phases[..., None])
    return np.asarray(np.tensordot(waves, np.array([0.45, 0.35, 0.2]), axes=(1, 0)))
