"""A looping animation in one file that a browser plays: APNG, WebP or GIF."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from numpy.typing import ArrayLike

from pegbar.io.apng import write_apng
from pegbar.io.gif import write_gif
from pegbar.io.webp import write_webp

_SUFFIXES = (".png", ".apng", ".webp", ".gif")


def write_animation(path: str | os.PathLike[str], frames: Iterable[ArrayLike], frame_rate: float) -> None:
    """Write pictures as an animation that repeats for ever, complete or not at all.

    Parameters
    ----------
    path : path
        .png or .apng (APNG, exact), .webp (lossless) or .gif (256 colours, alpha on or off).
    frames : iterable of (H, W, 3|4) uint8
        RGB or straight RGBA pictures of one size, taken as they come.
    frame_rate : float
        Frames a second. Times are whole milliseconds (GIF: hundredths) and do not drift.

    Raises
    ------
    ValueError
        For no frames, frames that differ in size, a wrong rate or suffix.
    OSError
        When the file cannot be written; it names ``path``.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in _SUFFIXES:
        raise ValueError(f"path: want a suffix of {', '.join(_SUFFIXES)}, got {suffix!r}")
    if not 0 < frame_rate < math.inf:
        raise ValueError(f"frame_rate: want frames a second above 0, got {frame_rate}")
    if suffix == ".gif":
        write_gif(path, frames, (duration // 10 for duration in _durations(frame_rate, 10)))
        return
    if suffix in (".png", ".apng"):
        write_apng(path, frames, _durations(frame_rate, 1))
        return
    write_webp(path, frames, _durations(frame_rate, 1))


def _durations(frame_rate: float, step: int) -> Iterator[int]:
    """Milliseconds of each frame, multiples of ``step``, whose sums follow the true times; without end."""
    shown = 0
    for count in itertools.count(1):
        duration = max(round(count * 1000 / frame_rate / step) * step - shown, step)
        shown += duration
        yield duration
