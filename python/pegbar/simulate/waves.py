"""A puddle's waves: the linear shallow-water equation on a height field, with limbs that displace water.

The surface obeys eta_tt = g depth laplacian(eta) - damping eta_t, stepped by symplectic Euler in steps that keep the
Courant number under its limit (1 / sqrt 2 in two dimensions). The border reflects. Water that a limb takes up is added
where it stands (Chentanez, Mueller 2010), so the volume over the still level is that of what is in the water.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pegbar.simulate.cache import State
from pegbar.simulate.fields import Puddle, places_of
from pegbar.simulate.wading import undersides

Floats = NDArray[np.float64]
#: Courant number of a step at most.
COURANT = 0.5
#: Share of the depth that has to be pushed away in a frame for drops to fly; most drops a frame; fastest (m/s).
STILL, MOST_DROPS, FASTEST_DROP = 0.05, 80, 3.0
#: A drop's ripple: a dip of its radius times this, with a ring around it that holds as much.
RIPPLE = 1.0


class PuddleRun:
    """A puddle on its way through the frames; ``heights``, ``rates`` and ``taken`` (rows, columns)."""

    def __init__(self, element: Puddle, ground: float, gravity: float) -> None:
        self.element, self.ground = element, ground
        self.x, self.z = places_of(element, element.water.shape)
        self.speed = math.sqrt(gravity * element.depth)
        shape = element.water.shape
        self.heights, self.rates, self.taken = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        #: What was displaced in the last frame, by node, in metres.
        self.pushed = np.zeros(shape)
        water = element.water
        self._open = [water[1:] & water[:-1], water[:, 1:] & water[:, :-1]]

    def take_up(self, state: State) -> None:
        """Begin with a frame's state."""
        self.heights, self.rates, self.taken = (
            np.array(state[name], np.float64) for name in ("heights", "rates", "taken")
        )

    def state(self) -> dict[str, Floats]:
        """What is kept of a frame."""
        return {"heights": self.heights, "rates": self.rates, "taken": self.taken}

    @property
    def bed(self) -> tuple[tuple[float, float], float, bool, Floats]:
        """What particles fall on."""
        origin = (float(self.element.origin[0]), float(self.element.origin[1]))
        level = np.where(self.element.water, self.ground + self.element.depth + self.heights, self.ground)
        return origin, self.element.spacing, False, np.ascontiguousarray(level)

    def settle(self, capsules: Floats) -> None:
        """Begin with still water round what stands in it."""
        self.taken = self._displaced(capsules[0])

    def advance(self, capsules: Floats, step: float) -> None:
        """Go on by the substeps (S + 1, C, 8) of a frame of ``step`` seconds each."""
        self.pushed = np.zeros(self.heights.shape)
        rounds = max(1, math.ceil(self.speed * step / (COURANT * self.element.spacing)))
        for rows in capsules[1:]:
            taken = self._displaced(rows)
            change = taken - self.taken
            self.taken = taken
            self.pushed += np.maximum(change, 0)
            self.heights += change
            for _ in range(rounds):
                self._step(step / rounds)

    def receive(self, landed: Floats) -> None:
        """Make ripples of drops (n, 4: place and radius)."""
        place = np.rint((landed[:, [2, 0]] - self.element.origin[::-1]) / self.element.spacing).astype(int)
        last = np.subtract(self.heights.shape, 1)
        inside = ((place >= 1) & (place < last)).all(axis=1)
        for (i, j), radius in zip(place[inside], landed[inside, 3], strict=True):
            part = np.s_[i - 1 : i + 2, j - 1 : j + 2]
            if self.element.water[part].all():
                self.heights[part] += RIPPLE * radius / 8
                self.heights[i, j] -= RIPPLE * radius * 9 / 8

    def _step(self, step: float) -> None:
        pull = np.zeros(self.heights.shape)
        for axis, way in enumerate(self._open):
            slope = np.where(way, np.diff(self.heights, axis=axis), 0.0)
            first, last = (np.s_[:-1], np.s_[1:]) if axis == 0 else (np.s_[:, :-1], np.s_[:, 1:])
            pull[first] += slope
            pull[last] -= slope
        self.rates += step * (self.speed / self.element.spacing) ** 2 * pull
        self.rates *= math.exp(-self.element.damping * step)
        self.heights += step * self.rates

    def _displaced(self, rows: Floats) -> Floats:
        """Metres of every node's water (rows, columns) that limbs take up under the still level."""
        level = self.ground + self.element.depth
        taken = np.zeros(self.heights.shape)
        for part, under, over in undersides(rows, self.x, self.z, level):
            thick = np.minimum(over, level) - np.maximum(under, self.ground)
            taken[part] = np.maximum(taken[part], np.maximum(thick, 0))
        return np.where(self.element.water, np.minimum(taken, self.element.depth), 0.0)


def splash(puddle: PuddleRun, rng: np.random.Generator, frame_rate: float) -> tuple[Floats, Floats]:
    """Return places (n, 3) and velocities (n, 3) of the drops that fly up where limbs have pushed water in a frame.

    As many as ``splash`` says for a litre; they fly outwards from the limb and up, faster where more is pushed.
    """
    element, pushed = puddle.element, puddle.pushed
    litres = 1000 * float(pushed.sum()) * element.spacing**2
    nodes = np.flatnonzero(pushed > STILL * element.depth)
    count = min(MOST_DROPS, int(element.splash * litres + rng.random())) if len(nodes) else 0
    if not count:
        return np.empty((0, 3)), np.empty((0, 3))
    share = pushed.ravel()[nodes] / pushed.ravel()[nodes].sum()
    chosen = rng.choice(nodes, count, p=share)
    rows, columns = np.unravel_index(nodes, pushed.shape)
    middle = np.array([puddle.x[columns] @ share, puddle.z[rows] @ share])
    rows, columns = np.unravel_index(chosen, pushed.shape)
    level = np.stack([puddle.x[columns], puddle.z[rows]], axis=1)
    out = level - middle + rng.normal(0, element.spacing, level.shape)
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)
    # Water that gives way within the frame goes as fast as it is pushed down; a crown rises about twice as fast.
    rise = 2 * pushed.ravel()[chosen] * frame_rate
    up = np.minimum(rise * rng.uniform(0.6, 1.6, count), FASTEST_DROP)
    sideways = up * rng.uniform(0.3, 0.8, count)
    height = puddle.ground + element.depth + 0.01
    # Beside the limb, not in it.
    places = np.column_stack([level[:, 0], np.full(count, height), level[:, 1]])
    places[:, [0, 2]] += 0.03 * out
    return places, np.column_stack([sideways * out[:, 0], up, sideways * out[:, 1]])
