"""The terms of Jain et al. 2010, equation 1, for a whole shot, as residuals in pixels with analytic derivatives.

Unknowns of a frame are a rotation (world to camera; a small turn w acts as exp([w]) R), the camera's centre, and the
logarithm of the focal length, which the shot shares: seven columns in this order. Every residual is in pixels.
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


class Cameras(NamedTuple):
    """One camera a frame: ``rotations`` (F, 3, 3) world to camera, ``centers`` (F, 3) metres, log focal length."""

    rotations: Floats
    centers: Floats
    log_focal: float

    def moved(self, steps: Floats, focal_step: float) -> Cameras:
        """Return the cameras after ``steps`` (F, 6), turns in radians and metres."""
        turns = Rotation.from_rotvec(steps[:, TURN]).as_matrix()
        return Cameras(turns @ self.rotations, self.centers + steps[:, PLACE], self.log_focal + focal_step)


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

    ``turn`` pixels a radian and ``place`` pixels a metre, both for second differences over time; ``roll`` pixels a unit
    of the sine of roll; ``ground`` pixels a metre below ``floor`` (metres); ``focal`` pixels a unit of log focal length
    away from ``usual_focal`` (log pixels); ``knee`` pixels: beyond it a mark's residual counts linearly (Huber).
    """

    turn: float
    place: float
    roll: float
    ground: float
    floor: float
    focal: float
    usual_focal: float
    knee: float = np.inf


@dataclass(frozen=True)
class Normal:
    """Normal equations: ``own`` (F, 7, 7), ``next`` (F - 1, 6, 6), ``after`` (F - 2, 6, 6), ``gradient`` (F, 7).

    ``next`` and ``after`` couple a frame's unknowns with those of the next frame and of the one after it.
    """

    own: Floats
    next: Floats
    after: Floats
    gradient: Floats


def seen_from(points: Floats, cameras: Cameras) -> Floats:
    """Return ``points`` (F, N, 3) in camera axes."""
    seen: Floats = (points - cameras.centers[:, None]) @ cameras.rotations.transpose(0, 2, 1)
    return seen


def reprojection(shot: Shot, cameras: Cameras) -> Floats:
    """Return projected minus drawn marks (F, N, 2) in pixels: zero where not seen, inf where behind the camera."""
    local = seen_from(shot.points, cameras)
    depth = local[..., 2:]
    with np.errstate(divide="ignore", invalid="ignore"):
        offset = np.exp(cameras.log_focal) * local[..., :2] / depth + shot.middle - shot.marks
    return np.where(shot.seen[..., None], np.where(depth > 1e-3, offset, np.inf), 0.0)


def reprojection_slopes(shot: Shot, cameras: Cameras) -> Floats:
    """Return the derivatives (F, N, 2, 7) of `reprojection`."""
    local = seen_from(shot.points, cameras)
    x, y, z = np.moveaxis(np.where(shot.seen[..., None], local, (0.0, 0.0, 1.0)), -1, 0)
    focal = np.exp(cameras.log_focal)
    u, v, by_metre = x / z, y / z, focal / z
    slopes = np.zeros((*x.shape, 2, COLUMNS))
    slopes[..., 0, TURN] = focal * np.stack([-u * v, 1 + u * u, -v], -1)
    slopes[..., 1, TURN] = focal * np.stack([-1 - v * v, u * v, u], -1)
    right, down, ahead = (cameras.rotations[:, None, row] for row in range(3))
    slopes[..., 0, PLACE] = by_metre[..., None] * (u[..., None] * ahead - right)
    slopes[..., 1, PLACE] = by_metre[..., None] * (v[..., None] * ahead - down)
    slopes[..., 0, FOCAL], slopes[..., 1, FOCAL] = focal * u, focal * v
    return slopes * shot.seen[..., None, None]


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
    """Return the sum over frames of mean squared reprojection (Huber) and the other squared residuals, pixels squared."""
    squared = np.sum(reprojection(shot, cameras) ** 2, axis=-1)
    beyond = squared > terms.knee**2
    robust = np.where(beyond, terms.knee * (2 * np.sqrt(squared) - terms.knee), squared) if beyond.any() else squared
    total = robust.sum() / shot.seen.shape[1]
    for scale, jolt in zip((terms.turn, terms.place), jolts(cameras), strict=True):
        total += scale**2 * np.sum(jolt**2)
    total += terms.roll**2 * np.sum(cameras.rotations[:, 0, 1] ** 2)
    total += terms.ground**2 * np.sum(np.maximum(0, terms.floor - cameras.centers[:, 1]) ** 2)
    return float(total + (terms.focal * (cameras.log_focal - terms.usual_focal)) ** 2)


