"""The particle engine: flakes and drops against exact moving limbs, cloth and props (``rust/kernels/particles.rs``).

It steps the height fields that they fall on as well.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.simulate.cache import Cache, State
from pegbar.simulate.colliders import Colliders
from pegbar.simulate.elements import Element, Prop
from pegbar.simulate.engine import Progress, refuse_explosion
from pegbar.simulate.fields import Puddle, SnowField
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.snow import SnowRun
from pegbar.simulate.tracks import pin_track
from pegbar.simulate.waves import PuddleRun, splash
from pegbar.simulate.weather import MOST, Particles

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
#: First node's x and z, metres between nodes, whether it takes flakes up, heights.
Bed = tuple[tuple[float, float], float, bool, Floats]
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
    """Simulates particles, lying snow and puddles, ``substeps`` a frame at 24 frames a second.

    Limbs press snow and make waves; what falls adds to snow and makes ripples. Particles meet the characters' volumes,
    balls, and the surfaces of cloth and props that are in the cache already, from both sides, and push nothing. The air
    is full and flakes lie on the first frame's pose when the shot begins. The result has the same bits in every run.
    """

    substeps: int = 4
    name: str = "particles"

    def supports(self, element: Element) -> bool:
        """Whether ``element`` is of particles or a height field."""
        return isinstance(element, Particles | SnowField | Puddle)

    def run(
        self, scene: SimulationScene, elements: Sequence[Element], cache: Cache, start: int, progress: Progress | None
    ) -> None:
        """Write frames ``start`` and later of the particles to ``cache``."""
        colliders = Colliders(scene, cache, max(1, round(self.substeps * 24 / scene.frame_rate)))
        everything = _Everything(scene, elements, colliders)
        if start:
            everything.take_up(cache, start - 1)
        else:
            everything.begin()
        for frame in range(start, scene.frames):
            if frame:
                everything.advance(frame, colliders)
            everything.write(cache, frame)
            if progress is not None:
                progress(self.name, frame + 1, scene.frames)


class _Everything:
    """All particles and fields of a run."""

    def __init__(self, scene: SimulationScene, elements: Sequence[Element], colliders: Colliders) -> None:
        self.held, self.step = colliders.held(), 1 / scene.frame_rate / colliders.substeps
        self.runs = [ParticleRun(scene, element, colliders) for element in elements if isinstance(element, Particles)]
        ground, pull = scene.ground or 0.0, float(np.linalg.norm(scene.gravity))
        self.snow = [SnowRun(element, ground) for element in elements if isinstance(element, SnowField)]
        self.puddles = [PuddleRun(element, ground, pull) for element in elements if isinstance(element, Puddle)]

    def begin(self) -> None:
        """Press the first pose into the snow, still the water, fill the air."""
        for snow in self.snow:
            snow.advance(self.held, 0, 0)
        for puddle in self.puddles:
            puddle.settle(self.held)
        for run in self.runs:
            run.fill(self._beds(), self._level())

    def take_up(self, cache: Cache, frame: int) -> None:
        """Begin with the states after ``frame``."""
        kept: list[SnowRun | PuddleRun | ParticleRun] = [*self.snow, *self.puddles, *self.runs]
        for each in kept:
            each.take_up(cache.read(each.element.name, frame))

    def write(self, cache: Cache, frame: int) -> None:
        """Write the states after ``frame``."""
        fields: list[SnowRun | PuddleRun] = [*self.snow, *self.puddles]
        for each in fields:
            refuse_explosion(each.element.name, frame, each.heights.reshape(-1, 1), np.empty((0, 3)))
            cache.write(each.element.name, frame, each.state())
        for run in self.runs:
            run.check(frame)
            cache.write(run.element.name, frame, run.state())

    def advance(self, frame: int, colliders: Colliders) -> None:
        """Go on to ``frame``: limbs into fields, splashes, particles, and what has landed into the fields."""
        around = Around(colliders.capsules(frame - 1, frame), colliders.vertices(frame - 1))
        around.after = colliders.vertices(frame)
        for snow in self.snow:
            snow.advance(around.capsules, frame - 1, frame)
        for puddle in self.puddles:
            puddle.advance(around.capsules, self.step)
            for run in self.runs:
                if run.element.name == puddle.element.drops:
                    run.throw(*splash(puddle, run.chance(frame, 1), 1 / (self.step * colliders.substeps)))
        around.beds, around.level = self._beds(), self._level()
        for run in self.runs:
            landed = run.advance(frame - 1, around)
            for puddle in self.puddles:
                puddle.receive(landed)
            for snow in self.snow if run.element.material.stick > 0 else ():
                snow.receive(landed)

    def _beds(self) -> list[Bed]:
        return [snow.bed for snow in self.snow] + [puddle.bed for puddle in self.puddles]

    def _level(self) -> float:
        """World height of snow that lies beyond its field; -inf where there is none."""
        return max((snow.level for snow in self.snow), default=-math.inf)


class Around:
    """What is met in one frame: capsules (S + 1, C, 8), vertices (V, 3) before and after it."""

    def __init__(self, capsules: Floats, before: Floats) -> None:
        self.capsules, self.before, self.after = capsules, before, before
        self.beds: list[Bed] = []
        self.level = -math.inf


class ParticleRun:
    """The particles of one element on their way through the frames."""

    def __init__(self, scene: SimulationScene, element: Particles, colliders: Colliders) -> None:
        self.scene, self.element, self.colliders = scene, over_props(scene, element), colliders
        element = self.element
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

    def fill(self, beds: list[Bed], level: float) -> None:
        """Fill the air evenly and let it fall on the first pose, until all has come from outside."""
        element, fps = self.element, self.scene.frame_rate
        rng = self.chance(-1 << 20)
        places = rng.uniform(element.low, element.high, (element.count, 3))
        self.begin(np.arange(element.count), places, rng)
        stream = float(np.abs(self.stream / (element.high - element.low)).max())
        frames = min(LONGEST_START / 24, 1.2 / stream if stream else 0.0) * fps
        around = Around(self.colliders.held(), self.colliders.vertices(0))
        around.beds, around.level = beds, level
        for frame in range(-math.ceil(frames), 0):
            self.advance(frame, around)

    def take_up(self, state: State) -> None:
        """Begin with a frame's state."""
        parts = [np.asarray(state[name], np.float64) for name in ("positions", "velocities", "sizes")]
        self.motion = np.ascontiguousarray(np.concatenate(parts, axis=1))
        self.codes = np.array(state["codes"], np.int64)
        self.emitted = int(state["emitted"])

    def check(self, frame: int) -> None:
        """Raise SimulationError for what is not where it can be."""
        there = self.codes[:, PHASE] != FREE
        refuse_explosion(self.element.name, frame, self.motion[there, :3], self.motion[there, 3:6])

    def state(self) -> dict[str, NDArray[Any]]:
        """What is kept of a frame: ``sizes`` are radius (metres) and age in the phase (seconds)."""
        state = {"positions": self.motion[:, :3], "velocities": self.motion[:, 3:6], "sizes": self.motion[:, 6:]}
        return {**state, "codes": self.codes, "emitted": np.array(self.emitted)}

    def throw(self, places: Floats, velocities: Floats) -> None:
        """Let drops (n, 3) fly up, as far as there are free slots."""
        slots = np.flatnonzero(self.codes[:, PHASE] == FREE)[: len(places)]
        self.begin(slots, places[: len(slots)], self.chance(self.emitted, 2))
        self.motion[slots, 3:6] = velocities[: len(slots)]

    def advance(self, before: int, around: Around) -> Floats:
        """Go from frame ``before`` to the next; return what came to the ground (n, 4: place and radius)."""
        scene, element = self.scene, self.element
        material, step = element.material, 1 / scene.frame_rate / self.colliders.substeps
        self.emit(before)
        lives = (material.lifetime, material.settle, material.splash_life, material.lifetime)
        ground = -math.inf if scene.ground is None else scene.ground
        landed: Floats = _kernels.step_particles(
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
            (max(ground, around.level), around.level > ground, around.beds),
            (scene.wind.velocity, self.waves, before / scene.frame_rate),
            (self.motion, self.codes),
        )
        return landed

    def emit(self, before: int) -> None:
        """Let in what enters in the frame after ``before``, at any time of it, as far as there are free slots."""
        element, rng = self.element, self.chance(before)
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
        self.begin(slots, places, rng)

    def begin(self, slots: Integers, places: Floats, rng: np.random.Generator) -> None:
        """Let particles fall from ``places`` (n, 3), in free ``slots``."""
        material = self.element.material
        sizes = rng.uniform(1 - material.spread, 1 + material.spread, len(slots)) * material.radius
        self.motion[slots] = np.column_stack([places, np.tile(self.stream, (len(slots), 1)), sizes, 0 * sizes])
        serials = self._salt() + self.emitted + np.arange(len(slots))
        self.codes[slots] = np.stack([serials, np.full(len(slots), -1), np.full(len(slots), FALLING)], axis=1)
        self.emitted += len(slots)

    def _salt(self) -> int:
        return (zlib.crc32(self.element.name.encode()) ^ self.scene.seed) << 24

    def chance(self, frame: int, purpose: int = 0) -> np.random.Generator:
        """Chance of its own for every frame, so that a run that is taken up goes on as it would have."""
        return np.random.default_rng(
            [self.scene.seed, zlib.crc32(self.element.name.encode()), frame + (1 << 24), purpose]
        )


def over_props(scene: SimulationScene, element: Particles) -> Particles:
    """The particles with their box raised over all that is held, so that none begin under it; as full as before."""
    props = [prop for prop in scene.elements if isinstance(prop, Prop)]
    top = max((float(pin_track(scene, prop.pin, prop.vertices)[..., 1].max()) for prop in props), default=-math.inf)
    height = element.high[1] - element.low[1]
    raised = top + 0.1 - element.high[1]
    if raised <= 0:
        return element
    high = element.high + np.array([0.0, raised, 0.0])
    return replace(element, high=high, count=min(MOST, math.ceil(element.count * (1 + raised / height))))
