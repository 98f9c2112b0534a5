"""Completes what a picture hides (Hornung et al. 2007, section 6): by patches where installed, else by diffusion."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable
from typing import Any, Literal, get_args

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pegbar import arrays
from pegbar.errors import MissingExtraError

Pixels = NDArray[np.uint8]
Flags = NDArray[np.bool_]
#: Fills the pixels of an (H, W, 3) picture where the second argument (H, W) is true, and returns the picture.
Completion = Callable[[Pixels, Flags], Pixels]
Method = Literal["auto", "patch", "diffuse", "flat"]
#: How far around a pixel diffusion looks, in pixels.
_RADIUS = 4
#: A larger hole is filled in a smaller picture: patches take their time, and behind a figure fine grain is not missed.
_MOST_HOLE = 25_000
#: Patches reach so far from their middle, in pixels.
_PATCH = 3


def complete(image: Any, hole: Any, method: Method | Completion = "auto", *, source: Any = None) -> Pixels:
    """Fill the ``hole`` of a picture from what is around it; everything else stays as it is, to the bit.

    Parameters
    ----------
    image : (H, W, 3) uint8
    hole : (H, W) bool
    method : {"auto", "patch", "diffuse", "flat"} or function
        "patch" copies patches from elsewhere in the picture (PatchMatch; needs the extra ``inpaint``), "diffuse"
        carries colours inwards (Telea 2004), "flat" takes the nearest colour, "auto" patches where they are installed,
        else diffusion. A function of ``(image, hole)`` is called instead.
    source : (H, W) bool, optional
        Where patches may come from; None: anywhere outside the hole.

    Raises
    ------
    ValueError
        For a wrong shape, dtype or method, or a hole that is the whole picture.
    MissingExtraError
        For "patch" without the extra.

    Examples
    --------
    >>> picture = np.full((9, 9, 3), 7, np.uint8)
    >>> hole = np.zeros((9, 9), bool)
    >>> hole[3:6, 3:6] = True
    >>> np.unique(complete(picture, hole, "flat")).tolist()
    [7]
    """
    image = arrays.image("image", image, (3,))
    hole = arrays.flags("hole", hole, image.shape[:2])
    if not callable(method) and method not in get_args(Method):
        raise ValueError(f"method: want {', '.join(get_args(Method))} or a function, got {method!r}")
    if not hole.any():
        return np.asarray(image)
    if hole.all():
        raise ValueError("hole: want something of the picture left, got a hole as large as it")
    if callable(method):
        filled: Pixels = arrays.image("method", method(image, hole), (3,))
        arrays.same_size("method", filled, "image", image.shape)
    elif method == "patch" or (method == "auto" and importlib.util.find_spec("patchmatch")):
        filled = _by_patches(image, hole, None if source is None else arrays.flags("source", source, hole.shape))
    elif method == "flat":
        filled = bled(image, ~hole)
    else:
        filled = np.asarray(cv2.inpaint(image, hole.view(np.uint8), _RADIUS, cv2.INPAINT_TELEA), np.uint8)
    result: Pixels = np.where(hole[..., None], filled, image)
    return result


def bled(image: Pixels, known: Flags) -> Pixels:
    """The picture (H, W, 3) with the nearest known colour wherever it is not ``known``."""
    if known.all() or not known.any():
        return image
    _, (rows, columns) = ndimage.distance_transform_edt(~known, return_indices=True)
    return np.ascontiguousarray(image[rows, columns])


def _by_patches(image: Pixels, hole: Flags, source: Flags | None) -> Pixels:
    rows, columns = np.nonzero(hole)
    # What is far from the hole gives few patches and costs as much time.
    margin = max(8 * _PATCH, int(np.ptp(rows) // 2), int(np.ptp(columns) // 2))
    window = (
        slice(max(rows.min() - margin, 0), rows.max() + margin + 1),
        slice(max(columns.min() - margin, 0), columns.max() + margin + 1),
    )
    barred = np.zeros_like(hole) if source is None else ~source & ~hole
    part, inside, outside = np.ascontiguousarray(image[window]), hole[window], barred[window]
    scale = min(1.0, math.sqrt(_MOST_HOLE / len(rows)))
    if scale < 1:
        size = (max(8, round(part.shape[1] * scale)), max(8, round(part.shape[0] * scale)))
        part = np.asarray(cv2.resize(part, size, interpolation=cv2.INTER_AREA), np.uint8)
        inside, outside = (
            cv2.resize(flags.astype(np.float32), size, interpolation=cv2.INTER_AREA) > 0 for flags in (inside, outside)
        )
        outside &= ~inside
    found = _patched(part, inside, outside)
    filled = image.copy()
    shape = filled[window].shape
    filled[window] = found if scale == 1 else cv2.resize(found, shape[1::-1], interpolation=cv2.INTER_CUBIC)
    return filled


def _patched(image: Pixels, hole: Flags, barred: Flags) -> Pixels:
    try:
        from patchmatch import patch_match
    except ImportError:
        raise MissingExtraError("completing pictures by patches", "inpaint") from None
    free = hole.size - int(barred.sum()) - int(hole.sum())
    kept = np.ascontiguousarray(barred) if barred.any() and free > (2 * _PATCH + 1) ** 2 else None
    filled = patch_match.inpaint(image, np.ascontiguousarray(hole), global_mask=kept, patch_size=_PATCH)
    return np.asarray(filled, np.uint8)
