"""The stage that simulates a shot's elements into a cache on disk, from the first frame that is missing."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pegbar.errors import SimulationError
from pegbar.io import atomic
from pegbar.io.hold import hold
from pegbar.io.simulation_cache import DiskCache
from pegbar.shot.record import fingerprint, forget, is_up_to_date, write_record
from pegbar.shot.secondary import Secondary
from pegbar.simulate.engine import Engine, simulate_scene
from pegbar.simulate.scene import SimulationScene


@dataclass(frozen=True, eq=False)
class SimulationStage:
    """Simulates ``scene`` of ``secondary`` with ``engines``, unless that is up to date."""

    secondary: Secondary
    scene: SimulationScene
    engines: Sequence[Engine]

    @property
    def cache(self) -> DiskCache:
        """Where the simulated frames are."""
        return DiskCache(self.secondary.folder / "cache")

    @property
    def output(self) -> Path:
        """The file that says that the whole simulation stands."""
        return self.secondary.folder / "cache" / "simulation.json"

    def run(self, progress: Callable[[str, int, int], None] | None = None) -> bool:
        """Simulate what is missing; return whether anything was.

        Raises SimulationError, naming the film frame, for a simulation that explodes; the frames before it are kept.
        """
        with hold(self.cache.folder):
            return self._simulate(progress)

    def _simulate(self, progress: Callable[[str, int, int], None] | None) -> bool:
        inputs, recipe = self.secondary.inputs(), self.secondary.recipe()
        if not self.secondary.overwrite and is_up_to_date([self.output], recipe, inputs) and self._is_whole():
            return False
        prints = [fingerprint(path) for path in inputs]
        forget([self.output])
        started, state = self.cache.folder / "begun.json", _begun(recipe, prints)
        same = started.is_file() and started.read_text(encoding="utf-8") == state
        names = [element.name for element in self.scene.elements]
        if self.secondary.overwrite or not same:
            for name in names:
                self.cache.clear(name, 0)
        atomic.write_bytes(started, state.encode())
        try:
            simulate_scene(self.scene, self.cache, self.engines, progress=progress)
        except SimulationError as error:
            raise SimulationError(error.element, self.secondary.frames[0] + error.frame, error.problem) from None
        atomic.write_bytes(self.output, json.dumps({"elements": names, "frames": self.scene.frames}).encode())
        write_record([self.output], recipe, prints)
        return True

    def _is_whole(self) -> bool:
        """Whether every element has all its frames."""
        wanted = list(range(self.scene.frames))
        return all(self.cache.frames(element.name) == wanted for element in self.scene.elements)


def _begun(recipe: str, prints: list[list[Any]]) -> str:
    """What a simulation that was begun depends on: it is only taken up again for the same."""
    contents = [[entry[0], entry[3]] for entry in prints]
    return hashlib.sha256(json.dumps([recipe, contents]).encode()).hexdigest()
