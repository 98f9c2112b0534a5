"""The pose of a clip and the camera that look most like one picture (Hornung, Dekkers, Kobbelt 2007, section 5)."""

from __future__ import annotations

import math
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import _kernels, arrays
from pegbar.align.pose_fit import PoseFit
from pegbar.errors import DegenerateError

Floats = NDArray[np.float64]
Loss = Literal["squared", "huber", "cauchy", "geman_mcclure"]
#: The usual lens, and how far its focal length strays (standard deviation of the logarithm).
USUAL_FIELD_OF_VIEW = math.radians(40)
FOCAL_SPREAD = 0.35
#: How far a camera is usually rolled, and how far it stands above or below the level, in radians.
ROLL_SPREAD = math.radians(5)
ELEVATION_SPREAD = math.radians(30)
#: The loss's scale, at least, as part of the marks' extent: marks by eye are no better.
LEAST_SCALE = 0.015
#: Marks narrower than this part of their length lie on one line.
_LINE = 1e-6


def fit_pose(
    joints: ArrayLike,
    poses: ArrayLike,
    image_size: ArrayLike,
    *,
    active: ArrayLike | None = None,
    field_of_view: float | None = None,
    loss: Loss = "huber",
    scale: float | None = None,
    starts: int = 8,
    usual_field_of_view: float = USUAL_FIELD_OF_VIEW,
    focal_spread: float = FOCAL_SPREAD,
    roll_spread: float = ROLL_SPREAD,
    elevation_spread: float = ELEVATION_SPREAD,
) -> PoseFit:
    """Find the pose of a clip, and the camera, under which it looks most like one picture (Hornung et al. 2007, s5).

    A camera with seven unknowns (place, orientation, field of view) is fitted to every pose from several azimuths
    (equations 1-3, the reprojection error by Levenberg-Marquardt); the pose with the lowest cost is the answer.

    Parameters
    ----------
    joints : (N, 2) float
        The marks on the picture, (x, y) in pixels, pixel centres at integers. They may lie outside the picture, and
        be NaN where switched off.
    poses : (P, N, 3) float
        The same joints in every pose, world metres, y up; NaN is allowed where switched off.
    image_size : (width, height)
        Of the picture in pixels. The principal point is its middle, pixels are square.
    active : (N,) bool, optional
        Which joints count; None is all. Four or more.
    field_of_view : float, optional
        Horizontal, radians. None solves it for every pose, pulled to the usual one: a figure's marks hardly tell it.
    loss : {"huber", "squared", "cauchy", "geman_mcclure"}
        What a mark costs that is off by e scales: e^2 near zero; an outlier costs 2 e - 1, e^2, ln(1 + e^2), or 1.
    scale : float, optional
        Scale of the loss in pixels: how far marks are usually off. None is 1.5% of the marks' extent, or what half of
        them are off where even the best pose fits worse (other proportions, or no such pose in the clip).
    starts : int
        Azimuths to start from, all round.
    usual_field_of_view, focal_spread : float
        Where the field of view is pulled when it is not given, in radians, and the spread of the focal length's
        logarithm: 0.35 is a third up or down.
    roll_spread, elevation_spread : float
        How far the camera may well be rolled, and above or below the level, in radians; infinity does not care.

    Returns
    -------
    PoseFit
        The best pose and its camera, and every pose's camera, error and rank.

    Raises
    ------
    ValueError
        For a wrong shape or option, no pose, or a number that is not finite in an active joint (named).
    DegenerateError
        For fewer than four active joints, marks on one line or in one place, or no pose whose joints are not on a line.

    Examples
    --------
    >>> poses = np.random.default_rng(0).normal(size=(5, 12, 3))
    >>> seen = poses[3] @ [[1, 0, 0], [0, -1, 0], [0, 0, -1]] + [0, 0, 6]
    >>> fit = fit_pose(seen[:, :2] / seen[:, 2:] * 800 + [319.5, 239.5], poses, (640, 480))
    >>> fit.pose, fit.error < 1
    (3, True)
    """
    if loss not in get_args(Loss):
        raise ValueError(f"loss: want one of {', '.join(get_args(Loss))}, got {loss!r}")
    if scale is not None and not 0 < scale < math.inf:
        raise ValueError(f"scale: want pixels, more than zero, got {scale}")
    size = arrays.integers("image_size", image_size, (2,), low=1)
    count = int(arrays.integers("starts", starts, (), low=1, high=10_000))
    marks, points, seen = _inputs(joints, poses, active)
    angle = _angle("usual_field_of_view", usual_field_of_view)
    if field_of_view is not None:
        angle = _angle("field_of_view", field_of_view)
    spreads = {"focal_spread": focal_spread, "roll_spread": roll_spread, "elevation_spread": elevation_spread}
    for name, value in spreads.items():
        if not value > 0:
            raise ValueError(f"{name}: want more than zero, got {value}")
    focal = size[0] / 2 / math.tan(angle / 2)
    camera = ([(size[0] - 1) / 2, (size[1] - 1) / 2], focal, focal_spread if field_of_view is None else None)
    least = scale or LEAST_SCALE * float(np.linalg.norm(np.ptp(marks, axis=0)))
    options = (*camera, [roll_spread, elevation_spread], loss)
    matrices, costs, distances = _kernels.fit_poses(marks, points, (*options, least, count))
    if not np.isfinite(costs).any():
        raise DegenerateError("poses: the active joints of every pose lie on one line or in one place")
    usual = float(np.median(distances[np.argmin(costs)]))
    if scale is None and usual > least:
        matrices, costs, distances = _kernels.fit_poses(marks, points, (*options, usual, count))
    joint_errors = np.full((len(points), len(seen)), np.nan)
    joint_errors[:, seen] = distances
    errors = np.sqrt(np.mean(distances**2, axis=1))
    ranking = np.argsort(costs, kind="stable")
    return PoseFit(errors, joint_errors, costs, ranking, matrices, (int(size[0]), int(size[1])))


def _angle(name: str, value: float) -> float:
    angle = float(arrays.floats(name, value, ()))
    if not 0 < angle < math.pi:
        raise ValueError(f"{name}: want radians between 0 and pi, got {angle}")
    return angle


def _inputs(joints: ArrayLike, poses: ArrayLike, active: ArrayLike | None) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """The active marks and points, and which joints are active."""
    marks = arrays.floats("joints", joints, ("N", 2), allow="nan")
    points = arrays.floats("poses", poses, ("P", len(marks), 3), allow="nan")
    if not len(points):
        raise ValueError("poses: want one pose or more, got none")
    seen = np.ones(len(marks), bool) if active is None else arrays.flags("active", active, (len(marks),))
    if seen.sum() < 4:
        name = "joints" if active is None else "active"
        raise DegenerateError(f"{name}: want four joints or more, got {seen.sum()}")
    if len(missing := np.argwhere(seen & np.isnan(marks).any(axis=1))):
        raise ValueError(f"joints: want finite numbers where active, got NaN in joint {missing[0][0]}")
    if len(missing := np.argwhere(np.isnan(points).any(axis=2) & seen)):
        pose, joint = missing[0]
        raise ValueError(f"poses: want finite numbers where active, got NaN in pose {pose}, joint {joint}")
    marks, points = np.ascontiguousarray(marks[seen]), np.ascontiguousarray(points[:, seen])
    lengths = np.linalg.svd(marks - marks.mean(axis=0), compute_uv=False)
    if not lengths[1] > _LINE * lengths[0]:
        raise DegenerateError("joints: the active marks lie on one line or in one place, which fits any camera")
    return marks, points, seen
