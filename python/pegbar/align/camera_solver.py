"""Levenberg-Marquardt over all cameras of a shot, with a banded factorisation and an arrow for what frames share."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve, cho_solve_banded, cholesky_banded

from pegbar.align.camera_terms import COLUMNS, FOCAL, Cameras, Normal, Shot, Terms, Unknowns, cost, normal

Floats = NDArray[np.float64]
#: Columns of `camera_terms` that every frame has for itself, by mode.
OWN_COLUMNS = {"static": (), "pan": (0, 1, 2), "free": (0, 1, 2, 3, 4, 5)}
_MOST_DAMPING = 1e8


class Solution(NamedTuple):
    """Cameras, their cost in pixels squared, and how many steps were tried."""

    cameras: Cameras
    cost: float
    steps: int


def unknowns_of(mode: str, solve_focal: bool) -> Unknowns:
    """Return which columns move in ``mode``."""
    own = OWN_COLUMNS[mode]
    shared = tuple(column for column in range(FOCAL) if column not in own)
    return Unknowns(own, (*shared, FOCAL) if solve_focal else shared)


def solve(
    shot: Shot, start: Cameras, terms: Terms, unknowns: Unknowns, *, steps: int = 50, tolerance: float = 1e-6
) -> Solution:
    """Return the cameras of least cost near ``start``; it ends when a step gains less than ``tolerance`` of it.

    A start that has marks behind the camera is returned as it is, at infinite cost.
    """
    cameras, best = start, cost(shot, start, terms)
    if best == np.inf:
        return Solution(start, best, 0)
    damping, tried = 1e-3, 0
    equations: Normal | None = None
    while tried < steps and damping < _MOST_DAMPING:
        tried += 1
        equations = normal(shot, cameras, terms, unknowns) if equations is None else equations
        step = damped_step(equations, unknowns, damping)
        trial = cameras if step is None else cameras.moved(step)
        value = np.inf if step is None else cost(shot, trial, terms)
        if value > best:
            damping *= 4
            continue
        gain, cameras, best, equations, damping = best - value, trial, value, None, max(damping / 5, 1e-9)
        if gain <= tolerance * best:
            break
    return Solution(cameras, best, tried)


def damped_step(equations: Normal, unknowns: Unknowns, damping: float) -> Floats | None:
    """Return the step (F, 7) of equations whose diagonal is raised by ``damping``; None where they have no solution."""
    own, shared = unknowns
    frames = len(equations.own)
    corner, right = equations.corner.copy(), -equations.shared_slope
    corner[np.diag_indices_from(corner)] *= 1 + damping
    step = np.zeros((frames, COLUMNS))
    try:
        if own:
            arrow = equations.arrow.reshape(frames * len(own), len(shared))
            band = cholesky_banded(_band(equations, damping), lower=True, check_finite=False)
            columns = np.column_stack([arrow, -equations.slope.ravel()])
            solved = cho_solve_banded((band, True), columns, check_finite=False)
            across, alone = solved[:, :-1], solved[:, -1]
            corner, right = corner - arrow.T @ across, right - arrow.T @ alone
        if shared:
            step[:, shared] = right = cho_solve(cho_factor(corner), right)
        if own:
            step[:, own] = (alone - across @ right).reshape(frames, len(own))
    except (LinAlgError, ValueError):
        return None
    return step if np.isfinite(step).all() else None


def _band(equations: Normal, damping: float) -> Floats:
    """Return the frames' own equations in scipy's lower banded form."""
    frames, size = equations.slope.shape
    band = np.zeros((3 * size, frames, size))
    for distance, block in enumerate((equations.own, equations.next, equations.after)):
        for later, earlier in np.ndindex(size, size):
            below = distance * size + later - earlier
            if below >= 0:
                # Blocks have the earlier frame's unknown first; below the diagonal the later one names the row.
                band[below, : len(block), earlier] = block[:, earlier, later]
    band[0] *= 1 + damping
    return band.reshape(3 * size, frames * size)
