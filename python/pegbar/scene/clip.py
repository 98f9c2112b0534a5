"""A clip as the search wants it: the canonical markers at an even rate, and where its frames are in the file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.scene.body import MARKERS
from pegbar.scene.motion import Motion

Floats = NDArray[np.float64]
#: Frames a second that clips are searched at; between them the markers run straight.
RATE = 30.0
#: Markers without which a clip cannot be compared with a drawing.
NEEDED = tuple(name for name in MARKERS if name.split("_")[0] in ("left", "right"))
# Markers missing for longer than this, in seconds, stay missing.
_GAP = 0.25


@dataclass(frozen=True, eq=False)
class Clip:
    """The canonical markers of a motion clip at an even rate.

    Attributes
    ----------
    name : str
        What to call it: its path in the folder of clips.
    markers : (G, 16, 3) float32
        World metres, Y up, in the order of `pegbar.scene.body.MARKERS`; NaN where a marker is missing.
    rate : float
        Frames of ``markers`` a second.
    frame_rate : float
        Frames of the file a second.
    first : int
        The file's frame at ``markers[0]``; an inserted T-pose before it is left out.
    frames : int
        How many frames the file has.
    """

    name: str
    markers: NDArray[np.float32]
    rate: float
    frame_rate: float
    first: int
    frames: int

    @classmethod
    def from_motion(cls, name: str, motion: Motion, *, rate: float = RATE) -> Clip:
        """Return the clip of ``motion``: its markers without an inserted T-pose, gaps of a quarter second filled.

        Raises
        ------
        ValueError
            Where the motion lacks joints without which it cannot be compared, or has no frame.
        """
        known = motion.known_markers
        missing = [marker for marker in NEEDED if marker not in known]
        if missing:
            raise ValueError(f"no {missing[0]}" + (f" and {len(missing) - 1} more joints" if missing[1:] else ""))
        found = [name for name in MARKERS if name in known]
        markers = np.full((len(motion.positions), len(MARKERS), 3), np.nan)
        markers[:, [MARKERS.index(name) for name in found]] = motion.markers(found)
        _complete(markers)
        first, rest = 0, motion.rest_frame
        if rest is not None and rest > 0:
            markers[rest] = np.nan
        elif rest == 0:
            first, markers = 1, markers[1:]
        if not len(markers):
            raise ValueError("no frames")
        _fill_gaps(markers, round(_GAP * motion.frame_rate))
        seconds = (len(markers) - 1) / motion.frame_rate
        times = np.arange(int(seconds * rate + 1e-6) + 1) * (motion.frame_rate / rate)
        even = interpolate(markers, times).astype(np.float32)
        return cls(name, even, rate, motion.frame_rate, first, len(motion.positions))

    @property
    def seconds(self) -> float:
        """How long the clip is."""
        return (len(self.markers) - 1) / self.rate

    def file_frames(self, times: ArrayLike) -> Floats:
        """The file's frames, in fractions, at ``times`` (...) in frames of ``markers``."""
        return self.first + np.asarray(times, np.float64) * (self.frame_rate / self.rate)

    def at(self, frames: ArrayLike) -> Floats:
        """The markers (F, 16, 3) at the file's ``frames`` (F,), which may be fractions."""
        frames = arrays.floats("frames", frames, ("F",))
        return interpolate(self.markers, (frames - self.first) * (self.rate / self.frame_rate))


def interpolate(markers: NDArray[np.floating], times: ArrayLike) -> Floats:
    """The markers (F, N, 3) at ``times`` (F,) in frames, straight between frames and held beyond the ends."""
    times = np.clip(np.asarray(times, np.float64), 0, len(markers) - 1)
    before = np.minimum(times.astype(np.intp), max(len(markers) - 2, 0))
    after = np.minimum(before + 1, len(markers) - 1)
    part = (times - before)[:, None, None]
    # A missing frame that has no share must not spoil one that has all.
    start, end = markers[before].astype(np.float64), markers[after].astype(np.float64)
    return np.where(part == 0, start, np.where(part == 1, end, start + part * (end - start)))


def _complete(markers: Floats) -> None:
    """Put a missing pelvis or neck into the middle between hips or shoulders, in place."""
    for middle, joint in (("pelvis", "hip"), ("neck", "shoulder")):
        place = MARKERS.index(middle)
        sides = markers[:, [MARKERS.index(f"left_{joint}"), MARKERS.index(f"right_{joint}")]].mean(axis=1)
        markers[:, place] = np.where(np.isnan(markers[:, place]), sides, markers[:, place])


def _fill_gaps(markers: Floats, longest: int) -> None:
    """Draw straight lines through gaps of at most ``longest`` frames, in place."""
    for marker in range(markers.shape[1]):
        points = markers[:, marker]
        known = np.flatnonzero(np.isfinite(points).all(axis=1))
        for gap in np.flatnonzero((np.diff(known) > 1) & (np.diff(known) <= longest + 1)):
            start, end = known[gap], known[gap + 1]
            share = (np.arange(start + 1, end) - start)[:, None] / (end - start)
            points[start + 1 : end] = points[start] + share * (points[end] - points[start])
