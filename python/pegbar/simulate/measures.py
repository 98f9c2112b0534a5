"""How well a simulation went: how deep cloth lies in volumes, and how far it has stretched."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.simulate.cache import Cache
from pegbar.simulate.elements import Cloth, Prop
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.sheet import cloth_edges
from pegbar.simulate.tracks import Volumes

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
    props = [element for element in scene.elements if isinstance(element, Prop)]
    limbs = [limb for character in scene.characters for limb in character.limb_names]
    limbs += [prop.name for prop in props for _ in prop.capsules]
    volumes = Volumes(scene, props)
    rows = volumes.at(np.arange(scene.frames, dtype=np.float64))
    names = [limbs[index] for index in volumes.known]
    edges, free = cloth_edges(cloth.triangles), _free(cloth)
    moving = edges[free[edges].any(axis=1)]
    rest = cloth.vertices if cloth.rest is None else cloth.rest
    lengths = np.maximum(np.linalg.norm(rest[edges[:, 0]] - rest[edges[:, 1]], axis=1), 1e-12)
    penetration, limb, stretch = np.zeros(scene.frames), [], np.empty((scene.frames, len(edges)))
    for frame in range(scene.frames):
        positions = np.asarray(cache.read(name, frame)["positions"], np.float64)
        stretch[frame] = np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1) / lengths - 1
        points = np.concatenate([positions[free], positions[moving].mean(axis=1)])
        distance, nearest = _kernels.capsule_distances(points, np.ascontiguousarray(rows[frame]))
        deepest = int(distance.argmin()) if len(distance) else -1
        inside = deepest >= 0 and distance[deepest] < 0
        penetration[frame] = -distance[deepest] if inside else 0.0
        limb.append(names[nearest[deepest]] if inside else "")
    return ClothMeasures(penetration, tuple(limb), stretch)


def _free(cloth: Cloth) -> NDArray[np.bool_]:
    free = np.ones(len(cloth.vertices), bool)
    for pin in cloth.pins:
        free[slice(None) if pin.vertices is None else pin.vertices] = False
    return free
