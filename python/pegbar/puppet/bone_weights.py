"""How much each bone moves each vertex: its own bone, and near a joint the bones on both sides (2007 paper, s7)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from pegbar.scene.puppet import Puppet

Floats = NDArray[np.float64]
# Weights below this are dropped: they cost time and move nothing that can be seen.
_LEAST = 0.02


def bone_weights(puppet: Puppet, *, rounds: int = 12) -> Floats:
    """Return the weights (n, B) of the bones at every vertex, each row's sum 1.

    A vertex begins with the bones of its triangles, by their areas, and takes ``rounds`` times the mean of itself and
    its neighbours along the mesh, so that what lies beside a limb but belongs to another is not mixed in.
    """
    count, bones = len(puppet.vertices), len(puppet.bones)
    owned = puppet.triangle_bone >= 0
    corners = puppet.triangles[owned]
    sides = puppet.vertices[corners[:, 1:]] - puppet.vertices[corners[:, :1]]
    areas = np.abs(np.linalg.det(sides)) + 1e-12
    weights = np.zeros((count, bones))
    for corner in range(3):
        np.add.at(weights, (corners[:, corner], puppet.triangle_bone[owned]), areas)
    near = _nearest_bones(puppet)
    lonely = ~(weights.sum(axis=1) > 0)
    weights[lonely, near[lonely]] = 1
    weights /= weights.sum(axis=1, keepdims=True)
    smooth = _neighbours(puppet.triangles, count)
    for _ in range(rounds):
        weights = smooth @ weights
    weights[weights < _LEAST] = 0
    result: Floats = weights / weights.sum(axis=1, keepdims=True)
    return result


def _neighbours(triangles: NDArray[np.int64], count: int) -> sparse.csr_array:
    """The (n, n) matrix that takes the mean over a vertex and its neighbours."""
    rows = np.concatenate([triangles[:, [0, 1, 2]].ravel(), triangles[:, [1, 2, 0]].ravel(), np.arange(count)])
    columns = np.concatenate([triangles[:, [1, 2, 0]].ravel(), triangles[:, [0, 1, 2]].ravel(), np.arange(count)])
    ring = sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    ring.data[:] = 1
    return sparse.csr_array(ring / ring.sum(axis=1)[:, None])


def _nearest_bones(puppet: Puppet) -> NDArray[np.int64]:
    distances, _ = bone_distances(puppet.vertices, puppet.marks, puppet.bones)
    nearest: NDArray[np.int64] = distances.argmin(axis=1)
    return nearest


def bone_distances(points: Floats, marks: Floats, bones: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """Return distances in pixels from ``points`` (n, 2) to bones (n, B), and where along each the nearest point is."""
    start, along = marks[bones[:, 0]], marks[bones[:, 1]] - marks[bones[:, 0]]
    squared = np.maximum((along**2).sum(axis=1), 1e-12)
    offset = points[:, None] - start
    share = np.clip((offset * along).sum(axis=2) / squared, 0, 1)
    distances: Floats = np.linalg.norm(offset - share[..., None] * along, axis=2)
    return distances, share
