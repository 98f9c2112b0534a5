"""From an alignment to a 3D animation: markers, joint angles, standing feet, loops (2009 paper, sections 3.4-3.6)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pegbar.align.retime import retime
from pegbar.lift.angles import joint_angles
from pegbar.lift.fitting import fit_skeleton
from pegbar.lift.given import FEWEST_MARKS
from pegbar.lift.looping import FEWEST as LOOP
from pegbar.lift.looping import close_loop
from pegbar.lift.markers import reconstruct_markers
from pegbar.lift.pins import planted_targets
from pegbar.lift.reach import CHAINS, hold_ends, stand_still
from pegbar.lift.retarget import rest_pose
from pegbar.lift.turned import turn_limbs
from pegbar.scene.alignment import Alignment
from pegbar.scene.body import bones_between
from pegbar.scene.lifted import Lifted
from pegbar.scene.motion import Motion
from pegbar.shot.lift_choices import LiftOptions, fixed_places, flip_rows, limb_lengths, standing_markers

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


def lift_drawing(alignment: Alignment, clip: Motion, rate: float, options: LiftOptions) -> Lifted:
    """Rebuild 3D markers and joint angles of an aligned drawing (2009, sections 3.4-3.6).

    Parameters
    ----------
    alignment : Alignment
        What was found for F drawings.
    clip : Motion
        Its clip as drawn: mirrored and exchanged as the alignment says.
    rate : float
        Drawings a second.
    options : LiftOptions
        What the user has chosen.

    Raises
    ------
    ValueError
        For a clip without a skeleton (unless another is given), a name that is no marker or that hangs on nothing, or
        fewer than 3 drawings for a loop.
    DegenerateError
        For a drawing with fewer than 4 marks.
    """
    if options.loop and len(alignment.times) < LOOP:
        raise ValueError(
            f"lift.loop: want {LOOP} drawings with marks or more to close a loop, got {len(alignment.times)}"
        )
    known = np.flatnonzero(np.isfinite(alignment.clip).all(axis=(0, 2)))
    names = tuple(alignment.names[index] for index in known)
    bones = bones_between(names)
    planted = standing_markers(clip, alignment, known, names, rate, options.planted)
    if options.depth == "lengths":
        markers = _by_lengths(alignment, known, planted, options)
    else:
        flips = flip_rows(options.flips, names, bones)
        markers = turn_limbs(alignment.positions[:, known], alignment.matrices, bones, flips, names)
        markers = _led(markers, fixed_places(options.held, markers, names))
    motion, size = _posed(markers, names, bones, retime(clip, alignment.times, frame_rate=rate), options)
    travel = np.zeros(3)
    if options.loop:
        loop = close_loop(motion)
        motion, travel = loop.motion, loop.travel
    held = fixed_places(options.held, markers, names)
    motion = _kept_in_place(motion, names, planted, held, travel if options.loop else None)
    return Lifted(names, bones, markers, planted, motion, travel, size)


def _by_lengths(alignment: Alignment, known: NDArray[np.intp], planted: Flags, options: LiftOptions) -> Floats:
    """Markers of limbs of constant length, over the whole sequence at once.

    Markers that no drawing shows would be guesses with limbs of their own: they go along with those they hang on.
    """
    seen = ~alignment.estimated[:, known]
    seen[seen.sum(axis=1) < FEWEST_MARKS] = True
    shown = np.flatnonzero(seen.any(axis=0))
    part = known[shown]
    names = tuple(alignment.names[index] for index in part)
    bones = bones_between(names)
    drawn = np.where(seen[:, shown, None], alignment.markers[:, part], np.nan)
    clip, standing = alignment.clip[:, part], planted[:, shown]
    held = fixed_places(options.held, alignment.positions[:, part], names)
    markers = alignment.positions[:, known].copy()
    found = reconstruct_markers(
        drawn,
        clip,
        alignment,
        bones,
        limb_lengths(drawn, clip, alignment, names, bones, options.lengths),
        refine=True,
        planted=standing if standing.any() else None,
        held=held if np.isfinite(held).any() else None,
        flips=flip_rows(options.flips, names, bones),
        stretch=options.stretch,
        root=names.index("pelvis") if "pelvis" in names else bones[0][0],
    )
    moved = np.full(markers.shape, np.nan)
    moved[:, shown] = found - markers[:, shown]
    return markers + _with_neighbours(moved, bones_between(tuple(alignment.names[index] for index in known)))


def _with_neighbours(moves: Floats, bones: Sequence[tuple[int, int]]) -> Floats:
    """``moves`` (F, N, 3) of markers; those that are NaN take the mean of the markers that bones join them to."""
    filled = moves.copy()
    for _ in bones:
        lost = np.flatnonzero(np.isnan(filled).any(axis=(0, 2)))
        before = filled.copy()
        for marker in lost:
            others = [b if a == marker else a for a, b in bones if marker in (a, b)]
            others = [other for other in others if not np.isnan(before[:, other]).any()]
            if others:
                filled[:, marker] = before[:, others].mean(axis=1)
    return np.nan_to_num(filled)


def _posed(
    markers: Floats, names: tuple[str, ...], bones: tuple[tuple[int, int], ...], clip: Motion, options: LiftOptions
) -> tuple[Motion, float]:
    """The skeleton on the markers, and how many times larger it is in its own file."""
    if options.skeleton is None and max(clip.parents) < 0:
        raise ValueError(
            "clip: it has points and no skeleton; name a BVH as lift.skeleton whose rest pose is to be posed"
        )
    if options.fitted:
        own = clip if options.skeleton is None else options.skeleton
        posed = joint_angles(markers, names, clip, skeleton=own)
        skeleton = fit_skeleton(own, markers, names, posed=posed)
        return joint_angles(markers, names, clip, stretch=options.stretch, skeleton=skeleton), 1.0
    if options.skeleton is None:
        return joint_angles(markers, names, clip, stretch=options.stretch), 1.0
    size = _size(options.skeleton, markers, names, bones)
    skeleton = scaled(options.skeleton, 1 / size)
    return joint_angles(markers, names, clip, stretch=options.stretch, skeleton=skeleton), size


def _size(skeleton: Motion, markers: Floats, names: tuple[str, ...], bones: tuple[tuple[int, int], ...]) -> float:
    """How many times larger than the markers a skeleton is: by its legs, so that feet come onto the same floor."""
    rest = rest_pose(skeleton)
    both = [(a, b) for a, b in bones if names[a] in rest.known_markers and names[b] in rest.known_markers]
    legs = [bone for bone in both if names[bone[1]].endswith(("knee", "foot"))] or both
    if not legs:
        return 1.0
    first, second = np.array(legs).T
    at_rest = np.stack([rest.markers([names[place] for place in ends]) for ends in (first, second)])
    own, drawn = at_rest[0] - at_rest[1], markers[:, first] - markers[:, second]
    lengths = [float(np.median(np.linalg.norm(part, axis=2), axis=0).sum()) for part in (own, drawn)]
    return lengths[0] / lengths[1] if min(lengths) > 0 else 1.0


def scaled(motion: Motion, size: float) -> Motion:
    """Return ``motion`` and its rest pose ``size`` times as large."""
    return motion.changed(
        positions=size * motion.positions,
        rest=None if motion.rest is None else size * motion.rest,
        ends={joint: size * np.asarray(end) for joint, end in motion.ends.items()},
    )


def _led(points: Floats, fixed: Floats) -> Floats:
    """``points`` (F, N, 3) at the places where they are ``fixed``, led there and away."""
    targets = planted_targets(points, np.zeros(points.shape[:2], bool), fixed)
    return np.where(np.isfinite(targets), targets, points)


def _kept_in_place(
    motion: Motion, names: tuple[str, ...], planted: Flags, held: Floats, travel: Floats | None
) -> Motion:
    """The skeleton with standing feet that do not slide, and held hands and feet where they are held."""
    ends = [name for name in CHAINS if name in names and {name, *CHAINS[name]} <= {*motion.known_markers}]
    motion = stand_still(motion, {end: planted[:, names.index(end)] for end in ends}, travel=travel)
    ends = [end for end in ends if np.isfinite(held[:, names.index(end)]).any()]
    if not ends:
        return motion
    fixed = held[:, [names.index(end) for end in ends]]
    targets = planted_targets(motion.markers(ends), np.zeros(fixed.shape[:2], bool), fixed)
    return hold_ends(motion, dict(zip(ends, np.moveaxis(targets, 1, 0), strict=True)))
