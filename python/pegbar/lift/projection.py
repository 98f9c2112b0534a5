"""Cameras as the linear rows of eq. 6 (2009 paper): what a drawn point says about its marker, in metres."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.orthographic import OrthographicCamera

Floats = NDArray[np.float64]
Camera = PerspectiveCamera | OrthographicCamera


def known(points: Floats) -> NDArray[np.bool_]:
    """Return where all coordinates of ``points`` (..., K) are finite (...)."""
    return np.asarray(np.isfinite(points).all(axis=-1))


def frame_cameras(camera: Any, frames: int) -> tuple[Camera, ...]:
    """Return one camera a frame: ``camera`` itself, a sequence of cameras, or an object with ``cameras``.

    Raises ValueError for anything else, and for another number of cameras than ``frames``.
    """
    if isinstance(camera, PerspectiveCamera | OrthographicCamera):
        return (camera,) * frames
    cameras = getattr(camera, "cameras", camera)
    if not isinstance(cameras, Sequence) or not all(
        isinstance(c, PerspectiveCamera | OrthographicCamera) for c in cameras
    ):
        raise ValueError(f"camera: want a camera or one for each frame, got {type(camera).__name__}")
    if len(cameras) != frames:
        raise ValueError(f"camera: want one camera or {frames}, one for each frame, got {len(cameras)}")
    return tuple(cameras)


def projection_rows(points: Floats, cameras: Sequence[Camera]) -> Floats:
    """Return the rows (F, N, 2, 4) of eq. 6 for drawn ``points`` (F, N, 2): ``a x + b y + c z = d`` in metres.

    An orthographic camera divides by its scale. For a perspective one the residual is the error in the picture times
    the marker's depth over the focal length, which is linear in the marker. Rows of points that are NaN are zero.
    """
    rows = np.empty((*points.shape[:2], 2, 4))
    shared = len(set(map(id, cameras))) == 1
    for part, camera in [(slice(None), cameras[0])] if shared else enumerate(cameras):
        rows[part] = _camera_rows(points[part], camera)
    rows[~known(points)] = 0
    return rows


def _camera_rows(points: Floats, camera: Camera) -> Floats:
    rows = np.empty((*points.shape, 4))
    if isinstance(camera, OrthographicCamera):
        rows[..., :3] = camera.rotation[:2]
        rows[..., 3] = (points - camera.center) / camera.scale
        return rows
    view = np.linalg.solve(camera.intrinsic / camera.intrinsic[2, 2], camera.matrix)
    inverse = np.linalg.inv(camera.intrinsic / camera.intrinsic[2, 2])
    plane = points @ inverse[:2, :2].T + inverse[:2, 2]
    rows[...] = view[:2] - plane[..., None] * view[2]
    rows[..., 3] *= -1
    return rows
