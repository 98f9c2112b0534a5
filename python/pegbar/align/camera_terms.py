"""The terms of Jain et al. 2010, equation 1, for a whole shot, as residuals in pixels with analytic derivatives.

Unknowns of a frame are a rotation (world to camera; a small turn w acts as exp([w]) R), the camera's centre, and the
logarithm of the focal length: seven columns in this order. A frame has some columns for itself and the shot shares
the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
COLUMNS = 7
TURN, PLACE, FOCAL = slice(0, 3), slice(3, 6), 6
_HEIGHT = 4
_SECOND_DIFFERENCE = (1.0, -2.0, 1.0)


class Cameras(NamedTuple):
    """One camera a frame: ``rotations`` (F, 3, 3) world to camera, ``centers`` (F, 3) metres, log focal length."""

    rotations: Floats
    centers: Floats
    log_focal: float

    def moved(self, steps: Floats) -> Cameras:
        """Return the cameras after ``steps`` (F, 7); the focal length takes the first frame's."""
        turns = Rotation.from_rotvec(steps[:, TURN]).as_matrix()
        focal = self.log_focal + float(steps[0, FOCAL])
        return Cameras(turns @ self.rotations, self.centers + steps[:, PLACE], focal)


@dataclass(frozen=True)
class Shot:
    """What is known: ``marks`` (F, N, 2) pixels, ``seen`` (F, N), ``points`` (F, N, 3) metres, ``middle`` (2,) pixels.

    ``marks`` and ``points`` hold zeros where a mark is not seen.
    """

    marks: Floats
    seen: NDArray[np.bool_]
    points: Floats
    middle: Floats

    def part(self, frames: NDArray[np.intp]) -> Shot:
        """Return the shot of some frames only."""
        return Shot(self.marks[frames], self.seen[frames], self.points[frames], self.middle)


@dataclass(frozen=True)
class Terms:
    """What multiplies the residuals, and where the data term stops being quadratic.

    ``turn`` is in pixels a radian and ``place`` in pixels a metre, both for second differences over time; ``roll`` and
    ``level`` in pixels a unit of the sine of roll and of elevation, ``ground`` in pixels a metre below ``floor``
    (metres), ``focal`` in pixels a unit of log focal length away from ``usual_focal`` (log pixels). Beyond ``knee``
    pixels a mark counts linearly (Huber).
    """

    turn: float
    place: float
    roll: float
    level: float
    ground: float
    floor: float
    focal: float
    usual_focal: float
    knee: float = np.inf


class Unknowns(NamedTuple):
    """The columns that every frame has for itself, and those that the shot shares."""

    own: tuple[int, ...]
    shared: tuple[int, ...]


@dataclass(frozen=True)
class Normal:
    """Normal equations with l columns a frame and s shared ones: blocks of a band, and an arrow.

    ``own`` (F, l, l), ``next`` (F - 1, l, l) and ``after`` (F - 2, l, l) couple a frame with itself, the next one and
    the one after it; ``arrow`` (F, l, s) and ``corner`` (s, s) couple with what is shared. ``slope`` (F, l) and
    ``shared_slope`` (s,) are the gradient.
    """

    own: Floats
    next: Floats
    after: Floats
    arrow: Floats
    corner: Floats
    slope: Floats
    shared_slope: Floats


def projected(points: Floats, middle: Floats, cameras: Cameras) -> Floats:
    """Return the pixels (F, N, 2) of ``points`` (F, N, 3): inf where behind the camera."""
    local = _local(points, cameras)
    depth = local[..., 2:]
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.exp(cameras.log_focal) * local[..., :2] / depth + middle
    return np.where(depth > 1e-3, found, np.inf)


