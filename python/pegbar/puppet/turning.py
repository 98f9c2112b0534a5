"""How far a performing figure turns: a picture shows one side of it (beside Hornung et al. 2007, s7).

Turned by 90 degrees a picture is an edge, and what is left of the trunk bulges between shoulders that have come
together. So the figure turns with the clip at first, and less and less beyond. Where the clip turns on, to the other
side, the figure turns over quickly, and is seen mirrored.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
# Degrees up to which the figure turns as the clip does, and by which it turns more at most.
_FREE, _REST = 25.0, 25.0
# Degrees away from a side, seen flat, at which the figure turns over to the other one: past the edge, so that a clip
# that stays there does not make it turn to and fro.
_OVER = 115.0
# Seconds that turning over takes, about.
_QUICK = 0.2


def shown_turn(turned: Floats, frame_rate: float) -> Floats:
    """Return by how much (F,) the figure turns where the clip turns by ``turned`` (F,), both in degrees, unwrapped.

    It is the same up to 25 degrees either side of the drawn view and of its mirror image, and never 50 or more off.
    """
    side = np.empty(len(turned))
    now = 180.0 * round(float(turned[0]) / 180) if len(turned) else 0.0
    for frame, angle in enumerate(turned.tolist()):
        if abs(angle - now) > _OVER:
            now = 180.0 * round(angle / 180)
        side[frame] = now
    shown = side + _limited(turned - side)
    over = np.flatnonzero(np.diff(side)) + 1
    if not len(over):
        return shown
    # What is jumped in turning over is taken out, and put back smoothly.
    jumps = np.zeros(len(turned))
    jumps[over] = shown[over] - side[over - 1] - _limited(turned[over] - side[over - 1])
    steps = np.cumsum(jumps)
    smooth: Floats = shown - steps + gaussian_filter1d(steps, _QUICK * frame_rate / 4, mode="nearest")
    return smooth


def turned_markers(markers: Floats, degrees: Floats, root: int, anchor: int) -> Floats:
    """Return markers (F, J, 3) turned about the upright through joint ``root`` by ``degrees`` (F,).

    The way of the root turns along, so that feet that stand stay: in frame ``anchor`` it is where it was.
    """
    about = Rotation.from_euler("y", degrees[:, None], degrees=True).as_matrix()
    own = markers[:, [root]]
    steps = np.diff(own[:, 0], axis=0, prepend=own[:1, 0])
    way = np.cumsum(np.einsum("fij,fj->fi", about, steps), axis=0)
    way += own[anchor, 0] - way[anchor]
    result: Floats = np.einsum("fij,fnj->fni", about, markers - own) + way[:, None]
    return result


def _limited(angles: Floats) -> Floats:
    """Angles in degrees, flattened towards the limit on both sides."""
    size = np.abs(angles)
    beyond = np.maximum(size - _FREE, 0)
    limited: Floats = np.sign(angles) * (np.minimum(size, _FREE) + _REST * np.tanh(beyond / _REST))
    return limited
