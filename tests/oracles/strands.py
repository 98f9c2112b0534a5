"""Slow numpy: the catenary, and one substep of a strand solved as one system of equations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize

Floats = NDArray[np.float64]


def catenary(across: Floats, width: float, length: float) -> Floats:
    """Heights of a chain of ``length`` between nails at 0 and ``width``, at height 0."""
    size = brentq(lambda a: 2 * a * np.sinh(width / 2 / a) - length, 0.05, 50)
    return size * np.cosh((across - width / 2) / size) - size * np.cosh(width / 2 / size)


def substep(points: Floats, rows: Floats, step: float, wind: Floats, damping: float) -> Floats:
    """Places after one substep from rest of a strand of equal links whose first point is held.

    Drag, gravity and damping; bending implicitly by a dense matrix; lengths by looking for the least energy of masses
    and springs, whatever way leads there.
    """
    weight, length, bend, drag, cling = rows[:, 0], rows[:, 2], rows[:, 4], rows[:, 6], rows[:, 7]
    along = np.gradient(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    lengthwise = (along @ wind)[:, None] * along
    velocity = np.zeros_like(points)
    for part, share in ((wind - lengthwise, np.ones(len(points))), (lengthwise, cling)):
        pull = (share * drag * weight * step)[:, None] * np.linalg.norm(part, axis=1, keepdims=True)
        velocity += part * pull / (1 + pull)
    velocity[:, 1] -= 9.81 * step
    velocity *= np.exp(-damping * step)
    places = points + step * velocity * (weight > 0)[:, None]
    free = weight > 0
    curve = np.zeros((len(points), len(points)))
    for k in range(1, len(points) - 1):
        before, after = length[k - 1], length[k]
        bow = np.zeros(len(points))
        bow[k - 1 : k + 2] = 1 / before, -1 / before - 1 / after, 1 / after
        curve += bend[k] * 2 / (before + after) * np.outer(bow, bow)
    system = np.diag(np.where(free, 1 / np.where(free, weight, 1), 1.0))
    right = system @ places
    system[free] += step**2 * curve[free]
    places = np.linalg.solve(system, right)
    masses = np.where(free, 1 / np.where(free, weight, 1), 0.0)
    springs = step**2 / (rows[:-1, 3] + 1e-3 * length[:-1] / (100 * masses.sum()))

    def energy(flat: Floats) -> float:
        moved = places.copy()
        moved[free] = flat.reshape(-1, 3)
        growth = np.linalg.norm(np.diff(moved, axis=0), axis=1) - length[:-1]
        return float(masses @ np.sum((moved - places) ** 2, axis=1) + springs @ growth**2) / 2

    start = minimize(energy, places[free].ravel(), method="BFGS", options={"gtol": 1e-10, "maxiter": 2000}).x
    found = places.copy()
    found[free] = start.reshape(-1, 3)
    return found
