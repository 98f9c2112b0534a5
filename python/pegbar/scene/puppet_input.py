"""What a puppet is made from: one picture, the joints marked in it, and where the figure is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.drawing import Limb


@dataclass(frozen=True, eq=False)
class PuppetInput:
    """One figure in one picture.

    ``image`` (H, W, 3 or 4) uint8 is the picture; ``mask`` (H, W) bool says where the figure is (None: nobody knows).
    ``names`` are its J joints, ``marks`` (J, 2) their pixels (NaN where a joint is not marked) and ``visible`` (J,)
    whether they are seen. ``bones`` (B, 2) int are pairs of joints, parent and child, from the root outwards.
    ``drives`` is joint -> the clip's marker that moves it. ``source`` is what to call the picture in messages,
    ``notes`` what a user should know. ``segmentation`` (H, W, 3) uint8
    is painted in the colours of ``limbs`` where the drawing comes with one. ``alpha`` (H, W) float32 is the figure's
    coverage, 0 to 1, where it is known better than from picture and mask; ``bone_map`` (H, W) uint8 the bone that each
    pixel belongs to, v + 1 for bone v, and ``radii`` (B,) the bones' half widths in pixels, once they are found.
    ``files`` are what all this was read from.
    """

    image: NDArray[np.uint8]
    mask: NDArray[np.bool_] | None
    names: tuple[str, ...]
    marks: NDArray[np.float64]
    visible: NDArray[np.bool_]
    bones: NDArray[np.int64]
    drives: Mapping[str, str] = field(default_factory=dict)
    source: str = "picture"
    notes: tuple[str, ...] = ()
    segmentation: NDArray[np.uint8] | None = None
    limbs: tuple[Limb, ...] = ()
    alpha: NDArray[np.float32] | None = None
    bone_map: NDArray[np.uint8] | None = None
    radii: NDArray[np.float64] | None = None
    files: tuple[Path, ...] = ()

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height of the picture."""
        return self.image.shape[1], self.image.shape[0]
