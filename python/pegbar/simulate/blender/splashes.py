"""What becomes of drops that fall on something in Blender, which can only end them: ours burst and run off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.simulate.cache import Cache, State
from pegbar.simulate.colliders import Colliders
from pegbar.simulate.particles import FREE, PHASE, Around, ParticleEngine, ParticleRun
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.weather import Particles

Floats = NDArray[np.float64]
#: Metres before the place where Blender ends a drop, at which ours takes it over: its limbs are hulls, ours are round.
BEFORE = 0.02


@dataclass(frozen=True, eq=False)
class Impacts:
    """Where drops came to their end: by frame (F,) places (n, 3) and velocities (n, 3) there."""

    places: tuple[Floats, ...]
    velocities: tuple[Floats, ...]


def impacts_of(element: Particles, result: dict[str, NDArray[Any]]) -> Impacts:
    """Return the ends of drops that ``result`` of Blender tells of: those that were there and are not.

    What has left the box has not fallen on anything.
    """
    alive, born, positions = result["alive"], result["born"], result["positions"].astype(np.float64)
    places, speeds = [np.empty((0, 3))], [np.empty((0, 3))]
    for frame in range(1, len(alive)):
        here = positions[frame]
        inside = ((here > element.low) & (here < element.high)).all(axis=1)
        ended = (alive[frame - 1] | born[frame]) & ~alive[frame] & inside
        places.append(here[ended])
        speeds.append(result["velocities"][frame, ended].astype(np.float64))
    return Impacts(tuple(places), tuple(speeds))


class Aftermath(ParticleRun):
    """Drops from ``BEFORE`` their impacts on: what bursts and what runs off, frame by frame."""

    def __init__(self, scene: SimulationScene, element: Particles, cache: Cache, impacts: Impacts) -> None:
        substeps = max(1, round(ParticleEngine().substeps * 24 / scene.frame_rate))
        super().__init__(scene, element, Colliders(scene, cache, substeps))
        self.impacts = impacts
        # The first frames' drops fall once more before the film: else it would begin without droplets.
        self.early = min(len(impacts.places) - 1, round(element.material.splash_life * scene.frame_rate))
        around = Around(self.colliders.held(), self.colliders.vertices(0))
        for frame in range(-self.early, 0):
            self.advance(frame, around)

    def go(self, frame: int) -> State:
        """Return the state at ``frame``, which is the next; slots that are free are left out."""
        if frame:
            around = Around(self.colliders.capsules(frame - 1, frame), self.colliders.vertices(frame - 1))
            around.after = self.colliders.vertices(frame)
            self.advance(frame - 1, around)
        state, there = self.state(), self.codes[:, PHASE] != FREE
        return {name: array[there] if array.ndim else array for name, array in state.items()}

    def emit(self, before: int) -> None:
        """Take over the drops that fall on something in the frame after ``before``."""
        frame = before + 1 if before >= 0 else before + 1 + self.early
        places, speeds = self.impacts.places[frame], self.impacts.velocities[frame]
        slots = np.flatnonzero(self.codes[:, PHASE] == FREE)[: len(places)]
        places, speeds = places[: len(slots)], speeds[: len(slots)]
        size = np.linalg.norm(speeds, axis=1, keepdims=True)
        self.begin(slots, places - BEFORE * speeds / np.maximum(size, 1e-9), self.chance(before))
        self.motion[slots, 3:6] = speeds
