"""Engines: what simulates elements into a cache, behind one small protocol."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import SimulationError
from pegbar.simulate.cache import Cache, complete_until
from pegbar.simulate.elements import Element
from pegbar.simulate.scene import SimulationScene

Progress = Callable[[str, int, int], None]
#: What leaves this many metres from the scene's middle, or is faster than this (m/s), has exploded.
FARTHEST = 1000.0
FASTEST = 200.0


class Engine(Protocol):
    """Simulates the elements that it supports."""

    @property
    def name(self) -> str:
        """What the engine is called."""

    def supports(self, element: Element) -> bool:
        """Whether the engine can simulate ``element``."""

    def run(
        self, scene: SimulationScene, elements: Sequence[Element], cache: Cache, start: int, progress: Progress | None
    ) -> None:
        """Write frames ``start`` and later of ``elements`` to ``cache``, which holds the frame before ``start``.

        States of elements that other engines have simulated already are read from the cache. Raises SimulationError
        for the first frame that explodes; the frames before it are kept.
        """


def simulate_scene(
    scene: SimulationScene,
    cache: Cache,
    engines: Sequence[Engine],
    *,
    start: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Simulate every element of ``scene`` into ``cache``, each in the first of ``engines`` that supports it.

    Parameters
    ----------
    scene : SimulationScene
        What to simulate.
    cache : Cache
        Where the frames go. Frames from ``start`` on are replaced.
    engines : sequence of Engine
        They run in this order, so that a later engine's elements can meet those of an earlier one.
    start : int, optional
        Frame to take the simulation up at; the cache holds the frame before. None: after what is there already.
    progress : callable, optional
        Called with the engine's name, the number of finished frames and of all frames.

    Raises
    ------
    ValueError
        For an element that no engine supports (named, with the engines), and a ``start`` whose frame before is not
        in the cache.
    SimulationError
        Naming element and frame, for a simulation that explodes; frames before it stay in the cache.

    Examples
    --------
    >>> from pegbar.simulate.cache import MemoryCache
    >>> empty = SimulationScene(frame_rate=24, frames=2, elements=())
    >>> simulate_scene(empty, MemoryCache(), engines=[])
    """
    for engine, elements in assign(scene, engines):
        there = min((complete_until(cache, element.name) for element in elements), default=0)
        first = there if start is None else start
        if not 0 <= first <= there:
            raise ValueError(f"start: {engine.name} can begin at frames 0 to {there}, got {first}")
        for element in elements:
            cache.clear(element.name, first)
        if first < scene.frames:
            engine.run(scene, elements, cache, first, progress)


def assign(scene: SimulationScene, engines: Sequence[Engine]) -> list[tuple[Engine, list[Element]]]:
    """Return the engines that are needed, each with its elements; ValueError for an element without an engine."""
    shares: list[tuple[Engine, list[Element]]] = [(engine, []) for engine in engines]
    for element in scene.elements:
        for engine, share in shares:
            if engine.supports(element):
                share.append(element)
                break
        else:
            names = ", ".join(engine.name for engine in engines) or "no engine"
            raise ValueError(f"elements: {names} cannot simulate {element.name} ({type(element).__name__})")
    return [(engine, share) for engine, share in shares if share]


def refuse_explosion(element: str, frame: int, positions: NDArray[np.float64], velocities: NDArray[np.float64]) -> None:
    """Raise SimulationError where positions or velocities (n, 3) are not finite, too far away or too fast."""
    if not (np.isfinite(positions).all() and np.isfinite(velocities).all()):
        raise SimulationError(element, frame, "the simulation exploded: positions are not finite")
    if positions.size and (farthest := float(np.abs(positions).max())) > FARTHEST:
        raise SimulationError(element, frame, f"the simulation exploded: it is {farthest:.3g} m away")
    if velocities.size and (fastest := float(np.linalg.norm(velocities, axis=1).max())) > FASTEST:
        raise SimulationError(element, frame, f"the simulation exploded: it moves at {fastest:.3g} m/s")
