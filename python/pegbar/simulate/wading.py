"""What limbs take up of a height field: the height of their undersides and tops over its nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Part = tuple[slice, slice]
#: Spheres along a limb, by which its outline from below and above is found.
SPHERES = 33


def undersides(rows: Floats, x: Floats, z: Floats, below: float) -> list[tuple[Part, Floats, Floats]]:
    """Return for every capsule that reaches under the height ``below`` what it covers of a grid.

    ``rows`` (C, 8) are capsules, ``x`` (columns,) and ``z`` (rows,) the nodes' places. Each entry has the part of the
    grid, and the heights of the capsule's underside (+inf beside it) and top (-inf) there.
    """
    found = []
    share = np.linspace(0, 1, SPHERES)[:, None]
    for row in rows:
        spheres = (1 - share) * row[:4] + share * row[4:]
        if (spheres[:, 1] - spheres[:, 3]).min() >= below:
            continue
        centers, radii = spheres[:, :3], spheres[:, 3]
        low, high = (centers - radii[:, None]).min(axis=0), (centers + radii[:, None]).max(axis=0)
        columns = slice(*np.searchsorted(x, (low[0], high[0])).tolist())
        lines = slice(*np.searchsorted(z, (low[2], high[2])).tolist())
        if columns.start >= columns.stop or lines.start >= lines.stop:
            continue
        apart = (x[columns][None, :, None] - centers[:, 0]) ** 2 + (z[lines][:, None, None] - centers[:, 2]) ** 2
        inside = radii**2 - apart
        half = np.sqrt(np.maximum(inside, 0))
        under = np.where(inside > 0, centers[:, 1] - half, np.inf).min(axis=2)
        over = np.where(inside > 0, centers[:, 1] + half, -np.inf).max(axis=2)
        found.append(((lines, columns), under, over))
    return found
