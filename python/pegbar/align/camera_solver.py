"""Levenberg-Marquardt over all cameras of a shot, with a banded factorisation and an arrow for what frames share."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve, cho_solve_banded, cholesky_banded

from pegbar.align.camera_terms import FOCAL, Cameras, Normal, Shot, Terms, cost, normal

Floats = NDArray[np.float64]
#: Columns of `camera_terms` that every frame has for itself, by mode; the other ones are shared.
OWN_COLUMNS = {"static": (), "pan": (0, 1, 2), "free": (0, 1, 2, 3, 4, 5)}


@dataclass(frozen=True)
class Solution:
    """Cameras, their cost in pixels squared, and how many steps were tried."""

    cameras: Cameras
    cost: float
    steps: int


def solve(
    shot: Shot, start: Cameras, terms: Terms, mode: str, *, solve_focal: bool, steps: int = 50, tolerance: float = 1e-6
) -> Solution:
    """Return the cameras of least cost near ``start``; frames share what ``mode`` does not let move."""
    own = OWN_COLUMNS[mode]
    terms = replace(terms, turn=terms.turn if 0 in own else 0.0, place=terms.place if 3 in own else 0.0)
    shared = tuple(column for column in range(6) if column not in own) + ((FOCAL,) if solve_focal else ())
    cameras, best = start, cost(shot, start, terms)
    damping, tried, equations = 1e-3, 0, None
    while tried < steps:
        tried += 1
        equations = normal(shot, cameras, terms) if equations is None else equations
        step = _step(equations, own, shared, damping)
        trial = cameras.moved(step[:, :6], step[0, FOCAL]) if step is not None else None
        value = cost(shot, trial, terms) if trial is not None else np.inf
        if value <= best and trial is not None:
            done = best - value <= tolerance * best
            cameras, best, equations, damping = trial, value, None, max(damping / 5, 1e-9)
            if done:
                break
        else:
            damping *= 4
            if damping > 1e8:
                break
    return Solution(cameras, best, tried)


def _step(equations: Normal, own: tuple[int, ...], shared: tuple[int, ...], damping: float) -> Floats | None:
    """Return the damped step (F, 7), or None where the equations cannot be factored."""
    frames = len(equations.own)
    corner = equations.own[:, shared][:, :, shared].sum(axis=0)
    right = -equations.gradient[:, shared].sum(axis=0)
    corner[np.diag_indices_from(corner)] *= 1 + damping
    step = np.zeros((frames, 7))
    try:
        if own:
            band = _band(equations, own, damping)
            arrow = equations.own[:, own][:, :, shared].reshape(frames * len(own), len(shared))
            inside = -equations.gradient[:, own].reshape(-1, 1)
            factor = cholesky_banded(band, lower=True, check_finite=False)
            solved = cho_solve_banded((factor, True), np.hstack([arrow, inside]), check_finite=False)
            across, alone = solved[:, :-1], solved[:, -1]
            if shared:
                corner, right = corner - arrow.T @ across, right - arrow.T @ alone
        common = cho_solve(cho_factor(corner, check_finite=False), right, check_finite=False) if shared else right
        if own:
            step[:, own] = (alone - across @ common).reshape(frames, len(own))
    except (LinAlgError, ValueError):
        return None
    step[:, shared] = common
    return step if np.isfinite(step).all() else None


def _band(equations: Normal, own: tuple[int, ...], damping: float) -> Floats:
    """Return the frames' own equations in scipy's lower banded form."""
    size, frames = len(own), len(equations.own)
    band = np.zeros((3 * size, frames, size))
    blocks = (equations.own, equations.next, equations.after)
    for distance, block in enumerate(blocks):
        if len(block) == 0:
            continue
        for row, first in enumerate(own):
            for column, second in enumerate(own):
                offset = distance * size + row - column
                if offset >= 0:
                    # `block` couples a frame (rows) with a later one (columns): below the diagonal it is transposed.
                    band[offset, : len(block), column] = block[:, second, first]
    band[0] *= 1 + damping
    return band.reshape(3 * size, frames * size)
