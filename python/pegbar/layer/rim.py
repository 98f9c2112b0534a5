"""Depth for the soft edges of a render, whose renderer gave one depth a pixel (Jain et al. 2010, section 3.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import _kernels, arrays


def rim_depth(rendered: ArrayLike, rendered_depth: ArrayLike) -> NDArray[np.float32]:
    """Give a render's soft edges the depth of what they are the edge of.

    Renderers smooth colours over an area but take depth at each pixel's centre. An edge pixel whose centre misses the
    object has coverage and no depth, so that :func:`pegbar.depth_composite` puts the drawing in front of it: the edge
    turns into a staircase. Here every sample that is covered in part and has no depth takes the nearest depth (smallest
    z) among the 8 samples around it, or else among those two samples away; filters of renderers reach no farther.
    Everything else stays: coverage farther away from any depth, as of smoke, and an opaque backdrop without depth,
    which would frame what stands before it.

    Parameters
    ----------
    rendered : (H, W, 4) uint8 or float
        Only the coverage is read: above 0 and below 1 (255) a sample is covered in part.
    rendered_depth : (H, W) float
        Metres along the view axis, +inf where there is nothing. NaN and -inf stay: ``depth_composite`` names them.

    Returns
    -------
    (H, W) float32
        ``rendered_depth`` itself where it is float32 and nothing has to be filled, else a new array.

    Raises
    ------
    ValueError
        For a wrong shape, size or dtype.

    Examples
    --------
    >>> import numpy as np
    >>> rendered = np.zeros((1, 5, 4), np.uint8)
    >>> rendered[0, :3, 3] = [255, 128, 16]
    >>> rim_depth(rendered, [[2.0, np.inf, np.inf, np.inf, np.inf]])
    array([[ 2.,  2.,  2., inf, inf]], dtype=float32)
    """
    samples = arrays.samples("rendered", rendered)
    depth = arrays.floats("rendered_depth", rendered_depth, ("H", "W"), dtype=np.float32, allow="any")
    arrays.same_size("rendered_depth", depth, "rendered", samples.shape)
    filled = _kernels.rim_depth(samples, depth)
    if filled is not None:
        return filled
    if isinstance(rendered_depth, np.ndarray) and rendered_depth.dtype == np.float32:
        return rendered_depth
    return depth
