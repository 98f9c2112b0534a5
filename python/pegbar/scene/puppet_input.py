"""What a puppet is made from: one picture, the joints marked in it, and where the figure is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class PuppetInput:
    """One figure in one picture.

    ``image`` (H, W, 3 or 4) uint8 is the picture; ``mask`` (H, W) bool says where the figure is (None: nobody knows).
    ``names`` are its J joints, ``marks`` (J, 2) their pixels (NaN where a joint is not marked) and ``visible`` (J,)
    whether they are seen. ``bones`` (B, 2) int are pairs of joints, parent and child, from the root outwards.
    ``drives`` is joint -> the clip's marker that moves it. ``source`` is what to call the picture in messages,
    ``photo`` whether its silhouette has soft edges, ``notes`` what a user should know.
    """

    image: NDArray[np.uint8]
    mask: NDArray[np.bool_] | None
    names: tuple[str, ...]
    marks: NDArray[np.float64]
    visible: NDArray[np.bool_]
    bones: NDArray[np.int64]
    drives: Mapping[str, str] = field(default_factory=dict)
    source: str = "picture"
    photo: bool = False
    notes: tuple[str, ...] = ()

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height of the picture."""
        return self.image.shape[1], self.image.shape[0]
