"""A drawn sequence as it was annotated: joint marks, limbs and their colours, camera and depths where known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.camera import PerspectiveCamera

Color = tuple[int, int, int]


@dataclass(frozen=True)
class Limb:
    """A limb between two markers, with its flat colour in the segmentation (None: not painted)."""

    name: str
    start: str
    end: str
    color: Color | None = None


@dataclass(frozen=True, eq=False)
class Drawing:
    """A drawn sequence with F frames, N markers and V limbs. Pixels are (x, y), pixel centres at integers.

    ``markers`` (F, N, 2) float and ``visible`` (F, N) bool go with ``names`` (a marker that is not visible may be
    NaN); ``boxes`` (F, V, 4, 2) are oriented limb boxes, ``extents`` (F, V, 4) the first and last column and row of
    every limb's visible pixels as (left, top, right, bottom), both NaN where a limb is not visible; ``depths`` (F, N)
    are planar depths in metres for ``cameras``, one a frame. ``images``, ``segmentations`` (limb colours) and
    ``masks`` (the figure) are the files, empty where none are named. ``holds`` says for how many film frames each
    drawing is shown (empty: one). ``loops`` is true for a cycle. ``notes`` keeps what the file says besides, as text.
    """

    names: tuple[str, ...]
    markers: NDArray[np.float64]
    visible: NDArray[np.bool_]
    image_size: tuple[int, int]
    frame_rate: float | None = None
    images: tuple[Path, ...] = ()
    segmentations: tuple[Path, ...] = ()
    limbs: tuple[Limb, ...] = ()
    boxes: NDArray[np.float64] | None = None
    cameras: tuple[PerspectiveCamera, ...] = ()
    depths: NDArray[np.float64] | None = None
    loops: bool = False
    extents: NDArray[np.float64] | None = None
    masks: tuple[Path, ...] = ()
    holds: tuple[int, ...] = ()
    notes: Mapping[str, Any] = field(default_factory=dict)

    @property
    def camera(self) -> PerspectiveCamera | None:
        """The camera of the first frame, or None when the file gives none."""
        return self.cameras[0] if self.cameras else None

    @property
    def limb_markers(self) -> NDArray[np.intp]:
        """The (V, 2) indices into ``names`` of every limb's two markers."""
        order = {name: index for index, name in enumerate(self.names)}
        pairs = [(order[limb.start], order[limb.end]) for limb in self.limbs]
        return np.array(pairs, dtype=np.intp).reshape(-1, 2)
