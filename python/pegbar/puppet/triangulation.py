"""Triangle meshes of outlines with holes and inner points."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from pegbar import _kernels, arrays


@dataclass(frozen=True, eq=False)
class Triangulation:
    """A mesh of outlines.

    ``vertices`` (n, 2) float begin with the outlines' places, then the holes', then the inner points, each in the order
    given; places that were added follow. ``triangles`` (T, 3) int all turn the same way (from x to y). ``rings`` are
    the vertices along each outline and then each hole, with those that were added on its edges; ``points`` are the
    vertices of the inner points.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    rings: tuple[NDArray[np.int64], ...]
    points: NDArray[np.int64]


def triangulate(
    outlines: Sequence[ArrayLike],
    *,
    holes: Sequence[ArrayLike] = (),
    points: ArrayLike = (),
    segments: ArrayLike = (),
    spacing: float | None = None,
    max_area: float | None = None,
    split_edges: bool = True,
) -> Triangulation:
    """Triangulate the inside of outlines (constrained Delaunay), with inner points and edges kept.

    A place belongs to the smallest ring that runs round it: inside when that is an outline, outside when it is a hole.
    So outlines may lie side by side, and islands in holes.

    Parameters
    ----------
    outlines, holes : sequences of (k, 2) float
        Closed rings, their last place joined to their first, in either sense.
    points : (p, 2) float
        Places inside that become vertices (bone vertices).
    segments : (s, 2) int
        Pairs of ``points`` that become edges, in parts where other vertices lie on them.
    spacing : float, optional
        Distance of the regular points that are added inside; they keep half of it from all other vertices. None: none.
    max_area : float, optional
        About the largest triangle, instead of ``spacing``: that of even triangles with this area.
    split_edges : bool
        Whether edges of outlines and holes that are longer than ``spacing`` are split evenly.

    Returns
    -------
    Triangulation

    Raises
    ------
    ValueError
        For a wrong shape or dtype, a number that is not finite, a ring of fewer than three places or without area,
        edges that cross (both are named), two given places that coincide, a point that is not inside, or no triangle.

    Examples
    --------
    >>> mesh = triangulate([[[0, 0], [4, 0], [4, 4], [0, 4]]], points=[[2, 2]])
    >>> len(mesh.triangles), mesh.points.tolist()
    (4, [4])
    """
    rings = [*_rings("outlines", outlines), *_rings("holes", holes)]
    inner = arrays.floats("points", points, ("p", 2))
    pairs = arrays.integers("segments", segments, ("s", 2), low=0, high=len(inner) - 1)
    if (pairs[:, 0] == pairs[:, 1]).any():
        raise ValueError(f"segments[{int(np.argmax(pairs[:, 0] == pairs[:, 1]))}]: want two different points")
    distance = _spacing(spacing, max_area)
    named = [(ring, index >= len(outlines)) for index, ring in enumerate(rings)]
    names = _names(len(outlines), rings, len(inner))
    given = np.concatenate([*rings, inner])
    _refuse_same(given, names)
    loops, added = _split(rings, given, distance if split_edges else None)
    vertices = np.concatenate([given, added])
    around = [np.stack([loop, np.roll(loop, -1)], axis=1) for loop in loops]
    edges = np.concatenate([*around, pairs + len(given) - len(inner)])
    if distance is not None:
        vertices = np.concatenate([vertices, _regular(vertices, edges, named, distance)])
    corners, crossing = _kernels.constrained_delaunay(vertices, edges.astype(np.uint32))
    if len(crossing):
        raise ValueError(_describe_crossing(vertices, edges, crossing[0].astype(np.int64), names))
    faces = corners.astype(np.int64)
    faces = faces[_wide(vertices[faces]) & _kernels.inside_rings(vertices[faces].mean(axis=1), named)]
    _refuse_unused(faces, len(given), names)
    return Triangulation(vertices, faces, tuple(loops), np.arange(len(given) - len(inner), len(given)))


def _rings(name: str, rings: Sequence[ArrayLike]) -> list[NDArray[np.float64]]:
    out = []
    for index, ring in enumerate(rings):
        places = arrays.floats(f"{name}[{index}]", ring, ("k", 2))
        if len(places) < 3:
            raise ValueError(f"{name}[{index}]: want three places or more, got {len(places)}")
        away = places - places[0]
        if np.linalg.matrix_rank(away, tol=1e-9 * np.abs(away).max()) < 2:
            raise ValueError(f"{name}[{index}]: all places lie on one line")
        out.append(places)
    if name == "outlines" and not out:
        raise ValueError("outlines: want one or more")
    return out


def _spacing(spacing: float | None, max_area: float | None) -> float | None:
    for name, value in (("spacing", spacing), ("max_area", max_area)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name}: want a positive number, got {value!r}")
    if spacing is not None and max_area is not None:
        raise ValueError("max_area: want it or spacing, got both")
    return spacing if max_area is None else math.sqrt(4 * max_area / math.sqrt(3))


