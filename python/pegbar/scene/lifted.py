"""A drawn sequence in 3D: its markers, and a skeleton posed on them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.motion import Motion

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Lifted:
    """What `pegbar lift` makes of F drawings.

    ``markers`` (F, N, 3) metres of ``names``; ``motion`` the skeleton posed on them, F drawings, as large as the drawn
    figure; ``planted`` (F, N) the markers that stand; ``travel`` (3,) how far the next turn of a loop is from this one;
    ``size`` how many times larger the skeleton is in its own file.
    """

    names: tuple[str, ...]
    bones: tuple[tuple[int, int], ...]
    markers: Floats
    planted: NDArray[np.bool_]
    motion: Motion
    travel: Floats = field(default_factory=lambda: np.zeros(3))
    size: float = 1.0
