"""How well a simulation went: how deep cloth, strands and particles lie in volumes, how far the first two stretch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from pegbar import _kernels
from pegbar.simulate.cache import Cache
from pegbar.simulate.elements import Cloth, Pin, Prop, Strands
from pegbar.simulate.particles import DROPLET, FALLING, FREE, PHASE, SETTLED
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.sheet import cloth_edges
from pegbar.simulate.tracks import Volumes
from pegbar.simulate.weather import Particles

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ClothMeasures:
    """What is measured on a cloth, or on strands, over F frames: all of the scene's, or those that were asked for.

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


def measure_cloth(
    scene: SimulationScene, cache: Cache, name: str, *, frames: Sequence[int] | None = None
) -> ClothMeasures:
    """Measure the cloth ``name`` of ``scene`` in ``frames`` of ``cache``, or in all.

    A thousand frames of a skirt with 6,000 edges take 50 MB.

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
    edges = cloth_edges(cloth.triangles)
    rest = cloth.vertices if cloth.rest is None else cloth.rest
    lengths = np.maximum(np.linalg.norm(rest[edges[:, 0]] - rest[edges[:, 1]], axis=1), 1e-12)
    return _Measuring(scene, cache, name, edges, lengths, free_of(cloth.pins, len(rest))).over(frames)


def measure_strands(
    scene: SimulationScene, cache: Cache, name: str, *, frames: Sequence[int] | None = None
) -> ClothMeasures:
    """Measure the strands ``name`` of ``scene`` in ``frames`` of ``cache``, or in all: points and middles of links.

    ``stretch`` (F, s) is that of every strand as a whole. Next to a pin that lies in a volume, as in a hand, strands
    lie in it too: only what is deeper than the pin and the way from it explain counts.

    Raises ValueError for an element that is no strands of the scene and KeyError for frames that are not in the cache.

    Examples
    --------
    >>> from pegbar.simulate.cache import MemoryCache
    >>> line = Strands("line", np.array([[0, 1, 0], [0, 0.5, 0], [0, 0, 0]]), np.array([3]), np.array([0.01]))
    >>> scene, cache = SimulationScene(frame_rate=24, frames=1, elements=(line,)), MemoryCache()
    >>> cache.write("line", 0, {"positions": 1.1 * line.points})
    >>> measure_strands(scene, cache, "line").stretch.round(3).tolist()
    [[0.1]]
    """
    strands = next((element for element in scene.elements if element.name == name), None)
    if not isinstance(strands, Strands):
        raise ValueError(f"name: {name!r} is no strands of the scene")
    links = strands.links
    lengths, free = strands.link_lengths[links[:, 0]], free_of(strands.pins, len(strands.points))
    found = _Measuring(scene, cache, name, links, lengths, free, to_pins(links, lengths, free)).over(frames)
    starts = np.cumsum(strands.counts - 1) - (strands.counts - 1)
    grown = np.add.reduceat((1 + found.stretch) * lengths, starts, axis=1)
    return replace(found, stretch=grown / np.add.reduceat(lengths, starts) - 1)


@dataclass(frozen=True, eq=False)
class _Measuring:
    """Measures points with ``edges`` (E, 2) of ``lengths`` (E,) of which those of ``free`` (n,) are not pinned.

    ``way`` has by point its pin and the metres to it, where these excuse what lies in a volume.
    """

    scene: SimulationScene
    cache: Cache
    name: str
    edges: NDArray[np.int64]
    lengths: Floats
    free: NDArray[np.bool_]
    way: tuple[NDArray[np.int64], Floats] | None = None

    def over(self, frames: Sequence[int] | None) -> ClothMeasures:
        """Measure in ``frames``; None: in all of the scene."""
        wanted = range(self.scene.frames) if frames is None else frames
        rows, names = _volumes(self.scene, wanted)
        moving = self.edges[self.free[self.edges].any(axis=1)]
        penetration, limb, stretch = np.zeros(len(wanted)), [], np.empty((len(wanted), len(self.edges)))
        for place, frame in enumerate(wanted):
            positions = np.asarray(self.cache.read(self.name, frame)["positions"], np.float64)
            ends = positions[self.edges[:, 0]] - positions[self.edges[:, 1]]
            stretch[place] = np.linalg.norm(ends, axis=1) / self.lengths - 1
            points = np.concatenate([positions[self.free], positions[moving].mean(axis=1)])
            excused: Floats | float = 0.0
            if self.way is not None:
                capsules = np.ascontiguousarray(rows[place])
                deep = -_kernels.capsule_distances(positions[self.way[0]], capsules)[0]
                held = np.maximum(deep - self.way[1], 0)
                excused = np.concatenate([held[self.free], held[moving].max(axis=1)])
            penetration[place], deepest = _deepest(points, rows[place], names, excused)
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
    rows, names = _volumes(scene, range(scene.frames))
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


def _volumes(scene: SimulationScene, frames: Sequence[int]) -> tuple[Floats, list[str]]:
    """The capsules (F, C, 8) of limbs and props in ``frames``, and their names."""
    props = [element for element in scene.elements if isinstance(element, Prop)]
    limbs = [limb for character in scene.characters for limb in character.limb_names]
    limbs += [prop.name for prop in props for _ in prop.capsules]
    volumes = Volumes(scene, props)
    return volumes.at(np.array(frames, np.float64)), [limbs[index] for index in volumes.known]


def _deepest(points: Floats, rows: Floats, names: list[str], excused: Floats | float = 0.0) -> tuple[float, str]:
    """How deep the deepest of ``points`` (n, 3) lies in a volume beyond what is ``excused``, and in which."""
    distance, nearest = _kernels.capsule_distances(points, np.ascontiguousarray(rows))
    distance = distance + excused
    if not len(distance) or not distance.min() < 0:
        return 0.0, ""
    deepest = int(distance.argmin())
    return float(-distance[deepest]), names[nearest[deepest]]


def free_of(pins: Sequence[Pin], count: int) -> NDArray[np.bool_]:
    """Which of ``count`` points (n,) no pin holds."""
    free = np.ones(count, bool)
    for pin in pins:
        free[slice(None) if pin.vertices is None else pin.vertices] = False
    return free


def to_pins(links: NDArray[np.int64], lengths: Floats, free: NDArray[np.bool_]) -> tuple[NDArray[np.int64], Floats]:
    """By point the nearest pinned point along its strand and the metres to it, inf where there is none."""
    pins = np.flatnonzero(~free)
    if not len(pins):
        return np.zeros(len(free), np.int64), np.full(len(free), np.inf)
    graph = coo_array((lengths, links.T), shape=(len(free), len(free))).tocsr()
    metres, _, source = dijkstra(graph, directed=False, indices=pins, min_only=True, return_predecessors=True)
    return np.where(source < 0, 0, source).astype(np.int64), metres
