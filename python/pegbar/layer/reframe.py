"""Pictures, coverage, depth and labels of a drawing as an animation camera over it sees them."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.scene.film_view import FilmView

Floats = NDArray[np.float32]
Value = TypeVar("Value", bound=np.generic)


def reframe_picture(picture: NDArray[Any], view: FilmView) -> NDArray[Any]:
    """Return what ``view`` shows of a picture (H, W, 4), transparent beyond the paper.

    uint8 is straight and float32 premultiplied, as `pegbar.depth_composite` makes them; the result is of the same kind.
    Filtered premultiplied with Keys' cubic, which is widened where the picture gets smaller.

    Raises
    ------
    ValueError
        For a picture of another size than the view's paper.
    """
    _check("picture", picture, view)
    if picture.dtype == np.uint8:
        alpha = picture[..., 3:].astype(np.float32) / np.float32(255)
        colors = picture[..., :3].astype(np.float32) / np.float32(255) * alpha
        return _straight(_resampled(np.concatenate([colors, alpha], axis=2), view))
    return _resampled(np.asarray(picture, np.float32), view)


def reframe_coverage(coverage: NDArray[Any], view: FilmView) -> Floats:
    """Return what ``view`` shows of a coverage (H, W), filtered as a picture's alpha; 0 beyond the paper."""
    _check("coverage", coverage, view)
    planes = np.repeat(np.asarray(coverage, np.float32)[..., None], 4, axis=2)
    return np.ascontiguousarray(_resampled(planes, view)[..., 0])


def reframe_nearest(values: NDArray[Value], view: FilmView, empty: float) -> NDArray[Value]:
    """Return what ``view`` shows of depths or labels (H, W): values that are there, none mixed of two.

    Every film pixel takes the nearest of the drawing's; where that is ``empty``, the nearest one under the filter's
    middle that is not, so that soft edges have depth and label as well. ``empty`` beyond the paper.

    Raises
    ------
    ValueError
        For values of another size than the view's paper.
    """
    _check("values", values, view)
    known = np.ascontiguousarray(values != empty, np.uint8)
    indices = _kernels.nearest_view(known, _matrix(view), list(view.size))
    found: NDArray[Value] = np.where(indices >= 0, values.ravel()[indices], values.dtype.type(empty))
    return found


def _resampled(picture: Floats, view: FilmView) -> Floats:
    return _kernels.resample_view(np.ascontiguousarray(picture), _matrix(view), list(view.size))


def _matrix(view: FilmView) -> list[float]:
    numbers: list[float] = view.to_paper[:2].ravel().tolist()
    return numbers


def _straight(premultiplied: Floats) -> NDArray[np.uint8]:
    alpha = premultiplied[..., 3:]
    colors = np.divide(premultiplied[..., :3], alpha, out=np.zeros_like(premultiplied[..., :3]), where=alpha > 0)
    straight: NDArray[np.uint8] = np.rint(np.concatenate([colors, alpha], axis=2).clip(0, 1) * 255).astype(np.uint8)
    # What covers less than half an 8-bit level is nothing, as in the composite.
    straight[straight[..., 3] == 0] = 0
    return straight


def _check(name: str, values: NDArray[Any], view: FilmView) -> None:
    height, width = values.shape[:2]
    if (width, height) != view.paper:
        raise ValueError(
            f"{name}: the camera sees paper of {view.paper[0]} x {view.paper[1]} pixels, got {width} x {height}"
        )
