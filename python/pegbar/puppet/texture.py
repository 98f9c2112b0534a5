"""What is painted on each layer of a figure: its own pixels, and completed where other layers hide it."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pegbar.puppet.inpaint import Completion, Method, complete
from pegbar.puppet.layers import Layer

Pixels = NDArray[np.uint8]
Flags = NDArray[np.bool_]
Coverage = NDArray[np.float32]
#: How soft an outline that is known as a mask only is drawn: the spread in pixels of what makes its stairs smooth.
_SOFTNESS = 0.7


def mask_alpha(mask: Flags) -> Coverage:
    """The coverage (H, W) in 0..1 of a mask: its outline where it was, without stairs, a pixel and a half wide."""
    soft = cv2.GaussianBlur(mask.astype(np.float32), (0, 0), _SOFTNESS, borderType=cv2.BORDER_REPLICATE)
    alpha: Coverage = np.clip((soft - 0.5) * 1.5 + 0.5, 0, 1).astype(np.float32)
    return alpha


def bled(image: Pixels, known: Flags) -> Pixels:
    """The picture (H, W, 3) with the nearest known colour wherever it is not ``known``."""
    if known.all() or not known.any():
        return image
    _, (rows, columns) = ndimage.distance_transform_edt(~known, return_indices=True)
    return np.ascontiguousarray(image[rows, columns])


def layer_textures(
    image: Pixels, alpha: Coverage, layers: Sequence[Layer], method: Method | Completion = "auto"
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
    """
    textures = []
    for layer in layers:
        hidden = layer.region & ~layer.drawn
        # What lies beside the layer is no part of it: it must not be carried into the hidden part.
        colors = bled(image, layer.drawn)
        if hidden.any() and layer.drawn.any():
            colors = complete(colors, hidden, method, source=layer.drawn)
            colors = bled(colors, layer.region)
        coverage = np.minimum(alpha, mask_alpha(layer.region))
        textures.append(np.dstack([colors, np.rint(coverage * 255).astype(np.uint8)]))
    return tuple(textures)
