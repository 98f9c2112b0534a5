"""Values of a figure cut into layers: what is drawn on each, how far it reaches behind others, and where it hangs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Layer:
    """One layer of a figure.

    ``bones`` are drawn on it. ``drawn`` (H, W) are the pixels of the picture that show it; ``region`` (H, W) is all
    that it covers, behind other layers too. ``joint`` is the joint by which it hangs on the layer ``parent`` (indices;
    -1 for the layer that all others hang on).
    """

    name: str
    bones: tuple[int, ...]
    drawn: Flags
    region: Flags
    joint: int = -1
    parent: int = -1
