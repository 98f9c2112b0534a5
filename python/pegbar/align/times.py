"""Smooth, monotone times through the tube that a time warp leaves open: a quadratic programme in banded matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded, solveh_banded

Floats = NDArray[np.float64]

_ROUNDS = 80  # the interior point needs 10 to 40
# Where a bound is met without force the times come only as near as the root of the gap: 1e-5 of a frame.
_GAP = 1e-10
# No bound's slack times force falls below this part of the mean: it would be pinned before the others are settled.
_CENTRAL = 1e-3
# Stiffer bounds than this leave the banded matrix without digits; by then the times move by less than 1e-3.
_STIFFEST = 1e17


def smooth_times(target: Floats, low: Floats, high: Floats, spacing: Floats, stiffness: float) -> Floats:
    """Return the times (F,) that minimise distance to ``target`` plus ``stiffness`` times changes of speed, squared.

    The times lie in ``low``..``high`` (F,), and like these and ``target`` never decrease. ``spacing``
    (F - 1,) are the durations between the entries; only their ratios count. Solved by a primal-dual interior point
    (Mehrotra's predictor and corrector) whose Newton matrix has two bands beside the diagonal.
    """
    count = len(target)
    if count < 2 or not stiffness:
        return np.clip(target, low, high)
    bands = stiffness * _bending(spacing)
    bands[0] += 1
    times = _Interior(bands, target, low, high).solve()
    return np.clip(np.maximum.accumulate(np.clip(times, low, high)), low, high)


def smooth_curve(values: Floats, period: float) -> Floats:
    """Return ``values`` (F, ...) smoothed evenly over time: swings of ``period`` frames are halved."""
    if len(values) < 3:
        return values
    bands = (period / (2 * np.pi)) ** 4 * _bending(np.ones(len(values) - 1))
    bands[0] += 1
    flat = solveh_banded(bands, values.reshape(len(values), -1), lower=True, check_finite=False)
    return np.asarray(flat, np.float64).reshape(values.shape)


def smooth_weighted(target: Floats, weights: Floats, spacing: Floats, stiffness: float) -> Floats:
    """Return the times (F,), never decreasing, near ``target`` where its ``weights`` (F,) are large, and smooth.

    They minimise the weighted squared distance (a usual weight counts 1) plus ``stiffness`` times the squared changes
    of speed; ``spacing`` (F - 1,) are the durations between the entries.
    """
    if len(target) < 3:
        return target
    shares = np.clip(weights / max(float(np.median(weights)), 1e-12), 0.05, 5.0)
    bands = stiffness * _bending(spacing)
    bands[0] += shares
    times: Floats = np.maximum.accumulate(solveh_banded(bands, shares * target, lower=True, check_finite=False))
    return times


def _bending(spacing: Floats) -> Floats:
    """Lower bands (3, F) of the matrix of the sum of squared accelerations over a time in units of the mean spacing."""
    count = len(spacing) + 1
    bands = np.zeros((3, count))
    if count < 3:
        return bands
    steps = spacing / spacing.mean()
    before, after = 1 / steps[:-1], 1 / steps[1:]
    rows = np.stack([before, -before - after, after]) / np.sqrt((steps[:-1] + steps[1:]) / 2)
    for band in range(3):
        for column in range(3 - band):
            bands[band, column : column + count - 2] += rows[column] * rows[column + band]
    return bands


class _Interior:
    """min t'Ht/2 - g't over t with t <= high, -t <= -low and -diff(t) <= 0; H by its lower bands (3, F)."""

    def __init__(self, bands: Floats, target: Floats, low: Floats, high: Floats) -> None:
        self.bands, self.target = bands, target
        self.bound = np.concatenate([high, -low, np.zeros(len(low) - 1)])
        self.middle = (low + high) / 2

    def solve(self) -> Floats:
        """Return the minimiser."""
        times = self.middle.copy()
        slack = np.maximum(self.bound - self._gaps(times), 0.1)
        force = np.ones_like(slack)
        for _ in range(_ROUNDS):
            gradient = self._multiply(times) - self.target + self._forces(force)
            violation = self._gaps(times) + slack - self.bound
            gap = float(slack @ force) / len(slack)
            stiff = force / slack
            if gap < _GAP or stiff.max() > _STIFFEST:
                break
            aim = slack * force
            factor = self._factor(stiff)
            _, ds, dz = self._newton(factor, gradient, violation, aim, slack, force)
            step = _longest(slack, ds), _longest(force, dz)
            ahead = float((slack + step[0] * ds) @ (force + step[1] * dz)) / len(slack)
            aim = aim + ds * dz - gap * (ahead / gap) ** 3
            dt, ds, dz = self._newton(factor, gradient, violation, aim, slack, force)
            step = 0.995 * _longest(slack, ds), 0.995 * _longest(force, dz)
            times, slack, force = times + step[0] * dt, slack + step[0] * ds, force + step[1] * dz
            least = _CENTRAL * float(slack @ force) / len(slack)
            slack = np.maximum(slack, least / force)
            force = np.maximum(force, least / slack)
        return times

    def _factor(self, stiff: Floats) -> Floats:
        count = len(self.target)
        bands = self.bands.copy()
        bands[0] += stiff[:count] + stiff[count : 2 * count]
        bands[0, :-1] += stiff[2 * count :]
        bands[0, 1:] += stiff[2 * count :]
        bands[1, :-1] -= stiff[2 * count :]
        return np.asarray(cholesky_banded(bands, overwrite_ab=True, lower=True, check_finite=False), np.float64)

    def _newton(
        self, factor: Floats, gradient: Floats, violation: Floats, aim: Floats, slack: Floats, force: Floats
    ) -> tuple[Floats, Floats, Floats]:
        pull = gradient + self._forces((force * violation - aim) / slack)
        dt = cho_solve_banded((factor, True), -pull, overwrite_b=True, check_finite=False)
        ds = -violation - self._gaps(dt)
        return dt, ds, -(aim + force * ds) / slack

    @staticmethod
    def _gaps(times: Floats) -> Floats:
        return np.concatenate([times, -times, times[:-1] - times[1:]])

    def _forces(self, force: Floats) -> Floats:
        count = len(self.target)
        total: Floats = force[:count] - force[count : 2 * count]
        total[:-1] += force[2 * count :]
        total[1:] -= force[2 * count :]
        return total

    def _multiply(self, times: Floats) -> Floats:
        total = self.bands[0] * times
        for band in (1, 2):
            side = self.bands[band, : len(times) - band]
            total[band:] += side * times[:-band]
            total[:-band] += side * times[band:]
        return np.asarray(total, np.float64)


def _longest(values: Floats, change: Floats) -> float:
    """The longest step up to 1 that leaves ``values`` positive."""
    return float(1 / max(1, -np.min(change / values)))
