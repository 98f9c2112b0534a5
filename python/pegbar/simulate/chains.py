"""Strands: chains of points with what hangs at their ends."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pegbar import arrays
from pegbar.simulate.materials import Look, StrandMaterial, check, positive
from pegbar.simulate.pins import Pin, check_pins

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Bobs:
    """Balls at the ends of strands, one a strand: weights, beads, balloons.

    ``radii`` (s,) are in metres, ``density`` in kg per cubic metre of the whole ball: what is lighter than air (1.2)
    rises; a balloon with helium has about 0.5. ``colors`` (s, 4) straight linear RGBA (None: the strands').
    """

    radii: Floats
    density: float = 600.0
    colors: NDArray[np.float32] | None = None

    def __post_init__(self) -> None:
        radii = positive("bobs.radii", self.radii, ("s",))
        object.__setattr__(self, "radii", radii)
        check(self, positive=("density",))
        if self.colors is not None:
            object.__setattr__(
                self, "colors", arrays.floats("bobs.colors", self.colors, (len(radii), 4), dtype=np.float32)
            )


@dataclass(frozen=True, eq=False)
class Strands:
    """Ropes, strings, ribbons or hair: chains of points.

    Parameters
    ----------
    name : str
        Unique in the scene.
    points : (n, 3) float
        Where the strands are before the first frame, one strand after the other, world metres.
    counts : (s,) int
        How many points each strand has, two or more.
    radii : (s,) float
        How thick each is, metres.
    pins : tuple of Pin
        What holds them; their ``vertices`` are indices into ``points``. Two neighbouring points held give a strand its
        direction there.
    rest : (n, 3) float, optional
        Points whose distances the strands keep, None: ``points``.
    bobs : Bobs, optional
        Balls around the last points; a string is knotted to the point before, which is ``bobs.radii`` away.
    colors : (s, 4) float, optional
        Straight linear RGBA by strand, None: the look's.
    material, look
        What they are made of and look like; a pattern of bands or stripes goes along the strand.
    """

    name: str
    points: Floats
    counts: Integers
    radii: Floats
    pins: tuple[Pin, ...] = ()
    rest: Floats | None = None
    bobs: Bobs | None = None
    colors: NDArray[np.float32] | None = None
    material: StrandMaterial = field(default_factory=StrandMaterial)
    look: Look = field(default_factory=Look)

    def __post_init__(self) -> None:
        points = arrays.floats("points", self.points, ("n", 3))
        counts = arrays.integers("counts", self.counts, ("s",), low=2)
        if counts.sum() != len(points) or not len(counts):
            raise ValueError(f"counts: want {len(points)} points in all, of one strand or more, got {counts.sum()}")
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "counts", counts)
        object.__setattr__(self, "radii", positive("radii", self.radii, (len(counts),)))
        rest = points if self.rest is None else arrays.floats("rest", self.rest, points.shape)
        object.__setattr__(self, "rest", rest)
        if (self.link_lengths[self.links[:, 0]] <= 0).any():
            raise ValueError(f"points: {self.name}: neighbouring points of a strand coincide")
        if self.bobs is not None and len(self.bobs.radii) != len(counts):
            raise ValueError(f"bobs: want {len(counts)}, one a strand, got {len(self.bobs.radii)}")
        if self.colors is not None:
            object.__setattr__(self, "colors", arrays.floats("colors", self.colors, (len(counts), 4), dtype=np.float32))
        check_pins(self.name, self.pins, len(points))

    @property
    def strand_of(self) -> Integers:
        """By point (n,) the strand that it belongs to."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    @property
    def links(self) -> Integers:
        """Neighbouring points (n - s, 2)."""
        first = np.delete(np.arange(len(self.points)), np.cumsum(self.counts) - 1)
        return np.stack([first, first + 1], axis=1)

    @property
    def link_lengths(self) -> Floats:
        """By point (n,) the metres at rest to the next point of its strand, 0 at the last."""
        rest = self.points if self.rest is None else self.rest
        lengths = np.zeros(len(rest))
        lengths[self.links[:, 0]] = np.linalg.norm(rest[self.links[:, 1]] - rest[self.links[:, 0]], axis=1)
        return lengths
