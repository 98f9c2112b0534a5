"""Drawings on film: which pose is seen when, and for how long."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pegbar.align.retime import retime
from pegbar.scene.motion import Motion

Floats = NDArray[np.float64]
Rate = float | Literal["drawings"]


def film_moments(
    holds: Sequence[int], frame_rate: float, *, stepped: bool, rate: Rate, loop: bool
) -> tuple[Floats, Floats]:
    """Return when each written frame is seen (T,), in seconds, and which drawing then, as a fraction (T,).

    Each drawing is held for ``holds`` film frames of ``frame_rate`` a second: the pose steps, or runs on to the next
    drawing. ``rate`` is that of the written frames; "drawings" writes one for each drawing. A ``loop`` has one frame
    more, its beginning again: drawing ``len(holds)``.
    """
    starts = np.concatenate([[0], np.cumsum(holds)]).astype(float)
    last = len(holds) if loop else len(holds) - 1
    if rate == "drawings":
        return starts[: last + 1] / frame_rate, np.arange(last + 1.0)
    count = max(round(starts[-1] * rate / frame_rate), 1)
    # A loop ends where it begins, whatever the rates.
    step = starts[-1] / count if loop else frame_rate / rate
    moments = np.arange(count + 1 if loop else count) * step
    if stepped:
        places = np.searchsorted(starts, moments + 1e-9, side="right") - 1.0
    else:
        places = np.interp(moments, starts, np.arange(len(starts), dtype=float))
    return np.arange(len(moments)) / rate, np.minimum(places, last)


def on_film(
    lifted: Motion,
    holds: Sequence[int],
    frame_rate: float,
    *,
    stepped: bool,
    rate: Rate,
    loop: bool,
    travel: Sequence[float] | Floats = (0.0, 0.0, 0.0),
) -> Motion:
    """Return the motion of the drawings at the frames of `film_moments`; a loop's next turn is ``travel`` metres on.

    With one frame a drawing its rate is the mean one: drawings that are held differently long need `film_moments`.
    """
    _, places = film_moments(holds, frame_rate, stepped=stepped, rate=rate, loop=loop)
    if loop:
        lifted = lifted.changed(
            positions=np.concatenate([lifted.positions, lifted.positions[:1] + np.asarray(travel)]),
            rotations=np.concatenate([lifted.rotations, lifted.rotations[:1]]),
        )
    if rate == "drawings":
        rate = frame_rate / float(np.mean(holds))
    return retime(lifted, places, frame_rate=rate)
