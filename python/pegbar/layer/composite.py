"""Depth composite of a drawn and a rendered frame (Jain et al. 2010, equations 16 and 17)."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from pegbar import _kernels, arrays

Space = Literal["display", "linear"]
SPACES = ("display", "linear")


def depth_composite(
    drawing: ArrayLike,
    alpha: ArrayLike,
    drawing_depth: ArrayLike,
    rendered: ArrayLike,
    rendered_depth: ArrayLike,
    *,
    rendered_space: Space = "display",
    space: Space = "display",
    dtype: DTypeLike | None = None,
    out: NDArray[Any] | None = None,
) -> NDArray[Any]:
    """Composite a drawing and a render by their depths (Jain et al. 2010, equations 16 and 17)."""
    drawing = arrays.image("drawing", drawing)
    size = drawing.shape[:2]
    alpha = arrays.floats("alpha", alpha, size, dtype=np.float32, allow="any")
    drawing_depth = arrays.floats("drawing_depth", drawing_depth, size, dtype=np.float32, allow="any")
    rendered = _samples(rendered)
    scale = _scale(size, rendered.shape[:2])
    rendered_depth = arrays.floats("rendered_depth", rendered_depth, ("H", "W"), dtype=np.float32, allow="any")
    arrays.same_size("rendered_depth", rendered_depth, "rendered", rendered.shape)
    for name, value in ("rendered_space", rendered_space), ("space", space):
        if value not in SPACES:
            raise ValueError(f'{name}: want "display" or "linear", got {value!r}')
    inputs = (drawing, alpha, drawing_depth, rendered, rendered_depth)
    out = _output((*size, 4), rendered.dtype if dtype is None else dtype, out, inputs)
    _kernels.depth_composite(*inputs, scale, [rendered_space == "linear", space == "linear"], out)
    return out


def _samples(rendered: ArrayLike) -> NDArray[Any]:
    array = np.asarray(rendered)
    if array.dtype.kind == "f":
        return arrays.floats("rendered", array, ("H", "W", 4), dtype=np.float32, allow="any")
    return arrays.image("rendered", array, (4,))


def _scale(size: tuple[int, ...], rendered: tuple[int, ...]) -> int:
    scale = max((large // small for large, small in zip(rendered, size, strict=True) if small), default=1)
    if scale < 1 or rendered != (size[0] * scale, size[1] * scale):
        raise ValueError(
            f"rendered: want the drawing's {size[0]} rows x {size[1]} columns or a whole multiple of both, "
            f"got {rendered[0]} x {rendered[1]}"
        )
    return scale


def _output(
    shape: tuple[int, ...], dtype: DTypeLike, out: NDArray[Any] | None, inputs: tuple[NDArray[Any], ...]
) -> NDArray[Any]:
    kind = np.dtype(dtype)
    if kind not in (np.uint8, np.float32):
        raise ValueError(f"dtype: want uint8 or float32, got {kind}")
    if out is None:
        return np.empty(shape, kind)
    return out
