"""Slow numpy: the tapered cylinder as the union of its spheres, and one substep of cloth, constraint by constraint."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def capsule_distance(point: Floats, row: Floats, steps: int = 4001) -> float:
    """Distance of ``point`` (3,) from the union of spheres between the two ends of ``row`` (8,)."""
    share = np.linspace(0, 1, steps)[:, None]
    centers = (1 - share) * row[:3] + share * row[4:7]
    radii = (1 - share[:, 0]) * row[3] + share[:, 0] * row[7]
    return float((np.linalg.norm(point - centers, axis=1) - radii).min())


def hang(
    positions: Floats, velocities: Floats, weights: Floats, links: list[tuple[int, int, float]], step: float
) -> tuple[Floats, Floats]:
    """One substep (Macklin et al. 2016, equations 17 and 18 one by one) under gravity, links stiff."""
    before = positions.copy()
    moved = velocities.copy()
    moved[weights > 0] += step * np.array([0.0, -9.81, 0.0])
    places = positions + step * moved * (weights > 0)[:, None]
    for a, b, length in links:
        apart = places[a] - places[b]
        now = np.linalg.norm(apart)
        multiplier = -(now - length) / (weights[a] + weights[b])
        places[a] += weights[a] * multiplier * apart / now
        places[b] -= weights[b] * multiplier * apart / now
    return places, (places - before) / step
