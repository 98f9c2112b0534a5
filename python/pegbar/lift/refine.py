"""Depth from foreshortening: rigid limbs through the drawn points, after Jain, Sheikh, Hodgins 2009, section 3.5.

Where the closed form linearises limb lengths around the clip's pose, here length and drawn foreshortening give the size
of a limb's depth (Taylor 2000), and clip and smooth motion together its sign.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.lift.given import Given, Refinement
from pegbar.lift.hinges import breaks, hinge
from pegbar.lift.lengths import Drawn, clip_lengths, likely_lengths
from pegbar.lift.pins import meet_lengths, planted_targets
from pegbar.lift.projection import known
from pegbar.lift.proportions import across, drawn_proportions, weighted_median
from pegbar.lift.rays import fill_marks, mark_noise, metres_per_unit, project, sight_rays, smooth_marks
from pegbar.lift.rigid import LimbTracks, rigid_limbs
from pegbar.scene.limb_tree import Link, limb_tree

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
#: Where limbs change their lengths, foreshortening is doubted by so many times that change.
SQUASH = 2.0

#: Drawn lengths change this much (relative) over time because poses differ from the clip's.
POSE = 0.03
#: A limb drawn longer than this part of its told length lies in the picture; changes below the second are noise.
FLAT, LEAST_CHANGE = 0.9, 0.02
#: Metres.
NO_LENGTH = 1e-4


@dataclass
class _Figure:
    """The drawn figure as far as it is solved; ``points`` are filled from the root outwards.

    ``above`` says which marker each one hangs on.
    """

    points: Floats
    prior: Floats
    smooth: tuple[Floats, Floats]
    marked: tuple[Floats, Floats]
    noise: Floats
    scales: Floats
    stretch: float
    change: float
    above: dict[int, int]


def refine_markers(given: Given, options: Refinement) -> tuple[Floats, Floats]:
    """Return the markers (F, N, 3) and the limbs' lengths (F, V), in metres; arguments as in `reconstruct_markers`."""
    drawn, prior, limbs, lengths = given.drawn, given.prior, given.limbs, given.lengths
    if not len(prior):
        return prior, np.zeros((0, len(limbs)))
    levels = limb_tree(limbs, prior, options.root)
    links = [link for level in levels for link in level]
    figure = _start(given, links, options)
    rows = [_solve_level(figure, level, lengths, options) for level in levels]
    linked = np.concatenate([np.zeros((0, len(drawn))), *rows])
    ends = np.array([link[:2] for link in links], dtype=np.int64).reshape(-1, 2)
    solved = _all_lengths(figure, limbs, links, linked, lengths)
    rings = sorted(set(range(len(limbs))) - {limb for _, _, limb in links})
    targets = np.full(figure.points.shape, np.nan)
    if options.planted is not None or options.held is not None:
        planted = np.zeros(drawn.shape[:2], bool) if options.planted is None else options.planted
        targets = planted_targets(figure.points, planted, options.held)
    if options.stretch:
        return np.where(np.isfinite(targets), targets, figure.points), solved
    moved = slice(None) if rings else np.flatnonzero(known(targets).any(axis=1))
    ends, linked = np.concatenate([ends, limbs[rings]]), np.concatenate([linked, solved[:, rings].T])
    rays, spans = figure.smooth[1][moved], linked.T[moved]
    figure.points[moved] = meet_lengths(figure.points[moved], rays, ends, spans, targets[moved])
    return figure.points, solved


def _all_lengths(
    figure: _Figure, limbs: NDArray[np.int64], links: list[Link], linked: Floats, lengths: Floats | None
) -> Floats:
    """The lengths (F, V) of all limbs: given, found along the tree's links, or (limbs that close rings) the clip's."""
    if lengths is not None:
        return lengths
    frames = len(figure.points)
    solved = np.tile(np.median(figure.scales) * clip_lengths(figure.prior, limbs), (frames, 1))
    for (_, _, limb), length in zip(links, linked, strict=True):
        if limb >= 0:
            solved[:, limb] = length
    return solved


