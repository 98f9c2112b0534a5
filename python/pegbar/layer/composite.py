"""Depth composite of a drawn and a rendered frame, and its mattes (Jain et al. 2010, equations 16 and 17)."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from pegbar import _kernels, arrays

Space = Literal["display", "linear"]


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
    """Composite a drawing and a render by their depths (Jain et al. 2010, equations 16 and 17).

    The nearer of both is put over the farther, premultiplied. With the drawing's straight colour h and coverage a,
    the render's premultiplied colour r and coverage ra: a h + (1 - a) r where the drawing is in front, r + (1 - ra) a h
    where the render is. On an opaque render this is the paper's composite exactly. Ties go to the render; a drawn
    pixel without depth (+inf) is in front; where the render covers nothing, the drawing stays.

    A render k times larger on both sides is composited sample by sample, then averaged: an edge between drawing and
    render is as smooth as k x k samples make it.

    Parameters
    ----------
    drawing : (H, W, 3) or (H, W, 4) uint8
        Straight sRGB colours. Their alpha channel is not used.
    alpha : (H, W) float
        The drawing's coverage, 0 to 1.
    drawing_depth : (H, W) float
        Metres along the view axis, +inf where the drawing has no depth.
    rendered : (k H, k W, 4) uint8 or float
        uint8 is straight, float premultiplied. Colours above 1 are allowed; coverage is clamped to 0..1.
    rendered_depth : (k H, k W) float
        Metres along the view axis, +inf where there is nothing.
    rendered_space : {"display", "linear"}
        What the render's colours are: sRGB, or proportional to light.
    space : {"display", "linear"}
        The space in which to composite, which is also the result's. Where it is not the render's own, each of the
        render's samples is unpremultiplied, converted and premultiplied again (colour without coverage, a glow that
        only adds light, is converted as it is). In linear space the drawing's colours are decoded.
    dtype : {uint8, float32}, optional
        Of the result; default ``out``'s, else ``rendered``'s. For uint8 the render's premultiplied samples are clipped
        to 0..1 before they are averaged, so that the edges of highlights stay smooth.
    out : (H, W, 4) array, optional
        Where to put the result: C-contiguous, of the result's dtype, apart from the inputs.

    Returns
    -------
    (H, W, 4) uint8 or float32
        uint8 is straight, rounded to nearest, 0 where nothing covers; float32 is premultiplied.

    Raises
    ------
    ValueError
        For a wrong shape, size or dtype; NaN or -inf in a depth; an alpha outside 0..1; a colour that is not finite.

    Examples
    --------
    >>> red = [[[255, 0, 0], [255, 0, 0]]]
    >>> depth_composite(red, [[1, 1]], [[2.0, 2.0]], [[[0, 0, 255, 255]] * 2], [[1.0, 3.0]])
    array([[[  0,   0, 255, 255],
            [255,   0,   0, 255]]], dtype=uint8)
    """
    drawing = arrays.image("drawing", drawing)
    size = drawing.shape[:2]
    alpha = arrays.floats("alpha", alpha, size, dtype=np.float32, allow="any")
    drawing_depth = arrays.floats("drawing_depth", drawing_depth, size, dtype=np.float32, allow="any")
    rendered = arrays.samples("rendered", rendered)
    scale = _scale("rendered", rendered, size)
    rendered_depth = arrays.floats("rendered_depth", rendered_depth, ("H", "W"), dtype=np.float32, allow="any")
    arrays.same_size("rendered_depth", rendered_depth, "rendered", rendered.shape)
    linear = [_is_linear("rendered_space", rendered_space), _is_linear("space", space)]
    inputs = (drawing, alpha, drawing_depth, rendered, rendered_depth)
    if out is None:
        out = np.empty((*size, 4), _pixel_type(rendered.dtype if dtype is None else dtype))
    else:
        _check_output(out, (*size, 4), dtype, inputs)
    _kernels.depth_composite(*inputs, scale, linear, out)
    return out


def holdout_matte(alpha: ArrayLike, drawing_depth: ArrayLike, rendered_depth: ArrayLike) -> NDArray[np.float32]:
    """Matte that holds the render out where the drawing is nearer (Jain et al. 2010, equation 16).

    The drawing's coverage where it is in front of the render, averaged over the render's samples: what a compositing
    package needs to do the depth composite again. With the drawing's straight colour h and the premultiplied render,
    ``rendered * (1 - holdout) + h * holdout`` (in Nuke: the drawing with the matte as its alpha, premultiplied; the
    render stencilled by the matte; merged by plus) is :func:`depth_composite` wherever the render is opaque or empty.
    Where a soft edge of the render is in front of the drawing, put :func:`visible_matte` in place of the second
    ``holdout``: then it is the composite everywhere. For a larger render both are exact in every pixel whose samples
    are all on one side of the drawing, or all of one colour; elsewhere they are an average of products by averages.

    Parameters
    ----------
    alpha : (H, W) float
        The drawing's coverage, 0 to 1.
    drawing_depth : (H, W) float
        Metres, +inf where the drawing has no depth.
    rendered_depth : (k H, k W) float
        Metres, +inf where there is nothing.

    Returns
    -------
    (H, W) float32
        0 to 1.

    Raises
    ------
    ValueError
        For a wrong shape or dtype; NaN or -inf in a depth; an alpha outside 0..1.

    Examples
    --------
    >>> holdout_matte([[1.0, 0.5]], [[2.0, 2.0]], [[1.0, 3.0]])
    array([[0. , 0.5]], dtype=float32)
    """
    return _matte(alpha, drawing_depth, None, rendered_depth)


def visible_matte(
    alpha: ArrayLike, drawing_depth: ArrayLike, rendered_alpha: ArrayLike, rendered_depth: ArrayLike
) -> NDArray[np.float32]:
    """Coverage of what is seen of a drawing: in front of the render, and through its soft edges.

    ``rendered * (1 - holdout) + h * visible`` is the depth composite; see :func:`holdout_matte`.

    Parameters
    ----------
    alpha : (H, W) float
        The drawing's coverage, 0 to 1.
    drawing_depth : (H, W) float
        Metres, +inf where the drawing has no depth.
    rendered_alpha : (k H, k W) float
        The render's coverage, clamped to 0..1.
    rendered_depth : (k H, k W) float
        Metres, +inf where there is nothing.

    Returns
    -------
    (H, W) float32
        0 to 1.

    Raises
    ------
    ValueError
        For a wrong shape or dtype; NaN or -inf in a depth; an alpha outside 0..1; a coverage that is not finite.

    Examples
    --------
    >>> visible_matte([[1.0, 1.0]], [[2.0, 2.0]], [[0.25, 0.25]], [[1.0, 3.0]])
    array([[0.75, 1.  ]], dtype=float32)
    """
    rendered_alpha = arrays.floats("rendered_alpha", rendered_alpha, ("H", "W"), dtype=np.float32, allow="any")
    return _matte(alpha, drawing_depth, rendered_alpha, rendered_depth)


def _matte(
    alpha: ArrayLike, drawing_depth: ArrayLike, rendered_alpha: NDArray[Any] | None, rendered_depth: ArrayLike
) -> NDArray[np.float32]:
    alpha = arrays.floats("alpha", alpha, ("H", "W"), dtype=np.float32, allow="any")
    drawing_depth = arrays.floats("drawing_depth", drawing_depth, alpha.shape, dtype=np.float32, allow="any")
    rendered_depth = arrays.floats("rendered_depth", rendered_depth, ("H", "W"), dtype=np.float32, allow="any")
    scale = _scale("rendered_depth", rendered_depth, alpha.shape)
    if rendered_alpha is not None:
        arrays.same_size("rendered_alpha", rendered_alpha, "rendered_depth", rendered_depth.shape)
    return _kernels.composite_matte(alpha, drawing_depth, rendered_alpha, rendered_depth, scale)


def _scale(name: str, rendered: NDArray[Any], size: tuple[int, ...]) -> int:
    """How many times larger than the drawing the render is."""
    got = rendered.shape[:2]
    scale = max((large // small for large, small in zip(got, size, strict=True) if small), default=1)
    if scale < 1 or got != (size[0] * scale, size[1] * scale):
        raise ValueError(
            f"{name}: want the drawing's {size[0]} rows x {size[1]} columns or the same whole multiple of both, "
            f"got {got[0]} x {got[1]}"
        )
    return scale


def _is_linear(name: str, space: str) -> bool:
    if space not in ("display", "linear"):
        raise ValueError(f'{name}: want "display" or "linear", got {space!r}')
    return space == "linear"


def _pixel_type(dtype: DTypeLike) -> np.dtype[Any]:
    try:
        kind = np.dtype(dtype)
    except TypeError as error:
        raise ValueError(f"dtype: {error}") from None
    if kind not in (np.dtype(np.uint8), np.dtype(np.float32)):
        raise ValueError(f"dtype: want uint8 or float32, got {kind}")
    return kind


def _check_output(
    out: object, shape: tuple[int, ...], dtype: DTypeLike | None, inputs: tuple[NDArray[Any], ...]
) -> None:
    if not isinstance(out, np.ndarray):
        raise ValueError(f"out: want an array, got {type(out).__name__}")
    wanted = _pixel_type(dtype) if dtype is not None else None
    if out.shape != shape or out.dtype not in (np.uint8, np.float32) or wanted not in (None, out.dtype):
        raise ValueError(f"out: want shape {shape}, {wanted or 'uint8 or float32'}, got {out.shape}, {out.dtype}")
    if not (out.flags.c_contiguous and out.flags.writeable and out.flags.aligned):
        raise ValueError("out: want a C-contiguous, aligned array that may be written")
    if any(np.may_share_memory(out, values) for values in inputs):
        raise ValueError("out: shares memory with an input")
