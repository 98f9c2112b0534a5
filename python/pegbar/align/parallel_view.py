"""The orthographic camera that a figure was drawn from, where nobody gave one (Jain, Sheikh, Hodgins 2009, section 3).

The paper's artists set it by hand. Here every direction of a coarse grid is tried by the pose descriptor, and the best
are refined until the clip's markers lie on the drawn ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

from pegbar import arrays
from pegbar.align.descriptor import pose_descriptor, pose_distance
from pegbar.align.timewarp import time_warp
from pegbar.errors import DegenerateError
from pegbar.scene.limb_tree import limb_tree
from pegbar.scene.orthographic import OrthographicCamera

Floats = NDArray[np.float64]
#: Degrees.
AZIMUTHS = np.arange(-180.0, 180.0, 15.0)
ELEVATIONS = np.arange(-15.0, 61.0, 15.0)
HIGHEST = 85.0
#: So many of the grid's best directions are refined, each by warping and fitting in turn.
STARTS, ROUNDS = 6, 4
#: More frames than these are thinned out: they tell the direction no better.
FRAMES = 120
#: How much a limb's own scale is drawn to the common one; 0 leaves it free.
OWN = 2.0


@dataclass(frozen=True)
class _View:
    """A camera's angles in degrees and scale, and its error: the residual's share of the drawings' own extent."""

    azimuth: float
    elevation: float
    scale: float
    error: float


def find_orthographic(drawn: ArrayLike, points: ArrayLike, *, limbs: ArrayLike | None = None) -> OrthographicCamera:
    """Find the orthographic camera under which a clip looks most like the drawings.

    Neither the clip's travel nor the drawing's matters. Azimuth, elevation and scale are those of the least squared
    distance between drawn and projected markers, every frame about its own centre; with ``limbs``, between drawn and
    projected limbs, each of which may be drawn longer or shorter than the clip's.

    Parameters
    ----------
    drawn : (F, N, 2) float
        Drawn markers in the picture's units, y down; NaN where not visible.
    points : (F, N, 3) or (G, N, 3) float
        The clip's markers in metres, Y up.
    limbs : (K, 2) int, optional
        The pose descriptor's limbs (the paper: upper arms, forearms, thighs and shins). With them the clip is
        time-warped to the drawings for every direction that is tried; without them it is time-aligned already.

    Returns
    -------
    OrthographicCamera
        Its centre brings the clip's markers onto the drawn ones in the mean over all frames.

    Raises
    ------
    ValueError
        For a wrong shape, a number that is not finite, or without ``limbs`` a clip of another length.
    DegenerateError
        For drawings without extent, or fewer than two visible markers in every frame.

    Examples
    --------
    >>> clip = np.random.default_rng(1).normal(size=(9, 6, 3))
    >>> drawn = OrthographicCamera.from_angles(30, 10, scale=200, center=(320, 240)).project(clip)
    >>> find_orthographic(drawn, clip)
    OrthographicCamera(azimuth=30.0, elevation=10.0, scale=200)
    """
    marks = arrays.floats("drawn", drawn, ("F", "N", 2), allow="nan")
    frames, markers = marks.shape[:2]
    clip = arrays.floats("points", points, (frames if limbs is None else "G", markers, 3))
    if not (np.isfinite(marks).all(axis=-1).sum(axis=1) >= 2).any() or not len(clip):
        raise DegenerateError("drawn: want two visible markers in a frame, and a clip with frames")
    pairs = None if limbs is None else arrays.integers("limbs", limbs, ("K", 2), low=0, high=markers - 1)
    marks, clip = _thinned(marks), _thinned(clip)
    starts = sorted(_grid(marks, clip, pairs))[:STARTS]
    tree = None if pairs is None else np.array([link[:2] for level in limb_tree(pairs, clip, 0) for link in level])
    views = [_refined(marks, clip, pairs, tree, azimuth, elevation) for _, azimuth, elevation in starts]
    best = min(views, key=lambda view: view.error)
    if not best.scale > 0:
        raise DegenerateError("drawn: the drawings have no extent, or show nothing of the clip's pose")
    camera = OrthographicCamera.from_angles(best.azimuth, best.elevation, best.scale)
    offset = marks - camera.project(_aligned(marks, clip, pairs, camera))
    return OrthographicCamera(camera.rotation, camera.scale, np.nanmean(offset, axis=(0, 1)))


