"""A sheet with every triangle divided: rounder folds and cleaner patterns than the simulated one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from pegbar.scene.mesh import smooth_normals

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Finer:
    """``triangles`` (T k^2, 3) of the finer sheet; ``weights`` (m, n) takes the coarse vertices to the finer ones.

    ``owner`` (m,) is a coarse triangle that holds the point, ``shares`` (m, 3) its corners' shares in it.
    """

    triangles: Integers
    weights: csr_array
    coarse: Integers
    parts: int
    owner: Integers
    shares: Floats

    def place(self, positions: Floats) -> Floats:
        """Return the finer vertices (m, 3): on the flat triangles, bulged towards the smooth surface (Phong).

        After Boubekeur and Alexa 2008: a point of a triangle goes part of the way to its mean projection onto the
        planes that its corners' normals stand on.
        """
        flat: Floats = self.weights @ positions
        if self.parts == 1:
            return flat
        normals = smooth_normals(positions, self.coarse)
        # Sum of w ((p - c) . n) n over the corners c, split into sums that the weights can take.
        along = np.einsum("ni,ni->n", positions, normals)
        outer = (normals[:, :, None] * normals[:, None]).reshape(len(normals), 9)
        planes = (self.weights @ outer).reshape(-1, 3, 3)
        bulge: Floats = np.einsum("mij,mj->mi", planes, flat) - self.weights @ (along[:, None] * normals)
        return flat - BULGE * bulge


#: How far a point goes towards the smooth surface; the method's authors take 3/4.
BULGE = 0.75


def finer_sheet(count: int, triangles: Integers, parts: int) -> Finer:
    """Divide the sides of ``triangles`` (T, 3) of ``count`` vertices into ``parts``; neighbours share their points.

    Vertices of no triangle are left out.
    """
    corners = _lattice(parts)
    place = {corner: index for index, corner in enumerate(corners)}
    shares = np.array(corners)
    # A point is known by its vertices and their shares, so that neighbours find the same one.
    vertices = np.repeat(triangles[:, None], len(corners), axis=1)
    amounts = np.broadcast_to(shares, vertices.shape)
    vertices = np.where(amounts > 0, vertices, count)
    order = np.argsort(vertices, axis=2)
    key = np.concatenate([np.take_along_axis(v, order, axis=2) for v in (vertices, amounts)], axis=2).reshape(-1, 6)
    points, first, inverse = np.unique(key, axis=0, return_index=True, return_inverse=True)
    rows = np.repeat(np.arange(len(points)), 3)
    used = points[:, :3].ravel() < count
    matrix = csr_array(
        (points[:, 3:].ravel()[used] / parts, (rows[used], points[:, :3].ravel()[used])), shape=(len(points), count)
    )
    upright = [((a + 1, b, c), (a, b + 1, c), (a, b, c + 1)) for a, b, c in _lattice(parts - 1)]
    inverted = [((a + 1, b + 1, c), (a, b + 1, c + 1), (a + 1, b, c + 1)) for a, b, c in _lattice(parts - 2)]
    small = [[place[corner] for corner in trio] for trio in upright + inverted]
    ids = inverse.reshape(len(triangles), len(corners))
    owner, corner = np.divmod(first, len(corners))
    return Finer(ids[:, np.array(small)].reshape(-1, 3), matrix, triangles, parts, owner, shares[corner] / parts)


def _lattice(total: int) -> list[tuple[int, int, int]]:
    """All triples of whole numbers of zero or more with this sum."""
    return [(i, j, total - i - j) for i in range(total + 1) for j in range(total + 1 - i)]