def normal(shot: Shot, cameras: Cameras, terms: Terms) -> Normal:
    """Return the Gauss-Newton equations of half of `cost` at ``cameras``."""
    frames, marks = shot.seen.shape
    offset = reprojection(shot, cameras)
    length = np.linalg.norm(offset, axis=-1)
    trust = np.where(length > terms.knee, terms.knee / np.maximum(length, 1e-300), 1.0) / marks
    slopes = reprojection_slopes(shot, cameras).reshape(frames, 2 * marks, COLUMNS)
    weighted = (slopes * np.repeat(trust, 2, axis=1)[..., None]).transpose(0, 2, 1)
    own, gradient = weighted @ slopes, (weighted @ offset.reshape(frames, 2 * marks, 1))[..., 0]
    result = Normal(own, np.zeros((max(frames - 1, 0), 6, 6)), np.zeros((max(frames - 2, 0), 6, 6)), gradient)
    _add_single(result, cameras, terms)
    if frames > 2:
        turn_jolt, place_jolt = jolts(cameras)
        _add_jolt(result, TURN, terms.turn, turn_jolt, turn_slopes(cameras.rotations))
        steps = np.array([1.0, -2.0, 1.0])[:, None, None] * np.eye(3)
        _add_jolt(result, PLACE, terms.place, place_jolt, np.broadcast_to(steps, (frames - 2, 3, 3, 3)))
    return result


def _add_single(result: Normal, cameras: Cameras, terms: Terms) -> None:
    """Add roll and ground of every frame and, to the first frame's focal column, the usual focal length."""
    sine = cameras.rotations[:, 0, 1]
    by_turn = np.zeros((len(sine), 3))
    by_turn[:, 1], by_turn[:, 2] = cameras.rotations[:, 2, 1], -cameras.rotations[:, 1, 1]
    result.own[:, TURN, TURN] += terms.roll**2 * by_turn[:, :, None] * by_turn[:, None, :]
    result.gradient[:, TURN] += terms.roll**2 * sine[:, None] * by_turn
    below = np.maximum(0, terms.floor - cameras.centers[:, 1])
    result.own[:, 4, 4] += terms.ground**2 * (below > 0)
    result.gradient[:, 4] -= terms.ground**2 * below
    result.own[0, FOCAL, FOCAL] += terms.focal**2
    result.gradient[0, FOCAL] += terms.focal**2 * (cameras.log_focal - terms.usual_focal)


def _add_jolt(result: Normal, columns: slice, scale: float, jolt: Floats, slopes: Floats) -> None:
    """Add second differences ``jolt`` (F - 2, 3) with derivatives ``slopes`` (F - 2, 3 frames, 3, 3)."""
    slopes, jolt = scale * slopes, scale * jolt
    turned = slopes.transpose(0, 1, 3, 2)
    count = len(jolt)
    for frame in range(3):
        result.own[frame : frame + count, columns, columns] += turned[:, frame] @ slopes[:, frame]
        result.gradient[frame : frame + count, columns] += (turned[:, frame] @ jolt[..., None])[..., 0]
    result.next[:count, columns, columns] += turned[:, 0] @ slopes[:, 1]
    result.next[1:, columns, columns] += turned[:, 1] @ slopes[:, 2]
    result.after[:, columns, columns] += turned[:, 0] @ slopes[:, 2]


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
