"""The simplest camera that explains a shot: kinds are judged by frames that their fit did not see.

A free camera always fits closer, since it swallows what is wrong with the drawings or with the warp. What it makes up
for one frame does not foretell others, though, while a real move does. So runs of frames are held out, the camera goes
smoothly through the gap, and the marks' distances there decide.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pegbar.align.camera_fit import Fit, Settings, fit, refit
from pegbar.align.camera_terms import Shot, huber, reprojection

#: Kinds of camera, simplest first.
MODES = ("static", "pan", "free")
#: Whether the camera moves is judged with so many times the window: an uneven warp lets the figure run ahead and lag
#: behind, which looks like a quick pan there and back, while real moves are slow.
SLOWNESS = 4
#: A moving camera must explain held-out frames so much better than a still one. Warped clips before still cameras gave
#: 0.93 to 1.12, cameras that moved 1.21 and more.
MOVE_GAIN = 1.16
#: A free camera must explain them so much better than a pan, with the window itself. Cameras that turned in their place
#: gave up to 1.03, cameras that followed a walk or came nearer 1.15 and more.
FREE_GAIN = 1.08
#: Marks count linearly beyond so many times the freest fit's noise.
_KNEE = 4.0


class HeldOut(NamedTuple):
    """RMS distances in pixels of marks in held-out frames: as they are, and without each mark's mean offset.

    The mean offset over a shot is mostly drawn proportions, which no camera explains; without it real moves show
    better. As they are, distances show a view that is wrong throughout.
    """

    distance: float
    centred: float

    def gain_of(self, other: HeldOut) -> float:
        """How many times smaller the other's errors are, by the measure that tells more."""
        pairs = zip(self, other, strict=True)
        return max((mine / theirs if theirs > 0 else float(mine > 0)) for mine, theirs in pairs)


class Choice(NamedTuple):
    """The chosen fit, and the held-out errors of every mode that was judged."""

    fit: Fit
    held_out: dict[str, HeldOut]


def choose(shot: Shot, settings: Settings) -> Choice:
    """Return the simplest mode that explains ``shot`` within its noise."""
    static = fit(shot, "static", settings)
    if len(shot.marks) < 3:
        return Choice(static, {"static": HeldOut(static.noise, static.noise)})
    slow = replace(settings, window=SLOWNESS * settings.window)
    drifting = fit(shot, "free", slow, (static,))
    errors = {
        "static": held_out_errors(shot, static, settings, drifting.noise),
        "free": held_out_errors(shot, drifting, settings, drifting.noise),
    }
    if not errors["static"].gain_of(errors["free"]) > MOVE_GAIN:
        return Choice(static, errors)
    free = fit(shot, "free", settings, (drifting,))
    pan = fit(shot, "pan", settings, (static, free))
    for found in (pan, free):
        errors[found.mode] = held_out_errors(shot, found, settings, free.noise)
    return Choice(free if errors["pan"].gain_of(errors["free"]) > FREE_GAIN else pan, errors)


def held_out_runs(frames: int, window: int) -> list[NDArray[np.intp]]:
    """Return lists of frames to hold out: alternate runs of half a ``window`` at most, never the first or last one."""
    run = max(1, min((window + 1) // 2, frames // 5))
    index = np.arange(frames)
    inside = (index >= run) & (index < frames - run)
    halves = [np.flatnonzero(inside & ((index // run) % 2 == odd)) for odd in (1, 0)]
    return [half for half in halves if len(half)]


def held_out_errors(shot: Shot, found: Fit, settings: Settings, noise: float) -> HeldOut:
    """Return the errors of the marks in frames that ``found``'s camera is solved without; far marks count linearly."""
    plain, centred, count = 0.0, 0.0, 0
    for frames in held_out_runs(len(shot.marks), settings.window):
        offsets = reprojection(shot, refit(shot, found, settings, frames))
        usual = offsets.sum(axis=0) / np.maximum(shot.seen.sum(axis=0), 1)[:, None]
        seen = shot.seen[frames]
        plain += _far_linear(offsets[frames][seen], noise)
        centred += _far_linear((offsets - usual)[frames][seen], noise)
        count += int(seen.sum())
    return HeldOut(*(float(np.sqrt(total / max(count, 1))) for total in (plain, centred)))


def _far_linear(offsets: NDArray[np.float64], noise: float) -> float:
    return float(huber(np.sum(offsets**2, axis=-1), _KNEE * max(noise, 1e-9)).sum())
