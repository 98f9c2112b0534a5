"""As-rigid-as-possible and as-similar-as-possible deformation (Hornung et al. 2007, sections 6 and 7)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import _kernels, arrays
from pegbar.puppet.pieces import find_guides

Stitch = Literal["poisson", "average"]


def fit_triangles(shapes: ArrayLike, intermediate: ArrayLike, triangles: ArrayLike) -> NDArray[np.float64]:
    """Fit each triangle onto a deformed mesh by rotation and translation only (Hornung et al. 2007, equation 4).

    The rotation is the one that minimises the squared distance of the three corners; the middle of the fitted triangle
    is that of the mesh's. A triangle of no size (in ``shapes`` or in the mesh) is not turned.

    Parameters
    ----------
    shapes : (T, 3, 2) float
        The triangles to fit, wherever they are.
    intermediate : (n, 2) float
        The deformed mesh's vertices.
    triangles : (T, 3) int
        Indices into ``intermediate``.

    Returns
    -------
    (T, 3, 2) float
        The fitted triangles: not connected with each other.

    Raises
    ------
    ValueError
        For a wrong shape or dtype, a number that is not finite, or an index without a vertex.

    Examples
    --------
    >>> fit_triangles([[[0, 0], [3, 0], [0, 3]]], [[0, 0], [0, 6], [-6, 0]], [[0, 1, 2]]).round(9)[0].tolist()
    [[-1.0, 1.0], [-1.0, 4.0], [-4.0, 1.0]]
    """
    intermediate = arrays.floats("intermediate", intermediate, ("n", 2))
    triangles = _triangles(triangles, len(intermediate))
    shapes = arrays.floats("shapes", shapes, (len(triangles), 3, 2))
    return _kernels.fit_triangles(shapes, intermediate, triangles)


def average_triangles(fitted: ArrayLike, triangles: ArrayLike, n: int) -> NDArray[np.float64]:
    """Join triangles to a mesh: each vertex is the mean of its corners (Hornung et al. 2007, section 7, as printed).

    Parameters
    ----------
    fitted : (T, 3, 2) float
        Triangles that are not connected, as `fit_triangles` returns them.
    triangles : (T, 3) int
        Which vertices their corners are.
    n : int
        Number of vertices.

    Returns
    -------
    (n, 2) float

    Raises
    ------
    ValueError
        For a wrong shape or dtype, a number that is not finite, an index without a vertex, or a vertex of no triangle.

    Examples
    --------
    >>> average_triangles([[[0, 0], [2, 0], [0, 2]], [[4, 0], [2, 2], [0, 4]]], [[0, 1, 2], [1, 3, 2]], 4).tolist()
    [[0.0, 0.0], [3.0, 0.0], [0.0, 3.0], [2.0, 2.0]]
    """
    if not isinstance(n, int | np.integer) or n < 0:
        raise ValueError(f"n: want the number of vertices, got {n!r}")
    triangles = _triangles(triangles, int(n))
    fitted = arrays.floats("fitted", fitted, (len(triangles), 3, 2))
    return _kernels.average_triangles(fitted, triangles, int(n))


class Deformer:
    """A mesh that follows some of its vertices, the handles (Hornung et al. 2007, sections 6 and 7).

    Both linear systems are factored here, once; a frame then costs two solves and one fit. The mesh may have several
    pieces, layers that share vertices, and edges of three or more triangles. A piece with handles at one place only
    turns with the handles near it; a piece with none cannot be placed.

    Parameters
    ----------
    vertices : (n, 2) float
        The mesh at rest.
    triangles : (T, 3) int
        Indices into ``vertices``; sides do not matter.
    handles : (h,) int
        Vertices that will be placed, each once.

    Raises
    ------
    ValueError
        For a wrong shape or dtype, a number that is not finite, an index without a vertex, or a handle given twice.
    DegenerateError
        For a piece of the mesh without a handle; the message names it.

    Examples
    --------
    >>> strip = [[0, 0], [0, 1], [1, 0], [1, 1], [2, 0], [2, 1]]
    >>> mesh = Deformer(strip, [[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]], [0, 4])
    >>> mesh.deform([[0, 0], [0, 2]]).round(6).tolist()[5]
    [-1.0, 2.0]
    """

    def __init__(self, vertices: ArrayLike, triangles: ArrayLike, handles: ArrayLike) -> None:
        vertices = arrays.floats("vertices", vertices, ("n", 2))
        triangles = _triangles(triangles, len(vertices))
        handles = arrays.integers("handles", handles, ("h",), dtype=np.uint32, low=0, high=len(vertices) - 1)
        values, counts = np.unique(handles, return_counts=True)
        if (counts > 1).any():
            raise ValueError(f"handles: vertex {values[counts > 1][0]} is given twice")
        self._guides = find_guides(vertices, triangles, handles)
        self._shape = (len(handles), len(triangles))
        guides = self._guides.vertices.astype(np.uint32)
        self._kernel = _kernels.Deformer(vertices, triangles, handles, guides)

    def deform(
        self, positions: ArrayLike, *, shapes: ArrayLike | None = None, iterations: int = 1, stitch: Stitch = "poisson"
    ) -> NDArray[np.float64]:
        """Return the mesh's vertices when its handles are at ``positions``.

        An intermediate shape follows the handles' turns and sizes; every triangle's shape is then fitted to it by
        rotation and translation (equation 4), and the fitted triangles are joined to a mesh. Handles are met exactly,
        and a rigid motion of the handles gives that motion of the mesh.

        Parameters
        ----------
        positions : (h, 2) float
            Where the handles are.
        shapes : (T, 3, 2) float, optional
            What shape each triangle should have (as-similar-as-possible, section 7); None: its shape at rest
            (as-rigid-as-possible).
        iterations : int
            Rounds of fitting and joining, one or more.
        stitch : {"poisson", "average"}
            Least squares on the fitted triangles' edges, each relative to its length at rest; or the mean of each
            vertex's fitted corners, with the handles put back (as printed, which moves a shape much less).

        Returns
        -------
        (n, 2) float

        Raises
        ------
        ValueError
            For a wrong shape or dtype, a number that is not finite, or an unknown option.
        """
        positions = arrays.floats("positions", positions, (self._shape[0], 2))
        if shapes is not None:
            shapes = arrays.floats("shapes", shapes, (self._shape[1], 3, 2))[None]
        places: NDArray[np.float64] = self._deform(positions[None], shapes, iterations, stitch)[0]
        return places

    def deform_many(
        self, positions: ArrayLike, *, shapes: ArrayLike | None = None, iterations: int = 1, stitch: Stitch = "poisson"
    ) -> NDArray[np.float64]:
        """Return the vertices (F, n, 2) of many frames: `deform` for each, in parallel.

        ``positions`` is (F, h, 2), ``shapes`` (F, T, 3, 2). The result has the same bits as one `deform` a frame, for
        any number of threads.
        """
        positions = arrays.floats("positions", positions, ("F", self._shape[0], 2))
        if shapes is not None:
            shapes = arrays.floats("shapes", shapes, (len(positions), self._shape[1], 3, 2))
        return self._deform(positions, shapes, iterations, stitch)

    def _deform(
        self, positions: NDArray[np.float64], shapes: NDArray[np.float64] | None, iterations: int, stitch: str
    ) -> NDArray[np.float64]:
        if not isinstance(iterations, int | np.integer) or iterations < 1:
            raise ValueError(f"iterations: want a whole number of one or more, got {iterations!r}")
        if stitch not in ("poisson", "average"):
            raise ValueError(f'stitch: want "poisson" or "average", got {stitch!r}')
        if len(self._guides.vertices):
            positions = np.concatenate([positions, self._guides.place(positions)], axis=1)
        return self._kernel.deform(positions, shapes, int(iterations), stitch == "average")


def _triangles(triangles: ArrayLike, count: int) -> NDArray[np.uint32]:
    return arrays.integers("triangles", triangles, ("T", 3), dtype=np.uint32, low=0, high=count - 1)
