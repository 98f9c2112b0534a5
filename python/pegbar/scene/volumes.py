"""Moving volumes: a tapered cylinder with round ends for every limb and frame (2010 paper, section 3.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TaperedCylinders:
    """V limbs in F frames: the axis from ``start`` to ``end`` (F, V, 3) and the radii (F, V) there, world metres.

    A limb whose box or markers are not known in a frame is NaN there.
    """

    start: Floats
    end: Floats
    start_radius: Floats
    end_radius: Floats
