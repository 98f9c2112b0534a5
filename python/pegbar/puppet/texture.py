"""What is painted on each layer of a figure: its own pixels, and completed where other layers hide it."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.puppet.inpaint import Completion, Method, bled, complete
from pegbar.puppet.layers import Layer

Pixels = NDArray[np.uint8]
Flags = NDArray[np.bool_]
Coverage = NDArray[np.float32]
#: How soft an outline that is known as a mask only is drawn: the spread in pixels of what makes its stairs smooth.
_SOFTNESS = 0.7
#: A pixel with less of the figure than this has some of the background's colour.
_OPAQUE = 0.98
#: How far colour is carried beyond a layer's region, in pixels.
_BLEED = 6


def mask_alpha(mask: Flags) -> Coverage:
    """The coverage (H, W) in 0..1 of a mask: its outline where it was, without stairs, a pixel and a half wide."""
    soft = cv2.GaussianBlur(mask.astype(np.float32), (0, 0), _SOFTNESS, borderType=cv2.BORDER_REPLICATE)
    alpha: Coverage = np.clip((soft - 0.5) * 1.5 + 0.5, 0, 1).astype(np.float32)
    return alpha


def layer_textures(
    image: Pixels,
    alpha: Coverage,
    layers: Sequence[Layer],
    method: Method | Completion = "auto",
    *,
    rim: float = 3.0,
) -> tuple[Pixels, ...]:
    """The texture (H, W, 4) of every layer, straight alpha, in the picture's coordinates.

    Parameters
    ----------
    image : (H, W, 3) uint8
        The figure's colours.
    alpha : (H, W) float32
        The whole figure's coverage.
    layers : sequence of Layer
        Front to back.
    method : see `complete`
        How what others hide is filled in.
    rim : float
        How far in from its border a layer's own colours begin, in pixels: nearer are outlines and blends with what is
        beside it, which must not be carried into what is filled in.
    """
    opaque = alpha >= _OPAQUE
    textures = []
    for layer in layers:
        colors = bled(image, layer.drawn & opaque)
        hidden = layer.region & ~layer.drawn
        if hidden.any() and layer.drawn.any():
            deep = cv2.distanceTransform(layer.drawn.view(np.uint8), cv2.DIST_L2, 5)
            sure = deep > min(rim, 0.5 * float(deep.max()))
            filled = complete(bled(image, sure), layer.region & ~sure, method, source=sure)
            colors = bled(np.where(hidden[..., None], filled, colors), layer.region & (opaque | hidden))
        coverage = np.minimum(alpha, mask_alpha(layer.region))
        # Bilinear sampling reaches a pixel beyond what is covered, a smaller picture's a few more.
        near = cv2.dilate(layer.region.view(np.uint8), np.ones((2 * _BLEED + 1,) * 2, np.uint8))
        colors = np.where(near[..., None] > 0, colors, 0)
        textures.append(np.dstack([colors, np.rint(coverage * 255).astype(np.uint8)]))
    return tuple(textures)
