"""Height fields on the ground: snow that feet press down, a puddle that they splash."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pegbar import arrays
from pegbar.simulate.materials import Look, check

Floats = NDArray[np.float64]
#: Most nodes of a field.
MOST = 400_000


@dataclass(frozen=True, eq=False)
class SnowField:
    """Lying snow: a height field that limbs press down and push up around them, and that falling flakes add to.

    Parameters
    ----------
    name : str
        Unique in the scene.
    origin : (2,) float
        World x and z of the first node.
    spacing : float
        Metres between nodes.
    heights : (rows, columns) float
        Depth of the snow over the ground before the first frame, metres; rows along z, columns along x.
    compaction : float
        Share of the snow under a foot that is pressed together; the rest is pushed aside into a rim.
    repose : float
        Angle of repose in degrees: steeper slopes slide down.
    beyond : (4,) float, optional
        World x and z of two corners: so far snow lies beyond the grid too, as deep as at its border. It is drawn and
        takes flakes up, and nothing presses it. None: there is none.
    soles : (F, S, 8) float, optional
        Capsules by frame that press it beside the characters' volumes: feet that have none. None: there are none.
    look
        Its ``color`` is fresh snow's, ``second`` that of what is pressed down.
    """

    name: str
    origin: Floats
    spacing: float
    heights: Floats
    compaction: float = 0.6
    repose: float = 50.0
    beyond: Floats | None = None
    soles: Floats | None = None
    look: Look = field(default_factory=lambda: Look((0.86, 0.91, 0.98, 1.0), (0.5, 0.62, 0.82, 1.0)))

    def __post_init__(self) -> None:
        _set_grid(self, arrays.floats("heights", self.heights, ("rows", "columns")))
        if self.heights.min() < 0:
            raise ValueError(f"heights: want depths of zero or more, got {self.heights.min()}")
        check(self, positive=("spacing", "repose"), not_negative=("compaction",))
        if self.compaction > 1:
            raise ValueError(f"compaction: want 0 to 1, got {self.compaction}")
        if self.repose >= 90:
            raise ValueError(f"repose: want less than 90 degrees, got {self.repose}")
        if self.beyond is not None:
            object.__setattr__(self, "beyond", arrays.floats("beyond", self.beyond, (4,)))
        if self.soles is not None:
            object.__setattr__(self, "soles", arrays.floats("soles", self.soles, ("F", "S", 8)))

    @property
    def border(self) -> NDArray[np.bool_]:
        """Which nodes (rows, columns) are the grid's outermost."""
        rim = np.ones(self.heights.shape, bool)
        rim[1:-1, 1:-1] = False
        return rim


@dataclass(frozen=True, eq=False)
class Puddle:
    """Shallow water on the ground: waves of a height field, made by limbs that wade through it and by drops.

    Parameters
    ----------
    name : str
        Unique in the scene.
    origin : (2,) float
        World x and z of the first node.
    spacing : float
        Metres between nodes.
    water : (rows, columns) bool
        Where there is water; its border reflects. Rows along z, columns along x.
    depth : float
        Of the still water, metres; it stands so high over the ground. Waves go at ``sqrt(g depth)``.
    damping : float
        Rate at which waves die, 1/s.
    drops : str, optional
        Name of the element of ``Particles`` that splashes are made of; None: no splashes.
    splash : float
        Drops a litre of water that a limb pushes away at once.
    look
        ``color`` is the water's, ``second`` that of the sides of waves which look to the light.
    """

    name: str
    origin: Floats
    spacing: float
    water: NDArray[np.bool_]
    depth: float = 0.03
    damping: float = 0.8
    drops: str | None = None
    splash: float = 60.0
    look: Look = field(default_factory=lambda: Look((0.16, 0.3, 0.45, 0.7), (0.75, 0.88, 0.96, 0.9)))

    def __post_init__(self) -> None:
        water = np.ascontiguousarray(self.water)
        if water.dtype != bool or water.ndim != 2:
            raise ValueError(f"water: want (rows, columns) bool, got {water.shape} {water.dtype}")
        object.__setattr__(self, "water", water)
        _set_grid(self, np.zeros(water.shape))
        check(self, positive=("spacing", "depth"), not_negative=("damping", "splash"))
        if not water.any():
            raise ValueError("water: want water somewhere")

    @property
    def area(self) -> float:
        """Of the water, square metres."""
        return float(self.water.sum()) * self.spacing**2


def _set_grid(made: SnowField | Puddle, nodes: Floats) -> None:
    """Coerce origin and heights; refuse grids that are too small or too large."""
    object.__setattr__(made, "origin", arrays.floats("origin", made.origin, (2,)))
    if isinstance(made, SnowField):
        object.__setattr__(made, "heights", nodes)
    if min(nodes.shape) < 3 or nodes.size > MOST:
        raise ValueError(f"{made.name}: want a grid of 3 x 3 to {MOST} nodes, got {nodes.shape[0]} x {nodes.shape[1]}")


def places_of(element: SnowField | Puddle, shape: tuple[int, int]) -> tuple[Floats, Floats]:
    """Return the world x (columns,) and z (rows,) of a field's nodes."""
    x, z = (element.origin[axis] + element.spacing * np.arange(shape[1 - axis]) for axis in (0, 1))
    return x, z
