"""The cameras of a shot, and how well they explain its drawings."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.camera import PerspectiveCamera


@dataclass(frozen=True, eq=False)
class CameraTrack:
    """One camera a frame.

    ``matrices`` (F, 3, 4) float map world metres to pixels, depth in the third row; ``errors`` (F,) float are the
    frames' RMS distances in pixels between projected and drawn marks that are seen (NaN where none is). ``mode`` and
    ``root`` ("travel", "in_place" or "scaled") are what was chosen, ``travel`` the share of the clip's travel that is
    kept, ``points`` (F, N, 3) float the points that the cameras see: the clip's with that travel. ``noise`` is the
    marks' robust standard deviation in pixels; ``trials`` holds, where the mode was chosen, the RMS distance of every
    mode that was judged in frames held out; ``notes`` are what a user should know.
    """

    matrices: NDArray[np.float64]
    errors: NDArray[np.float64]
    image_size: tuple[int, int]
    mode: str
    root: str
    travel: float
    points: NDArray[np.float64]
    noise: float
    trials: dict[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @cached_property
    def cameras(self) -> tuple[PerspectiveCamera, ...]:
        """The cameras, one a frame."""
        return tuple(PerspectiveCamera(matrix, self.image_size) for matrix in self.matrices)

    @property
    def error(self) -> float:
        """RMS over the frames of ``errors``, in pixels."""
        return float(np.sqrt(np.nanmean(self.errors**2)))

    def project(self) -> NDArray[np.float64]:
        """Return the pixels (F, N, 2) of ``points``: the clip as the artist drew it."""
        image = np.einsum("fab,fnb->fna", self.matrices[:, :, :3], self.points) + self.matrices[:, None, :, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels: NDArray[np.float64] = image[..., :2] / image[..., 2:]
        return pixels
