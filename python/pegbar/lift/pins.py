"""Markers that stand or are held, and rings of limbs: exact lengths around fixed points, with the least motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label, mean

from pegbar.lift.projection import known

Floats = NDArray[np.float64]
#: Depth, which only foreshortening tells, gives way this many times more than the drawn place (as deviations).
DEPTH_GIVES = 3.0
#: A foot that leaves or reaches its place does so over this many frames.
TAPER = 4
ROUNDS = 30
#: Metres to which lengths are met.
EXACT = 1e-11
#: Frames worked at a time, for memory.
CHUNK = 512


def planted_targets(points: Floats, planted: NDArray[np.bool_], held: Floats | None) -> Floats:
    """Return where markers have to be, (F, N, 3), NaN where they are free.

    A marker stays at its mean place through every run of frames in which it is ``planted`` (F, N), or where ``held``
    (F, N, 3) puts it; its ``points`` (F, N, 3) just before and after are led there gradually.
    """
    fixed = np.full(points.shape, np.nan)
    for marker in np.flatnonzero(planted.any(axis=0)):
        runs, count = label(planted[:, marker])
        places = [mean(points[:, marker, axis], runs, np.arange(1, count + 1)) for axis in range(3)]
        fixed[runs > 0, marker] = np.transpose(places)[runs[runs > 0] - 1]
    if held is not None:
        fixed = np.where(np.isfinite(held), held, fixed)
    targets = fixed.copy()
    for marker in np.flatnonzero(known(fixed).any(axis=0)):
        away, (nearest,) = distance_transform_edt(~known(fixed[:, marker]), return_indices=True)
        near = (away > 0) & (away <= TAPER)
        steps = (fixed - points)[nearest[near], marker]
        targets[near, marker] = points[near, marker] + (1 - away[near] / (TAPER + 1))[:, None] * steps
    return targets


def meet_lengths(points: Floats, rays: Floats, limbs: NDArray[np.int64], lengths: Floats, targets: Floats) -> Floats:
    """Return ``points`` (F, N, 3) moved least so that ``limbs`` (C, 2) have ``lengths`` (F, C) and targets are met.

    Newton's method on the lengths; a move along the unit ``rays`` (F, N, 3) counts less than one across them. Where
    targets are farther apart than limbs reach, the targets are kept.
    """
    met = points.copy()
    for start in range(0, len(points), CHUNK):
        part = slice(start, start + CHUNK)
        met[part] = _meet(points[part], rays[part], limbs, lengths[part], targets[part])
    return met


def _meet(points: Floats, rays: Floats, limbs: NDArray[np.int64], lengths: Floats, targets: Floats) -> Floats:
    pinned = known(targets)
    met: Floats = np.where(pinned[..., None], targets, points)
    give = np.eye(3) + (DEPTH_GIVES**2 - 1) * rays[..., :, None] * rays[..., None, :]
    give = np.where(pinned[..., None, None], 0.0, give)
    first, second = limbs.T
    # How each limb's length pulls at each marker: +1 at its first, -1 at its second.
    pulls = np.zeros((points.shape[1], len(limbs)))
    pulls[first, np.arange(len(limbs))], pulls[second, np.arange(len(limbs))] = 1, -1
    for _ in range(ROUNDS):
        apart = met[:, second] - met[:, first]
        sizes = np.maximum(np.linalg.norm(apart, axis=-1), 1e-12)
        wrong = sizes - lengths
        if np.abs(wrong).max(initial=0) < EXACT:
            break
        unit = apart / sizes[..., None]
        slopes = pulls[None, :, :, None] * unit[:, None]
        moves = np.einsum("fnij,fncj->fnci", give, slopes)
        matrix = np.einsum("fnci,fndi->fcd", slopes, moves) + 1e-12 * np.eye(len(limbs))
        shares = np.linalg.solve(matrix, wrong[..., None])[..., 0]
        met += np.einsum("fc,fnci->fni", shares, moves)
    return met
