"""How opaque every drawn pixel is (Jain et al. 2010, equations 14 and 15), and its colour without the paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import _kernels, arrays

Mode = Literal["ink", "unmix", "fill", "alpha"]


@dataclass(frozen=True, eq=False)
class Matte:
    """A drawing off its paper: straight ``color``, ``alpha`` (H, W) float32 in 0..1, and its mode.

    ``color`` is (H, W, 3) uint8; for the mode "alpha" it is the (H, W, 4) picture itself.
    """

    color: NDArray[np.uint8]
    alpha: NDArray[np.float32]
    mode: Mode


def ink_alpha(image: ArrayLike) -> NDArray[np.float32]:
    """Alpha as darkness (Jain et al. 2010, equations 14 and 15): white paper exactly 0, black ink exactly 1.

    Parameters
    ----------
    image : (H, W, 3) or (H, W, 4) uint8
        The drawing. One with alpha is put over white first.

    Returns
    -------
    (H, W) float32
        1 - (0.299 R + 0.587 G + 0.114 B) / 255. The paper prints 0.298, which leaves white paper an alpha of 0.001.

    Raises
    ------
    ValueError
        For a wrong shape or dtype.

    Examples
    --------
    >>> ink_alpha([[[255, 255, 255], [0, 0, 0], [0, 255, 0]]]).round(3)
    array([[0.   , 1.   , 0.413]], dtype=float32)
    """
    return _kernels.ink_alpha(arrays.image("image", image))


def matte(
    image: ArrayLike,
    mode: Mode | Literal["auto"] = "auto",
    *,
    labels: ArrayLike | None = None,
    white_point: int = 255,
) -> Matte:
    """Take a drawing off its paper: colour and alpha that give the drawing back over white.

    Parameters
    ----------
    image : (H, W, 3) or (H, W, 4) uint8
        The drawing. Every mode but "alpha" puts one with alpha over white first.
    mode : {"auto", "ink", "unmix", "fill", "alpha"}
        - "ink": equations 14 and 15 of Jain et al. 2010, alpha = darkness, colour as drawn. Light colours become glass.
        - "unmix": alpha = 1 - min(R, G, B), and the colour that over white gives the drawing back.
        - "fill": alpha 1 inside the labelled limbs, "unmix" outside. The limbs' border pixels, part paint and part
          paper, get the alpha with which the paint farther in or the outline's ink explains them; hard borders stay
          opaque.
        - "alpha": the picture's own alpha and colour.
        - "auto": "alpha" for a picture whose alpha channel is not all 255, else "fill" if there are labels, else
          "unmix".
    labels : (H, W) uint8, optional
        0 where there is no limb; needed by "fill". Labels grown over the whole figure give the cleanest rim.
    white_point : int
        1..255. Levels from here up are paper white, and those below are spread over the whole range: a little below the
        darkest paper of a scan. Not used by "alpha".

    Returns
    -------
    Matte
        Colour, alpha and the mode that was used.

    Raises
    ------
    ValueError
        For a wrong shape or dtype, an unknown mode, a white point outside 1..255, "alpha" of a picture without
        alpha, or "fill" without labels.

    Examples
    --------
    >>> light = matte([[[255, 191, 191]]], "unmix")
    >>> light.color, light.alpha.round(3)
    (array([[[255,   0,   0]]], dtype=uint8), array([[0.251]], dtype=float32))
    >>> matte([[[250, 247, 244]]], "unmix", white_point=244).alpha
    array([[0.]], dtype=float32)
    """
    image = arrays.image("image", image)
    if mode not in ("auto", "ink", "unmix", "fill", "alpha"):
        raise ValueError(f'mode: want "auto", "ink", "unmix", "fill" or "alpha", got {mode!r}')
    if labels is not None:
        labels = arrays.integers("labels", labels, ("H", "W"), dtype=np.uint8)
        arrays.same_size("labels", labels, "image", image.shape)
    if not isinstance(white_point, (int, np.integer)) or not 1 <= white_point <= 255:
        raise ValueError(f"white_point: want an integer from 1 to 255, got {white_point!r}")
    if mode == "auto":
        mode = "alpha" if _kernels.has_alpha(image) else "unmix" if labels is None else "fill"
    if mode == "alpha" and image.shape[2] == 3:
        raise ValueError('image: want an alpha channel for the matte "alpha", got 3 channels')
    if mode == "alpha":
        return Matte(image, _kernels.own_alpha(image), mode)
    image = _whiten(image, white_point)
    if mode == "fill":
        if labels is None:
            raise ValueError('labels: want limb labels for the matte "fill", got None')
        return Matte(*_kernels.fill_matte(image, labels), mode)
    return Matte(*_kernels.matte(image, mode), mode)


def _whiten(image: NDArray[np.uint8], white_point: int) -> NDArray[np.uint8]:
    """Spread the levels below the white point over 0..255; an alpha channel stays as it is."""
    if white_point == 255 or not image.size:
        return image
    levels = np.arange(256)
    # To the nearest, halves up, in whole numbers.
    spread = np.minimum(255, (2 * 255 * levels + white_point) // (2 * white_point))
    table = np.repeat(spread[:, None], image.shape[2], axis=1)
    table[:, 3:] = levels[:, None]
    return np.asarray(cv2.LUT(image, table[None].astype(np.uint8)), np.uint8)
