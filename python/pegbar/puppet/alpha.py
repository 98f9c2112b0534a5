"""How much of every pixel is the figure's (Hornung et al. 2007, section 6): closed-form matting, or the mask's edge."""

from __future__ import annotations

import importlib.util
import logging
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar import arrays
from pegbar.errors import MissingExtraError
from pegbar.puppet.texture import mask_alpha

Pixels = NDArray[np.uint8]
Flags = NDArray[np.bool_]
Coverage = NDArray[np.float32]
Matting = Literal["auto", "closed form", "guided", "mask"]
#: How far on both sides of a silhouette coverage is open, as part of the figure's size, and at least in pixels.
BAND, LEAST_BAND = 0.004, 3.0
#: How far the guided filter looks around a pixel, in bands, and what it takes for flat (squared, of 0 to 1).
_LOOK, _FLAT = 2.0, 5e-3
# Seconds after which the user is told what takes so long: PyMatting compiles at its first use.
_PATIENCE = 3.0


def figure_alpha(image: Pixels, mask: Flags, method: Matting = "auto") -> Coverage:
    """The figure's coverage (H, W) in 0..1, for a picture without alpha of its own.

    Parameters
    ----------
    image : (H, W, 3) uint8
    mask : (H, W) bool
        Where the figure is, to about a pixel or two.
    method : {"auto", "closed form", "guided", "mask"}
        "closed form" (Levin, Lischinski, Weiss 2008) takes the picture's own soft edge and hair; it needs the extra
        ``matting``, and its first use compiles for most of a minute. "guided" fits the mask's edge to the picture's
        (He, Sun, Tang 2010). "mask" is the mask with a smooth outline: what drawings want. "auto" is closed form where
        it is installed, else guided.

    Raises
    ------
    ValueError
        For an unknown method or a wrong shape.
    MissingExtraError
        For "closed form" without the extra.
    """
    image = arrays.image("image", image, (3,))
    mask = arrays.flags("mask", mask, image.shape[:2])
    if method not in get_args(Matting):
        raise ValueError(f"method: want {', '.join(get_args(Matting))}, got {method!r}")
    if method == "mask" or not mask.any() or mask.all():
        return mask_alpha(mask)
    band = max(LEAST_BAND, BAND * float(np.linalg.norm(np.ptp(np.argwhere(mask), axis=0))))
    inside = cv2.distanceTransform(mask.view(np.uint8), cv2.DIST_L2, 5)
    outside = cv2.distanceTransform((~mask).view(np.uint8), cv2.DIST_L2, 5)
    sure, nothing = inside > band, outside > band
    rows, columns = np.nonzero(~nothing)
    pad = round(4 * band)
    window = (
        slice(max(int(rows.min()) - pad, 0), int(rows.max()) + pad + 1),
        slice(max(int(columns.min()) - pad, 0), int(columns.max()) + pad + 1),
    )
    alpha = np.zeros(mask.shape, np.float32)
    part = np.ascontiguousarray(image[window])
    if method == "closed form" or (method == "auto" and importlib.util.find_spec("pymatting")):
        alpha[window] = _closed_form(part, sure[window], nothing[window])
    else:
        guide, soft = part.astype(np.float32) / 255, mask_alpha(mask)[window]
        alpha[window] = cv2.ximgproc.guidedFilter(guide, soft, round(_LOOK * band), _FLAT)
    alpha[sure], alpha[nothing] = 1, 0
    return np.clip(alpha, 0, 1)


def _closed_form(image: Pixels, sure: Flags, nothing: Flags) -> Coverage:
    with _told_when_slow(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            from pymatting import estimate_alpha_cf
        except ImportError:
            raise MissingExtraError("closed-form matting", "matting") from None
        trimap = np.where(sure, 1.0, np.where(nothing, 0.0, 0.5))
        alpha = estimate_alpha_cf(image / 255.0, trimap)
    return np.asarray(alpha, np.float32)


@contextmanager
def _told_when_slow() -> Iterator[None]:
    """Tell, while it happens, what the user waits for."""
    note = "pegbar: note: closed-form matting takes a while: at its first use it compiles, for about a minute"
    timer = threading.Timer(_PATIENCE, lambda: logging.getLogger("pegbar").warning(note))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
