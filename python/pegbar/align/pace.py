"""The pace of a retimed clip: drawings' holds as film frames, and how steadily the root travels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.align.retime import sample_markers
from pegbar.align.timewarp import TimeWarp

Floats = NDArray[np.float64]


def film_times(times: ArrayLike, holds: ArrayLike, *, stepped: bool = True) -> Floats:
    """Spread the times of drawings over the film frames that they are held for.

    Parameters
    ----------
    times : (F,) float
        The clip frame of each drawing, as `time_warp` gives it.
    holds : (F,) int
        How many film frames each drawing is shown, 1 or more: all 2 for animation on twos.
    stepped : bool
        The clip waits while a drawing is held, as the drawn figure does. False: it runs on evenly from drawing to
        drawing, and stays in the last one's hold.

    Returns
    -------
    (sum of holds,) float
        The clip frame of each film frame.

    Raises
    ------
    ValueError
        For a wrong shape or dtype, a number that is not finite, or a hold under 1.

    Examples
    --------
    >>> film_times([0.0, 3.0, 4.0], [2, 1, 2]).tolist()
    [0.0, 0.0, 3.0, 4.0, 4.0]
    >>> film_times([0.0, 3.0, 4.0], [2, 1, 2], stepped=False).tolist()
    [0.0, 1.5, 3.0, 4.0, 4.0]
    """
    drawn = arrays.floats("times", times, ("F",))
    lengths = arrays.integers("holds", holds, (len(drawn),), low=1)
    if stepped or not len(drawn):
        return np.repeat(drawn, lengths)
    starts = np.cumsum(lengths) - lengths
    running: Floats = np.interp(np.arange(lengths.sum()), starts, drawn)
    return running


class RootSpeeds(NamedTuple):
    """Speeds over the ground in metres a second: of the clip, of its warped frames, and of its smoothed times."""

    clip: Floats
    warped: Floats
    smoothed: Floats

    def __str__(self) -> str:
        lines = ["            min    max    RMS  (m/s)"]
        for name, speeds in zip(("clip", "warped", "smoothed"), self, strict=True):
            worth = (speeds.min(), speeds.max(), np.sqrt(np.mean(speeds**2))) if speeds.size else ()
            lines.append(f"{name:9}" + "".join(f"{value:7.2f}" for value in worth))
        return "\n".join(lines)


def root_speeds(
    root: ArrayLike, warp: TimeWarp, *, clip_rate: float, drawn_rate: float, holds: ArrayLike | None = None
) -> RootSpeeds:
    """Speeds of a clip's root as captured, warped by whole frames, and warped by smoothed times.

    Parameters
    ----------
    root : (G, 3) float
        The root's places in metres, Y up: the columns of the warp's cost.
    warp : TimeWarp
        The alignment with the drawing.
    clip_rate, drawn_rate : float
        Frames a second of the clip and of the film.
    holds : (F,) int, optional
        How many film frames each drawing is shown; 1 where None.

    Returns
    -------
    RootSpeeds
        ``clip`` (G - 1,), ``warped`` and ``smoothed`` (F - 1,); as text a table of least, greatest and RMS.

    Raises
    ------
    ValueError
        For a wrong shape or dtype, a number that is not finite, or a rate or hold that is not positive.

    Examples
    --------
    >>> from pegbar import time_warp
    >>> places = np.outer(np.arange(5), [0.1, 0, 0])
    >>> speeds = root_speeds(places, time_warp(1.0 - np.eye(5)), clip_rate=24, drawn_rate=24)
    >>> speeds.smoothed.round(3).tolist()
    [2.4, 2.4, 2.4, 2.4]
    """
    places = arrays.floats("root", root, ("G", 3))[:, None]
    rates = arrays.floats("clip_rate, drawn_rate", [clip_rate, drawn_rate], (2,))
    ones = np.ones(len(warp.times), np.int64)
    lengths = ones if holds is None else arrays.integers("holds", holds, (len(ones),), low=1)
    if not (rates > 0).all():
        raise ValueError(f"clip_rate, drawn_rate: want positive rates, got {rates.tolist()}")

    def speeds(track: Floats, rate: Floats) -> Floats:
        return np.asarray(np.linalg.norm(np.diff(track[:, 0, ::2], axis=0), axis=1) * rate, np.float64)

    drawn = rates[1] / lengths[:-1]
    warped, smoothed = (sample_markers(places, times) for times in (warp.frames, warp.times))
    return RootSpeeds(speeds(places, rates[0]), speeds(warped, drawn), speeds(smoothed, drawn))
