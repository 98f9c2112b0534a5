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
#: Camera moves are slow: kinds are judged with so many times the window.
SLOWNESS = 4
#: A pan must explain held-out frames so much better than standing still. An uneven warp lets the figure run ahead and
#: lag behind, which looks like a pan and was seen to be worth up to 1.2; pans and tilts gave 1.27 and more.
PAN_GAIN = 1.25
#: A free camera must explain them so much better than a pan, and so much better than standing still. Pans came
#: out as free at 1.08 to 1.2 where the warp was bad, dollies gave 1.17 and more, the cameras that follow 1.02 and more.
FREE_GAIN, FREE_GAIN_OVER_STATIC = 1.1, 1.15
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
    free = fit(shot, "free", slow, (static,))
    pan = fit(shot, "pan", slow, (static, free))
    fits = {"static": static, "pan": pan, "free": free}
    errors = {mode: held_out_errors(shot, fits[mode], settings, free.noise) for mode in MODES}
    mode = simplest(errors)
    found = static if mode == "static" else fit(shot, mode, settings, (fits[mode],))
    return Choice(found, errors)


def simplest(errors: dict[str, HeldOut]) -> str:
    """Return the simplest mode by the held-out errors of all three."""
    static, pan, free = (errors[mode] for mode in MODES)
    if pan.gain_of(free) > FREE_GAIN and static.gain_of(free) > FREE_GAIN_OVER_STATIC:
        return "free"
    return "pan" if static.gain_of(pan) > PAN_GAIN else "static"


def held_out_runs(frames: int, window: int) -> list[NDArray[np.intp]]:
    """Return lists of frames to hold out: alternate runs of at most ``window`` frames, never the first or last one."""
    run = max(1, min(window, frames // 5))
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