def _start(given: Given, links: list[Link], options: Refinement) -> _Figure:
    drawn, prior, cameras, lengths = given.drawn, given.prior, given.cameras, given.lengths
    picture, unit = project(prior, cameras), float(np.mean(metres_per_unit(prior, cameras)))
    ends = np.array([link[:2] for link in links], dtype=np.int64).reshape(-1, 2)
    size = float(np.linalg.norm(prior[:, ends[:, 0]] - prior[:, ends[:, 1]], axis=-1).mean(axis=0).sum())
    deviation = mark_noise(drawn * unit, NATURAL_NOISE * size) if options.noise is None else options.noise * unit
    filled = fill_marks(drawn, picture)
    noise = np.where(known(drawn), deviation, HIDDEN_NOISE * size + deviation)
    jolts = np.median(np.abs(np.diff(picture, 2, axis=0)), axis=(0, 2)) + 1e-3 / unit if len(drawn) > 2 else 1.0
    smooth = sight_rays(smooth_marks(filled, noise / unit, np.broadcast_to(jolts, noise.shape[1:])), cameras)
    points = _onto_rays(prior, smooth)
    scales = np.ones(drawn.shape[1])
    drawn_as = drawn_proportions(points, prior, smooth[1], ends)
    scales[ends[:, 1]] = drawn_as.scales
    if lengths is not None:
        scales[ends[:, 1]] = _told_scales(scales[ends[:, 1]], prior, links, lengths)
    # Limbs of lengths that are told change as far as they are drawn too long; others as far as poses do not explain.
    stretch, unexplained = drawn_as.stretch, math.sqrt(max(drawn_as.stretch**2 - POSE**2, 0))
    told = 0.0 if lengths is None else _beyond(points, smooth[1], noise, links, lengths)
    change = stretch if options.stretch else unexplained if lengths is None else told
    return _Figure(
        points,
        prior,
        smooth,
        sight_rays(filled, cameras),
        noise,
        scales,
        stretch,
        change,
        {child: parent for parent, child, _ in links},
    )


def _beyond(points: Floats, directions: Floats, noise: Floats, links: list[Link], lengths: Floats) -> float:
    """How much (relative, one deviation) limbs change their length that are drawn longer than told; 0 if hardly any."""
    known = [(a, b, limb) for a, b, limb in links if limb >= 0]
    if not known:
        return 0.0
    first, second, limbs = np.array(known).T
    told = np.maximum(lengths[:, limbs], NO_LENGTH)
    drawn = across(points, directions, np.stack([first, second], axis=1)) / told
    doubt = 3 * np.hypot(noise[:, first], noise[:, second]) / told
    # Of limbs that lie in the picture about half are drawn too long: those count for both halves.
    flat = drawn > FLAT
    change = math.sqrt(2 * float(np.mean(np.maximum(drawn - doubt - 1, 0)[flat] ** 2))) if flat.any() else 0.0
    return change if change > LEAST_CHANGE else 0.0


def _told_scales(scales: Floats, prior: Floats, links: list[Link], lengths: Floats) -> Floats:
    """The links' scales where lengths are told: theirs, and their median for links without."""
    spans = np.median([np.linalg.norm(prior[:, a] - prior[:, b], axis=-1) for a, b, _ in links], axis=1)
    limbs = np.array([limb for _, _, limb in links])
    told = np.where(limbs >= 0, np.median(lengths, axis=0)[limbs], 0.0)
    both = (told > NO_LENGTH) & (spans > NO_LENGTH)
    if not both.any():
        return scales
    ratios = told / np.where(both, spans, 1)
    return np.where(both, ratios, weighted_median(ratios[both], spans[both]))


def _onto_rays(points: Floats, rays: tuple[Floats, Floats]) -> Floats:
    """The points of the rays (starts, directions) that are nearest to ``points``."""
    starts, directions = rays
    nearest: Floats = starts + np.sum((points - starts) * directions, axis=-1, keepdims=True) * directions
    return nearest


@dataclass(frozen=True)
class _Level:
    """Limbs that hang equally far from the root, and what the drawings and the clip say of them.

    ``drawn`` as in `likely_lengths`; ``limbs`` (F, V, 3) and ``spans`` (V,) are the clip's, as large as they are drawn.
    """

    links: list[Link]
    parents: NDArray[np.int64]
    children: NDArray[np.int64]
    limbs: Floats
    spans: Floats
    drawn: Drawn


def _observed(figure: _Figure, links: list[Link]) -> _Level:
    parents, children = np.array([link[:2] for link in links], dtype=np.int64).T
    limbs = figure.scales[children, None] * (figure.prior[:, children] - figure.prior[:, parents])
    spans = np.median(np.linalg.norm(limbs, axis=-1), axis=0)
    before = _onto_rays(figure.points[:, parents], _of(figure.smooth, parents))
    across = _onto_rays(before, _of(figure.smooth, children)) - before
    rays = figure.smooth[1][:, children]
    clip = np.sum(limbs * rays, axis=-1)
    off = across - (limbs - clip[..., None] * rays)
    doubts = DOUBT * (np.sqrt(np.mean(np.sum(off**2, axis=-1), axis=0) / 2) + LEAST_DOUBT * spans + 1e-9)
    noise = SMOOTHED * np.hypot(figure.noise[:, parents], figure.noise[:, children])
    noise = np.hypot(noise, figure.change * spans)
    scales = np.column_stack([_jolts(clip[..., None]) + LEAST_JOLT * spans + 1e-9, doubts])
    planar, clip, noise = (np.ascontiguousarray(rows.T) for rows in (np.linalg.norm(across, axis=-1), clip, noise))
    return _Level(links, parents, children, limbs, spans, (planar, clip, noise, scales))


