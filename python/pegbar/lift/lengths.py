"""How long the limbs of a drawn figure are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.lift.projection import Camera

Floats = NDArray[np.float64]


def limb_lengths(points: Floats, prior: Floats, cameras: Sequence[Camera], limbs: NDArray[np.int64]) -> Floats:
    """Return the lengths (V,) in metres of the figure that is drawn at ``points`` (F, N, 2)."""
    spans = np.linalg.norm(prior[:, limbs[:, 0]] - prior[:, limbs[:, 1]], axis=-1)
    return np.median(spans, axis=0) if len(spans) else np.zeros(len(limbs))


def given_lengths(lengths: ArrayLike, frames: int, limbs: int) -> Floats:
    """Return ``lengths`` (V,) or (F, V) as (F, V), refusing negative ones."""
    wanted = (frames, limbs) if np.ndim(lengths) == 2 else (limbs,)
    checked = arrays.floats("lengths", lengths, wanted)
    if (checked < 0).any():
        raise ValueError(f"lengths: want metres of at least 0, got {checked.min()}")
    return np.ascontiguousarray(np.broadcast_to(checked, (frames, limbs)))
