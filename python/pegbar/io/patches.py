"""What changes from one picture of an animation to the next: files hold the rectangle of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays

Pixels = NDArray[np.uint8]


class Patch(NamedTuple):
    """What changes: ``pixels`` (h, w, 3|4) with their corner at column ``left``, row ``top``."""

    left: int
    top: int
    pixels: Pixels


def changed_patches(frames: Iterable[ArrayLike], step: int = 1) -> Iterator[Patch]:
    """Give what is new in each picture (H, W, 3|4); one pixel where nothing is. Corners are at multiples of ``step``.

    Raises
    ------
    ValueError
        For pictures that differ in size or channels.
    """
    before: Pixels | None = None
    for picture in arrays.images("frames", frames):
        if before is None:
            yield Patch(0, 0, picture)
        else:
            changed = (picture != before).any(axis=2)
            rows, columns = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
            top, bottom, left, right = (rows[0], rows[-1], columns[0], columns[-1]) if len(rows) else (0, 0, 0, 0)
            top, left = int(top) // step * step, int(left) // step * step
            yield Patch(left, top, picture[top : bottom + 1, left : right + 1])
        before = picture
