"""The clips of an experiment, found in a user's folder by their CMU numbers."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pegbar.io.motion import read_motion
from pegbar.scene.body import MARKERS
from pegbar.scene.motion import Motion


def find_clip(data: Path, clip: str) -> Path:
    """Return the file of a CMU clip somewhere under ``data``: a BVH before an AMC; ValueError where there is none."""
    if not data.is_dir():
        raise FileNotFoundError(2, "No such folder", str(data))
    names = (f"cmu_{clip}.bvh", f"{clip}.bvh", f"{clip}.amc")
    for name in names:
        if found := sorted(data.rglob(name)):
            return found[0]
    raise ValueError(f"--data: {data} lacks the CMU clip {clip} ({', '.join(names[:2])} or {names[2]})")


def read_clips(data: Path, clips: Iterable[str]) -> dict[str, Motion]:
    """Read CMU clips that lie under ``data``, all found before the first is read; see `find_clip`."""
    paths = {clip: find_clip(data, clip) for clip in clips}
    return {clip: read_motion(path) for clip, path in paths.items()}


def moving_markers(motion: Motion, step: int = 1) -> NDArray[np.float64]:
    """Return the canonical markers (F, N, 3) in metres of every ``step``-th frame, without an inserted T-pose."""
    places = motion.markers(MARKERS)
    if motion.rest_frame is not None:
        places = np.delete(places, motion.rest_frame, axis=0)
    return places[::step]


def person_height(motion: Motion) -> float:
    """Return the person's height in metres as read; ValueError where it is not known."""
    height = motion.report.height if motion.report is not None else None
    if height is None:
        raise ValueError("motion: want a clip whose person's height is known")
    return height
