"""Depth from foreshortening: rigid limbs through the drawn points, after Jain, Sheikh, Hodgins 2009, section 3.5.

Where the closed form linearises limb lengths around the clip's pose, here length and drawn foreshortening give the size
of a limb's depth (Taylor 2000), and clip and smooth motion together its sign.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.lift.lengths import likely_lengths
from pegbar.lift.projection import Camera
from pegbar.lift.rays import fill_marks, mark_noise, metres_per_unit, project, sight_rays, smooth_marks
from pegbar.lift.rigid import LimbTracks, rigid_limbs
from pegbar.lift.tree import Link, limb_tree

Floats = NDArray[np.float64]
#: Natural motion at usual frame rates looks like noise of this part of all limbs' length together.
NATURAL_NOISE = 1.4e-4
#: A marker that is not visible is known to this part of all limbs' length together.
HIDDEN_NOISE = 0.02
#: What smoothing leaves of a mark's noise.
SMOOTHED = 0.6
#: Least jolts and doubts, as parts of a limb's length, so that a still clip does not forbid motion.
LEAST_JOLT, LEAST_DOUBT = 2e-3, 2e-2
#: The clip is trusted less than its error across the view says: its errors are alike for many frames.
DOUBT = 2.0
#: A rigid limb may jolt this many times more than the clip's does.
LOOSER = 2.0


@dataclass(frozen=True)
class Refinement:
    """What `refine_markers` may be told: see `reconstruct_markers`."""

    noise: float | None = None
    root: int = 0
    flips: NDArray[np.int64] | None = None
    stretch: bool = False


@dataclass
class _Figure:
    """The drawn figure as far as it is solved; ``points`` are filled from the root outwards."""

    points: Floats
    prior: Floats
    smooth: tuple[Floats, Floats]
    marked: tuple[Floats, Floats]
    noise: Floats
    scale: float


def refine_markers(
    drawn: Floats,
    prior: Floats,
    cameras: Sequence[Camera],
    limbs: NDArray[np.int64],
    lengths: Floats | None,
    options: Refinement,
) -> tuple[Floats, Floats]:
    """Return the markers (F, N, 3) and the limbs' lengths (F, V), in metres; arguments as in `reconstruct_markers`."""
    levels = limb_tree(limbs, prior, options.root)
    figure = _start(drawn, prior, cameras, [link for level in levels for link in level], lengths, options)
    solved = np.zeros((len(drawn), len(limbs))) if lengths is None else lengths
    for level in levels:
        found = _solve_level(figure, level, lengths, options)
        for (_, _, limb), length in zip(level, found, strict=True):
            if limb >= 0:
                solved[:, limb] = length
    if options.stretch:
        figure.points = _onto_rays(figure.points, figure.marked)
    return figure.points, solved


def _start(
    drawn: Floats,
    prior: Floats,
    cameras: Sequence[Camera],
    links: list[Link],
    lengths: Floats | None,
    options: Refinement,
) -> _Figure:
    picture, unit = project(prior, cameras), float(np.mean(metres_per_unit(prior, cameras)))
    ends = np.array([link[:2] for link in links], dtype=np.int64).reshape(-1, 2)
    size = float(np.linalg.norm(prior[:, ends[:, 0]] - prior[:, ends[:, 1]], axis=-1).mean(axis=0).sum())
    deviation = mark_noise(drawn * unit, NATURAL_NOISE * size) if options.noise is None else options.noise * unit
    filled = fill_marks(drawn, picture)
    noise = np.where(np.isfinite(drawn).all(axis=-1), deviation, HIDDEN_NOISE * size + deviation)
    jolts = np.median(np.abs(np.diff(picture, 2, axis=0)), axis=(0, 2)) + 1e-3 / unit if len(drawn) > 2 else 1.0
    smooth = sight_rays(smooth_marks(filled, noise / unit, np.broadcast_to(jolts, noise.shape[1:])), cameras)
    points = _onto_rays(prior, smooth)
    scale = _scale(points, prior, smooth[1], ends)
    if lengths is not None:
        whole = [link for link in links if link[2] >= 0]
        spans = np.linalg.norm([prior[:, a] - prior[:, b] for a, b, _ in whole], axis=-1)
        given = lengths[:, [limb for _, _, limb in whole]]
        scale = float(given.sum() / spans.sum()) if spans.sum() > 0 and given.sum() > 0 else scale
    return _Figure(points, prior, smooth, sight_rays(filled, cameras), noise, scale)