def projected_slopes(points: Floats, cameras: Cameras) -> Floats:
    """Return the derivatives (F, N, 2, 7) of `projected`; zero where behind the camera."""
    local = _local(points, cameras)
    ahead_of = local[..., 2:] > 1e-3
    x, y, z = np.moveaxis(np.where(ahead_of, local, (0.0, 0.0, 1.0)), -1, 0)
    focal = np.exp(cameras.log_focal)
    u, v, by_metre = x / z, y / z, focal / z
    slopes = np.empty((*x.shape, 2, COLUMNS))
    slopes[..., 0, TURN] = focal * np.stack([-u * v, 1 + u * u, -v], -1)
    slopes[..., 1, TURN] = focal * np.stack([-1 - v * v, u * v, u], -1)
    right, down, ahead = (cameras.rotations[:, None, row] for row in range(3))
    slopes[..., 0, PLACE] = by_metre[..., None] * (u[..., None] * ahead - right)
    slopes[..., 1, PLACE] = by_metre[..., None] * (v[..., None] * ahead - down)
    slopes[..., 0, FOCAL], slopes[..., 1, FOCAL] = focal * u, focal * v
    return slopes * ahead_of[..., None]


def reprojection(shot: Shot, cameras: Cameras) -> Floats:
    """Return projected minus drawn marks (F, N, 2) in pixels; zero where a mark is not seen."""
    return np.where(shot.seen[..., None], projected(shot.points, shot.middle, cameras) - shot.marks, 0.0)


def jolts(cameras: Cameras) -> tuple[Floats, Floats]:
    """Return second differences over time of orientation (radians) and of centre (metres), both (F - 2, 3)."""
    turns = _turns(cameras.rotations)
    return np.diff(turns, axis=0), np.diff(cameras.centers, n=2, axis=0)


def turn_slopes(rotations: Floats) -> Floats:
    """Return the derivatives (F - 2, 3 frames, 3, 3) of orientation's second differences by three frames' turns."""
    turns = _turns(rotations)
    by_later, by_earlier = _inverse_left_jacobian(turns), -_inverse_left_jacobian(-turns)
    return np.stack([-by_earlier[:-1], by_earlier[1:] - by_later[:-1], by_later[1:]], axis=1)


def cost(shot: Shot, cameras: Cameras, terms: Terms) -> float:
    """Return the sum over frames of the mean squared reprojection (Huber) and of the other squared residuals."""
    squared = np.sum(reprojection(shot, cameras) ** 2, axis=-1)
    if not np.isfinite(squared).all():
        return np.inf
    total = huber(squared, terms.knee).sum() / shot.seen.shape[1]
    for scale, jolt in zip((terms.turn, terms.place), jolts(cameras), strict=True):
        total += scale**2 * np.sum(jolt**2)
    total += terms.roll**2 * np.sum(cameras.rotations[:, 0, 1] ** 2)
    total += terms.level**2 * np.sum(cameras.rotations[:, 2, 1] ** 2)
    total += terms.ground**2 * np.sum(np.maximum(0, terms.floor - cameras.centers[:, 1]) ** 2)
    return float(total + (terms.focal * (cameras.log_focal - terms.usual_focal)) ** 2)


def huber(squared: Floats, knee: float) -> Floats:
    """Return ``squared`` distances, beyond ``knee`` growing with the distance only."""
    if knee == np.inf:
        return squared
    return np.where(squared > knee**2, knee * (2 * np.sqrt(squared) - knee), squared)


def normal(shot: Shot, cameras: Cameras, terms: Terms, unknowns: Unknowns) -> Normal:
    """Return the Gauss-Newton equations of half of `cost` at ``cameras``."""
    frames, marks = shot.seen.shape
    offset = reprojection(shot, cameras)
    length = np.linalg.norm(offset, axis=-1)
    trust = shot.seen * np.where(length > terms.knee, terms.knee / np.maximum(length, 1e-300), 1.0) / marks
    slopes = projected_slopes(shot.points, cameras)
    slopes = slopes.reshape(frames, 2 * marks, COLUMNS)
    weighted = (slopes * np.repeat(trust, 2, axis=1)[..., None]).transpose(0, 2, 1)
    whole, slope = weighted @ slopes, (weighted @ offset.reshape(frames, 2 * marks, 1))[..., 0]
    _add_single(whole, slope, cameras, terms)
    own, shared = unknowns
    size = len(own)
    result = Normal(
        whole[:, list(own)][:, :, list(own)],
        np.zeros((max(frames - 1, 0), size, size)),
        np.zeros((max(frames - 2, 0), size, size)),
        whole[:, own][:, :, shared],
        whole[:, shared][:, :, shared].sum(axis=0),
        slope[:, own],
        slope[:, shared].sum(axis=0),
    )
    if frames > 2:
        _add_jolts(result, cameras, terms, own)
    return result


