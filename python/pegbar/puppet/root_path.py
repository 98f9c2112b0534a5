"""Where the drawn figure is in each frame: on the floor like the clip's, in place or travelling, the camera with it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

Floats = NDArray[np.float64]
#: Whether the figure goes where the clip goes.
TRAVELS = ("auto", "in-place", "travelling")
# Metres within which the root of a clip stays that is no walk: its steps aside are part of the movement.
_ROOM = 0.75
# Seconds over which a following camera smooths the figure's way.
_LAG = 0.5


def ground_poses(joints: Floats, clip: Floats, drawn: Floats, pose: Floats, scale: float) -> Floats:
    """Return poses (F, J, 3) raised or lowered so that the lowest joint stands as high as the clip's.

    Heights over the floor are the clip's times ``scale``; the floor is where ``drawn`` (J, 3) stands when the clip
    stands as in ``pose`` (J, 3). ``joints`` (F, J, 3) are the drawn figure's, ``clip`` (F, J, 3) the clip's markers.
    """
    floor = drawn[:, 1].min() - scale * np.nanmin(pose[:, 1])
    wanted = floor + scale * np.nanmin(clip[:, :, 1], axis=1)
    lift = wanted - joints[:, :, 1].min(axis=1)
    result: Floats = joints + lift[:, None, None] * np.array([0.0, 1.0, 0.0])
    return result


def horizontal_path(roots: Floats, origin: Floats, scale: float, travel: str) -> Floats:
    """Return how far (F, 3) the figure has gone from where it was drawn, level, in metres.

    ``roots`` (F, 3) are the clip's, ``origin`` (3,) the root of the pose as drawn; ``travel`` "in-place" stays,
    "travelling" goes along, times ``scale``, and "auto" goes along where the whole way is shorter than a step.
    """
    if travel not in TRAVELS:
        raise ValueError(f"travel: want one of {', '.join(TRAVELS)}, got {travel!r}")
    level = np.array([1.0, 0.0, 1.0])
    path: Floats = (roots - origin) * level * scale
    extent = np.linalg.norm(np.ptp(roots[:, [0, 2]], axis=0)) if len(roots) else 0.0
    if travel == "in-place" or (travel == "auto" and extent > _ROOM):
        return np.zeros_like(path)
    # A short way of its own may lie far from the frame that the picture was recognised in.
    return path - path[0] if travel == "auto" else path


def follow(path: Floats, frame_rate: float) -> Floats:
    """Return where (F, 3) a following camera goes: the figure's path, smoothed over half a second."""
    if len(path) < 2:
        return path.copy()
    smooth: Floats = gaussian_filter1d(path, max(_LAG * frame_rate / 2, 1e-6), axis=0, mode="nearest")
    return smooth
