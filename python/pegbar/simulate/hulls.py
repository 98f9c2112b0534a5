"""Capsules as convex meshes: for engines that take no tapered cylinder, and to be looked at."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
#: Vertices around, and rings on each round end.
AROUND, RINGS = 16, 3
_TURN = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
_CIRCLE = np.stack([np.cos(_TURN), np.zeros(AROUND), np.sin(_TURN)], axis=1)
_SHARES = np.arange(1, RINGS + 1) / RINGS


def poses(rows: Floats) -> tuple[Floats, Floats]:
    """Return the middles (C, 3) of capsules ``rows`` (C, 8), and rotations (C, 4) that bring +Y onto their axes.

    Rotations are quaternions x y z w. The rotation is the smallest one; an axis of no length is not turned.
    """
    axes = rows[:, 4:7] - rows[:, :3]
    lengths = np.linalg.norm(axes, axis=1, keepdims=True)
    along = np.where(lengths > 1e-9, axes / np.maximum(lengths, 1e-9), (0.0, 1.0, 0.0))
    # Half-way between +Y and the axis; straight down is reached by half a turn about X.
    turns = np.stack([along[:, 2], np.zeros(len(rows)), -along[:, 0], 1 + along[:, 1]], axis=1)
    sizes = np.linalg.norm(turns, axis=1, keepdims=True)
    turns = np.where(sizes > 1e-6, turns / np.maximum(sizes, 1e-12), (1.0, 0.0, 0.0, 0.0))
    return (rows[:, :3] + rows[:, 4:7]) / 2, turns


def hull_vertices(length: ArrayLike, first: ArrayLike, last: ArrayLike) -> Floats:
    """Return the hull's vertices (..., n, 3) of capsules along +Y about the origin: on their spheres, inside them.

    ``length`` (...) is the axis's, ``first`` and ``last`` (...) the radii at -Y and +Y.
    """
    length, first, last = (np.asarray(value, np.float64)[..., None] for value in (length, first, last))
    lean = np.arcsin(np.clip((first - last) / np.maximum(length, 1e-12), -1, 1))
    low = -np.pi / 2 + _SHARES * (lean + np.pi / 2)
    high = np.pi / 2 - (1 - _SHARES + 1 / RINGS) * (np.pi / 2 - lean)
    wide = np.concatenate([first * np.cos(low), last * np.cos(high)], axis=-1)
    tall = np.concatenate([first * np.sin(low) - length / 2, last * np.sin(high) + length / 2], axis=-1)
    around = wide[..., None, None] * _CIRCLE
    around[..., 1] = tall[..., None]
    poles = np.zeros((*length.shape[:-1], 2, 3))
    poles[..., 0, 1], poles[..., 1, 1] = (-length / 2 - first)[..., 0], (length / 2 + last)[..., 0]
    rings = around.reshape(*length.shape[:-1], 2 * RINGS * AROUND, 3)
    return np.concatenate([poles[..., :1, :], rings, poles[..., 1:, :]], axis=-2)


@cache
def hull_triangles() -> NDArray[np.uint32]:
    """Return the triangles (T, 3) of ``hull_vertices``, turning against the clock seen from outside."""
    corners = []
    last = 1 + 2 * RINGS * AROUND
    for at in range(AROUND):
        after = (at + 1) % AROUND
        corners.append((0, 1 + at, 1 + after))
        for ring in range(2 * RINGS - 1):
            a, b = 1 + ring * AROUND + at, 1 + ring * AROUND + after
            corners += [(a, a + AROUND, b), (b, a + AROUND, b + AROUND)]
        corners.append((last, last - AROUND + after, last - AROUND + at))
    triangles = np.array(corners, np.uint32)
    triangles.setflags(write=False)
    return triangles