def _solve_level(figure: _Figure, links: list[Link], lengths: Floats | None, options: Refinement) -> Floats:
    """Place the markers at the ends of ``links``; returns the links' lengths (links, F)."""
    level = _observed(figure, links)
    found = _level_lengths(level, lengths)
    level.drawn[1][:] = _unbroken(figure, level, found)
    depths = _flipped(_kernels.limb_depths(level.drawn, found), links, options.flips)
    here, marked = figure.points[:, level.parents], _of(figure.marked, level.children)
    if options.stretch:
        soft = _soft_depths(level, depths, found, figure.stretch).T
        figure.points[:, level.children] = _onto_rays(here, marked) + soft[..., None] * marked[1]
        return found
    if figure.change > 0 and options.noise != 0:
        depths = np.ascontiguousarray(_soft_depths(level, depths, found, SQUASH * figure.stretch))
    tracks = LimbTracks(
        across=(_onto_rays(here, marked) - here).swapaxes(0, 1),
        rays=marked[1].swapaxes(0, 1),
        clip=np.clip(level.drawn[1], -found, found),
        noise=figure.noise[:, level.children].T,
        jolts=LOOSER * (_jolts(level.limbs) / np.sqrt(3) + LEAST_JOLT * level.spans + 1e-9),
        doubts=DOUBT * level.drawn[3][:, 1],
    )
    figure.points[:, level.children] = here + rigid_limbs(tracks, depths, found).swapaxes(0, 1)
    return found


def _unbroken(figure: _Figure, level: _Level, lengths: Floats) -> Floats:
    """The clip's depths (V, F), turned where they would break a joint that in the clip bends to one side alone."""
    depths = level.drawn[1].copy()
    for row, (here, end, _) in enumerate(level.links):
        above = figure.above.get(here)
        clip = figure.prior[:, here]
        joint = None if above is None else hinge(clip - figure.prior[:, above], figure.prior[:, end] - clip)
        if joint is None:
            continue
        place = figure.points[:, here]
        starts, rays = (part[:, end] for part in figure.smooth)
        across = _onto_rays(place, (starts, rays)) - place
        size = np.sqrt(np.maximum(lengths[row] ** 2 - np.sum(across**2, axis=1), 0))
        away = np.copysign(size, depths[row])[:, None] * rays
        broken = breaks(joint, place - figure.points[:, above], across + away, across - away)
        depths[row] = np.where(broken, -depths[row], depths[row])
    return depths


def _soft_depths(level: _Level, depths: Floats, lengths: Floats, stretch: float) -> Floats:
    """The ``depths`` (V, F) that ``lengths`` ask for and the clip's, each as far as it is sure where limbs stretch."""
    change = np.maximum(stretch * lengths, 1e-9)
    told = (change * lengths) ** 2 / np.maximum(np.maximum(depths**2, 2 * change * lengths), 1e-12)
    clip = (level.drawn[3][:, 1:] / DOUBT) ** 2
    soft: Floats = (clip * depths + told * level.drawn[1]) / (clip + told)
    return soft


def _of(rays: tuple[Floats, Floats], markers: NDArray[np.int64]) -> tuple[Floats, Floats]:
    return rays[0][:, markers], rays[1][:, markers]


def _jolts(tracks: Floats) -> Floats:
    """The usual size (V,) of the second differences of ``tracks`` (F, V, K)."""
    if len(tracks) < 3:
        return np.zeros(tracks.shape[1])
    jolts: Floats = np.median(np.linalg.norm(np.diff(tracks, 2, axis=0), axis=-1), axis=0)
    return jolts


def _level_lengths(level: _Level, lengths: Floats | None) -> Floats:
    """The lengths (links, F), given or as the drawings say; a link without length in clip and drawings has none."""
    found = np.empty_like(level.drawn[0])
    told = np.array([lengths is not None and limb >= 0 for _, _, limb in level.links])
    if not told.all():
        planar, clip, noise, scales = (rows[~told] for rows in level.drawn)
        spans = level.spans[~told]
        seen = np.sqrt(np.mean(planar**2, axis=1)) > 3 * np.median(noise, axis=1) + NO_LENGTH
        likely = likely_lengths((planar, clip, noise, scales), spans)
        found[~told] = np.where(seen | (spans > NO_LENGTH), likely, 0.0)[:, None]
    if lengths is not None:
        found[told] = lengths[:, [limb for _, _, limb in level.links if limb >= 0]].T
    return found


def _flipped(depths: Floats, links: list[Link], flips: NDArray[np.int64]) -> Floats:
    """``depths`` (links, F) with the signs turned that ``flips`` (limb, first frame, one past the last) name."""
    for limb, start, stop in flips:
        for row, link in enumerate(links):
            if link[2] == limb:
                depths[row, start:stop] *= -1
    return depths
