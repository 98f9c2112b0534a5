"""Many frames on one sheet."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]


def over_paper(picture: Picture, paper: tuple[int, int, int] = (255, 255, 255)) -> Picture:
    """Return an (H, W, 3|4) uint8 straight-alpha ``picture`` put over a plain colour, as (H, W, 3) uint8."""
    if picture.shape[2] == 3:
        return picture
    alpha = picture[..., 3:].astype(np.float32) / 255
    mixed = picture[..., :3] * alpha + np.asarray(paper, np.float32) * (1 - alpha)
    result: Picture = np.rint(mixed).astype(np.uint8)
    return result


def contact_sheet(
    pictures: Sequence[Picture],
    *,
    columns: int,
    width: int = 320,
    gap: int = 4,
    paper: tuple[int, int, int] = (255, 255, 255),
) -> Picture:
    """Return ``pictures`` (each (H, W, 3|4) uint8, one size) in rows of ``columns``, each ``width`` pixels wide.

    Read left to right, top to bottom; ValueError for no picture or no column.
    """
    import cv2

    if not pictures or columns < 1:
        raise ValueError(f"contact_sheet: want pictures and columns, got {len(pictures)} and {columns}")
    rows, cols = pictures[0].shape[:2]
    height = max(1, round(rows * width / cols))
    lines = -(-len(pictures) // columns)
    sheet = np.full((lines * (height + gap) + gap, columns * (width + gap) + gap, 3), 128, np.uint8)
    for index, picture in enumerate(pictures):
        small = cv2.resize(over_paper(picture, paper), (width, height), interpolation=cv2.INTER_AREA)
        top, left = (gap + (index // columns) * (height + gap), gap + (index % columns) * (width + gap))
        sheet[top : top + height, left : left + width] = small
    return sheet
