"""The particle engine: flakes and drops against exact moving limbs, cloth and props (``rust/kernels/particles.rs``)."""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.simulate.cache import Cache
from pegbar.simulate.colliders import Colliders
from pegbar.simulate.elements import Element
from pegbar.simulate.engine import Progress, refuse_explosion
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.weather import Particles

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
#: What a particle is: ``codes[:, PHASE]``.
FREE, FALLING, SETTLED, DROPLET, SLIDING = range(5)
#: Columns of ``codes``: serial number, what it lies on (-1: the ground), phase.
SERIAL, HOST, PHASE = range(3)
#: Metres outside its box at which a particle is gone.
MARGIN = 0.5
#: Frames at 24 a second at most, in which the air fills before the first frame.
LONGEST_START = 240


@dataclass(frozen=True)
class ParticleEngine:
    """Simulates particles, ``substeps`` a frame at 24 frames a second, as many a second at other rates.

    They meet the characters' volumes, balls, and the surfaces of cloth and props that are in the cache already, from
    both sides, and push nothing. The air is full and flakes lie on the first frame's pose when the shot begins. The
    result has the same bits in every run.
    """

    substeps: int = 4
    name: str = "particles"

    def supports(self, element: Element) -> bool:
        """Whether ``element`` is of particles."""
        return isinstance(element, Particles)

    def run(
        self, scene: SimulationScene, elements: Sequence[Element], cache: Cache, start: int, progress: Progress | None
    ) -> None:
        """Write frames ``start`` and later of the particles to ``cache``."""
        colliders = Colliders(scene, cache, max(1, round(self.substeps * 24 / scene.frame_rate)))
        runs = [_Run(scene, element, colliders) for element in elements if isinstance(element, Particles)]
        for run in runs:
            if start:
                run.take_up(cache, start - 1)
            else:
                run.fill()
        for frame in range(start, scene.frames):
            if frame:
                around = _Around(colliders.capsules(frame - 1, frame), colliders.vertices(frame - 1))
                around.after = colliders.vertices(frame)
                for run in runs:
                    run.advance(frame - 1, around)
            for run in runs:
                run.write(cache, frame)
            if progress is not None:
                progress(self.name, frame + 1, scene.frames)


class _Around:
    """What is met in one frame: capsules (S + 1, C, 8), vertices (V, 3) before and after it."""

    def __init__(self, capsules: Floats, before: Floats) -> None:
        self.capsules, self.before, self.after = capsules, before, before


