"""The strand engine: ropes, strings and hair as chains of points in small substeps (``rust/kernels/strand.rs``)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.simulate.cache import Cache
from pegbar.simulate.colliders import Colliders
from pegbar.simulate.course import Course, run_courses
from pegbar.simulate.elements import Element, Strands
from pegbar.simulate.engine import Progress
from pegbar.simulate.scene import SimulationScene

Floats = NDArray[np.float64]
#: Density of air, kg per cubic metre.
AIR = 1.2
#: Drag coefficients of a cylinder across the flow and of a ball, and the cylinder's share along the flow.
CYLINDER, BALL, ALONG = 1.0, 0.47, 0.1
#: The mass of air that a ball takes along, as a share of the air in its place.
TAKEN_ALONG = 0.5
#: Newtons under which a strand grows by its material's ``stretch``.
LOAD = 10.0
#: Metres kept clear of volumes and ground, beside the strand's radius.
CLEAR = 0.001


@dataclass(frozen=True)
class StrandEngine:
    """Simulates strands and their bobs; ``substeps`` a frame at 24 frames a second, as many a second at other rates;
    in each, lengths are restored by ``rounds`` Newton steps, twice as many where light strings hold bobs.

    Strands meet the characters' volumes, props, the ground, and balls that are in the cache already; bobs of one
    element meet each other as well. Strands push nothing and do not meet each other. The result has the same bits in
    every run, for any number of threads.
    """

    substeps: int = 30
    rounds: int = 2
    name: str = "strands"

    def supports(self, element: Element) -> bool:
        """Whether ``element`` is made of strands."""
        return isinstance(element, Strands)

    def run(
        self, scene: SimulationScene, elements: Sequence[Element], cache: Cache, start: int, progress: Progress | None
    ) -> None:
        """Write frames ``start`` and later of the strands to ``cache``."""
        around = Colliders(scene, cache, max(1, round(self.substeps * 24 / scene.frame_rate)))
        runs = [_Run(scene, element, around, self.rounds) for element in elements if isinstance(element, Strands)]
        run_courses(self.name, runs, cache, start, progress)


class _Run(Course):
    """One element of strands on its way through the frames."""

    def __init__(self, scene: SimulationScene, strands: Strands, around: Colliders, rounds: int) -> None:
        super().__init__(scene, strands, strands.points, around)
        self.material, self.rounds = strands.material, rounds if strands.bobs is None else 2 * rounds
        ends = np.cumsum(strands.counts)
        bobs = ends - 1 if strands.bobs is not None else np.empty(0)
        self.made = (point_rows(strands, self.pins), ends.astype(np.uint32), bobs.astype(np.uint32))

    def step(self, seconds: float, air: Floats, targets: Floats, capsules: Floats) -> None:
        scene, material = self.scene, self.material
        ground = -np.inf if scene.ground is None else scene.ground
        forces = (material.drag, material.damping, CLEAR, material.friction, float(ground))
        _kernels.step_strands(
            self.made,
            ((seconds, scene.gravity), forces, self.rounds),
            air,
            (self.pins.astype(np.uint32), targets),
            capsules,
            (self.positions, self.velocities),
        )


def point_rows(strands: Strands, pins: NDArray[np.int64]) -> Floats:
    """Return what the kernel takes (n, 8): see ``Point`` in ``rust/kernels/chain.rs``.

    The columns are 1/mass, radius, length and compliance of the link to the next point, bending stiffness, share of
    gravity, drag and its share along the strand. A bob's mass is its own and that of the air it takes along.
    """
    material, count = strands.material, len(strands.points)
    of, last = strands.strand_of, np.cumsum(strands.counts) - 1
    radii, lengths = strands.radii[of], strands.link_lengths
    links = lengths.copy()
    if strands.bobs is not None:
        # From knot to centre there is no string.
        links[last - 1] = 0.0
    share = (links + np.concatenate([[0.0], links[:-1]])) / 2
    masses = np.pi * radii**2 * share * material.density
    rows = np.zeros((count, 8))
    rows[:, 1], rows[:, 2], rows[:, 3] = radii, lengths, material.stretch / LOAD * lengths
    rows[:, 4], rows[:, 5] = material.bend, 1.0
    rows[:, 6], rows[:, 7] = AIR / 2 * CYLINDER * 2 * radii * share, ALONG
    if strands.bobs is not None:
        ball = strands.bobs.radii
        air = AIR * 4 / 3 * np.pi * ball**3
        own = strands.bobs.density / AIR * air
        masses[last] = own + TAKEN_ALONG * air
        rows[last, 1], rows[last, 5] = ball, (own - air) / masses[last]
        rows[last, 6], rows[last, 7] = AIR / 2 * BALL * np.pi * ball**2, 1.0
        rows[last - 1, 4] = 0.0
    rows[:, 0] = 1 / masses
    rows[pins, 0] = 0.0
    return rows
