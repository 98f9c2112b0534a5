"""Turns a projected clip's limbs until they point as the drawn ones do (Jain, Sheikh, Hodgins 2009, section 3.4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays

Floats = NDArray[np.float64]


def align_limbs(projected: ArrayLike, drawn: ArrayLike, chains: ArrayLike) -> Floats:
    """Rotate the limbs of a projected clip in the picture until their angles are the drawn ones.

    Jain, Sheikh, Hodgins 2009, section 3.4: from the root outwards every limb keeps its projected length and takes the
    drawn limb's angle; what hangs on it moves along. Time warp the clip first.

    Parameters
    ----------
    projected : (F, N, 2) float
        The clip's markers as the camera sees them, in the picture's units.
    drawn : (F, N, 2) float
        The drawn markers; NaN where a marker is not visible.
    chains : (C, 2) int
        Limbs as (parent, child) markers from the root outwards: those of the upper body in the paper, which leaves
        standing legs alone. Chains may share their first limbs.

    Returns
    -------
    (F, N, 2) float
        The aligned markers. A marker that no limb of ``chains`` ends at stays where it was; a limb whose drawn ends
        coincide or are not visible keeps the clip's angle.

    Raises
    ------
    ValueError
        For a wrong shape or a number that is not finite, a marker index that does not exist, a marker with two
        parents, or a limb that stands before the limb it hangs on.

    Examples
    --------
    >>> align_limbs([[[0, 0], [2, 0]]], [[[5, 5], [5, 6]]], [(0, 1)]).round(6).tolist()
    [[[0.0, 0.0], [0.0, 2.0]]]
    """
    projected = arrays.floats("projected", projected, ("F", "N", 2))
    drawn = arrays.floats("drawn", drawn, projected.shape, allow="nan")
    aligned = projected.copy()
    for parent, child in ordered_pairs("chains", chains, projected.shape[1]):
        limb = projected[:, child] - projected[:, parent]
        target = drawn[:, child] - drawn[:, parent]
        drawn_length = np.linalg.norm(target, axis=1, keepdims=True)
        known = drawn_length > 0  # also false for NaN
        length = np.linalg.norm(limb, axis=1, keepdims=True)
        turned = target * (length / np.where(known, drawn_length, 1))
        aligned[:, child] = aligned[:, parent] + np.where(known, turned, limb)
    return aligned


def ordered_pairs(name: str, pairs: ArrayLike, markers: int) -> list[tuple[int, int]]:
    """Return ``pairs`` once each; refuses a marker with two parents and a limb before the one it hangs on."""
    rows = arrays.integers(name, pairs, ("C", 2), low=0, high=markers - 1).tolist()
    once = list(dict.fromkeys((parent, child) for parent, child in rows))
    used: set[int] = set()
    moved: set[int] = set()
    for parent, child in once:
        if child in moved or child == parent:
            raise ValueError(f"{name}: marker {child} hangs on {'itself' if child == parent else 'two markers'}")
        if child in used:
            raise ValueError(f"{name}: the limb ({parent}, {child}) must stand before the limbs that hang on it")
        moved.add(child)
        used.add(parent)
    return once
