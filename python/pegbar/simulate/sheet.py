"""How a cloth is made for the cloth engine: weights, links that hold lengths, folds and seams, tethers to its pins."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from pegbar.simulate.elements import Cloth

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
#: Newtons per metre of the links across the folds of the stiffest cloth (``bend`` 1).
STIFFEST_FOLD = 40.0
#: Newtons per metre of width under which a strip grows by its material's ``stretch``.
LOAD = 10.0
#: How many links of the way from a pin the stays reach over, the long ones first.
STAYS = (32, 16, 8, 4)


@dataclass(frozen=True, eq=False)
class Sheet:
    """What ``step_cloth`` takes: see ``Sheet`` in ``rust/kernels/cloth.rs``."""

    weights: Floats
    triangles: Integers
    links: Integers
    lengths: Floats
    folds: Integers
    spans: Floats
    stays: Integers
    spread: Floats
    tethers: Integers
    reaches: Floats
    compliances: tuple[float, float]

    def arrays(self) -> tuple[Any, ...]:
        """The arrays in the kernel's types and order."""
        first = (self.weights, self.triangles, self.links, self.lengths)
        made = (*first, self.folds, self.spans, self.stays, self.spread, self.tethers, self.reaches)
        return tuple(np.ascontiguousarray(a, np.uint32 if a.dtype.kind == "i" else np.float64) for a in made)


def make_sheet(cloth: Cloth, pins: Integers) -> Sheet:
    """Prepare ``cloth`` whose vertices ``pins`` (P,) are held."""
    edges, material = cloth_edges(cloth.triangles), cloth.material
    rest = cloth.vertices if cloth.rest is None else cloth.rest
    lengths = _lengths(rest, edges)
    masses = _masses(rest, cloth.triangles) * material.density
    weights = np.divide(1.0, masses, out=np.zeros_like(masses), where=masses > 0)
    weights[pins] = 0
    distance, anchor, before = _from_pins(len(rest), edges, lengths, cloth.seams, pins)
    folds = _across(cloth.triangles) if material.bend > 0 else np.empty((0, 2), np.int64)
    links, lengths = _outwards(
        np.concatenate([edges, cloth.seams]), np.concatenate([lengths, np.zeros(len(cloth.seams))]), distance
    )
    stays = _stays(distance, before)
    give = 1 + material.stretch
    hung = np.flatnonzero(np.isfinite(distance) & (weights > 0))
    return Sheet(
        weights,
        cloth.triangles,
        links,
        lengths,
        folds,
        _lengths(rest, folds),
        stays,
        (distance[stays[:, 1]] - distance[stays[:, 0]]) * give,
        np.stack([hung, anchor[hung]], axis=1),
        distance[hung] * give,
        (material.stretch / LOAD, 1 / (STIFFEST_FOLD * material.bend) if material.bend > 0 else 0.0),
    )


def _outwards(pairs: Integers, lengths: Floats, distance: Floats) -> tuple[Integers, Floats]:
    """The pairs from the pins outwards, the vertex nearer to a pin first in each, with their lengths."""
    near = np.where(np.isfinite(distance), distance, 0.0)[pairs]
    turned = np.where((near[:, 0] > near[:, 1])[:, None], pairs[:, ::-1], pairs)
    order = np.lexsort((near.max(axis=1), near.min(axis=1)))
    return turned[order], lengths[order]


def cloth_edges(triangles: Integers) -> Integers:
    """Return the edges (E, 2) of ``triangles`` (T, 3), each once."""
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    return np.unique(np.sort(sides, axis=1), axis=0)


def _lengths(rest: Floats, pairs: Integers) -> Floats:
    lengths: Floats = np.linalg.norm(rest[pairs[:, 0]] - rest[pairs[:, 1]], axis=1)
    return lengths


def _masses(rest: Floats, triangles: Integers) -> Floats:
    """A third of the area (n,) of the triangles around every vertex."""
    a, b, c = (rest[triangles[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    masses: Floats = np.bincount(triangles.ravel(), np.repeat(areas / 3, 3), len(rest)).astype(np.float64)
    return masses


def _across(triangles: Integers) -> Integers:
    """The two vertices (Q, 2) that face each other across every edge of two triangles."""
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    facing = np.concatenate([triangles[:, 2], triangles[:, 0], triangles[:, 1]])
    sides = np.sort(sides, axis=1)
    order = np.lexsort((sides[:, 1], sides[:, 0]))
    sides, facing = sides[order], facing[order]
    same = (sides[1:] == sides[:-1]).all(axis=1)
    return np.stack([facing[:-1][same], facing[1:][same]], axis=1)


def _from_pins(
    count: int, edges: Integers, lengths: Floats, seams: Integers, pins: Integers
) -> tuple[Floats, Integers, Integers]:
    """Each vertex's length of cloth (n,) to its nearest pin, that pin, and the vertex before it on the way there.

    Without pins lengths are inf; pins have no vertex before them: -1.
    """
    if not len(pins):
        return np.full(count, np.inf), np.full(count, -1), np.full(count, -1)
    pairs = np.concatenate([edges, seams])
    # A seam has no length, and a sparse matrix drops zeros.
    steps = np.concatenate([lengths, np.full(len(seams), 1e-9)])
    graph = coo_array((steps, pairs.T), shape=(count, count)).tocsr()
    found = dijkstra(graph, directed=False, indices=pins, min_only=True, return_predecessors=True)
    distance, before, source = found
    return distance, np.where(source < 0, -1, source), np.where(before < 0, -1, before).astype(np.int64)


def _stays(distance: Floats, before: Integers) -> Integers:
    """Pairs (s, 2): a vertex some links nearer to the pin, and the vertex itself."""
    pairs = []
    nearer, steps = np.arange(len(before)), {}
    for hops in range(1, max(STAYS) + 1):
        nearer = np.where(nearer >= 0, before[nearer], -1)
        steps[hops] = nearer
    for hops in STAYS:
        vertices = np.flatnonzero(steps[hops] >= 0)
        vertices = vertices[np.argsort(distance[vertices], kind="stable")]
        pairs.append(np.stack([steps[hops][vertices], vertices], axis=1))
    return np.concatenate(pairs)
