"""The cloth engine: small-step XPBD against exact moving capsules (``rust/kernels/cloth.rs``)."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.simulate.cache import Cache
from pegbar.simulate.colliders import Colliders
from pegbar.simulate.elements import Cloth, Element
from pegbar.simulate.engine import Progress, refuse_explosion
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.sheet import make_sheet
from pegbar.simulate.tracks import at_times, pin_track

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
        world = Colliders(scene, cache, max(1, round(self.substeps * 24 / scene.frame_rate)))
        runs = [_Run(scene, element, world, self.rounds) for element in elements if isinstance(element, Cloth)]
        with ThreadPoolExecutor(len(runs)) as pool:
            if start == 0:
                list(pool.map(_Run.settle, runs))
            else:
                for run in runs:
                    run.take_up(cache, start - 1)
            for frame in range(start, scene.frames):
                if frame:
                    capsules = world.capsules(frame - 1, frame)
                    list(pool.map(_Run.advance, runs, [frame] * len(runs), [capsules] * len(runs)))
                for run in runs:
                    refuse_explosion(run.cloth.name, frame, run.positions, run.velocities)
                    cache.write(run.cloth.name, frame, {"positions": run.positions, "velocities": run.velocities})
                if progress is not None:
                    progress(self.name, frame + 1, scene.frames)


class _Run:
    """One cloth on its way through the frames."""

    def __init__(self, scene: SimulationScene, cloth: Cloth, world: Colliders, rounds: int) -> None:
        self.scene, self.cloth, self.world, self.rounds = scene, cloth, world, rounds
        self.pins, self.places = _pinned(scene, cloth)
        self.sheet = make_sheet(cloth, self.pins)
        self.waves = scene.wind.waves()
        self.positions, self.velocities = cloth.vertices.copy(), np.zeros_like(cloth.vertices)

    def settle(self) -> None:
        """Go through the pre-roll; at its end the cloth has the speed of what it is pinned to."""
        launch = self._launch()
        for frame in range(-self.scene.pre_roll.frames, 0):
            self._advance(frame, self.world.capsules(frame, frame + 1), launch)
        self.velocities += launch

    def take_up(self, cache: Cache, frame: int) -> None:
        """Begin with the state after ``frame``."""
        state = cache.read(self.cloth.name, frame)
        self.positions = np.array(state["positions"], np.float64)
        self.velocities = np.array(state["velocities"], np.float64)

    def advance(self, frame: int, capsules: Floats) -> None:
        """Go from the frame before to ``frame``."""
        self._advance(frame - 1, capsules, np.zeros(3))

    def _advance(self, before: int, capsules: Floats, launch: Floats) -> None:
        scene, material = self.scene, self.cloth.material
        step = 1 / scene.frame_rate / self.world.substeps
        ground = -np.inf if scene.ground is None else scene.ground
        forces = (material.drag, material.damping, material.thickness, material.friction, float(ground))
        targets = at_times(self.places, np.maximum(self.world.times(before)[1:], 0))
        air = self._air((before + 0.5) / scene.frame_rate) - launch
        _kernels.step_cloth(
            self.sheet.arrays(),
            (self.sheet.compliances, (step, scene.gravity), forces, self.rounds),
            np.ascontiguousarray(air),
            (self.pins.astype(np.uint32), np.ascontiguousarray(targets)),
            capsules,
            (self.positions, self.velocities),
        )

    def _air(self, time: float) -> Floats:
        air = np.tile(np.array(self.scene.wind.velocity), (len(self.positions), 1))
        if len(self.waves):
            phase = self.positions @ self.waves[:, 3:6].T - self.waves[:, 6] * time + self.waves[:, 7]
            air += np.sin(phase) @ self.waves[:, :3]
        return air

    def _launch(self) -> Floats:
        """The mean velocity (3,) in m/s of the pins in the first frame; nothing for a cloth pinned to the world."""
        if len(self.places) < 2 or not len(self.pins) or any(pin.kind == "world" for pin in self.cloth.pins):
            return np.zeros(3)
        speed: Floats = (self.places[1] - self.places[0]).mean(axis=0) * self.scene.frame_rate
        return speed


def _pinned(scene: SimulationScene, cloth: Cloth) -> tuple[NDArray[np.int64], Floats]:
    """The pinned vertices (P,) and their places (F, P, 3); a vertex of several pins follows the last."""
    held: dict[int, Floats] = {}
    for pin in cloth.pins:
        vertices = np.arange(len(cloth.vertices)) if pin.vertices is None else pin.vertices
        track = pin_track(scene, pin, cloth.vertices[vertices])
        held |= {int(vertex): track[:, index] for index, vertex in enumerate(vertices)}
    if not held:
        return np.empty(0, np.int64), np.empty((scene.frames, 0, 3))
    order = sorted(held)
    return np.array(order), np.stack([held[vertex] for vertex in order], axis=1)
