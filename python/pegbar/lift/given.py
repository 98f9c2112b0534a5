"""What the reconstruction of markers is given, coerced and checked by argument name."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.errors import DegenerateError
from pegbar.lift.lengths import given_lengths
from pegbar.lift.projection import Camera, frame_cameras, known

Floats = NDArray[np.float64]
#: With fewer visible marks than this the rest of the figure is a guess from the clip alone.
FEWEST_MARKS = 4


@dataclass(frozen=True)
class Given:
    """Drawn markers (F, N, 2), a clip's (F, N, 3), a camera a frame, limbs (V, 2) and their lengths (F, V) or None."""

    drawn: Floats
    prior: Floats
    cameras: tuple[Camera, ...]
    limbs: NDArray[np.int64]
    lengths: Floats | None

    @classmethod
    def checked(
        cls, drawn: ArrayLike, prior: ArrayLike, camera: Any, limbs: ArrayLike, lengths: ArrayLike | None
    ) -> Given:
        """Return the arguments of `reconstruct_markers` in one piece; ValueError and DegenerateError as said there."""
        clip = arrays.floats("prior", prior, ("F", "N", 3))
        frames, markers = clip.shape[:2]
        points = arrays.floats("aligned", drawn, (frames, markers, 2), allow="nan")
        pairs = arrays.integers("limbs", limbs, ("V", 2), low=0, high=markers - 1)
        if (pairs[:, 0] == pairs[:, 1]).any():
            raise ValueError(f"limbs: limb {int(np.argmax(pairs[:, 0] == pairs[:, 1]))} joins a marker to itself")
        spans = None if lengths is None else given_lengths(lengths, frames, len(pairs))
        _check_marks(points)
        return cls(points, clip, frame_cameras(camera, frames), pairs, spans)


@dataclass(frozen=True)
class Refinement:
    """The options of ``refine``, as `reconstruct_markers` says."""

    planted: NDArray[np.bool_] | None = None
    held: Floats | None = None
    flips: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 3), np.int64))
    stretch: bool = False
    noise: float | None = None
    root: int = 0

    @classmethod
    def checked(
        cls,
        given: Given,
        planted: ArrayLike | None,
        held: ArrayLike | None,
        flips: ArrayLike,
        stretch: bool,
        noise: float | None,
        root: int,
    ) -> Refinement:
        """Return the options for ``given``; ValueError for a wrong one, by its name."""
        frames, markers = given.prior.shape[:2]
        turned = arrays.integers("flips", flips, ("K", 3), low=0)
        for limb, start, stop in turned:
            if not (limb < len(given.limbs) and start <= stop <= frames):
                wanted = f"a limb below {len(given.limbs)} and frames in 0..{frames}"
                raise ValueError(f"flips: want {wanted}, got {[int(limb), int(start), int(stop)]}")
        if noise is not None and not (math.isfinite(noise) and noise >= 0):
            raise ValueError(f"noise: want a finite number of at least 0, got {noise}")
        return cls(
            None if planted is None else arrays.flags("planted", planted, (frames, markers)),
            None if held is None else arrays.floats("held", held, (frames, markers, 3), allow="nan"),
            turned,
            bool(stretch),
            noise,
            int(arrays.integers("root", root, (), low=0, high=markers - 1)),
        )


def check_weights(**weights: float) -> None:
    """Refuse a weight that is negative or not finite, by its name."""
    for name, value in weights.items():
        if not (math.isfinite(value) and value >= 0):
            raise ValueError(f"{name}: want a finite number of at least 0, got {value}")


def _check_marks(points: Floats) -> None:
    """Refuse a frame of (F, N, 2) ``points`` in which fewer than four are not NaN (or all, of fewer markers)."""
    visible = known(points).sum(axis=1)
    wanted = min(FEWEST_MARKS, points.shape[1])
    if (visible < wanted).any():
        frame = int(np.argmax(visible < wanted))
        raise DegenerateError(
            f"frame {frame}: {visible[frame]} visible markers, want at least {wanted} to place the figure"
        )
