"""How well a simulation went: how deep cloth and particles lie in volumes, and how far cloth has stretched."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.simulate.cache import Cache
from pegbar.simulate.elements import Cloth, Prop
from pegbar.simulate.particles import DROPLET, FALLING, FREE, PHASE, SETTLED
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.sheet import cloth_edges
from pegbar.simulate.tracks import Volumes
from pegbar.simulate.weather import Particles

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ClothMeasures:
    """What is measured on a cloth over F frames.

    ``penetration`` (F,) is how deep its deepest free point lies in a volume, in metres, 0 where it is clear: of all
    vertices that no pin holds and the middles of their edges. ``limb`` (F,) names the volume ("" where it is clear).
    ``stretch`` (F, E) is the growth of every edge over its length at rest; negative where it is shorter.
    """

    penetration: Floats
    limb: tuple[str, ...]
    stretch: Floats

    @property
    def percentiles(self) -> tuple[float, float, float]:
        """Median, 99th percentile and largest stretch over all edges and frames."""
        if not self.stretch.size:
            return 0.0, 0.0, 0.0
        middle, most, largest = np.percentile(self.stretch, (50, 99, 100)).tolist()
        return middle, most, largest


def measure_cloth(scene: SimulationScene, cache: Cache, name: str) -> ClothMeasures:
    """Measure the cloth ``name`` of ``scene`` in all frames of ``cache``.

    Raises ValueError for an element that is no cloth of the scene and KeyError for frames that are not in the cache.

    Examples
    --------
    >>> from pegbar.simulate.cache import MemoryCache
    >>> flag = Cloth("flag", np.eye(3), np.array([[0, 1, 2]]))
    >>> scene, cache = SimulationScene(frame_rate=24, frames=1, elements=(flag,)), MemoryCache()
    >>> cache.write("flag", 0, {"positions": 1.1 * np.eye(3)})
    >>> measure_cloth(scene, cache, "flag").stretch.round(3).tolist()
    [[0.1, 0.1, 0.1]]
    """
    cloth = next((element for element in scene.elements if element.name == name), None)
    if not isinstance(cloth, Cloth):
        raise ValueError(f"name: {name!r} is no cloth of the scene")
    rows, names = _volumes(scene)
    edges, free = cloth_edges(cloth.triangles), _free(cloth)
    moving = edges[free[edges].any(axis=1)]
    rest = cloth.vertices if cloth.rest is None else cloth.rest
    lengths = np.maximum(np.linalg.norm(rest[edges[:, 0]] - rest[edges[:, 1]], axis=1), 1e-12)
    penetration, limb, stretch = np.zeros(scene.frames), [], np.empty((scene.frames, len(edges)))
    for frame in range(scene.frames):
        positions = np.asarray(cache.read(name, frame)["positions"], np.float64)
        stretch[frame] = np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1) / lengths - 1
        points = np.concatenate([positions[free], positions[moving].mean(axis=1)])
        penetration[frame], deepest = _deepest(points, rows[frame], names)
        limb.append(deepest)
    return ClothMeasures(penetration, tuple(limb), stretch)


@dataclass(frozen=True, eq=False)
class ParticleMeasures:
    """What is measured on particles over F frames.

    ``penetration`` (F,) is how deep the deepest particle's middle lies in a volume, in metres, 0 where all are clear;
    ``limb`` (F,) names the volume. ``falling``, ``settled`` and ``droplets`` (F,) count what is in the air and has
    touched nothing, lies on something, and has splashed.
    """

    penetration: Floats
    limb: tuple[str, ...]
    falling: NDArray[np.int64]
    settled: NDArray[np.int64]
    droplets: NDArray[np.int64]


def measure_particles(scene: SimulationScene, cache: Cache, name: str) -> ParticleMeasures:
    """Measure the particles ``name`` of ``scene`` in all frames of ``cache``.

    Raises ValueError for an element that is not of particles and KeyError for frames that are not in the cache.

    Examples
    --------
    >>> from pegbar.simulate.cache import MemoryCache
    >>> from pegbar.simulate.particles import ParticleEngine
    >>> snow = Particles("snow", (0, 0, 0), (1, 1, 1), count=10)
    >>> scene, cache = SimulationScene(frame_rate=24, frames=1, elements=(snow,)), MemoryCache()
    >>> ParticleEngine().run(scene, scene.elements, cache, 0, None)
    >>> float(measure_particles(scene, cache, "snow").penetration[0])
    0.0
    """
    element = next((element for element in scene.elements if element.name == name), None)
    if not isinstance(element, Particles):
        raise ValueError(f"name: {name!r} is no element of particles")
    rows, names = _volumes(scene)
    penetration, limb = np.zeros(scene.frames), []
    counts = np.zeros((scene.frames, 5), np.int64)
    for frame in range(scene.frames):
        state = cache.read(name, frame)
        phases = np.asarray(state["codes"])[:, PHASE]
        counts[frame] = np.bincount(phases, minlength=5)
        points = np.ascontiguousarray(np.asarray(state["positions"], np.float64)[phases != FREE])
        penetration[frame], deepest = _deepest(points, rows[frame], names)
        limb.append(deepest)
    return ParticleMeasures(penetration, tuple(limb), *counts[:, [FALLING, SETTLED, DROPLET]].T)


def _volumes(scene: SimulationScene) -> tuple[Floats, list[str]]:
    """The capsules (F, C, 8) of limbs and props, and their names."""
    props = [element for element in scene.elements if isinstance(element, Prop)]
    limbs = [limb for character in scene.characters for limb in character.limb_names]
    limbs += [prop.name for prop in props for _ in prop.capsules]
    volumes = Volumes(scene, props)
    return volumes.at(np.arange(scene.frames, dtype=np.float64)), [limbs[index] for index in volumes.known]


def _deepest(points: Floats, rows: Floats, names: list[str]) -> tuple[float, str]:
    """How deep the deepest of ``points`` (n, 3) lies in a volume, and in which."""
    distance, nearest = _kernels.capsule_distances(points, np.ascontiguousarray(rows))
    if not len(distance) or not distance.min() < 0:
        return 0.0, ""
    deepest = int(distance.argmin())
    return float(-distance[deepest]), names[nearest[deepest]]


def _free(cloth: Cloth) -> NDArray[np.bool_]:
    free = np.ones(len(cloth.vertices), bool)
    for pin in cloth.pins:
        free[slice(None) if pin.vertices is None else pin.vertices] = False
    return free
