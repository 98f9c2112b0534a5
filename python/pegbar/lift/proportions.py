"""How large a drawn figure is beside the clip's, limb by limb."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
#: A limb is of the figure's own proportions, not a person's, when it is drawn longer or shorter by more than the second
#: of these (logarithms) than the clip's at the figure's scale; below the first that is pose and style.
PERSON, OWN = 0.2, 0.4
#: A limb seen shorter than this part of its length says nothing of its scale.
SEEN = 0.5


@dataclass(frozen=True)
class Proportions:
    """How many times longer limbs (V,) are drawn than in the clip, and how much (relative) that changes over time."""

    scales: Floats
    stretch: float


def drawn_proportions(points: Floats, prior: Floats, directions: Floats, ends: NDArray[np.int64]) -> Proportions:
    """Compare a drawn figure with the clip's, limb by limb across the view.

    ``points`` (F, N, 3) are the drawn markers somewhere on their rays of ``directions`` (F, N, 3), ``prior`` (F, N, 3)
    the clip's, ``ends`` (V, 2) the limbs. All have the figure's scale but for those of clearly other proportions.
    """
    drawn, seen = (across(markers, directions, ends) for markers in (points, prior))
    full = np.linalg.norm(prior[:, ends[:, 1]] - prior[:, ends[:, 0]], axis=-1)
    return Proportions(_scales(_size(drawn), _size(seen), _size(full)), _stretch(drawn, seen, full))


def _scales(drawn: Floats, seen: Floats, full: Floats) -> Floats:
    told = (seen > SEEN * full) & (drawn > 0)
    if not told.any():
        return np.ones(len(full))
    ratios = np.log(np.where(told, drawn, 1) / np.where(told, seen, 1))
    common = weighted_median(ratios[told], seen[told])
    apart = np.where(told, ratios - common, 0)
    share = np.clip((np.abs(apart) - PERSON) / (OWN - PERSON), 0, 1)
    scales: Floats = np.exp(common + share * apart)
    return scales


def _stretch(drawn: Floats, seen: Floats, full: Floats) -> float:
    """The usual relative change of drawn lengths that the clip's turning does not explain."""
    told = (seen > SEEN * full) & (drawn > 0)
    ratios = np.log(np.where(told, drawn, 1) / np.where(told, seen, 1))
    changes = [np.abs(r[t] - np.median(r[t])) for r, t in zip(ratios.T, told.T, strict=True) if t.sum() > 1]
    # 0.6745 is the median of a unit normal's size.
    return float(np.median(np.concatenate(changes))) / 0.6745 if changes else 0.0


def weighted_median(values: Floats, weights: Floats) -> float:
    """Return the value below which half of the weight lies, between the two values nearest to it."""
    order = np.argsort(values)
    share = np.cumsum(weights[order]) - weights[order] / 2
    return float(np.interp(np.sum(weights) / 2, share, values[order]))


def across(markers: Floats, directions: Floats, ends: NDArray[np.int64]) -> Floats:
    """Return the lengths (F, V) of the limbs ``ends`` (V, 2) across the rays of their second markers."""
    limbs, away = markers[:, ends[:, 1]] - markers[:, ends[:, 0]], directions[:, ends[:, 1]]
    aside = limbs - np.sum(limbs * away, axis=-1, keepdims=True) * away
    lengths: Floats = np.linalg.norm(aside, axis=-1)
    return lengths


def _size(lengths: Floats) -> Floats:
    size: Floats = np.sqrt(np.mean(lengths**2, axis=0))
    return size
