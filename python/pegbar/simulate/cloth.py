"""The cloth engine: small-step XPBD against exact moving capsules (``rust/kernels/cloth.rs``)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.simulate.cache import Cache
from pegbar.simulate.colliders import Colliders
from pegbar.simulate.course import Course, run_courses
from pegbar.simulate.elements import Cloth, Element
from pegbar.simulate.engine import Progress
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.sheet import make_sheet

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ClothEngine:
    """Simulates cloth; ``substeps`` a frame at 24 frames a second, as many a second at other rates;
    in each, lengths are restored ``rounds`` times, outwards from the pins and back.

    Cloth meets the characters' volumes, props, the ground, and balls that are in the cache already; it does not push
    balls, and one cloth does not meet another or itself. The result has the same bits in every run.
    """

    substeps: int = 60
    rounds: int = 2
    name: str = "cloth"

    def supports(self, element: Element) -> bool:
        """Whether ``element`` is cloth."""
        return isinstance(element, Cloth)

    def run(
        self, scene: SimulationScene, elements: Sequence[Element], cache: Cache, start: int, progress: Progress | None
    ) -> None:
        """Write frames ``start`` and later of the cloths to ``cache``."""
        around = Colliders(scene, cache, max(1, round(self.substeps * 24 / scene.frame_rate)))
        runs = [_Run(scene, element, around, self.rounds) for element in elements if isinstance(element, Cloth)]
        run_courses(self.name, runs, cache, start, progress)


class _Run(Course):
    """One cloth on its way through the frames."""

    def __init__(self, scene: SimulationScene, cloth: Cloth, around: Colliders, rounds: int) -> None:
        super().__init__(scene, cloth, cloth.vertices, around)
        self.material, self.rounds = cloth.material, rounds
        self.sheet = make_sheet(cloth, self.pins)

    def step(self, seconds: float, air: Floats, targets: Floats, capsules: Floats) -> None:
        scene, material = self.scene, self.material
        ground = -np.inf if scene.ground is None else scene.ground
        forces = (material.drag, material.damping, material.thickness, material.friction, float(ground))
        _kernels.step_cloth(
            self.sheet.arrays(),
            (self.sheet.compliances, (seconds, scene.gravity), forces, self.rounds),
            air,
            (self.pins.astype(np.uint32), targets),
            capsules,
            (self.positions, self.velocities),
        )
