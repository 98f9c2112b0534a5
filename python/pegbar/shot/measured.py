"""A simulated shot in figures: how deep elements lie in limbs, how far they stretch, how many particles there are."""

from __future__ import annotations

from typing import Any

import numpy as np

from pegbar.simulate.cache import Cache
from pegbar.simulate.elements import Cloth, Strands
from pegbar.simulate.measures import measure_cloth, measure_particles, measure_strands
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.spread import Spread
from pegbar.simulate.weather import Particles

# To how much of a length stretch is told, and the frames that are measured at once: a skirt's edges take 50 kB a frame.
_FINEST, _TOGETHER = 1e-5, 100


def measured(scene: SimulationScene, cache: Cache, first: int) -> dict[str, Any]:
    """Deepest penetration, with its film frame and limb, and stretch of all cloth and strands, and of all cloth.

    ``first`` is the film frame of the scene's first.
    """
    found: dict[str, dict[str, Any]] = {"cloth": {}, "strands": {}, "particles": {}}
    every = Spread(_FINEST)
    for element in scene.elements:
        if isinstance(element, Cloth):
            size = {"vertices": len(element.vertices)}
            found["cloth"][element.name] = size | _worst(scene, cache, element, first, every)
        elif isinstance(element, Strands):
            size = {"strands": len(element.counts), "points": len(element.points)}
            found["strands"][element.name] = size | _worst(scene, cache, element, first, Spread(_FINEST))
        elif isinstance(element, Particles):
            found["particles"][element.name] = _falling(scene, cache, element, first)
    parts = [part for kind in found.values() for part in kind.values()]
    return {
        **found,
        "deepest_penetration_m": max((part["deepest_penetration_m"] for part in parts), default=None),
        "height_m": max((character.height for character in scene.characters), default=0.0),
        "stretch_p99": every.percentiles([99])[0] if every.count else None,
    }


def _worst(scene: SimulationScene, cache: Cache, element: Cloth | Strands, first: int, every: Spread) -> dict[str, Any]:
    """The figures of one element, whose stretch is added to ``every``."""
    measure = measure_cloth if isinstance(element, Cloth) else measure_strands
    penetration, stretch = [], Spread(_FINEST)
    limbs: list[str] = []
    for start in range(0, scene.frames, _TOGETHER):
        part = measure(scene, cache, element.name, frames=range(start, min(start + _TOGETHER, scene.frames)))
        penetration.append(part.penetration)
        limbs += part.limb
        stretch.add(part.stretch)
        every.add(part.stretch)
    depths = np.concatenate(penetration)
    worst = int(np.argmax(depths))
    middle, most, largest = stretch.percentiles([50, 99, 100]) if stretch.count else (0.0, 0.0, 0.0)
    return {
        "deepest_penetration_m": float(depths[worst]),
        "in_frame": first + worst,
        "in_limb": limbs[worst],
        "stretch_median": middle,
        "stretch_p99": most,
        "stretch_max": largest,
    }


def _falling(scene: SimulationScene, cache: Cache, element: Particles, first: int) -> dict[str, Any]:
    """The deepest penetration of particles, with its film frame and limb, and how many there are on average."""
    measures = measure_particles(scene, cache, element.name)
    worst = int(np.argmax(measures.penetration))
    return {
        "falling_mean": float(measures.falling.mean()),
        "settled_mean": float(measures.settled.mean()),
        "deepest_penetration_m": float(measures.penetration[worst]),
        "in_frame": first + worst,
        "in_limb": measures.limb[worst],
    }
