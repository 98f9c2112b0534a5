"""Bobs as Blender is told of them: at the string's end a stiff ball of cloth, which air bears by the pressure on it."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from pegbar.simulate.blender.cloth import UNIT, WIND_PRESSURE, air_at
from pegbar.simulate.elements import Strands
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.strands import AIR, BALL, TAKEN_ALONG

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
#: Bobs whose radii differ by more than this share of the mean are not simulated: a cloth's vertices have one mass.
ALIKE = 0.1
#: How many times an icosahedron's triangles may be divided for a ball.
DIVISIONS = (0, 1, 2)
#: Ball's vertices that a knot is tied to.
TIES = 6


def are_alike(strands: Strands) -> bool:
    """Whether all bobs of ``strands`` have one mass, as Blender's cloth wants it."""
    return strands.bobs is None or bool(np.ptp(strands.bobs.radii) <= ALIKE * strands.bobs.radii.mean())


def icosphere(divisions: int) -> tuple[Floats, Integers]:
    """Return unit vectors (n, 3), the highest in z first, and triangles (m, 3), turned outward.

    They are those of an icosahedron of which every triangle is cut into four, ``divisions`` times.
    """
    golden = (1 + 5**0.5) / 2
    vertices = np.array([np.roll((0.0, a, b * golden), turn) for turn in range(3) for a in (-1, 1) for b in (-1, 1)])
    near = np.linalg.norm(vertices[:, None] - vertices, axis=2) < 2.1
    sides = np.array([side for side in itertools.combinations(range(12), 3) if near[np.ix_(side, side)].all()])
    inward = np.linalg.det(vertices[sides]) < 0
    sides[inward] = sides[inward][:, ::-1]
    for _ in range(divisions):
        edges = np.sort(np.stack([sides, np.roll(sides, -1, axis=1)], axis=2), axis=2)
        pairs, middles = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
        (a, b, c), (ab, bc, ca) = sides.T, len(vertices) + middles.reshape(-1, 3).T
        # On the sphere, whose radius is that of the first.
        middle = vertices[pairs].sum(axis=1)
        middle *= np.linalg.norm(vertices[0]) / np.linalg.norm(middle, axis=1, keepdims=True)
        vertices = np.concatenate([vertices, middle])
        sides = np.concatenate([np.stack(part, 1) for part in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    order = np.argsort(-vertices[:, 2], kind="stable")
    return vertices[order] / np.linalg.norm(vertices[0]), np.argsort(order, kind="stable")[sides]


def string_mass(strands: Strands) -> float:
    """The mass in kg of all strings, without what is between knots and bobs."""
    lengths = strands.link_lengths.copy()
    if strands.bobs is not None:
        lengths[np.cumsum(strands.counts) - 2] = 0.0
    return float((np.pi * strands.radii[strands.strand_of] ** 2 * lengths).sum() * strands.material.density)


def bob_mass(strands: Strands) -> float:
    """The mean mass in kg of a bob with the air that it takes along."""
    assert strands.bobs is not None
    volumes = 4 / 3 * np.pi * strands.bobs.radii**3
    return float(volumes.mean() * (strands.bobs.density + TAKEN_ALONG * AIR))


def divisions_for(strands: Strands) -> int:
    """How often to divide the balls, so that their vertices weigh what those of the strings do, as nearly as can be."""
    points = len(strands.points) - len(strands.counts)
    wanted = bob_mass(strands) / max(string_mass(strands) / points, 1e-9)
    counts = [10 * 4**divisions + 3 for divisions in DIVISIONS]
    return DIVISIONS[int(np.argmin(np.abs(np.log(np.array(counts) / wanted))))]


class Balls:
    """The balls of ``strands``: vertices that come after the strands' own points, and what holds them together.

    The last point of a strand is its ball's centre, tied to all of the surface; the knot before it is tied to the
    centre and to the nearest of the surface.
    """

    def __init__(self, strands: Strands) -> None:
        assert strands.bobs is not None
        self.unit, self.sides = icosphere(divisions_for(strands))
        self.centers, self.points = np.cumsum(strands.counts) - 1, len(strands.points)
        self.radii, each = strands.bobs.radii, len(self.unit)
        first = self.points + np.arange(len(self.centers)) * each
        self.triangles = (first[:, None, None] + self.sides).reshape(-1, 3)
        surface = first[:, None] + np.arange(each)
        self.stiff = np.concatenate([self.centers, surface.ravel()])
        knots = np.repeat(self.centers - 1, TIES)
        spokes = np.stack([np.repeat(self.centers, each), surface.ravel()], axis=1)
        tied = np.stack([knots, surface[:, :TIES].ravel()], axis=1)
        self.ties = np.concatenate([spokes, tied, np.stack([self.centers - 1, self.centers], axis=1)])

    def around(self, points: Floats) -> Floats:
        """Return the strands' ``points`` (n, 3) and after them those of the balls, each with its +z at the knot."""
        balls = []
        for center, radius in zip(self.centers, self.radii, strict=True):
            way = points[center - 1] - points[center]
            way = way / max(float(np.linalg.norm(way)), 1e-9)
            side = np.cross(way, (1.0, 0.0, 0.0) if abs(way[0]) < 0.7 else (0.0, 1.0, 0.0))
            side /= np.linalg.norm(side)
            balls.append(points[center] + radius * self.unit @ np.stack([side, np.cross(way, side), way]))
        return np.concatenate([points, *balls])

    @property
    def count(self) -> int:
        """How many vertices the balls have beside their centres."""
        return len(self.unit) * len(self.centers)

    @property
    def area(self) -> float:
        """The balls' whole surface in square metres, flat between their vertices."""
        a, b, c = np.moveaxis(self.unit[self.sides], 1, 0)
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 * (self.radii**2).sum())

    @property
    def volume(self) -> float:
        """What the balls take up in all, in cubic metres, flat between their vertices."""
        return float(np.linalg.det(self.unit[self.sides]).sum() / 6 * (self.radii**3).sum())


def bob_settings(strands: Strands, balls: Balls, spring: float) -> dict[str, float | bool]:
    """Return Blender's settings that bear the bobs and keep them round; ``spring`` is its stiffness of links.

    The pressure of the air around a bob bears the air in its place, and that which it takes along has no weight.
    """
    assert strands.bobs is not None
    real = float((4 / 3 * np.pi * strands.bobs.radii**3).sum())
    return {
        "use_pressure": True,
        "uniform_pressure_force": 0.0,
        # In kilograms a litre, and less than none: what is around.
        "fluid_density": -AIR * (1 + TAKEN_ALONG) * real / balls.volume / 1000,
        "compression_stiffness_max": spring,
        "tension_stiffness_max": spring,
    }


def string_drag(strands: Strands) -> float:
    """What air holds the strings with, in newtons at a metre a second across them."""
    sides = float((2 * strands.radii[strands.strand_of] * strands.link_lengths).sum())
    return AIR / 2 * strands.material.drag * sides


def bob_drag(strands: Strands) -> float:
    """What air holds the bobs with, in newtons at a metre a second."""
    assert strands.bobs is not None
    return float((AIR / 2 * strands.material.drag * BALL * np.pi * strands.bobs.radii**2).sum())


def blow_of(scene: SimulationScene, strands: Strands, balls: Balls, middle: Floats) -> Floats:
    """The wind (T, 3) by frame in Blender's strength that pushes the ``balls`` as air pushes bobs and half the strings.

    Blender's wind pushes every side alike, however it is turned (measured with 3.4 to 5.0).
    """
    numbers = np.arange(-scene.pre_roll.frames, scene.frames)
    air = air_at(scene, middle[np.maximum(numbers, 0)], numbers[:, None] / scene.frame_rate)
    speed = np.linalg.norm(air, axis=1, keepdims=True)
    force = (bob_drag(strands) + string_drag(strands) / 2) * UNIT**2 / (WIND_PRESSURE * balls.area)
    push: Floats = air * speed * force * scene.frame_rate
    return push
