"""Principal components of a clip's poses (Jain, Sheikh, Hodgins 2009, eqs. 12-13)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from pegbar.errors import DegenerateError

Floats = NDArray[np.float64]


def principal_components(training: Floats, count: int) -> tuple[Floats, Floats]:
    """Return the mean pose (N, 3) and at most ``count`` orthonormal components (P, 3 N) of ``training`` (G, N, 3).

    Directions in which the poses do not vary are left out. Fewer than two poses raise ValueError, poses that are all
    equal DegenerateError.
    """
    if len(training) < 2:
        raise ValueError(f"training: want at least 2 poses for principal components, got {len(training)}")
    poses = training.reshape(len(training), -1)
    mean = poses.mean(axis=0)
    away = poses - mean
    # Not numpy's: its threads take 100 ms to wake for a problem of 1 ms.
    values, vectors = eigh(away.T @ away)
    # Below this a direction is rounding of the poses' own size.
    varies = values > max(1e-12 * values[-1], len(poses) * (1e-9 * np.abs(poses).max()) ** 2)
    if not varies.any():
        raise DegenerateError("training: all poses are equal, so there are no principal components")
    return mean.reshape(-1, 3), np.ascontiguousarray(vectors[:, varies][:, ::-1][:, :count].T)
