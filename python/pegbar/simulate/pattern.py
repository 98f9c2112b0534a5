"""The colours of a cloth's points: plain, stripes, bands, checks, dots or a texture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pegbar.simulate.elements import Cloth
from pegbar.simulate.finer import Finer
from pegbar.simulate.materials import Look

Floats = NDArray[np.float64]
#: Radius of a dot in pattern sizes.
DOT = 0.28


def sheet_colors(cloth: Cloth, sheet: Finer) -> NDArray[np.float32]:
    """Return the straight linear RGBA (m, 4) of the points of ``cloth``'s finer sheet."""
    look = cloth.look
    if cloth.coordinates is None or (look.pattern == "plain" and look.texture is None):
        return np.tile(np.array(look.color, np.float32), (sheet.weights.shape[0], 1))
    places = _coordinates(cloth.coordinates, cloth.around, sheet)
    if look.texture is not None:
        low, high = cloth.coordinates.min(axis=0), cloth.coordinates.max(axis=0)
        size = np.array([cloth.around or high[0] - low[0], high[1] - low[1]])
        return _sampled(look.texture, (places - low) / np.maximum(size, 1e-9))
    second = _second(look, places, cloth.around)
    return np.where(second[:, None], np.array(look.second, np.float32), np.array(look.color, np.float32))


def _coordinates(corners: Floats, around: float | None, sheet: Finer) -> Floats:
    """Coordinates (m, 2) of the points. A triangle where a closed sheet begins anew goes on beyond its length."""
    own = corners[sheet.coarse[sheet.owner]]
    if around is not None:
        across = own[..., 0] - own[:, :1, 0]
        own[..., 0] -= around * np.round(across / around)
    places: Floats = np.einsum("mc,mci->mi", sheet.shares, own)
    return places


def _second(look: Look, places: Floats, around: float | None) -> NDArray[np.bool_]:
    """Which points have the second colour; round a closed sheet there is a whole number of patterns."""
    size = np.array([look.pattern_size, look.pattern_size])
    if around is not None:
        size[0] = around / max(1, round(around / look.pattern_size))
    across, along = (places / size).T
    if look.pattern == "dots":
        row = np.floor(along)
        from_dot = np.hypot((across + 0.5 * (row % 2)) % 1 - 0.5, along % 1 - 0.5)
        return np.asarray(from_dot < DOT)
    stripes, bands = across % 1 < 0.5, along % 1 < 0.5
    which = {"stripes": stripes, "bands": bands, "checks": stripes ^ bands}
    return np.asarray(which[look.pattern])


def _sampled(texture: NDArray[np.uint8], places: Floats) -> NDArray[np.float32]:
    """Bilinear samples of a straight sRGB texture at ``places`` (m, 2) in 0..1, in linear light."""
    srgb = texture / 255.0
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    linear[..., 3] = srgb[..., 3]
    height, width = texture.shape[:2]
    # Beyond its end a closed sheet begins anew.
    across = np.where(places[:, 0] > 1 + 1e-9, places[:, 0] - 1, places[:, 0])
    x = np.clip(across * width - 0.5, 0, width - 1)
    y = np.clip(places[:, 1] * height - 0.5, 0, height - 1)
    left, top = x.astype(int), y.astype(int)
    right, low = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    u, v = (x - left)[:, None], (y - top)[:, None]
    upper = (1 - u) * linear[top, left] + u * linear[top, right]
    lower = (1 - u) * linear[low, left] + u * linear[low, right]
    colors: NDArray[np.float32] = ((1 - v) * upper + v * lower).astype(np.float32)
    return colors
