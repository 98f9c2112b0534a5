"""A clip as poses of a puppet's joints, at the times of the pictures."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from pegbar.errors import DegenerateError
from pegbar.puppet.retarget import facing_turn
from pegbar.scene.clip import interpolate
from pegbar.scene.motion import Motion
from pegbar.scene.puppet import Puppet

Floats = NDArray[np.float64]
#: Pictures a second that are enough where no rate is asked for.
USUAL_RATE = 30.0
_HALVES = {"pelvis": "hip", "neck": "shoulder"}


def clip_times(motion: Motion, first: int | None, last: int | None, frame_rate: float | None) -> tuple[Floats, float]:
    """Return the clip's frames (F,), in fractions, at the pictures' times, and the pictures' rate.

    ``first`` and ``last`` count from 0 and are both shown; without them an inserted T-pose is left out. Without
    ``frame_rate`` it is the clip's, or the largest whole part of it that is not above 30 (30 of 120).

    Raises
    ------
    ValueError
        For a range of frames that the clip has not, or a rate that is none.
    """
    count = len(motion.positions)
    start = first if first is not None else 1 if motion.rest_frame == 0 and count > 1 else 0
    end = last if last is not None else count - 2 if motion.rest_frame == count - 1 and count > 1 else count - 1
    if not 0 <= start <= end < count:
        raise ValueError(
            f"frames: the clip has {count}, counted from 1: want a range within 1-{count}, got {start + 1}-{end + 1}"
        )
    if frame_rate is None:
        frame_rate = motion.frame_rate / max(1, math.ceil(motion.frame_rate / USUAL_RATE - 0.01))
    if not 0 < frame_rate < math.inf:
        raise ValueError(f"frame_rate: want pictures a second above 0, got {frame_rate}")
    step = motion.frame_rate / frame_rate
    times: Floats = start + step * np.arange(int((end - start) / step + 1e-6) + 1, dtype=np.float64)
    return times, frame_rate


def clip_markers(puppet: Puppet, motion: Motion, times: ArrayLike) -> Floats:
    """Return where (F, J, 3) the markers are that drive a puppet's joints at ``times`` (F,), in frames of the clip.

    Gaps are bridged straight. Joints that no marker of the clip drives are NaN.

    Raises
    ------
    DegenerateError
        For a marker that is missing in all frames; it names the joint.
    """
    times = np.asarray(times, np.float64)
    known = marker_names(motion)
    wanted = sorted({marker for marker in puppet.drives.values() if marker in known})
    tracks = {marker: _bridged(marker, _track(motion, marker)) for marker in wanted}
    result = np.full((len(times), len(puppet.names), 3), np.nan)
    for joint, name in enumerate(puppet.names):
        marker = puppet.drives.get(name)
        if marker in tracks:
            result[:, joint] = interpolate(tracks[marker][:, None], times)[:, 0]
    return result


def continued(puppet: Puppet, markers: Floats, before: Floats) -> Floats:
    """Return ``markers`` (F, J, 3) turned and moved so that they go on where ``before`` (G, J, 3) ends.

    The person faces the same way; the lowest joint is on the same floor (the fifth percentile of its heights).
    """
    turn = facing_turn(puppet, markers[:1], before[-1])[0]
    turned = Rotation.from_euler("y", -turn, degrees=True).apply(markers.reshape(-1, 3)).reshape(markers.shape)
    floors = [np.percentile(np.nanmin(clip[:, :, 1], axis=1), 5) for clip in (turned, before)]
    root = int(np.flatnonzero(puppet.parents < 0)[0])
    move = before[-1, root] - turned[0, root]
    move[1] = floors[1] - floors[0]
    moved: Floats = turned + move
    return moved


def marker_names(motion: Motion) -> Sequence[str]:
    """The markers that a clip has, with a pelvis or neck in the middle between hips or shoulders."""
    known = motion.known_markers
    halves = [
        middle
        for middle, half in _HALVES.items()
        if middle not in known and all(f"{side}_{half}" in known for side in ("left", "right"))
    ]
    return (*known, *halves)


def _track(motion: Motion, marker: str) -> Floats:
    if marker in motion.known_markers:
        return motion.markers([marker])[:, 0]
    middle: Floats = motion.markers([f"{side}_{_HALVES[marker]}" for side in ("left", "right")]).mean(axis=1)
    return middle


def _bridged(marker: str, track: Floats) -> Floats:
    """The points (F, 3) with straight lines through gaps, held beyond the ends."""
    known = np.flatnonzero(np.isfinite(track).all(axis=1))
    if not len(known):
        raise DegenerateError(f"markers: the clip has no position for {marker} in any frame")
    if len(known) == len(track):
        return track
    places = np.arange(len(track))
    return np.stack([np.interp(places, known, track[known, axis]) for axis in range(3)], axis=1)
