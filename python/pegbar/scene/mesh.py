"""A triangle mesh with colours, as the passes renderer takes it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in the world.

    Parameters
    ----------
    vertices : (n, 3) float
        World metres.
    triangles : (T, 3) int
        Indices into ``vertices``; both sides are seen.
    colors : (n, 4) or (4,) float
        Straight linear RGBA per vertex, or one for all; alpha in 0..1. Kept as (n, 4) float32.
    object_id : int
        1 to 65535: the value in the object pass; 0 is the background there. Around 65280 to 65534, particles and
        shadows, no ink lines are drawn.
    normals : (n, 3) float, optional
        Directions at the vertices. None: the mean of the neighbouring triangles' normals, weighted by area. Kept with
        length 1 (a vertex of no triangle keeps a zero).

    Raises
    ------
    ValueError
        For a wrong shape or dtype, a number that is not finite, an index without a vertex, an alpha outside 0..1 or
        an object id outside 1..65535.

    Examples
    --------
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]], (1, 0, 0, 1))
    >>> square.normals[0].tolist()
    [0.0, 0.0, 1.0]
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    colors: NDArray[np.float32]
    object_id: int = 1
    normals: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        vertices = arrays.floats("vertices", self.vertices, ("n", 3))
        triangles = arrays.integers("triangles", self.triangles, ("T", 3), low=0, high=len(vertices) - 1)
        if not isinstance(self.object_id, int | np.integer) or not 1 <= self.object_id <= 0xFFFF:
            raise ValueError(f"object_id: want a whole number in 1..65535, got {self.object_id!r}")
        if self.normals is None:
            normals = smooth_normals(vertices, triangles)
        else:
            normals = _unit(arrays.floats("normals", self.normals, (len(vertices), 3)))
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", triangles)
        object.__setattr__(self, "colors", _vertex_colors(self.colors, len(vertices)))
        object.__setattr__(self, "normals", normals)


def smooth_normals(vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the unit normals (n, 3) at ``vertices`` (n, 3): the area-weighted mean over ``triangles`` (T, 3)."""
    scaled = vertices / max(np.abs(vertices).max(initial=0), np.finfo(float).tiny)
    a, b, c = (scaled[triangles[:, k]] for k in range(3))
    faces = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    corners = triangles.ravel()
    sums = [np.bincount(corners, faces[:, axis], len(vertices)) for axis in range(3)]
    return _unit(np.stack(sums, axis=1))


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    largest = np.abs(vectors).max(axis=1, keepdims=True, initial=0)
    scaled = vectors / np.where(largest > 0, largest, 1)
    unit: NDArray[np.float64] = scaled / np.maximum(np.linalg.norm(scaled, axis=1, keepdims=True), 1)
    return unit


def _vertex_colors(colors: ArrayLike, count: int) -> NDArray[np.float32]:
    given = np.asarray(colors)
    shape: arrays.Shape = (4,) if given.ndim == 1 else (count, 4)
    values = arrays.floats("colors", given, shape, dtype=np.float32)
    if values.size and not (values[..., 3].min() >= 0 and values[..., 3].max() <= 1):
        raise ValueError("colors: want alpha in 0..1")
    return np.ascontiguousarray(np.broadcast_to(values, (count, 4)))
