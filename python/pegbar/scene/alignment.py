"""A drawn sequence registered with a clip: cameras, retimed clip, and the drawing's joints in 3D."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.camera import PerspectiveCamera

#: Marks that are farther from the clip than this share of the figure's height are told to the user.
MISFIT = 0.1


@dataclass(frozen=True, eq=False)
class Alignment:
    """What `pegbar align` finds, for F drawings and the N markers ``names``.

    ``times`` (F,) are fractional clip frames; ``clip`` (F, N, 3) the clip's markers there as they were registered
    (NaN where it lacks one), in its mirror image if ``mirrored``, without its travel if ``root`` is "in_place", with
    the floor at height 0. ``matrices`` (F, 3, 4) are the cameras, of the kind ``mode``. ``markers`` (F, N, 2) are the
    drawn places, guessed where ``estimated`` (F, N): the drawing hides them. ``positions`` (F, N, 3) are the
    drawing's markers in world metres, which project exactly onto ``markers``; ``grounded`` (F, N) tells those whose
    depth is from the ground. ``errors`` (F,) are RMS distances between clip and seen marks in pixels, ``notes``
    what was found or assumed and ``warnings`` what looks wrong, in words; ``clip_path`` is the clip's file, and
    ``swapped`` says that left and right marks are exchanged.
    """

    names: tuple[str, ...]
    image_size: tuple[int, int]
    times: NDArray[np.float64]
    clip: NDArray[np.float64]
    matrices: NDArray[np.float64]
    markers: NDArray[np.float64]
    estimated: NDArray[np.bool_]
    grounded: NDArray[np.bool_]
    positions: NDArray[np.float64]
    errors: NDArray[np.float64]
    mode: str
    root: str
    clip_path: str = ""
    mirrored: bool = False
    swapped: bool = False
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @cached_property
    def cameras(self) -> tuple[PerspectiveCamera, ...]:
        """The F cameras."""
        return tuple(PerspectiveCamera(matrix, self.image_size) for matrix in self.matrices)

    @property
    def figure_height(self) -> float:
        """How tall the drawn figure is in pixels: the median over drawings, from its highest marker to its lowest."""
        rows = self.markers[..., 1]
        return float(np.median(np.nanmax(rows, axis=1) - np.nanmin(rows, axis=1)))

    @property
    def depths(self) -> NDArray[np.float64]:
        """Planar depths (F, N) of the drawing's markers in metres."""
        depths: NDArray[np.float64] = (
            np.einsum("fi,fni->fn", self.matrices[:, 2, :3], self.positions) + self.matrices[:, 2, 3:]
        )
        return depths