class _Run:
    """The particles of one element on their way through the frames."""

    def __init__(self, scene: SimulationScene, element: Particles, colliders: Colliders) -> None:
        self.scene, self.element, self.colliders = scene, element, colliders
        self.waves = scene.wind.waves()
        self.stream = element.stream(np.array(scene.gravity), np.array(scene.wind.velocity))
        self.rates = element.rates(self.stream)
        count = self._capacity()
        self.motion, self.codes = np.zeros((count, 8)), np.zeros((count, 3), np.int64)
        self.emitted = 0

    def _capacity(self) -> int:
        """Slots: those in the air, and those that lie or splash, within reason."""
        material, rate = self.element.material, float(self.rates.sum())
        later = min(rate * (material.stick * material.settle + material.splash * material.splash_life), 1e5)
        return math.ceil(1.3 * self.element.count + later) + 64

    def fill(self) -> None:
        """Fill the air evenly and let it fall on the first pose, until all has come from outside."""
        element, fps = self.element, self.scene.frame_rate
        rng = self._chance(-1 << 20)
        places = rng.uniform(element.low, element.high, (element.count, 3))
        self._begin(np.arange(element.count), places, rng)
        stream = float(np.abs(self.stream / (element.high - element.low)).max())
        frames = min(LONGEST_START / 24, 1.2 / stream if stream else 0.0) * fps
        around = _Around(self.colliders.held(), self.colliders.vertices(0))
        for frame in range(-math.ceil(frames), 0):
            self.advance(frame, around)

    def take_up(self, cache: Cache, frame: int) -> None:
        """Begin with the state after ``frame``."""
        state = cache.read(self.element.name, frame)
        parts = [np.asarray(state[name], np.float64) for name in ("positions", "velocities", "sizes")]
        self.motion = np.ascontiguousarray(np.concatenate(parts, axis=1))
        self.codes = np.array(state["codes"], np.int64)
        self.emitted = int(state["emitted"])

    def write(self, cache: Cache, frame: int) -> None:
        """Write the state after ``frame``: ``sizes`` are radius (metres) and age in the phase (seconds)."""
        there = self.codes[:, PHASE] != FREE
        refuse_explosion(self.element.name, frame, self.motion[there, :3], self.motion[there, 3:6])
        state = {"positions": self.motion[:, :3], "velocities": self.motion[:, 3:6], "sizes": self.motion[:, 6:]}
        cache.write(self.element.name, frame, {**state, "codes": self.codes, "emitted": np.array(self.emitted)})

    def advance(self, before: int, around: _Around) -> None:
        """Go from frame ``before`` to the next."""
        scene, element = self.scene, self.element
        material, step = element.material, 1 / scene.frame_rate / self.colliders.substeps
        self._emit(before)
        lives = (material.lifetime, material.settle, material.splash_life, material.lifetime)
        ground = -math.inf if scene.ground is None else scene.ground
        _kernels.step_particles(
            (
                (step, scene.gravity),
                9.81 / material.terminal_velocity**2,
                (material.flutter, material.flutter_rate),
                (material.stick, material.run_off),
                (material.splash, material.splash_speed),
                lives,
                (tuple((element.low - MARGIN).tolist()), tuple((element.high + MARGIN).tolist())),
            ),
            around.capsules,
            (around.before, around.after, self.colliders.triangles),
            (ground, []),
            (scene.wind.velocity, self.waves, before / scene.frame_rate),
            (self.motion, self.codes),
        )

    def _emit(self, before: int) -> None:
        """Let in what enters in the frame after ``before``, at any time of it, as far as there are free slots."""
        element, rng = self.element, self._chance(before)
        expected = self.rates / self.scene.frame_rate
        count = int(expected.sum() + rng.random())
        slots = np.flatnonzero(self.codes[:, PHASE] == FREE)[:count]
        if not len(slots):
            return
        places = rng.uniform(element.low, element.high, (len(slots), 3))
        sides = rng.choice(3, len(slots), p=expected / expected.sum())
        entry = np.where(self.stream > 0, element.low, element.high)
        rows = np.arange(len(slots))
        places[rows, sides] = entry[sides]
        # Up to a frame's way outside, so that they enter at any time in it.
        places -= rng.random((len(slots), 1)) * self.stream / self.scene.frame_rate
        self._begin(slots, places, rng)

    def _begin(self, slots: Integers, places: Floats, rng: np.random.Generator) -> None:
        material = self.element.material
        sizes = rng.uniform(1 - material.spread, 1 + material.spread, len(slots)) * material.radius
        self.motion[slots] = np.column_stack([places, np.tile(self.stream, (len(slots), 1)), sizes, 0 * sizes])
        serials = self._salt() + self.emitted + np.arange(len(slots))
        self.codes[slots] = np.stack([serials, np.full(len(slots), -1), np.full(len(slots), FALLING)], axis=1)
        self.emitted += len(slots)

    def _salt(self) -> int:
        return (zlib.crc32(self.element.name.encode()) ^ self.scene.seed) << 24

    def _chance(self, frame: int) -> np.random.Generator:
        """Chance of its own for every frame, so that a run that is taken up goes on as it would have."""
        return np.random.default_rng([self.scene.seed, zlib.crc32(self.element.name.encode()), frame + (1 << 24)])
