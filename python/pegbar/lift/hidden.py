"""Joints that a drawing hides get a place: where the clip is seen, and what the drawing differs from it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


def fill_hidden(
    markers: ArrayLike, visible: ArrayLike, projected: ArrayLike, *, limbs: ArrayLike | None = None
) -> tuple[Floats, Flags]:
    """Place markers that the drawing hides: the projected clip plus what the drawing differs from it.

    A marker's difference is interpolated in time between the frames that show it and held before the first and after
    the last. One that no frame shows takes the mean difference of the markers it is joined to by limbs, or of those
    they are joined to, or of all.

    Parameters
    ----------
    markers : (F, N, 2) float
        Drawn markers in pixels; what is not visible is not looked at and may be NaN.
    visible : (F, N) bool
        False where the drawing hides a marker.
    projected : (F, N, 2) float
        The clip's markers under the registered cameras, in pixels.
    limbs : (V, 2) int, optional
        The limbs' two markers, as indices.

    Returns
    -------
    filled : (F, N, 2) float
        ``markers`` with places for what is hidden.
    guessed : (F, N) bool
        True where the place is not drawn.

    Raises
    ------
    ValueError
        For a wrong shape, a limb's marker that is not there, or a number that is not finite (frame and marker are
        named).

    Examples
    --------
    >>> drawn = [[[10.0, 0]], [[np.nan, np.nan]], [[16.0, 0]]]
    >>> filled, guessed = fill_hidden(drawn, [[True], [False], [True]], [[[9.0, 0]], [[11, 0]], [[13, 0]]])
    >>> filled[1].tolist(), guessed[1].tolist()
    ([[13.0, 0.0]], [True])
    """
    marks = arrays.floats("markers", markers, ("F", "N", 2), allow="any")
    frames, count = marks.shape[:2]
    seen = arrays.flags("visible", visible, (frames, count))
    seen_from = arrays.floats("projected", projected, (frames, count, 2))
    pairs = arrays.integers("limbs", [] if limbs is None else limbs, ("V", 2), low=0, high=max(count - 1, 0))
    wrong = np.argwhere(seen & ~np.isfinite(marks).all(axis=2))
    if len(wrong):
        frame, marker = wrong[0]
        raise ValueError(f"markers: frame {frame}, marker {marker} is visible but has no position")
    differences = np.where(seen[..., None], marks - seen_from, 0)
    moments = np.arange(frames)
    for marker in np.flatnonzero(seen.any(axis=0)):
        shown = seen[:, marker]
        for axis in range(2):
            differences[:, marker, axis] = np.interp(moments, moments[shown], differences[shown, marker, axis])
    _spread(differences, np.asarray(seen.any(axis=0)), pairs)
    return np.where(seen[..., None], marks, seen_from + differences), ~seen


def _spread(differences: Floats, known: Flags, limbs: NDArray[np.int64]) -> None:
    """Give markers (N) that are not ``known`` the mean difference of joined markers, ring by ring, in place."""
    known = known.copy()
    everybody = differences[:, known].mean(axis=1) if known.any() else np.zeros((len(differences), 2))
    joined = np.zeros((len(known), len(known)), bool)
    joined[limbs[:, 0], limbs[:, 1]] = joined[limbs[:, 1], limbs[:, 0]] = True
    while True:
        ring = np.flatnonzero(~known & joined[:, known].any(axis=1))
        if not len(ring):
            break
        for marker in ring:
            differences[:, marker] = differences[:, joined[marker] & known].mean(axis=1)
        known[ring] = True
    differences[:, ~known] = everybody[:, None]
