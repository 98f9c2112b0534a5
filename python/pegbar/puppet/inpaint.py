"""Completes what a picture hides (Hornung et al. 2007, section 6): by patches where installed, else by diffusion."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import Any, Literal, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar import arrays
from pegbar.errors import MissingExtraError

Pixels = NDArray[np.uint8]
Flags = NDArray[np.bool_]
#: Fills the pixels of an (H, W, 3) picture where the second argument (H, W) is true, and returns the picture.
Completion = Callable[[Pixels, Flags], Pixels]
Method = Literal["auto", "patch", "diffuse"]
#: How far around a pixel diffusion looks, in pixels.
_RADIUS = 4
#: Patches reach so far from their middle, in pixels.
_PATCH = 3


def complete(image: Any, hole: Any, method: Method | Completion = "auto", *, source: Any = None) -> Pixels:
    """Fill the ``hole`` of a picture from what is around it; everything else stays as it is, to the bit.

    Parameters
    ----------
    image : (H, W, 3) uint8
    hole : (H, W) bool
    method : {"auto", "patch", "diffuse"} or function
        "patch" copies patches from elsewhere in the picture (PatchMatch; needs the extra ``inpaint``), "diffuse"
        carries colours inwards (Telea 2004), "auto" takes patches where they are installed. A function of
        ``(image, hole)`` is called instead.
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
    >>> np.unique(complete(picture, hole, "diffuse")).tolist()
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
    else:
        filled = np.asarray(cv2.inpaint(image, hole.view(np.uint8), _RADIUS, cv2.INPAINT_TELEA), np.uint8)
    result: Pixels = np.where(hole[..., None], filled, image)
    return result


def _by_patches(image: Pixels, hole: Flags, source: Flags | None) -> Pixels:
    try:
        from patchmatch import patch_match
    except ImportError:
        raise MissingExtraError("completing pictures by patches", "inpaint") from None
    rows, columns = np.nonzero(hole)
    # What is far from the hole gives few patches and costs as much time.
    margin = max(8 * _PATCH, int(np.ptp(rows) // 2), int(np.ptp(columns) // 2))
    window = (
        slice(max(rows.min() - margin, 0), rows.max() + margin + 1),
        slice(max(columns.min() - margin, 0), columns.max() + margin + 1),
    )
    filled = image.copy()
    part = np.ascontiguousarray(image[window])
    barred = None if source is None else np.ascontiguousarray(~source[window] & ~hole[window])
    if barred is not None and barred.sum() + hole[window].sum() > hole[window].size - (2 * _PATCH + 1) ** 2:
        barred = None
    hidden = np.ascontiguousarray(hole[window])
    filled[window] = patch_match.inpaint(part, hidden, global_mask=barred, patch_size=_PATCH)
    return filled
