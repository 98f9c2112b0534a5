"""The planes of an EXR file as they are stored: colours as half, all else as float."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

_HALF_MAX = 65504.0
_COLORS = ("R", "G", "B", "A", "Y")


def stored_planes(channels: Mapping[str, ArrayLike], *, exact: bool = False) -> dict[str, NDArray[Any]]:
    """Return one contiguous plane a channel, in the type that it is stored as; ``exact`` keeps the type it has.

    Raises ValueError for what `pegbar.io.exr.write_exr` refuses.
    """
    planes: dict[str, NDArray[Any]] = {}
    for name, value in channels.items():
        array = np.asarray(value)
        if array.dtype.kind not in "fiu":
            raise ValueError(f"channels: {name!r}: want real numbers, got dtype {array.dtype}")
        if array.ndim == 3 and array.shape[2] in (3, 4) and array.size:
            prefix = f"{name}." if name else ""
            letters = [prefix + letter for letter in "RGBA"[: array.shape[2]]]
            planes |= zip(letters, _layer_planes(array, half=not exact), strict=True)
        elif array.ndim == 2 and name:
            planes[name] = _stored(array, half=not exact and name.rpartition(".")[2] in _COLORS)
        else:
            raise ValueError(f"channels: {name!r}: want shape (H, W) or (H, W, 3|4), got {array.shape}")
    if not planes or len({plane.shape for plane in planes.values()}) > 1 or not all(p.size for p in planes.values()):
        raise ValueError(f"channels: want one size for all, got { {n: p.shape for n, p in planes.items()} }")
    return planes


def _layer_planes(array: NDArray[Any], *, half: bool) -> list[NDArray[Any]]:
    """The planes of an (H, W, C) picture; converted as a whole, since a plane of it is not contiguous."""
    import cv2

    if array.dtype == np.uint32:
        return [np.ascontiguousarray(array[..., index]) for index in range(array.shape[2])]
    stored = _stored(array, half=half)
    planes = cv2.split(stored.view(np.int16) if stored.dtype == np.float16 else stored)
    return [np.asarray(plane).view(stored.dtype) for plane in planes]


def _stored(array: NDArray[Any], *, half: bool) -> NDArray[Any]:
    """As uint32 or half if it is that, as half if it shall be and fits, else as float."""
    if array.dtype == np.uint32 or array.dtype == np.float16:
        return np.ascontiguousarray(array)
    array = np.ascontiguousarray(array, np.float32)
    if not half or not array.size or max(array.max(), -array.min()) > _HALF_MAX:
        return array
    import cv2

    return np.asarray(cv2.convertFp16(array)).view(np.float16).reshape(array.shape)
