"""Drawn points as rays in space, and the noise of the hand that marked them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

from pegbar.lift.projection import Camera, known
from pegbar.scene.orthographic import OrthographicCamera

Floats = NDArray[np.float64]
#: Second differences as a penalty: the diagonals of D'D away from the ends.
JOLT = (6.0, -4.0, 1.0)


def sight_rays(points: Floats, cameras: Sequence[Camera]) -> tuple[Floats, Floats]:
    """Return a point on the ray of every drawn point and its unit direction away from the camera, both (F, N, 3)."""
    starts, directions = np.empty((*points.shape[:2], 3)), np.empty((*points.shape[:2], 3))
    for part, camera in camera_parts(cameras):
        depths = np.zeros(points[part].shape[:-1])
        if isinstance(camera, OrthographicCamera):
            starts[part] = camera.unproject(points[part], depths)
            directions[part] = camera.rotation[2]
        else:
            starts[part] = camera.position
            away = camera.unproject(points[part], depths + 1) - camera.position
            directions[part] = away / np.linalg.norm(away, axis=-1, keepdims=True)
    return starts, directions


def camera_parts(cameras: Sequence[Camera]) -> list[tuple[slice, Camera]]:
    """Return the runs of frames that have the same camera."""
    starts = [f for f, camera in enumerate(cameras) if f == 0 or camera is not cameras[f - 1]]
    ends = [*starts[1:], len(cameras)]
    return [(slice(start, end), cameras[start]) for start, end in zip(starts, ends, strict=True)]


def project(points: Floats, cameras: Sequence[Camera]) -> Floats:
    """Return the pictures (F, N, 2) of world ``points`` (F, N, 3), each frame by its own camera."""
    seen = np.empty((*points.shape[:2], 2))
    for part, camera in camera_parts(cameras):
        seen[part] = camera.project(points[part])
    return seen


def metres_per_unit(points: Floats, cameras: Sequence[Camera]) -> Floats:
    """Return how many metres one picture unit is at world ``points`` (F, N, 3): one number a frame (F,)."""
    scale = np.empty(len(points))
    for part, camera in camera_parts(cameras):
        if isinstance(camera, OrthographicCamera):
            scale[part] = 1 / camera.scale
        else:
            scale[part] = camera.depth(points[part]).mean(axis=-1) / camera.focal_length
    return scale


def mark_noise(points: Floats, motion: float) -> float:
    """Return the deviation of the marks ``points`` (F, N, 2), in their unit, from their own fourth differences.

    ``motion`` is what natural movement alone gives; NaN marks are left out. Fewer than 6 frames give 0.
    """
    if len(points) < 6:
        return 0.0
    wobble = np.abs(np.diff(points, 4, axis=0))
    wobble = wobble[np.isfinite(wobble)]
    # 70 is the sum of the squares of the differences' factors, 0.6745 the median of a unit normal's size.
    measured = float(np.median(wobble)) / 0.6745 / np.sqrt(70) if wobble.size else 0.0
    return float(np.sqrt(max(measured**2 - motion**2, 0)))


def fill_marks(points: Floats, picture: Floats) -> Floats:
    """Return ``points`` (F, N, 2) with their NaN marks put where the clip's ``picture`` (F, N, 2) would lead them.

    The offset from the picture runs linearly in time between the frames where the mark is visible; a mark that never is
    takes the visible ones' mean offset.
    """
    offset = points - picture
    seen = known(offset)
    frames = np.arange(len(points))
    with_others = np.nansum(offset, axis=1) / np.maximum(seen.sum(axis=1), 1)[:, None]
    for marker in np.flatnonzero(~seen.all(axis=0)):
        visible = seen[:, marker]
        for axis in range(2):
            between = (
                np.interp(frames, frames[visible], offset[visible, marker, axis])
                if visible.any()
                else with_others[:, axis]
            )
            offset[~visible, marker, axis] = between[~visible]
    filled: Floats = np.where(seen[..., None], points, picture + offset)
    return filled


def smooth_marks(points: Floats, noise: Floats, jolts: Floats) -> Floats:
    """Return ``points`` (F, N, 2) smoothed over time as much as their ``noise`` (F, N) asks for.

    ``jolts`` (N,) is the usual size of a marker's second difference.
    """
    smoothed = points.copy()
    if len(points) < 3:
        return smoothed
    penalty = jolt_diagonals(len(points))
    for marker in np.flatnonzero(noise.any(axis=0)):
        weight = (jolts[marker] / np.maximum(noise[:, marker], 1e-3 * jolts[marker])) ** 2
        diagonals = penalty + np.pad(weight[None], ((0, 2), (0, 0)))
        smoothed[:, marker] = solveh_banded(diagonals, weight[:, None] * points[:, marker], lower=True)
    return smoothed


def jolt_diagonals(frames: int) -> Floats:
    """Return the lower diagonals (3, F) of the sum of squared second differences as a matrix, for 3 frames or more."""
    diagonals = np.repeat(np.array(JOLT)[:, None], frames, axis=1)
    diagonals[0, [0, -1]], diagonals[0, [1, -2]] = 1, 4 if frames == 3 else 5
    diagonals[1, [0, -2]] = -2
    return diagonals
