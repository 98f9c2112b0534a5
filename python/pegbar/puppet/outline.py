"""The outline of a region of pixels as polygons: simplified, with corners no farther apart than a mesh wants them."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
#: How far a simplified outline may be off, in pixels.
TOLERANCE = 1.0


def outlines(region: Flags, spacing: float, *, tolerance: float = TOLERANCE) -> tuple[list[Floats], list[Floats]]:
    """The outer outlines and the holes of ``region`` (H, W) as polygons (K, 2) through its border pixels.

    Corners are at most ``spacing`` apart; pieces and holes too small to hold a triangle of that size are left out, a
    region's largest piece never.
    """
    pieces, tree = cv2.findContours(region.view(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    outer: list[Floats] = []
    holes: list[Floats] = []
    least = 0.3 * spacing**2
    largest = max((cv2.contourArea(piece) for piece in pieces), default=0.0)
    for piece, (_, _, _, parent) in zip(pieces, [] if tree is None else tree[0], strict=True):
        area = cv2.contourArea(piece)
        if area < least and (parent >= 0 or area < largest):
            continue
        polygon = cv2.approxPolyDP(piece, tolerance, closed=True)[:, 0].astype(np.float64)
        if len(polygon) >= 3:
            (outer if parent < 0 else holes).append(_divided(polygon, spacing))
    return outer, holes


def _divided(polygon: Floats, spacing: float) -> Floats:
    """The polygon with its long sides divided evenly into parts of at most ``spacing``."""
    corners = []
    for start, end in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        parts = max(1, int(np.ceil(np.linalg.norm(end - start) / spacing - 1e-9)))
        corners.append(start + np.arange(parts)[:, None] / parts * (end - start))
    return np.concatenate(corners)
