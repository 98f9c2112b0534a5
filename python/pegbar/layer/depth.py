"""Depth of every drawn pixel (Jain et al. 2010, section 3.3.1)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import _kernels, arrays

Interpolation = Literal["linear", "perspective"]


def limb_depth(
    labels: ArrayLike, ends: ArrayLike, end_depths: ArrayLike, *, interpolation: Interpolation = "linear"
) -> NDArray[np.float32]:
    """Depth map of a drawing whose limbs are labelled (Jain et al. 2010, section 3.3.1).

    Every pixel of a limb has the depth of the closest point on the segment between the limb's two markers; a limb of
    no length has the depth of its nearer end.

    Parameters
    ----------
    labels : (H, W) uint8
        0 where there is no limb, v + 1 on limb v.
    ends : (V, 2, 2) float
        The limbs' first and second markers, (x, y) in pixels, pixel centres at integers.
    end_depths : (V, 2) float
        The depths of these markers, metres along the view axis.
    interpolation : {"linear", "perspective"}
        Depth linear along the drawn segment (as printed), or linear in 1/z (a straight limb under a perspective
        camera; every depth must be positive).

    Returns
    -------
    (H, W) float32
        Depth in metres, +inf where there is no limb.

    Raises
    ------
    ValueError
        For a wrong shape or dtype, a number that is not finite, a label above V, or an unknown interpolation.

    Examples
    --------
    >>> limb_depth([[0, 1, 1, 1]], [[[1, 0], [3, 0]]], [[2.0, 4.0]])
    array([[inf,  2.,  3.,  4.]], dtype=float32)
    """
    if interpolation not in ("linear", "perspective"):
        raise ValueError(f'interpolation: want "linear" or "perspective", got {interpolation!r}')
    labels = arrays.integers("labels", labels, ("H", "W"), dtype=np.uint8)
    ends = arrays.floats("ends", ends, ("V", 2, 2))
    end_depths = arrays.floats("end_depths", end_depths, (len(ends), 2))
    return _kernels.limb_depth(labels, ends, end_depths, interpolation == "perspective")
