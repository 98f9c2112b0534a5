"""Limbs of exact length through noisy marks: Gauss-Newton over whole sequences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

from pegbar.lift.rays import jolt_diagonals

Floats = NDArray[np.float64]
ROUNDS = 6
#: The length is held this much tighter than the marks while iterating; at the end it is exact.
TIGHTER = 5.0
#: Metres: marks are followed no tighter than this while others are noisy.
LEAST_NOISE = 2e-4


@dataclass(frozen=True)
class LimbTracks:
    """What is known of V limbs in F frames before they are made rigid, all in metres.

    ``across`` (V, F, 3) leads from a limb's first marker to the nearest point of its second marker's ray, whose unit
    directions are ``rays`` (V, F, 3); ``clip`` and ``noise`` (V, F) are the clip's depths along the rays and the marks'
    deviation; ``jolts`` and ``doubts`` (V,) the usual sizes of a second difference and of the clip's error.
    """

    across: Floats
    rays: Floats
    clip: Floats
    noise: Floats
    jolts: Floats
    doubts: Floats


def rigid_limbs(tracks: LimbTracks, depths: Floats, lengths: Floats) -> Floats:
    """Return the limbs (V, F, 3), of exactly ``lengths`` (V, F), from ``depths`` (V, F) along the rays as a start.

    Minimises squared mark errors, second differences and, weakly, the distance to the clip's depths, each over its
    variance, by Gauss-Newton on the limbs' lengths. Marks without noise are followed wherever a length allows it.
    """
    limbs = _of_length(tracks.across + depths[..., None] * tracks.rays, lengths)
    if not tracks.noise.any() or limbs.shape[1] < 3:
        return limbs
    noise = np.maximum(tracks.noise, LEAST_NOISE)
    along = tracks.rays[..., :, None] * tracks.rays[..., None, :]
    sure, hold = 1 / noise**2, (TIGHTER / noise) ** 2
    weak = 1 / tracks.doubts[:, None] ** 2
    fixed = sure[..., None, None] * (np.eye(3) - along) + weak[..., None, None] * along
    target = sure[..., None] * tracks.across + (weak * tracks.clip)[..., None] * tracks.rays
    bands = _jolt_bands(limbs.shape[1], tracks.jolts)
    for _ in range(ROUNDS):
        unit = _of_length(limbs, np.ones_like(lengths))
        blocks = fixed + hold[..., None, None] * unit[..., :, None] * unit[..., None, :]
        right = target + (hold * lengths)[..., None] * unit
        limbs = solveh_banded(_with_blocks(bands, blocks), right.ravel(), lower=True).reshape(limbs.shape)
    return _of_length(limbs, lengths)


def _of_length(limbs: Floats, lengths: Floats) -> Floats:
    sizes = np.linalg.norm(limbs, axis=-1)
    scaled: Floats = limbs * (lengths / np.where(sizes > 0, sizes, 1))[..., None]
    return scaled


def _jolt_bands(frames: int, jolts: Floats) -> Floats:
    """Lower bands (7, V F 3) of the limbs' squared second differences over their variances."""
    diagonals = jolt_diagonals(frames)
    diagonals[1, -1:] = diagonals[2, -2:] = 0  # the next limb is another problem
    bands = np.zeros((7, len(jolts) * frames * 3))
    weighted = diagonals[:, None] / jolts[:, None] ** 2
    bands[::3] = np.repeat(weighted.reshape(3, -1), 3, axis=1)
    return bands


def _with_blocks(bands: Floats, blocks: Floats) -> Floats:
    """Add the symmetric (V, F, 3, 3) ``blocks`` along the diagonal."""
    bands = bands.copy()
    flat = blocks.reshape(-1, 3, 3)
    for row in range(3):
        for column in range(row + 1):
            bands[row - column, column::3] += flat[:, row, column]
    return bands
