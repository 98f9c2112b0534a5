"""Feet on the ground: low and slow, with hysteresis. The canonical foot is the ankle, so its resting height counts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import label

from pegbar import arrays

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
FEET = ("left_foot", "right_foot")
#: How far above the floor an ankle can rest at all, in metres; it rests higher on tiptoe.
HIGHEST_REST = 0.16
#: A step begins where the ankle is slower (m/s) and less above its resting height (m) than the first pair, and lasts
#: while it is below the second. Ankles of walkers and runners fall below 0.2 m/s while the sole is flat, and are at 2
#: to 5 m/s in the air; floors of clips drift by some 5 cm.
BEGIN = (0.3, 0.06)
LAST = (0.6, 0.08)
#: Speed is measured over about so many seconds, so that the noise of the capture does not count as speed.
SPAN = 1 / 30


def foot_contacts(markers: ArrayLike, names: Sequence[str], frame_rate: float, floor: float | None = None) -> Flags:
    """Find the frames in which a foot stands flat on the ground.

    Parameters
    ----------
    markers : (F, N, 3) float
        A clip's canonical markers, metres, y up; NaN where missing.
    names : sequence of N str
        The markers' names, of which "left_foot" and "right_foot" (ankles) are looked at.
    frame_rate : float
        Frames a second.
    floor : float, optional
        Height of the floor in metres: ankles that come no nearer to it than 16 cm never stand on it. None: the ground
        is where the feet are lowest.

    Returns
    -------
    (F, 2) bool
        Left, right.

    Raises
    ------
    ValueError
        For a wrong shape, a foot that is not among the names, or a frame rate that is not positive.

    Examples
    --------
    >>> clip = np.zeros((5, 2, 3))
    >>> clip[:, 1, 1] = [0, 0, 0.3, 0.6, 0.9]
    >>> foot_contacts(clip, ["left_foot", "right_foot"], 24).tolist()
    [[True, True], [True, False], [True, False], [True, False], [True, False]]
    """
    feet = _feet(markers, names)
    if not (np.isfinite(frame_rate) and frame_rate > 0):
        raise ValueError(f"frame_rate: want a positive number, got {frame_rate}")
    speeds = _speeds(feet, frame_rate)
    contacts = np.zeros(speeds.shape, bool)
    for foot in range(2):
        heights, speed = feet[:, foot, 1], speeds[:, foot]
        rest = _rest_height(heights, speed)
        if floor is not None and rest > floor + HIGHEST_REST:
            continue
        begin, last = ((speed < fast) & (heights < rest + high) for fast, high in (BEGIN, LAST))
        contacts[:, foot] = runs_with(last, begin)
    return contacts


def ankle_heights(markers: ArrayLike, names: Sequence[str], contacts: ArrayLike) -> Floats:
    """Return the median heights (2,) in metres of the ankles in their ``contacts`` (F, 2); NaN without any."""
    heights = _feet(markers, names)[..., 1]
    standing = arrays.flags("contacts", contacts, (len(heights), 2))
    return np.array([np.median(h[s]) if s.any() else np.nan for h, s in zip(heights.T, standing.T, strict=True)])


def foot_places(names: Sequence[str]) -> list[int]:
    """Where the left and the right foot are among ``names``; ValueError where one is not."""
    for foot in FEET:
        if foot not in names:
            raise ValueError(f"names: want {foot} among them, got {', '.join(names)}")
    return [list(names).index(foot) for foot in FEET]


def runs_with(allowed: Flags, wanted: Flags) -> Flags:
    """Hysteresis: the runs (F,) of ``allowed`` frames that hold a frame of ``wanted``."""
    runs, count = label(allowed)
    chosen = np.zeros(count + 1, bool)
    chosen[runs[allowed & wanted]] = True
    found: Flags = chosen[runs]
    return found


def _feet(markers: ArrayLike, names: Sequence[str]) -> Floats:
    places = foot_places(names)
    feet: Floats = arrays.floats("markers", markers, ("F", len(names), 3), allow="nan")[:, places]
    return feet


def _speeds(feet: Floats, frame_rate: float) -> Floats:
    """Speeds (F, 2) in m/s by central differences, one-sided at the ends; one frame stands still."""
    frames = np.arange(len(feet))
    reach = max(1, round(frame_rate * SPAN / 2))
    before, after = np.maximum(frames - reach, 0), np.minimum(frames + reach, max(len(feet) - 1, 0))
    moved = np.linalg.norm(feet[after] - feet[before], axis=2)
    speeds: Floats = moved * (frame_rate / np.maximum(after - before, 1))[:, None]
    return speeds


def _rest_height(heights: Floats, speed: Floats) -> float:
    """The height at which a slow ankle is found, the lower fifth of it; infinite where the foot is never slow."""
    slow = heights[(speed < BEGIN[0]) & np.isfinite(heights)]
    return float(np.quantile(slow, 0.2)) if len(slow) else np.inf