def _add_single(whole: Floats, slope: Floats, cameras: Cameras, terms: Terms) -> None:
    """Add roll, level and ground of every frame and, to the first frame's focal column, the usual focal length."""
    right, down, ahead = (cameras.rotations[:, row, 1] for row in range(3))
    none = np.zeros_like(right)
    for scale, sine, by_turn in (
        (terms.roll, right, np.stack([none, ahead, -down], axis=1)),
        (terms.level, ahead, np.stack([down, -right, none], axis=1)),
    ):
        whole[:, TURN, TURN] += scale**2 * by_turn[:, :, None] * by_turn[:, None, :]
        slope[:, TURN] += scale**2 * sine[:, None] * by_turn
    below = np.maximum(0, terms.floor - cameras.centers[:, 1])
    whole[:, PLACE, PLACE][:, 1, 1] += terms.ground**2 * (below > 0)
    slope[:, _HEIGHT] -= terms.ground**2 * below
    whole[0, FOCAL, FOCAL] += terms.focal**2
    slope[0, FOCAL] += terms.focal**2 * (cameras.log_focal - terms.usual_focal)


def _add_jolts(result: Normal, cameras: Cameras, terms: Terms, own: tuple[int, ...]) -> None:
    """Add smoothness of what every frame has for itself; of what is shared there are no differences."""
    turn_jolt, place_jolt = jolts(cameras)
    if set(range(6)[TURN]) <= set(own):
        _add_jolt(result, TURN, terms.turn * turn_jolt, terms.turn * turn_slopes(cameras.rotations))
    if set(range(6)[PLACE]) <= set(own):
        steps = terms.place * np.array(_SECOND_DIFFERENCE)[:, None, None] * np.eye(3)
        _add_jolt(result, PLACE, terms.place * place_jolt, np.broadcast_to(steps, (len(place_jolt), 3, 3, 3)))


def _add_jolt(result: Normal, columns: slice, jolt: Floats, slopes: Floats) -> None:
    """Add second differences ``jolt`` (F - 2, 3) with derivatives ``slopes`` (F - 2, 3 frames, 3, 3)."""
    turned = slopes.transpose(0, 1, 3, 2)
    count = len(jolt)
    for frame in range(3):
        result.own[frame : frame + count, columns, columns] += turned[:, frame] @ slopes[:, frame]
        result.slope[frame : frame + count, columns] += (turned[:, frame] @ jolt[..., None])[..., 0]
    result.next[:count, columns, columns] += turned[:, 0] @ slopes[:, 1]
    result.next[1:, columns, columns] += turned[:, 1] @ slopes[:, 2]
    result.after[:, columns, columns] += turned[:, 0] @ slopes[:, 2]


def _local(points: Floats, cameras: Cameras) -> Floats:
    """Return ``points`` (F, N, 3) in camera axes."""
    local: Floats = (points - cameras.centers[:, None]) @ cameras.rotations.transpose(0, 2, 1)
    return local


def _turns(rotations: Floats) -> Floats:
    """Return the turn (F - 1, 3) in radians that takes each frame's orientation to the next."""
    return Rotation.from_matrix(rotations[1:] @ rotations[:-1].transpose(0, 2, 1)).as_rotvec()


def _inverse_left_jacobian(turns: Floats) -> Floats:
    """Return the derivatives (n, 3, 3) of log(exp(w) exp(turn)) by a small w."""
    angle = np.linalg.norm(turns, axis=-1)
    x, y, z = turns.T
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(-1, 3, 3)
    safe = np.where(angle > 1e-4, angle, 1.0)
    factor = np.where(angle > 1e-4, 1 / safe**2 - (1 + np.cos(safe)) / (2 * safe * np.sin(safe)), 1 / 12)
    jacobian: Floats = np.eye(3) - 0.5 * cross + factor[:, None, None] * (cross @ cross)
    return jacobian
