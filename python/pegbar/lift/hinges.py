"""Knees and elbows: joints that in the clip bend to one side alone rule out one sign of a limb's depth.

Foreshortening leaves open whether a limb points towards the camera or away. Where the time-aligned clip is on the other
foot its sign is wrong, and a shin that follows it breaks the knee. No joint's name is needed for this: that a joint is
a hinge is seen from the clip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from pegbar.lift.turning import unit

Floats = NDArray[np.float64]
#: A joint's axis is the mean over about so many frames to each side: a body that turns carries its axes along.
WINDOW = 8.0
#: A hinge's bends agree on their side to this part, and bend (sine) at least so far in a tenth of the frames: backs,
#: which hardly bend, go to either side.
AGREE, BENDS = 0.8, 0.35
#: So far to the wrong side (sine) a knee is straight rather than broken.
STRAIGHT = 0.05


@dataclass(frozen=True)
class Hinge:
    """The unit ``axes`` (F, 3) about which a joint bends, and in which frames (F,) it is ``steady``."""

    axes: Floats
    steady: NDArray[np.bool_]


def hinge(upper: Floats, lower: Floats) -> Hinge | None:
    """Return the hinge between a clip's limbs ``upper`` and ``lower`` (F, 3), or None where the joint is none."""
    normals = np.cross(unit(upper), unit(lower))
    sizes = np.linalg.norm(normals, axis=1)
    if not len(sizes) or np.quantile(sizes, 0.9) < BENDS:
        return None
    mean = gaussian_filter1d(normals, WINDOW, axis=0, mode="nearest")
    agreed = np.linalg.norm(mean, axis=1) > AGREE * gaussian_filter1d(sizes, WINDOW, mode="nearest")
    return Hinge(unit(mean), agreed)


def breaks(joint: Hinge, upper: Floats, lower: Floats, other: Floats) -> NDArray[np.bool_]:
    """Return in which frames (F,) the limb ``lower`` breaks the joint and ``other`` does not, both after ``upper``."""

    def bend(limb: Floats) -> Floats:
        sine: Floats = np.sum(np.cross(unit(upper), unit(limb)) * joint.axes, axis=1)
        return sine

    broken: NDArray[np.bool_] = joint.steady & (bend(lower) < -STRAIGHT) & (bend(other) > 0)
    return broken
