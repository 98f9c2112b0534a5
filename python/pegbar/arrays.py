"""Coerces what users pass to what kernels take: once, by argument name, with a ValueError that says what was wanted.

A shape is a tuple of sizes: a number is that number, a tuple of numbers is any of them, a name is any size. A leading
``...`` stands for any number of leading axes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from types import EllipsisType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Size = int | str | tuple[int, ...]
Shape = tuple[Size | EllipsisType, ...]


def floats(
    name: str, value: ArrayLike, shape: Shape, *, dtype: Any = np.float64, allow: str = "finite"
) -> NDArray[Any]:
    """Return ``value`` as a C-contiguous float array of ``dtype``.

    ``allow`` is "finite", "nan" (missing values may be NaN) or "any" (the kernel checks the values itself).
    """
    array = _plain(name, value, shape)
    if array.dtype.kind not in "fiu":
        raise ValueError(f"{name}: want real numbers, got dtype {array.dtype}")
    _check_shape(name, array, shape)
    with np.errstate(over="ignore"):
        array = np.ascontiguousarray(array, dtype=dtype).reshape(array.shape)
    if allow != "any":
        wrong = ~np.isfinite(array) if allow == "finite" else np.isinf(array)
        if wrong.any():
            index = tuple(int(i) for i in np.argwhere(wrong)[0])
            raise ValueError(f"{name}: want finite numbers, got {array[index]} at {list(index)}")
    return array


def integers(
    name: str,
    value: ArrayLike,
    shape: Shape,
    *,
    dtype: Any = np.int64,
    low: int | None = None,
    high: int | None = None,
) -> NDArray[Any]:
    """Return ``value`` as a C-contiguous integer array of ``dtype``; every value must lie in ``low``..``high``."""
    array = _plain(name, value, shape)
    if array.dtype.kind not in "iu" and array.size:
        raise ValueError(f"{name}: want integers, got dtype {array.dtype}")
    _check_shape(name, array, shape)
    if array.size and (array.dtype != dtype or low is not None or high is not None):
        limits = np.iinfo(dtype)
        low, high = limits.min if low is None else low, limits.max if high is None else high
        least, most = int(array.min()), int(array.max())
        if least < low or most > high:
            raise ValueError(f"{name}: want values in {low}..{high}, got {least if least < low else most}")
    return np.ascontiguousarray(array, dtype=dtype).reshape(array.shape)


def flags(name: str, value: ArrayLike, shape: Shape) -> NDArray[np.bool_]:
    """Return ``value`` as a C-contiguous boolean array."""
    array = _plain(name, value, shape)
    if array.dtype.kind != "b":
        raise ValueError(f"{name}: want true or false values, got dtype {array.dtype}")
    _check_shape(name, array, shape)
    return np.ascontiguousarray(array).reshape(array.shape)


def image(name: str, value: ArrayLike, channels: tuple[int, ...] = (3, 4)) -> NDArray[np.uint8]:
    """Return ``value`` as a C-contiguous (H, W, C) uint8 picture with one of ``channels`` as C."""
    return integers(name, value, ("H", "W", channels), dtype=np.uint8)


def samples(name: str, value: ArrayLike) -> NDArray[Any]:
    """Return ``value`` as C-contiguous (H, W, 4) samples of a render: integers as uint8, floats as float32."""
    array = _plain(name, value, ("H", "W", 4))
    if array.dtype.kind == "f":
        return floats(name, array, ("H", "W", 4), dtype=np.float32, allow="any")
    return image(name, array, (4,))


def same_size(name: str, array: NDArray[Any], other: str, size: tuple[int, ...]) -> None:
    """Refuse ``array`` unless its rows and columns are ``size``, the rows and columns of argument ``other``."""
    if array.shape[:2] != size[:2]:
        raise ValueError(f"{name}: want {size[0]} rows x {size[1]} columns as {other}, got shape {array.shape}")


def images(name: str, values: Iterable[ArrayLike]) -> Iterator[NDArray[np.uint8]]:
    """Give ``values`` as pictures, as they come, all of the first one's size and channels."""
    shape: tuple[int, ...] = ()
    for index, value in enumerate(values):
        picture = image(f"{name}[{index}]", value, (shape[2],) if shape else (3, 4))
        if shape:
            same_size(f"{name}[{index}]", picture, "the first frame", shape)
        shape = picture.shape
        yield picture


def _plain(name: str, value: ArrayLike, shape: Shape) -> NDArray[Any]:
    try:
        array = np.asarray(value)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{name}: not an array: {error}") from None
    sizes = [size for size in shape[1:] if isinstance(size, int)]
    if array.shape == (0,) and len(sizes) == len(shape) - 1:
        return array.reshape(0, *sizes)  # an empty list has no other axes
    return array


def _check_shape(name: str, array: NDArray[Any], shape: Shape) -> None:
    sizes = [size for size in shape if not isinstance(size, EllipsisType)]
    leading = len(sizes) < len(shape)
    got = array.shape[array.ndim - len(sizes) :] if leading and array.ndim >= len(sizes) else array.shape
    if len(got) != len(sizes) or not all(map(_fits, sizes, got)):
        raise ValueError(f"{name}: want shape {_describe(shape)}, got {array.shape}")


def _fits(size: Size, got: int) -> bool:
    return isinstance(size, str) or got == size or (isinstance(size, tuple) and got in size)


def _describe(shape: Shape) -> str:
    words = []
    for size in shape:
        if isinstance(size, tuple):
            words.append("|".join(map(str, size)))
        else:
            words.append("..." if isinstance(size, EllipsisType) else str(size))
    return f"({', '.join(words)}{',' if len(words) == 1 else ''})"
