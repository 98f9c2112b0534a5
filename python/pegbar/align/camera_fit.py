"""Fits one kind of camera track to a shot: starts from everywhere, then least squares with a noise-aware loss."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pegbar.align import camera_start
from pegbar.align.camera_solver import solve, unknowns_of
from pegbar.align.camera_terms import Cameras, Shot, Terms, reprojection
from pegbar.align.root_motion import HALF_POWER

Floats = NDArray[np.float64]
#: How far the focal length of a shot strays from the usual one: standard deviation of its logarithm.
_FOCAL_SPREAD = 0.35
#: Median length of a two-dimensional normal error of standard deviation 1.
RAYLEIGH_MEDIAN = 1.1774
#: Beyond so many standard deviations a mark counts linearly.
_KNEE = 2.5
#: A drawing is never taken as more exact than this share of the figure's spread.
_EXACT = 2e-3
#: Frames looked at for a start, and how many directions are followed.
_LOOKED_AT, _FOLLOWED = 48, 6


@dataclass(frozen=True)
class Settings:
    """What the user set: the log focal length in pixels, given or the usual one; smoothing, weights and floor."""

    log_focal: float
    solve_focal: bool
    window: int
    weights: dict[str, float]
    floor: float | None
    robust: bool


class Fit(NamedTuple):
    """Cameras of a mode, their marks' distances (F, N) in pixels, 0 where not seen, and their noise in pixels."""

    mode: str
    cameras: Cameras
    terms: Terms
    distances: Floats
    noise: float


def fit(shot: Shot, mode: str, settings: Settings, others: tuple[Fit, ...] = ()) -> Fit:
    """Return the best cameras of ``mode``; those of ``others``, simpler or freer, are starts as well."""
    spread = figure_spread(shot)
    starts = _starts(shot, mode, settings)
    terms = _terms(shot, settings, starts[0], spread)
    fixed, open_ = unknowns_of(mode, False), unknowns_of(mode, settings.solve_focal)
    if mode == "pan":
        moving = solve(shot, starts[0], terms, unknowns_of("free", False), steps=6, tolerance=1e-2)
        starts = [camera_start.turning(moving.cameras, figure_middles(shot))]
    starts += [other.cameras for other in others if mode == "free" or other.mode == "static"]
    rough = [solve(shot, start, terms, fixed, steps=12, tolerance=1e-2) for start in starts]
    found = min(rough, key=lambda end: end.cost)
    for _ in range(3):
        noise = _noise(shot, found.cameras)
        prior = max(noise, _EXACT * spread) * math.sqrt(settings.window * settings.weights["field_of_view"])
        knee = max(_KNEE * noise, _EXACT * spread) if settings.robust else math.inf
        terms = replace(terms, focal=prior / _FOCAL_SPREAD, knee=knee)
        found = solve(shot, found.cameras, terms, open_)
    distances = np.linalg.norm(reprojection(shot, found.cameras), axis=-1)
    return Fit(mode, found.cameras, terms, distances, _noise(shot, found.cameras))


def refit(shot: Shot, found: Fit, settings: Settings, without: NDArray[np.intp]) -> Cameras:
    """Return the cameras of ``found`` solved again without the marks of some frames; smoothness leads through them."""
    seen = shot.seen.copy()
    seen[without] = False
    part = Shot(shot.marks, seen, shot.points, shot.middle)
    return solve(
        part, found.cameras, found.terms, unknowns_of(found.mode, settings.solve_focal), steps=15, tolerance=1e-3
    ).cameras


def figure_spread(shot: Shot) -> float:
    """Return how far marks lie from their frame's middle, RMS in pixels."""
    seen = shot.seen[..., None]
    middle = (shot.marks * seen).sum(axis=1, keepdims=True) / np.maximum(seen.sum(axis=1, keepdims=True), 1)
    return float(np.sqrt(np.sum(((shot.marks - middle) * seen) ** 2) / shot.seen.sum()))


def figure_middles(shot: Shot) -> Floats:
    """Return the mean (F, 3) of each frame's seen points in metres."""
    middles: Floats = shot.points.sum(axis=1) / np.maximum(shot.seen.sum(axis=1), 1)[:, None]
    return middles


def _noise(shot: Shot, cameras: Cameras) -> float:
    distances = np.linalg.norm(reprojection(shot, cameras), axis=-1)
    return float(np.median(distances[shot.seen])) / RAYLEIGH_MEDIAN


def _terms(shot: Shot, settings: Settings, start: Cameras, spread: float) -> Terms:
    """Return the terms' factors; a metre has the pixels that it has at the figure."""
    weights = settings.weights
    depth = float(np.median(np.linalg.norm(figure_middles(shot) - start.centers, axis=1)))
    turn = 1.5 * spread * math.sqrt(weights["smooth"]) * (settings.window / HALF_POWER) ** 2
    return Terms(
        turn=turn,
        place=turn / depth,
        roll=math.sqrt(weights["roll"]) * spread,
        level=math.sqrt(weights["level"]) * spread,
        ground=0.0 if settings.floor is None else math.sqrt(weights["ground"]) * math.exp(settings.log_focal) / depth,
        floor=settings.floor or 0.0,
        focal=0.0,
        usual_focal=settings.log_focal,
        knee=0.1 * spread,
    )


def _starts(shot: Shot, mode: str, settings: Settings) -> list[Cameras]:
    frames = len(shot.marks)
    full = np.flatnonzero(shot.seen.sum(axis=1) >= 4)
    keys = full[np.unique(np.linspace(0, len(full) - 1, min(_LOOKED_AT, len(full))).round().astype(int))]
    part = shot.part(keys)
    found = camera_start.views(part, math.exp(settings.log_focal))
    if mode != "static":
        return [camera_start.moving_start(shot, found, keys, settings.log_focal)]
    starts = camera_start.still_starts(part, found, settings.log_focal, _FOLLOWED)
    return [camera_start.repeated(start, frames) for start in starts]
