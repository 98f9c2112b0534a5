"""Drawn characters put into what is rendered of the elements, one after the other, some rows at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.layer.composite import Space, depth_composite
from pegbar.layer.rim import rim_depth
from pegbar.shot.drawn import Drawn
from pegbar.shot.view import View

Floats = NDArray[np.float32]
# Rows of the picture that are composited at once: all of a 4K picture's samples take a gigabyte.
_ROWS = 128


def layered(view: View, drawn: Sequence[Drawn], scales: Sequence[float], space: Space, dtype: Any) -> NDArray[Any]:
    """Composite ``drawn`` characters, the first one first, with what is seen of the elements in ``view``.

    Parameters
    ----------
    view : View
        The elements, linear.
    drawn : sequence of Drawn
        Pictures of the view's size.
    scales : sequence of float
        What brings each character's depths to those of the view's camera.
    space : "display" or "linear"
        Where to mix colours, and what float32 pixels are in.
    dtype : uint8 or float32
        Of the result's pixels, as `depth_composite` gives them.

    Returns
    -------
    (H, W, 4) uint8 or float32
    """
    (width, height), filled = view.size, rim_depth(view.passes.beauty, view.passes.depth)
    picture = np.empty((height, width, 4), dtype)
    for top in range(0, height, _ROWS):
        rows = slice(top, min(top + _ROWS, height))
        beauty, depth = view.strip(rows.start, rows.stop, filled)
        _merge(
            picture[rows], beauty, depth, [(one, scale, rows) for one, scale in zip(drawn, scales, strict=True)], space
        )
    return picture


def _merge(
    onto: NDArray[Any], beauty: Floats, depth: Floats, drawn: Sequence[tuple[Drawn, float, slice]], space: Space
) -> None:
    """Composite rows of ``drawn`` with a strip's ``beauty`` and ``depth`` into ``onto``."""
    own: Space = "linear"
    for place, (one, scale, rows) in enumerate(drawn, 1):
        own_depth, is_last = one.depth[rows] * np.float32(scale), place == len(drawn)
        mixed = depth_composite(
            one.color[rows],
            one.alpha[rows],
            own_depth,
            beauty,
            depth,
            rendered_space=own,
            space=space,
            dtype=onto.dtype if is_last else np.float32,
        )
        if is_last:
            onto[:] = mixed
        else:
            depth, beauty, own = _nearest(depth, one.alpha[rows], own_depth), mixed, space


def _nearest(rendered: Floats, alpha: Floats, drawn_depth: Floats) -> Floats:
    """The nearer depth of each of the drawing's pixels; a pixel drawn without depth keeps what is behind it."""
    height, width = alpha.shape
    blocks = rendered.reshape(height, rendered.shape[0] // height, width, rendered.shape[1] // width)
    nearest: Floats = np.minimum(blocks.min(axis=(1, 3)), np.where(alpha > 0, drawn_depth, np.inf))
    return nearest
