"""A clip's travel, whole, in part or taken out: for figures drawn on the spot (Jain et al. 2010, section 5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

Floats = NDArray[np.float64]
#: A moving average over K frames and a second-difference smoother of weight (K / 2.78)^4 halve the same period's power.
HALF_POWER = 2.78


def travelling(points: Floats, window: float, share: float) -> Floats:
    """Return ``points`` (F, N, 3) with only a ``share`` of their smooth horizontal travel, about its middle.

    The travel is the figure's mean path, smoothed as an average over ``window`` frames would: what is quicker, sway and
    surge within a step, stays. 1 leaves the points, 0 keeps the figure in place. Missing points are NaN.
    """
    if share == 1:
        return points
    steps = np.diff(points[..., [0, 2]], axis=0)
    known = np.isfinite(steps).all(axis=-1, keepdims=True)
    mean = np.where(known, steps, 0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    path = smoothed(np.concatenate([np.zeros((1, 2)), np.cumsum(mean, axis=0)]), window)
    moved = points.copy()
    moved[..., [0, 2]] -= (1 - share) * (path - path.mean(axis=0))[:, None]
    return moved


def smoothed(path: Floats, window: float) -> Floats:
    """Return ``path`` (F, D) with its second differences over time penalised; straight lines stay as they are."""
    frames = len(path)
    if frames < 3:
        return path
    weight = (window / HALF_POWER) ** 4
    bands = np.zeros((3, frames))
    bands[0] = 1
    for first, factor in enumerate((1.0, -2.0, 1.0)):
        for second, other in enumerate((1.0, -2.0, 1.0)):
            if second >= first:
                bands[second - first, first : frames - 2 + first] += weight * factor * other
    smooth: Floats = solveh_banded(bands, path, lower=True, check_finite=False)
    return smooth