def _names(outlines: int, rings: list[NDArray[np.float64]], points: int) -> list[str]:
    kinds = [f"outlines[{k}]" if k < outlines else f"holes[{k - outlines}]" for k in range(len(rings))]
    of_rings = [f"{kind}[{i}]" for kind, ring in zip(kinds, rings, strict=True) for i in range(len(ring))]
    return of_rings + [f"points[{i}]" for i in range(points)]


def _refuse_same(given: NDArray[np.float64], names: list[str]) -> None:
    _, first, inverse = np.unique(given, axis=0, return_index=True, return_inverse=True)
    for index, earlier in enumerate(first[inverse.ravel()].tolist()):
        if earlier != index:
            raise ValueError(f"{names[index]}: the same place as {names[earlier]}")


def _split(
    rings: list[NDArray[np.float64]], given: NDArray[np.float64], distance: float | None
) -> tuple[list[NDArray[np.int64]], NDArray[np.float64]]:
    """Loops of vertices along the rings, and the places that were added on their long edges.

    No place is added beside a given one: a point on an edge splits it as well.
    """
    starts = np.cumsum([0, *map(len, rings)])
    tree, count = cKDTree(given), len(given)
    loops, added = [], [np.empty((0, 2))]
    for start, ring in zip(starts, rings, strict=False):
        loop = []
        for index, (a, b) in enumerate(zip(ring, np.roll(ring, -1, axis=0), strict=True)):
            loop.append(start + index)
            parts = 1 if distance is None else math.ceil(np.linalg.norm(b - a) / distance - 1e-9)
            if distance is not None and parts > 1:
                places = a + (b - a) * (np.arange(1, parts) / parts)[:, None]
                places = places[tree.query(places)[0] >= distance / 4]
                loop.extend(range(count, count + len(places)))
                count += len(places)
                added.append(places)
        loops.append(np.array(loop, np.int64))
    return loops, np.concatenate(added)


def _regular(
    vertices: NDArray[np.float64],
    edges: NDArray[np.int64],
    rings: list[tuple[NDArray[np.float64], bool]],
    distance: float,
) -> NDArray[np.float64]:
    """Points of a grid of even triangles, inside and half the distance away from every vertex and edge."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    rows = np.arange(low[1] + distance / 2, high[1], distance * math.sqrt(3) / 2)
    columns = np.arange(low[0], high[0] + distance, distance)
    grid = np.stack(np.broadcast_arrays(columns, rows[:, None]), axis=-1)
    grid[1::2, :, 0] -= distance / 2
    places = grid.reshape(-1, 2)
    places = places[_kernels.inside_rings(places, rings)]
    samples = [vertices]
    for a, b in vertices[edges]:
        parts = math.ceil(4 * np.linalg.norm(b - a) / distance)
        samples.append(a + (b - a) * (np.arange(1, parts) / max(parts, 1))[:, None])
    away = cKDTree(np.concatenate(samples)).query(places)[0]
    return np.ascontiguousarray(places[away >= distance / 2])


def _wide(corners: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether triangles (T, 3, 2) have an area: those between places that rounding has put beside an edge have none.

    Such a triangle lies outside: inside, Delaunay's rule joins the middle place to what lies opposite.
    """
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    twice_area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    wide: NDArray[np.bool_] = twice_area > 1e-12 * ((a**2).sum(axis=1) + (b**2).sum(axis=1))
    return wide


def _describe_crossing(
    vertices: NDArray[np.float64], edges: NDArray[np.int64], crossing: NDArray[np.int64], names: list[str]
) -> str:
    a, b = vertices[crossing]

    def side(start: NDArray[np.float64], end: NDArray[np.float64], place: NDArray[np.float64]) -> NDArray[np.float64]:
        along, away = end - start, place - start
        return np.sign(along[..., 0] * away[..., 1] - along[..., 1] * away[..., 0])

    c, d = vertices[edges[:, 0]], vertices[edges[:, 1]]
    crossed = (side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)
    pairs = [crossing, *edges[crossed][:1]]
    return " crosses ".join(f"the edge {' - '.join(_described(pair, vertices, names))}" for pair in pairs)


def _described(pair: NDArray[np.int64], vertices: NDArray[np.float64], names: list[str]) -> Iterator[str]:
    for index in pair.tolist():
        x, y = vertices[index]
        yield names[index] if index < len(names) else f"({x:g}, {y:g})"


def _refuse_unused(faces: NDArray[np.int64], given: int, names: list[str]) -> None:
    used = np.zeros(max(given, faces.max(initial=-1) + 1), bool)
    used[faces] = True
    if not used[:given].all():
        raise ValueError(f"{names[int(np.argmin(used))]}: not inside the outlines")
