"""Snow that lies: pressed down by limbs, pushed up around them, fed by flakes.

After Sumner, O'Brien, Hodgins 1999, "Animating sand, mud, and snow": what a limb displaces is compressed in part, the
rest goes to the free nodes around, and slopes steeper than the angle of repose slide. Volume is kept to rounding:
heights and what is pressed together add up to the snow that there was and that fell.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter

from pegbar.simulate.cache import State
from pegbar.simulate.fields import SnowField, places_of
from pegbar.simulate.wading import undersides

Floats = NDArray[np.float64]
#: Rounds of sliding a frame, and the share of what is too steep that goes in each.
ROUNDS, SHARE = 12, 0.18
#: How far from a foot its rim lies, in nodes, and over how many a flake's snow is evened out.
RIM, FLAKE = 3.0, 2.0
#: Share of the ball of its size that is snow in a flake.
FLUFF = 0.1
#: Share of its depth to which snow can be pressed together.
PACKED = 0.15
#: Nodes beside what limbs touch, within which snow slides.
MARGIN = 24


class SnowRun:
    """A snow field on its way through the frames; ``heights`` and ``pressed`` (rows, columns) in metres."""

    def __init__(self, element: SnowField, ground: float) -> None:
        self.element, self.ground = element, ground
        self.x, self.z = places_of(element, element.heights.shape)
        self.heights, self.pressed = element.heights.copy(), np.zeros(element.heights.shape)
        #: What is pressed as hard as can be.
        self.hard = PACKED * element.heights

    def take_up(self, state: State) -> None:
        """Begin with a frame's state."""
        self.heights, self.pressed = (np.array(state[name], np.float64) for name in ("heights", "pressed"))

    def state(self) -> dict[str, Floats]:
        """What is kept of a frame."""
        return {"heights": self.heights, "pressed": self.pressed}

    @property
    def bed(self) -> tuple[tuple[float, float], float, bool, Floats]:
        """What particles land on."""
        origin = (float(self.element.origin[0]), float(self.element.origin[1]))
        return origin, self.element.spacing, True, np.ascontiguousarray(self.ground + self.heights)

    @property
    def level(self) -> float:
        """World height of the snow beyond the grid; -inf where there is none."""
        border = float(self.heights[self.element.border].mean())
        return -math.inf if self.element.beyond is None else self.ground + border

    def advance(self, capsules: Floats, before: int, after: int) -> None:
        """Let the capsules of the substeps (S + 1, C, 8) from frame ``before`` to ``after`` press; then slide."""
        touched = np.zeros(self.heights.shape, bool)
        shares = np.linspace(0, 1, len(capsules))
        for rows, share in zip(capsules[1:], shares[1:], strict=True):
            touched |= self._press(np.concatenate([rows, self._soles(before, after, float(share))]))
        if touched.any():
            self._slide(touched)

    def receive(self, landed: Floats) -> None:
        """Add flakes (n, 4: place and radius) where they lie, each with a share of the volume of a ball."""
        spacing, shape = self.element.spacing, self.heights.shape
        place = (landed[:, [2, 0]] - self.element.origin[::-1]) / spacing
        inside = ((place >= 0) & (place <= np.array(shape) - 1)).all(axis=1)
        place, radii = place[inside], landed[inside, 3]
        first = np.minimum(place.astype(int), np.array(shape) - 2)
        share = place - first
        depth, fallen = FLUFF * 4 / 3 * math.pi * radii**3 / spacing**2, np.zeros(shape)
        if not len(depth):
            return
        for i in (0, 1):
            for j in (0, 1):
                part = np.where(i, share[:, 0], 1 - share[:, 0]) * np.where(j, share[:, 1], 1 - share[:, 1])
                np.add.at(fallen, (first[:, 0] + i, first[:, 1] + j), part * depth)
        self.heights += gaussian_filter(fallen, FLAKE, mode="reflect")

    def _soles(self, before: int, after: int, share: float) -> Floats:
        """The soles (S, 8) between two frames."""
        if self.element.soles is None:
            return np.empty((0, 8))
        between: Floats = (1 - share) * self.element.soles[before] + share * self.element.soles[after]
        return between

    def _press(self, rows: Floats) -> NDArray[np.bool_]:
        """Take the snow out of the capsules; return where they touch it."""
        found = undersides(rows, self.x, self.z, self.ground + float(self.heights.max()))
        lowest = np.full(self.heights.shape, np.inf)
        for part, lower, _ in found:
            lowest[part] = np.minimum(lowest[part], np.maximum(lower - self.ground, self.hard[part]))
        touched: NDArray[np.bool_] = self.heights > lowest
        if not touched.any():
            return touched
        part = _around(touched, MARGIN)
        here = touched[part]
        removed = np.where(here, self.heights[part] - lowest[part], 0)
        self.heights[part] += _aside((1 - self.element.compaction) * removed, here) - removed
        self.pressed[part] += self.element.compaction * removed
        return touched

    def _slide(self, touched: NDArray[np.bool_]) -> None:
        """Let slopes steeper than the angle of repose slide down beside what is touched."""
        part = _around(touched, MARGIN)
        heights, fixed = self.heights[part], touched[part]
        steepest = math.tan(math.radians(self.element.repose)) * self.element.spacing
        for _ in range(ROUNDS):
            change = np.zeros_like(heights)
            for axis in (0, 1):
                fall = np.diff(heights, axis=axis)
                low, high = (np.delete(fixed, end, axis=axis) for end in (-1, 0))
                flow = np.sign(fall) * np.maximum(np.abs(fall) - steepest, 0) * SHARE
                flow[low | high] = 0
                ahead = [(1, 0), (0, 0)] if axis == 0 else [(0, 0), (1, 0)]
                behind = [(0, 1), (0, 0)] if axis == 0 else [(0, 0), (0, 1)]
                change += np.pad(flow, behind) - np.pad(flow, ahead)
            heights += change


def _around(touched: NDArray[np.bool_], margin: int) -> tuple[slice, slice]:
    """The part of a grid that holds all of ``touched`` and ``margin`` nodes more."""
    lines, columns = (np.flatnonzero(touched.any(axis=axis)) for axis in (1, 0))
    rows, across = (slice(max(0, int(v[0]) - margin), int(v[-1]) + margin + 1) for v in (lines, columns))
    return rows, across


def _aside(displaced: Floats, touched: NDArray[np.bool_]) -> Floats:
    """What is ``displaced`` (rows, columns), laid on the nodes around that are not ``touched``; all of it.

    Every node's goes to the free ones near it, the more the nearer; where there are none, to the nearest of all.
    """
    if touched.all():
        return displaced
    free = (~touched).astype(np.float64)
    room = gaussian_filter(free, RIM, mode="constant")
    near = touched & (room > 1e-4)
    laid: Floats = free * gaussian_filter(np.where(near, displaced / np.maximum(room, 1e-4), 0), RIM, mode="constant")
    far = touched & ~near & (displaced > 0)
    if far.any():
        to = distance_transform_edt(touched, return_distances=False, return_indices=True)[:, far]
        np.add.at(laid, (to[0], to[1]), displaced[far])
    return laid