def _thinned(sequence: Floats) -> Floats:
    return sequence[:: -(-len(sequence) // FRAMES) or 1]


def _grid(marks: Floats, clip: Floats, limbs: NDArray[np.int64] | None) -> list[tuple[float, float, float]]:
    """(cost, azimuth, elevation) of every direction of the grid."""
    directions = [(azimuth, elevation) for azimuth in AZIMUTHS for elevation in ELEVATIONS]
    if limbs is None:
        return [
            (_fit(marks, clip, None, azimuth, elevation).error, azimuth, elevation) for azimuth, elevation in directions
        ]
    costs = []
    for azimuth, elevation in directions:
        camera = OrthographicCamera.from_angles(azimuth, elevation)
        warp = time_warp(_cost(marks, clip, limbs, camera), stiffness=0)
        costs.append((warp.cost / len(warp.path), azimuth, elevation))
    return costs


def _cost(marks: Floats, clip: Floats, limbs: NDArray[np.int64], camera: OrthographicCamera) -> Floats:
    return pose_distance(pose_descriptor(marks, limbs), pose_descriptor(camera.project(clip), limbs))


def _aligned(marks: Floats, clip: Floats, limbs: NDArray[np.int64] | None, camera: OrthographicCamera) -> Floats:
    """The clip's frames (F, N, 3) that go with the drawings."""
    return clip if limbs is None else clip[time_warp(_cost(marks, clip, limbs, camera), stiffness=0).frames]


def _refined(
    marks: Floats,
    clip: Floats,
    limbs: NDArray[np.int64] | None,
    tree: NDArray[np.int64] | None,
    azimuth: float,
    elevation: float,
) -> _View:
    view = _View(azimuth, elevation, 0.0, np.inf)
    for _ in range(1 if limbs is None else ROUNDS):
        poses = _aligned(marks, clip, limbs, OrthographicCamera.from_angles(view.azimuth, view.elevation))
        fitted = _fit(marks, poses, tree, *_best_angles(marks, poses, tree, view))
        if not fitted.error < view.error - 1e-9:
            break
        view = fitted
    return view


def _best_angles(marks: Floats, poses: Floats, limbs: NDArray[np.int64] | None, start: _View) -> tuple[float, float]:
    def residuals(angles: Floats) -> Floats:
        return _residuals(marks, poses, limbs, float(angles[0]), float(angles[1]))[0].ravel()

    bounds = ([-np.inf, -HIGHEST], [np.inf, HIGHEST])
    solved = least_squares(residuals, [start.azimuth, start.elevation], bounds=bounds, x_scale=10.0, xtol=1e-7)
    return float(solved.x[0]), float(solved.x[1])


def _fit(marks: Floats, poses: Floats, limbs: NDArray[np.int64] | None, azimuth: float, elevation: float) -> _View:
    residuals, scale, extent = _residuals(marks, poses, limbs, azimuth, elevation)
    error = float(np.sum(residuals**2)) / extent if extent > 0 and scale > 0 else np.inf
    return _View(float(azimuth), float(elevation), scale, error)


def _residuals(
    marks: Floats, poses: Floats, limbs: NDArray[np.int64] | None, azimuth: float, elevation: float
) -> tuple[Floats, float, float]:
    """Drawn minus projected, the best scale, and the drawings' squared extent.

    Compared are markers, each frame about its centre; or limbs, each of which may be drawn longer or shorter than the
    clip's for the whole sequence.
    """
    camera = OrthographicCamera.from_angles(azimuth, elevation)
    drawn, clip = _compared(marks, limbs), _compared(camera.project(poses), limbs)
    seen = np.asarray(np.isfinite(drawn).all(axis=-1, keepdims=True))
    drawn, clip = np.where(seen, drawn, 0), clip * seen
    if limbs is None:
        drawn, clip = _centred(drawn, seen), _centred(clip, seen)
    size = float(np.sum(clip**2))
    scale = max(float(np.sum(drawn * clip)) / size, 0.0) if size > 0 else 0.0
    scales = np.full(clip.shape[1], scale)
    if limbs is not None:
        own = np.sum(clip**2, axis=(0, 2)) + 1e-12 * size
        scales = np.maximum((np.sum(drawn * clip, axis=(0, 2)) + OWN * scale * own) / ((1 + OWN) * own), 0)
    return drawn - scales[:, None] * clip, scale, float(np.sum(drawn**2))


def _compared(points: Floats, limbs: NDArray[np.int64] | None) -> Floats:
    return points if limbs is None else points[:, limbs[:, 1]] - points[:, limbs[:, 0]]


def _centred(points: Floats, seen: NDArray[np.bool_]) -> Floats:
    count = np.maximum(seen.sum(axis=1, keepdims=True), 1)
    centre = np.sum(points * seen, axis=1, keepdims=True) / count
    centred: Floats = (points - centre) * seen
    return centred
