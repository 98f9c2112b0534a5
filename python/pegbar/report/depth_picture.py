"""A depth map as a picture to look at."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def depth_picture(depth: NDArray[np.float32], near: float, far: float) -> NDArray[np.uint8]:
    """Return ``depth`` (H, W) as an (H, W, 4) uint8 picture: ``near`` red, ``far`` blue, no depth transparent.

    ``near`` and ``far`` are metres; keep them for a whole shot and the colours can be compared between frames.
    """
    import cv2

    known = np.isfinite(depth)
    span = max(far - near, 1e-9)
    level = np.clip((far - np.where(known, depth, far)) / span, 0, 1)
    colors = cv2.applyColorMap(np.rint(level * 255).astype(np.uint8), cv2.COLORMAP_TURBO)
    return np.dstack([colors[..., ::-1], known.astype(np.uint8) * 255])