def _onto_rays(points: Floats, rays: tuple[Floats, Floats]) -> Floats:
    """The points of the rays (starts, directions) that are nearest to ``points``."""
    starts, directions = rays
    nearest: Floats = starts + np.sum((points - starts) * directions, axis=-1, keepdims=True) * directions
    return nearest


def _scale(points: Floats, prior: Floats, directions: Floats, ends: NDArray[np.int64]) -> float:
    """How much larger the drawn figure is than the clip's, from its limbs across the view."""
    first, second = ends.T
    away = directions[:, second]

    def across(markers: Floats) -> float:
        limbs = markers[:, second] - markers[:, first]
        return float(np.sum(np.square(limbs - np.sum(limbs * away, axis=-1, keepdims=True) * away)))

    return float(np.sqrt(across(points) / max(across(prior), 1e-12))) or 1.0


def _solve_level(figure: _Figure, level: list[Link], lengths: Floats | None, options: Refinement) -> Floats:
    """Place the markers at the ends of ``level``'s links; returns the links' lengths (links, F)."""
    parents, children = np.array([link[:2] for link in level]).T
    starts, rays = (side[:, children] for side in figure.smooth)
    clip_limbs = figure.scale * (figure.prior[:, children] - figure.prior[:, parents])
    spans = np.median(np.linalg.norm(clip_limbs, axis=-1), axis=0)
    before = _onto_rays(figure.points[:, parents], tuple(side[:, parents] for side in figure.smooth))
    across = _onto_rays(before, (starts, rays)) - before
    clip = np.sum(clip_limbs * rays, axis=-1)
    off = across - (clip_limbs - clip[..., None] * rays)
    doubts = DOUBT * (np.sqrt(np.mean(np.sum(off**2, axis=-1), axis=0) / 2) + LEAST_DOUBT * spans + 1e-9)
    noise = SMOOTHED * np.hypot(figure.noise[:, parents], figure.noise[:, children])
    scales = np.column_stack([_jolts(clip[..., None]) + LEAST_JOLT * spans + 1e-9, doubts])
    planar = np.linalg.norm(across, axis=-1)
    drawn = (*(np.ascontiguousarray(values.T) for values in (planar, clip, noise)), scales)
    found = _level_lengths(level, lengths, drawn, spans)
    depths = _flipped(_kernels.limb_depths(drawn, found), level, options.flips)
    starts, rays = (side[:, children] for side in figure.marked)
    here = figure.points[:, parents]
    tracks = LimbTracks(
        (_onto_rays(here, (starts, rays)) - here).swapaxes(0, 1),
        rays.swapaxes(0, 1),
        np.clip(drawn[1], -found, found),
        figure.noise[:, children].T,
        LOOSER * (_jolts(clip_limbs) / np.sqrt(3) + LEAST_JOLT * spans + 1e-9),
        2 * doubts,
    )
    figure.points[:, children] = here + rigid_limbs(tracks, depths, found).swapaxes(0, 1)
    return found


def _jolts(tracks: Floats) -> Floats:
    """The usual size (V,) of the second differences of ``tracks`` (F, V, K)."""
    if len(tracks) < 3:
        return np.zeros(tracks.shape[1])
    jolts: Floats = np.median(np.linalg.norm(np.diff(tracks, 2, axis=0), axis=-1), axis=0)
    return jolts


def _level_lengths(level: list[Link], lengths: Floats | None, drawn: tuple[Floats, ...], spans: Floats) -> Floats:
    """The lengths (links, F), given or as the drawings say; a link of no length in the clip has none."""
    planar, clip, noise, scales = drawn
    found = np.empty_like(planar)
    unknown = np.array([lengths is None or limb < 0 for _, _, limb in level])
    if unknown.any():
        part = (planar[unknown], clip[unknown], noise[unknown], scales[unknown])
        found[unknown] = np.where(spans[unknown] > 1e-6, likely_lengths(part, spans[unknown]), 0.0)[:, None]
    for row in np.flatnonzero(~unknown):
        found[row] = lengths[:, level[row][2]]
    return found


def _flipped(depths: Floats, level: list[Link], flips: NDArray[np.int64] | None) -> Floats:
    """``depths`` (links, F) with the signs turned that ``flips`` (limb, first frame, one past the last) name."""
    for limb, start, stop in flips if flips is not None else ():
        for row, link in enumerate(level):
            if link[2] == limb:
                depths[row, start:stop] *= -1
    return depths
