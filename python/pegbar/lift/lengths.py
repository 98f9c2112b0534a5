"""How long the limbs of a drawn figure are."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import _kernels, arrays

Floats = NDArray[np.float64]
Drawn = tuple[Floats, Floats, Floats, Floats]
#: A limb of the drawn figure is this much (relative, one deviation) longer or shorter than the clip's.
PROPORTION = 0.06
#: So many frames say as much as one would if frames were independent.
DEPENDENCE = 3.0
#: Candidates are tried in two rounds, the second between the neighbours of the first's best.
CANDIDATES = 13
#: Candidates reach this many times the clip's length (or a little over the longest drawn one).
REACH, BEYOND = 1.35, 0.15


def likely_lengths(drawn: Drawn, clip: Floats) -> Floats:
    """Return the lengths (V,) in metres that explain best how ``drawn`` limbs foreshorten.

    ``drawn`` holds planar lengths, the clip's depths and the marks' noise, all (V, F), and (V, 2) the usual jolt and
    doubt; ``clip`` (V,) the clip's lengths at the drawing's scale. A length is the likelier the smoother and the nearer
    to the clip the depths are that it leads to, the fewer limbs it makes longer than drawn without need, and the
    nearer it is to the clip's proportions; it is no shorter than the limb is drawn, outliers apart.
    """
    planar, _, noise, _ = drawn
    shortest = np.maximum(np.median(planar, axis=1), planar.max(axis=1) - 4 * np.median(noise, axis=1))
    shortest = np.maximum(shortest, 1e-3 * np.maximum(clip, 1e-6))
    reach = np.maximum(np.log(np.maximum(REACH * clip, 1e-6) / shortest), BEYOND)
    # Quadratic steps: just above the longest drawn length little more length is much more depth.
    steps = np.broadcast_to(np.linspace(0, 1, CANDIDATES), (len(clip), CANDIDATES))
    for _ in range(2):
        candidates = shortest[:, None] * np.exp(reach[:, None] * steps**2)
        costs = _kernels.length_costs(drawn, candidates) / DEPENDENCE
        costs += (np.log(candidates / np.maximum(clip, 1e-6)[:, None]) / PROPORTION) ** 2
        best = np.argmin(costs, axis=1)[:, None]
        low, high = (np.take_along_axis(steps, np.clip(best + side, 0, CANDIDATES - 1), 1) for side in (-1, 1))
        found: Floats = np.take_along_axis(candidates, best, axis=1)[:, 0]
        steps = low + (high - low) * np.linspace(0, 1, CANDIDATES)
    return found


def clip_lengths(prior: Floats, limbs: NDArray[np.int64]) -> Floats:
    """Return the usual lengths (V,) of ``limbs`` (V, 2) in ``prior`` (F, N, 3)."""
    spans = np.linalg.norm(prior[:, limbs[:, 0]] - prior[:, limbs[:, 1]], axis=-1)
    lengths: Floats = np.median(spans, axis=0) if len(spans) else np.zeros(len(limbs))
    return lengths


def given_lengths(lengths: ArrayLike, frames: int, limbs: int) -> Floats:
    """Return ``lengths`` (V,) or (F, V) as (F, V), refusing negative ones."""
    wanted: tuple[Any, ...] = (frames, limbs) if np.ndim(lengths) == 2 else (limbs,)
    checked = arrays.floats("lengths", lengths, wanted)
    if (checked < 0).any():
        raise ValueError(f"lengths: want metres of at least 0, got {checked.min()}")
    return np.ascontiguousarray(np.broadcast_to(checked, (frames, limbs)))
