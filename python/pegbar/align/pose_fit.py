"""What `fit_pose` finds: a camera and an error for every pose, and the pose that looks most like the picture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.camera import PerspectiveCamera

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PoseFit:
    """A camera for each of P poses, fitted to the N marks of one picture.

    ``errors`` (P,) are the RMS distances in pixels between active marks and projected joints, ``joint_errors`` (P, N)
    the distances themselves (NaN where switched off), ``costs`` (P,) what the fit minimised: losses and priors, without
    unit. ``ranking`` (P,) int lists the poses from the best to the worst, by ``costs``. ``matrices`` (P, 3, 4) are the
    cameras' matrices. A pose without an answer (all its active joints on one line) has an infinite error, NaN in its
    matrix and comes last.
    """

    errors: Floats
    joint_errors: Floats
    costs: Floats
    ranking: NDArray[np.intp]
    matrices: Floats
    image_size: tuple[int, int]

    @property
    def pose(self) -> int:
        """The index of the pose that looks most like the picture."""
        return int(self.ranking[0])

    @property
    def error(self) -> float:
        """The best pose's RMS distance in pixels."""
        return float(self.errors[self.pose])

    @property
    def camera(self) -> PerspectiveCamera:
        """The best pose's camera."""
        return PerspectiveCamera(self.matrices[self.pose], self.image_size)

    @cached_property
    def cameras(self) -> tuple[PerspectiveCamera | None, ...]:
        """Every pose's camera; None for a pose without an answer."""
        known = np.isfinite(self.costs)
        return tuple(
            PerspectiveCamera(matrix, self.image_size) if fine else None
            for matrix, fine in zip(self.matrices, known, strict=True)
        )

    def __repr__(self) -> str:
        return f"PoseFit(pose={self.pose}, error={self.error:.2f} px, {len(self.errors)} poses)"
