"""Rotations between directions and between point sets, for many frames at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
# Opposite directions have no smallest rotation between them; nearer than this to it (in 1 + cos) the axis is noise.
_OPPOSITE = 0.1


def unit(vectors: Floats) -> Floats:
    """Return ``vectors`` (..., 3) with length 1; one of no length stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    result: Floats = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
    return result


def swing(source: Floats, target: Floats) -> Floats:
    """Return the smallest rotations (F, 3, 3) that turn ``source`` (F, 3) to the direction of ``target`` (F, 3).

    A vector of no length gives no rotation. Opposite directions turn about an axis that is square to both.
    """
    a, b = unit(source), unit(target)
    cosine = np.einsum("fi,fi->f", a, b)
    normal = np.cross(a, b)
    opposite = cosine < -1 + 1e-9
    if opposite.any():
        least = np.eye(3)[np.argmin(np.abs(a[opposite]), axis=1)]
        square = unit(np.cross(a[opposite], least))
        half = 2 * np.einsum("fi,fj->fij", square, square) - np.eye(3)
    cross = _cross_matrices(normal)
    factor = 1 / np.where(opposite, 1.0, 1 + cosine)
    turns = np.eye(3) + cross + cross @ cross * factor[:, None, None]
    if opposite.any():
        turns[opposite] = half
    still = (np.linalg.norm(a, axis=1) == 0) | (np.linalg.norm(b, axis=1) == 0)
    turns[still] = np.eye(3)
    return turns


def steady_swing(source: Floats, target: Floats, before: Floats) -> Floats:
    """Return ``swing @ before`` (F, 3, 3), without the flips that a swing between nearly opposite directions makes.

    There the turn about ``target`` is taken more and more from the frame before, so that it changes steadily.
    """
    turned = swing(source, target) @ before
    closeness = 1 + np.einsum("fi,fi->f", unit(source), unit(target))
    for frame in np.flatnonzero((closeness < _OPPOSITE) & (np.arange(len(source)) > 0)):
        wanted = turned[frame - 1] @ turned[frame].T
        axis = unit(target[frame])
        # The twist about the axis that is nearest to the wanted rotation.
        sine = float(axis @ _axial(wanted))
        angle = np.arctan2(sine, np.trace(wanted) - axis @ wanted @ axis)
        share = 1 - closeness[frame] / _OPPOSITE
        turned[frame] = _about(axis, share * angle) @ turned[frame]
    return turned


def best_rotation(source: Floats, target: Floats, weights: Floats, prior: Floats) -> Floats:
    """Return the rotations (F, 3, 3) that turn ``source`` (F, n, 3) onto ``target`` (F, n, 3) with least squares.

    Vectors are measured from the centre of the rotation; ``weights`` (n,) weigh the squared distances. What the
    vectors leave open (all along one line) is settled by staying near ``prior`` (F, 3, 3), the rotations before.
    """
    spread = np.einsum("fni,n,fnj->fij", target, weights, source)
    scale = np.sqrt(np.einsum("fij,fij->f", spread, spread))
    u, _, vt = np.linalg.svd(spread + 1e-7 * scale[:, None, None] * prior)
    sign = np.linalg.det(u @ vt)
    u[:, :, 2] *= sign[:, None]
    turns: Floats = u @ vt
    turns[scale == 0] = prior[scale == 0]
    return turns


def _cross_matrices(vectors: Floats) -> Floats:
    result = np.zeros((*vectors.shape[:-1], 3, 3))
    x, y, z = np.moveaxis(vectors, -1, 0)
    result[..., 2, 1], result[..., 0, 2], result[..., 1, 0] = x, y, z
    return result - np.swapaxes(result, -1, -2)


def _axial(matrix: Floats) -> Floats:
    return np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])


def _about(axis: Floats, angle: float) -> Floats:
    cross = _cross_matrices(axis)
    turn: Floats = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return turn
