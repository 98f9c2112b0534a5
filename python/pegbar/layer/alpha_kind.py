"""Whether a render's colours are multiplied by its alpha, told by its soft edges."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
# So many half-covered pixels beside opaque ones tell something.
_ENOUGH = 30
# One explanation must be so much better than the other.
_BETTER = 0.7


def alpha_kind(pictures: Iterable[Floats]) -> Literal["premultiplied", "straight"] | None:
    """Return how the colours of linear RGBA ``pictures`` (H, W, 4) are stored, None where their edges do not tell.

    A half-covered pixel beside an opaque one has its colour if alpha is straight, and alpha times it if not.
    """
    count, straight, multiplied = 0, 0.0, 0.0
    for picture in pictures:
        alpha, colors = picture[..., 3], np.nan_to_num(picture[..., :3])
        opaque = (alpha > 0.99).astype(np.float32)
        near = cv2.blur(opaque, (5, 5))
        around = cv2.blur(colors * opaque[..., None], (5, 5)) / np.maximum(near, 1e-6)[..., None]
        edge = (alpha > 0.1) & (alpha < 0.9) & (near > 0) & (around.max(axis=2) > 1e-3)
        own, beside, share = colors[edge], around[edge], alpha[edge][:, None]
        count += int(edge.sum())
        straight += float(np.abs(own - beside).sum())
        multiplied += float(np.abs(own - share * beside).sum())
    if count < _ENOUGH:
        return None
    if multiplied < _BETTER * straight:
        return "premultiplied"
    return "straight" if straight < _BETTER * multiplied else None
