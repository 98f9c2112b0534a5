"""Joint marks drawn as coloured dots, one colour a joint (2010 paper, section 3.1.1)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays

Floats = NDArray[np.float64]
# A second spot of a colour that is so large beside the largest makes the mark doubtful.
_RIVAL = 0.5


# Fewer pixels of a colour are the rim of a dot, or dirt.
_SMALLEST = 8
# Paper, ink and pencil differ less between their channels.
_VIVID = 100


def flat_colors(picture: NDArray[np.uint8]) -> dict[tuple[int, int, int], tuple[int, int]]:
    """Return the flat vivid colours of ``picture`` (H, W, 3 or 4) uint8, largest first, and a pixel (x, y) of each.

    >>> picture = np.full((9, 9, 3), 255, np.uint8)
    >>> picture[2:6, 3:7] = (255, 0, 0)
    >>> flat_colors(picture)
    {(255, 0, 0): (4, 3)}
    """
    opaque = picture[..., 3] == 255 if picture.shape[2] == 4 else np.ones(picture.shape[:2], bool)
    rows, columns = np.nonzero(opaque)
    packed = picture[rows, columns, :3].astype(np.int64) @ [65536, 256, 1]
    values, owner, counts = np.unique(packed, return_inverse=True, return_counts=True)
    found = {}
    for index in np.argsort(-counts, kind="stable").tolist():
        red, green, blue = (int(values[index]) >> shift & 255 for shift in (16, 8, 0))
        if counts[index] >= _SMALLEST and max(red, green, blue) - min(red, green, blue) > _VIVID:
            pixels = np.flatnonzero(owner == index)
            row = rows[pixels[(len(pixels) - 1) // 2]]
            across = columns[pixels[rows[pixels] == row]]
            found[red, green, blue] = int(across[(len(across) - 1) // 2]), int(row)
    return found


@dataclass(frozen=True, eq=False)
class Dots:
    """Dots found in one picture for N colours.

    ``places`` (N, 2) are their middles in pixels, NaN for a colour without a dot; ``areas`` (N,) their sizes in
    pixels; ``rivals`` holds, for each colour, the middles (k, 2) of further spots of about its dot's size.
    """

    places: Floats
    areas: Floats
    rivals: tuple[Floats, ...]


def find_dots(picture: ArrayLike, colors: ArrayLike, *, tolerance: float = 60, smallest: int = 3) -> Dots:
    """Find one dot of each colour.

    A pixel belongs to the nearest of ``colors`` within ``tolerance``; a dot is the largest connected spot, and its
    middle is weighted by how far its pixels are covered, so that soft rims count in part.

    Parameters
    ----------
    picture : (H, W, 3) or (H, W, 4) uint8
        The layer of dots, on paper or transparent; it may hold the drawing as well.
    colors : (N, 3) uint8
        The joints' colours.
    tolerance : float
        Largest distance from a colour, Euclidean in 8-bit RGB: scans and soft rims need some.
    smallest : int
        Spots of fewer pixels are dirt.

    Returns
    -------
    Dots

    Raises
    ------
    ValueError
        For a wrong shape or dtype, a negative number, or two colours that are nearer to each other than the tolerance.

    Examples
    --------
    >>> picture = np.full((9, 9, 3), 255, np.uint8)
    >>> picture[2:5, 5:8] = (255, 0, 0)
    >>> find_dots(picture, [[255, 0, 0], [0, 0, 255]]).places.tolist()
    [[6.0, 3.0], [nan, nan]]
    """
    image = arrays.image("picture", picture)
    wanted = arrays.integers("colors", colors, ("N", 3), dtype=np.uint8).astype(float)
    if not (math.isfinite(tolerance) and tolerance >= 0):
        raise ValueError(f"tolerance: want a number of 0 or more, got {tolerance}")
    _check_apart(wanted, tolerance)
    cover = image[..., 3] / 255 if image.shape[2] == 4 else np.ones(image.shape[:2])
    owner, match = _owners(image, wanted, tolerance)
    owner[cover < 0.25] = -1
    places, areas, rivals = np.full((len(wanted), 2), np.nan), np.zeros(len(wanted)), []
    for index in range(len(wanted)):
        spots = _spots(owner == index, cover * match, smallest)
        rivals.append(np.array([place for place, _ in spots[1:]]).reshape(-1, 2))
        if spots:
            places[index], areas[index] = spots[0]
    return Dots(places, areas, tuple(rivals))


def _owners(image: NDArray[np.uint8], colors: Floats, tolerance: float) -> tuple[NDArray[np.int64], Floats]:
    """Which colour each pixel belongs to (-1: none), and how well it does, 1 for the colour itself."""
    owner = np.full(image.shape[:2], -1)
    match = np.zeros(image.shape[:2])
    colored = np.ptp(image[..., :3], axis=2) > 0 if (np.ptp(colors, axis=1) > tolerance).all() else None
    rows, columns = np.nonzero(colored) if colored is not None else np.nonzero(np.ones(image.shape[:2], bool))
    pixels = image[rows, columns, :3].astype(float)
    best, nearest = np.full(len(pixels), np.inf), np.full(len(pixels), -1)
    for index, color in enumerate(colors):
        away = np.linalg.norm(pixels - color, axis=1)
        nearer = away < best
        best[nearer], nearest[nearer] = away[nearer], index
    near = best <= tolerance
    owner[rows[near], columns[near]] = nearest[near]
    match[rows[near], columns[near]] = 1 - 0.5 * best[near] / max(tolerance, 1e-9)
    return owner, match


def _spots(mask: NDArray[np.bool_], weights: Floats, smallest: int) -> list[tuple[Floats, float]]:
    """Middles and areas of the spots in ``mask``, the largest first, then those of about its size."""
    if not mask.any():
        return []
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    areas = stats[1:count, cv2.CC_STAT_AREA]
    order = np.argsort(-areas, kind="stable")
    found = []
    for spot in order[(areas[order] >= smallest) & (areas[order] >= _RIVAL * areas.max())]:
        rows, columns = np.nonzero(labels == spot + 1)
        weight = weights[rows, columns]
        middle = np.array([(columns * weight).sum(), (rows * weight).sum()]) / weight.sum()
        found.append((middle, float(areas[spot])))
    return found


def _check_apart(colors: Floats, tolerance: float) -> None:
    for index, color in enumerate(colors):
        away = np.linalg.norm(colors[:index] - color, axis=1)
        if (away <= tolerance).any():
            other = int(np.argmin(away))
            raise ValueError(
                f"colors: {colors[other].astype(int).tolist()} and {color.astype(int).tolist()} are {away.min():.0f} "
                f"apart, nearer than the tolerance of {tolerance:g}"
            )
