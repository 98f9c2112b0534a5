"""How wide drawn limbs are: the first boundary across each limb (2010 paper, section 3.2).

The paper looks from the line between a limb's markers for the first black pixel at a right angle to it. Here that is
done at stations along the limb, and a straight edge is laid through what they find on either side. Where limbs are
coloured the boundary is where the colour ends; where another limb begins there, the limb may go on behind it, and the
station counts for little.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays

Floats = NDArray[np.float64]
#: Where along a limb its width is measured: not at the joints, where limbs are round and run into each other.
STATIONS = np.linspace(0.12, 0.88, 17)
# How much a boundary with another limb counts beside one with the paper.
_COVERED = 0.1
# Holds the edges parallel where the stations say little about their slope: few of them, close together.
_PARALLEL = 0.05
# No edge is nearer to the axis, in pixels: half a pixel is a line one pixel wide.
_THINNEST = 0.5


@dataclass(frozen=True, eq=False)
class LimbEdges:
    """Edges of V limbs in one picture.

    ``half_widths`` (V, 2, 2) are the distances in pixels from each limb's axis to its edge at its [first, second]
    marker, on the [left, right] side as one looks from the first to the second marker in a picture with y down;
    NaN where nothing was found. ``trust`` (V, 2) is the share of the stations that found the edge for certain.
    """

    half_widths: Floats
    trust: Floats


def label_edges(labels: ArrayLike, ends: ArrayLike) -> LimbEdges:
    """Measure limbs by their labels: a limb ends at the last pixel of its own before the paper.

    Parameters
    ----------
    labels : (H, W) uint8
        0 where there is no limb, v + 1 on limb v.
    ends : (V, 2, 2) float
        The limbs' first and second markers, (x, y) in pixels; NaN where unknown.

    Returns
    -------
    LimbEdges
        Distances reach to the borders of pixels, half a pixel beyond their centres.

    Raises
    ------
    ValueError
        For a wrong shape or dtype.

    Examples
    --------
    >>> labels = np.zeros((9, 20), np.uint8)
    >>> labels[2:7] = 1
    >>> label_edges(labels, [[[0, 4], [19, 4]]]).half_widths[0].tolist()
    [[2.5, 2.5], [2.5, 2.5]]
    """
    picture = arrays.integers("labels", labels, ("H", "W"), dtype=np.uint8)
    ends = arrays.floats("ends", ends, ("V", 2, 2), allow="nan")
    seen = _across(picture, ends)
    own = seen == np.arange(1, len(ends) + 1, dtype=np.uint8)[:, None, None, None]
    inside = np.logical_and.accumulate(seen != 0, axis=3)
    own &= inside
    last = own.shape[3] - 1 - np.argmax(own[..., ::-1], axis=3)
    beyond = np.take_along_axis(seen, np.minimum(last + 1, own.shape[3] - 1)[..., None], axis=3)[..., 0]
    weights = np.where(own.any(axis=3), np.where(beyond == 0, 1.0, _COVERED), 0.0)
    return _edges(last + 0.5, weights)


def ink_edges(gray: ArrayLike, ends: ArrayLike, *, threshold: float = 128, paper: ArrayLike | None = None) -> LimbEdges:
    """Measure limbs by their ink, as the paper does: the first dark pixel across the limb.

    Where the axis itself is dark (a stick figure, black trousers) it is the last dark pixel.

    Parameters
    ----------
    gray : (H, W) uint8
        The drawing in grey.
    ends : (V, 2, 2) float
        The limbs' first and second markers, (x, y) in pixels; NaN where unknown.
    threshold : float
        Pixels with less grey than this are dark.
    paper : (H, W) bool, optional
        Where nothing is drawn, which bounds a limb too.

    Returns
    -------
    LimbEdges

    Raises
    ------
    ValueError
        For a wrong shape or dtype.

    Examples
    --------
    >>> gray = np.full((9, 20), 255, np.uint8)
    >>> gray[[2, 7]] = 0
    >>> ink_edges(gray, [[[0, 4], [19, 4]]]).half_widths[0].tolist()
    [[2.0, 3.0], [2.0, 3.0]]
    """
    picture = arrays.integers("gray", gray, ("H", "W"), dtype=np.uint8)
    ends = arrays.floats("ends", ends, ("V", 2, 2), allow="nan")
    # 1: plain, 2: dark, 0: nothing is drawn; the picture's own border bounds nothing.
    kinds = np.where(picture < threshold, 2, 1).astype(np.uint8)
    if paper is not None:
        kinds[arrays.flags("paper", paper, picture.shape)] = 0
    seen = _across(kinds, ends, outside=1)
    start = seen[..., :1]
    bound = np.where(start == 2, seen != 2, seen != 1)
    first = np.argmax(bound, axis=3)
    found = bound.any(axis=3) & (start[..., 0] != 0)
    return _edges(np.where(start[..., 0] == 2, first - 0.5, first), found.astype(float))


def _across(picture: NDArray[np.uint8], ends: Floats, outside: int = 0) -> NDArray[np.uint8]:
    """Pixels (V, stations, 2 sides, R) from the axis outwards, a pixel apart; ``outside`` beyond the picture."""
    axis = ends[:, 1] - ends[:, 0]
    lengths = np.linalg.norm(axis, axis=1)
    reach = int(max(np.nanmax(lengths, initial=0.0), 8.0)) + 2
    left = np.stack([axis[:, 1], -axis[:, 0]], axis=1) / np.where(lengths > 0, lengths, np.inf)[:, None]
    steps = np.arange(reach) * np.array([[1.0], [-1.0]])
    places = (ends[:, :1] + STATIONS[:, None] * axis[:, None])[:, :, None, None] + (
        left[:, None, None, None] * steps[..., None]
    )
    pixels = np.rint(np.where(np.isfinite(places), places, -1)).astype(np.int64)
    columns, rows = pixels[..., 0], pixels[..., 1]
    inside = (columns >= 0) & (rows >= 0) & (columns < picture.shape[1]) & (rows < picture.shape[0])
    found = picture[np.where(inside, rows, 0), np.where(inside, columns, 0)]
    return np.where(inside, found, outside).astype(np.uint8)


def _edges(distances: Floats, weights: Floats) -> LimbEdges:
    """A straight edge through ``distances`` (V, stations, 2) that count as ``weights``; robust, by reweighting."""
    certain = (weights == 1).sum(axis=1, keepdims=True) >= 4
    weights = np.where(certain & (weights < 1), 0.0, weights)
    place = STATIONS - 0.5
    used = weights
    for _ in range(12):
        middle, slope = _line(place, distances, used)
        off = np.abs(distances - middle[:, None] - slope[:, None] * place[:, None])
        used = weights / np.maximum(off, 0.5)
    any_found: NDArray[np.bool_] = np.any(weights > 0, axis=1)
    low = np.where(any_found, np.where(weights > 0, distances, np.inf).min(axis=1), 0.0)
    high = np.where(any_found, np.where(weights > 0, distances, -np.inf).max(axis=1), 0.0)
    half = np.stack([middle - slope / 2, middle + slope / 2], axis=1)
    # From the last station to the joint an edge goes on as it went, no farther than the stations allow, and not across
    # the axis: a limb that is narrow at one place would be inside out at its end.
    more = 0.25 * (high - low)
    half = np.clip(half, np.maximum(low - more, _THINNEST)[:, None], (high + more)[:, None])
    half = np.where(any_found[:, None], half, np.nan)
    return LimbEdges(half, (weights == 1).mean(axis=1))


def _line(place: Floats, distances: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Middle and slope (V, 2) of the weighted least-squares lines, slopes drawn to zero."""
    total = np.maximum(weights.sum(axis=1), 1e-12)
    centre = np.einsum("s,vsk->vk", place, weights) / total
    mean = (distances * weights).sum(axis=1) / total
    away = place[:, None] - centre[:, None]
    spread = (weights * away**2).sum(axis=1) + _PARALLEL * total / len(place)
    slope = (weights * away * (distances - mean[:, None])).sum(axis=1) / spread
    return mean - slope * centre, slope
