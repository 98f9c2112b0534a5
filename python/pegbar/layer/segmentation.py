"""Which limb every drawn pixel belongs to (Jain et al. 2010, section 3.3.1)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import _kernels, arrays

MOST_COLORS = 254


@dataclass(frozen=True, eq=False)
class LabelMap:
    """Limb labels of one segmentation, and what of it matched no colour.

    ``labels`` (H, W) uint8 is 0 where there is no limb and v + 1 on limb v. ``unmatched`` counts the pixels that match
    no colour of the palette (their label is 0); ``first_unmatched`` is the (row, column) of the first in reading order
    and ``first_unmatched_color`` what is painted there, both None when everything matched.
    """

    labels: NDArray[np.uint8]
    unmatched: int
    first_unmatched: tuple[int, int] | None
    first_unmatched_color: tuple[int, ...] | None


def segment_stick_figure(
    gray: ArrayLike, ends: ArrayLike, half_width: ArrayLike, *, threshold: float = 128
) -> NDArray[np.uint8]:
    """Limb labels of a stick figure: its dark pixels inside each limb's window (Jain et al. 2010, section 3.3.1).

    The window is the rectangle from the limb's first marker to its second, ``half_width`` to both sides, borders
    included; a limb of no length has a disc. A pixel in several windows belongs to the nearest limb, of equally near
    ones to the earlier.

    Parameters
    ----------
    gray : (H, W) uint8
        The drawing in grey.
    ends : (V, 2, 2) float
        The limbs' first and second markers, (x, y) in pixels, pixel centres at integers. At most 255 limbs.
    half_width : float or (V,) float
        How far from the limb's axis its line may lie, in pixels: one number for all limbs or one a limb.
    threshold : float
        Pixels with less grey than this are dark.

    Returns
    -------
    (H, W) uint8
        0 where there is no limb, v + 1 on limb v.

    Raises
    ------
    ValueError
        For a wrong shape or dtype, a number that is not finite, a negative width, or more than 255 limbs.

    Examples
    --------
    >>> segment_stick_figure([[255, 0, 0, 90, 200]], [[[1, 0], [4, 0]]], 1.5)
    array([[0, 1, 1, 1, 0]], dtype=uint8)
    """
    gray = arrays.integers("gray", gray, ("H", "W"), dtype=np.uint8)
    ends = arrays.floats("ends", ends, ("V", 2, 2))
    widths = arrays.floats("half_width", half_width, () if np.ndim(half_width) == 0 else (len(ends),))
    if (widths < 0).any():
        raise ValueError(f"half_width: want no negative width, got {widths.min()}")
    if not math.isfinite(threshold):
        raise ValueError(f"threshold: want a finite number, got {threshold}")
    level = min(max(math.ceil(threshold), 0), 256)
    return _kernels.segment_stick_figure(gray, ends, np.ascontiguousarray(np.broadcast_to(widths, len(ends))), level)


def palette_labels(
    segmentation: ArrayLike,
    colors: ArrayLike,
    labels: ArrayLike,
    *,
    tolerance: float = 0,
    background: ArrayLike = (0, 0, 0),
) -> LabelMap:
    """Limb labels from the colours that the limbs were painted in (Jain et al. 2010, section 3.3.1).

    With ``tolerance=0`` colours are taken as they are. Otherwise, for scanned or antialiased segmentations, a pixel has
    the nearest colour within the tolerance if that colour is solid nearby; if not, it is taken for a mixture of the
    solid colours around it and the background, and goes to the one that covers most of it. So a border between red and
    yellow limbs does not become an orange one. Parts thinner than 3 pixels count only where no mixture explains them.

    Parameters
    ----------
    segmentation : (H, W, 3) or (H, W, 4) uint8
        The painted limbs. Pixels with alpha below 128 are background.
    colors : (P, 3) uint8
        The palette. Several colours may stand for one limb: hair goes with the head.
    labels : (P,) uint8
        What each colour stands for: v + 1 for limb v, 0 for none.
    tolerance : float
        Largest distance from a colour or mixture, Euclidean in 8-bit RGB.
    background : (3,) or (B, 3) uint8
        Colours of no limb, such as black and white paper; ``()`` for none.

    Returns
    -------
    LabelMap
        The labels, and how many pixels matched nothing, with the first one's place and colour.

    Raises
    ------
    ValueError
        For a wrong shape or dtype, a negative tolerance, a colour that stands for two labels, or more than 254 colours.

    Examples
    --------
    >>> found = palette_labels([[[0, 0, 0], [255, 0, 0], [9, 9, 9]]], [[255, 0, 0]], [1])
    >>> found.labels
    array([[0, 1, 0]], dtype=uint8)
    >>> found.unmatched, found.first_unmatched, found.first_unmatched_color
    (1, (0, 2), (9, 9, 9))
    """
    image = arrays.image("segmentation", segmentation)
    limb_colors = arrays.integers("colors", colors, ("P", 3), dtype=np.uint8)
    limb_labels = arrays.integers("labels", labels, (len(limb_colors),), dtype=np.uint8)
    if not (math.isfinite(tolerance) and tolerance >= 0):
        raise ValueError(f"tolerance: want a number of 0 or more, got {tolerance}")
    paper = np.asarray(background)
    paper = arrays.integers(
        "background", paper.reshape(-1, 3) if paper.size in (0, 3) else paper, ("B", 3), dtype=np.uint8
    )
    swatches = np.concatenate([limb_colors, paper])
    meanings = np.concatenate([limb_labels, np.zeros(len(paper), np.uint8)])
    _check_palette(swatches, meanings, len(limb_colors))
    found, unmatched, first = _kernels.palette_labels(image, swatches, meanings, tolerance)
    if first is None:
        return LabelMap(found, unmatched, None, None)
    row, column = first
    return LabelMap(found, unmatched, (row, column), tuple(int(value) for value in image[row, column]))


def _check_palette(colors: NDArray[np.uint8], labels: NDArray[np.uint8], limbs: int) -> None:
    if len(colors) > MOST_COLORS:
        raise ValueError(f"colors: want at most {MOST_COLORS} with the background's, got {len(colors)}")
    known: dict[tuple[int, ...], int] = {}
    for index, (color, label) in enumerate(zip(colors.tolist(), labels.tolist(), strict=True)):
        if known.setdefault(tuple(color), label) != label:
            other = f"label {label}" if index < limbs else "the background (give another one, or () for none)"
            raise ValueError(f"colors: {tuple(color)} stands for label {known[tuple(color)]} and for {other}")


def grow_labels(labels: ArrayLike, figure: ArrayLike, *, reach: float | None = None) -> NDArray[np.uint8]:
    """Limb labels grown over the rest of the figure: lines, soft rims, hair (after Jain et al. 2010, section 3.3.1).

    Every pixel of the figure without a label gets the label of the nearest labelled pixel, by exact Euclidean distance;
    of equally near ones the one farther left, then the one farther up. Labels outside the figure stay.

    Parameters
    ----------
    labels : (H, W) uint8
        0 where there is no limb, v + 1 on limb v.
    figure : (H, W) bool or uint8
        Where the drawing is: true, or not zero.
    reach : float, optional
        Farthest distance to grow, in pixels; None: as far as needed.

    Returns
    -------
    (H, W) uint8
        The grown labels; all as given where there is no label to grow from.

    Raises
    ------
    ValueError
        For a wrong shape or dtype, or a negative reach.

    Examples
    --------
    >>> grow_labels([[0, 1, 0, 0, 2, 0]], [[0, 1, 1, 1, 1, 1]])
    array([[0, 1, 1, 2, 2, 2]], dtype=uint8)
    """
    labels = arrays.integers("labels", labels, ("H", "W"), dtype=np.uint8)
    if np.asarray(figure).dtype == np.bool_:
        mask = arrays.flags("figure", figure, ("H", "W")).view(np.uint8)
    else:
        mask = arrays.integers("figure", figure, ("H", "W"), dtype=np.uint8)
    arrays.same_size("figure", mask, "labels", labels.shape)
    if reach is not None and not reach >= 0:
        raise ValueError(f"reach: want a number of 0 or more, got {reach}")
    return _kernels.grow_labels(labels, mask, reach)
