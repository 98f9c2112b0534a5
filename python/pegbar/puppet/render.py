"""Renders a flat, textured mesh: what is painted last is on top (Hornung et al. 2007, section 7)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import _kernels, arrays


def render_mesh(
    vertices: ArrayLike,
    triangles: ArrayLike,
    texture_coordinates: ArrayLike,
    texture: ArrayLike,
    size: tuple[int, int],
    *,
    vertex_depth: ArrayLike | None = None,
    triangle_depth: ArrayLike | None = None,
    samples: int = 1,
) -> NDArray[np.uint8]:
    """Render a textured mesh, triangle over triangle, farthest first.

    A pixel is painted by a triangle that holds its centre; of triangles that share an edge exactly one holds each
    centre on it (top-left rule, corners snapped to 1/256 of a pixel). So neighbours leave no crack and blend nowhere
    twice. Colours are read bilinearly with their alpha multiplied in and blended over what is there; outside the
    texture its rim is repeated.

    Parameters
    ----------
    vertices : (n, 2) float
        Places in the picture, (x, y) in pixels, pixel centres at integers. They may lie outside.
    triangles : (T, 3) int
        Indices into ``vertices``; both sides are seen.
    texture_coordinates : (n, 2) float
        Places in the texture, (x, y) in its pixels, pixel centres at integers.
    texture : (h, w, 4) uint8
        Straight alpha.
    size : (int, int)
        Width and height of the picture.
    vertex_depth : (n,) float, optional
        Depth of each vertex, larger is farther; a triangle has the mean of its corners.
    triangle_depth : (T,) float, optional
        Depth of each triangle; not together with ``vertex_depth``. Triangles of one depth, and all of them when no
        depth is given, are painted in the order given.
    samples : int
        k: every pixel is the mean of k x k samples, which smooths the outline. 1 keeps a texture that is not moved
        exactly.

    Returns
    -------
    (H, W, 4) uint8
        Straight alpha, zero where nothing is.

    Raises
    ------
    ValueError
        For a wrong shape or dtype, a number that is not finite, an index without a vertex, both depths given, or a
        size or number of samples that is not positive.

    Examples
    --------
    >>> corners = [[-0.5, -0.5], [1.5, -0.5], [1.5, 0.5], [-0.5, 0.5]]
    >>> texture = [[[255, 0, 0, 255], [0, 0, 255, 128]]]
    >>> render_mesh(corners, [[0, 1, 2], [0, 2, 3]], corners, texture, (2, 1)).tolist()
    [[[255, 0, 0, 255], [0, 0, 255, 128]]]
    """
    vertices = arrays.floats("vertices", vertices, ("n", 2))
    triangles = arrays.integers("triangles", triangles, ("T", 3), dtype=np.uint32, low=0, high=len(vertices) - 1)
    coordinates = arrays.floats("texture_coordinates", texture_coordinates, (len(vertices), 2))
    texture = arrays.image("texture", texture, (4,))
    width, height = arrays.integers("size", size, (2,), low=1, high=1 << 16).tolist()
    if not isinstance(samples, int | np.integer) or not 1 <= samples <= 16:
        raise ValueError(f"samples: want a whole number in 1..16, got {samples!r}")
    depth = _triangle_depth(triangles, len(vertices), vertex_depth, triangle_depth)
    if depth is not None:
        triangles = np.ascontiguousarray(triangles[np.argsort(-depth, kind="stable")])
    return _kernels.render_sheet(vertices, triangles, coordinates, texture, (width, height), int(samples))


def _triangle_depth(
    triangles: NDArray[np.uint32], count: int, vertex_depth: ArrayLike | None, triangle_depth: ArrayLike | None
) -> NDArray[np.float64] | None:
    if vertex_depth is not None and triangle_depth is not None:
        raise ValueError("triangle_depth: want it or vertex_depth, got both")
    if vertex_depth is not None:
        depth: NDArray[np.float64] = arrays.floats("vertex_depth", vertex_depth, (count,))[triangles].mean(axis=1)
        return depth
    if triangle_depth is not None:
        return arrays.floats("triangle_depth", triangle_depth, (len(triangles),))
    return None
