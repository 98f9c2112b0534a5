"""A skeleton in motion: joint positions and rotations per frame, in metres, Y up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Motion:
    """A clip with F frames and J joints.

    ``parents`` holds a joint's parent or -1; ``positions`` (F, J, 3) float are world metres, ``rotations``
    (F, J, 3, 3) float take joint axes to world axes; ``frame_rate`` is frames a second. ``rest_frame`` is the index
    of an inserted T-pose, or None.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    positions: NDArray[np.float64]
    rotations: NDArray[np.float64]
    frame_rate: float
    rest_frame: int | None = None
