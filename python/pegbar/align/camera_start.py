"""Where a shot's cameras may stand: a search over azimuths and elevations that needs no start.

Around the figure's middle a camera is nearly a scaled parallel projection, whose scale has a closed form for every
rotation. So rotations on a grid, upright, are tried for some frames of the shot, and the best ones are kept: one for
all frames, or the cheapest path over time (Viterbi), which does not flip between a view and its mirror image.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from pegbar.align.camera_terms import Cameras, Shot

Floats = NDArray[np.float64]
#: Directions tried, in degrees: 15 apart, so that a start is at most about 10 degrees from the answer.
AZIMUTHS = np.arange(0.0, 360.0, 15.0)
ELEVATIONS = np.arange(-45.0, 76.0, 15.0)
#: A turn of so many degrees from one looked-at frame to the next costs as much as the usual frame fits badly.
_USUAL_TURN = 20.0

#: A camera starts so many metres away at least.
_NEAREST = 0.5


class Views(NamedTuple):
    """How well G rotations explain n frames.

    ``rotations`` is (G, 3, 3), ``misfit`` and ``depth`` (n, G), ``ray`` (n, 3, 3). ``misfit`` is the mean distance of
    marks without unit, ``depth`` the metres from camera to figure, and ``ray`` turns the view axis to the figure's
    middle. ``middle`` (n, 3) is that middle in the world.
    """

    rotations: Floats
    misfit: Floats
    depth: Floats
    ray: Floats
    middle: Floats


def upright_rotations() -> Floats:
    """Return the rotations (G, 3, 3) of level cameras in all directions, azimuth by azimuth."""
    azimuth, elevation = (a.ravel() for a in np.meshgrid(*map(np.radians, (AZIMUTHS, ELEVATIONS)), indexing="ij"))
    zero = np.zeros_like(azimuth)
    right = np.stack([np.cos(azimuth), zero, -np.sin(azimuth)], -1)
    flat = np.cos(elevation)
    ahead = -np.stack([np.sin(azimuth) * flat, np.sin(elevation), np.cos(azimuth) * flat], -1)
    return np.stack([right, np.cross(ahead, right), ahead], axis=1)


def views(shot: Shot, focal: float) -> Views:
    """Return how well cameras of ``focal`` pixels on the grid explain each frame of ``shot``."""
    rotations = upright_rotations()
    seen = shot.seen[..., None]
    count = np.maximum(seen.sum(axis=1), 1)
    image = (shot.marks - shot.middle) / focal
    center = (image * seen).sum(axis=1) / count
    ray = _rays(center)
    direct = np.concatenate([image, np.ones_like(image[..., :1])], axis=-1) @ ray
    flat = direct[..., :2] / direct[..., 2:]
    flat = (flat - (flat * seen).sum(axis=1, keepdims=True) / count[:, None]) * seen
    middle = (shot.points * seen).sum(axis=1) / count
    around = (shot.points - middle[:, None]) * seen
    rows = np.einsum("nba,gbc->ngac", ray[:, :, :2], rotations)
    plane = np.einsum("ngac,njc->ngja", rows, around)
    scale = np.einsum("ngja,nja->ng", plane, flat) / np.maximum(np.einsum("ngja,ngja->ng", plane, plane), 1e-12)
    scale = np.maximum(scale, 1e-6)
    distance = np.linalg.norm(scale[..., None, None] * plane - flat[:, None], axis=-1).sum(axis=-1)
    size = np.maximum(np.linalg.norm(flat, axis=-1).sum(axis=1), 1e-12)
    return Views(rotations, distance / size[:, None], 1 / scale, ray, middle)


def _rays(center: Floats) -> Floats:
    """Return the smallest rotations (n, 3, 3) that turn the view axis to image points ``center`` (n, 2)."""
    ray = np.concatenate([center, np.ones((len(center), 1))], axis=1)
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    return _turns_between(np.broadcast_to([0.0, 0.0, 1.0], ray.shape), ray)


def _turns_between(first: Floats, second: Floats) -> Floats:
    """Return the smallest rotations (n, 3, 3) that take unit vectors ``first`` (n, 3) to ``second``."""
    axis = np.cross(first, second)
    sine = np.linalg.norm(axis, axis=1, keepdims=True)
    angle = np.arctan2(sine, np.sum(first * second, axis=1, keepdims=True))
    return Rotation.from_rotvec(axis / np.maximum(sine, 1e-12) * angle).as_matrix()


def turning(cameras: Cameras, middles: Floats) -> Cameras:
    """Return cameras at one place that see the figure's ``middles`` (F, 3) where ``cameras`` see them."""
    center = np.median(cameras.centers, axis=0)
    old, new = middles - cameras.centers, middles - center
    old, new = (a / np.linalg.norm(a, axis=1, keepdims=True) for a in (old, new))
    turns = _turns_between(new, old)
    return Cameras(cameras.rotations @ turns, np.broadcast_to(center, old.shape).copy(), cameras.log_focal)


def still_starts(shot: Shot, found: Views, log_focal: float, count: int) -> list[Cameras]:
    """Return up to ``count`` cameras that stand still: the directions that fit better than those around them."""
    total = found.misfit.mean(axis=0).reshape(len(AZIMUTHS), len(ELEVATIONS))
    padded = np.pad(np.pad(total, ((1, 1), (0, 0)), mode="wrap"), ((0, 0), (1, 1)), constant_values=np.inf)
    shape = total.shape
    around = [padded[a : a + shape[0], e : e + shape[1]] for a in range(3) for e in range(3)]
    lowest = np.flatnonzero((total <= np.min(around, axis=0)).ravel())
    best = lowest[np.argsort(total.ravel()[lowest], kind="stable")][:count]
    return [still(shot, np.broadcast_to(found.rotations[g], (len(shot.marks), 3, 3)), log_focal) for g in best]


def still(shot: Shot, rotations: Floats, log_focal: float) -> Cameras:
    """Return cameras with these ``rotations`` (F, 3, 3) and the one centre from which the marks' rays fit best.

    Where that is too near, the centre goes back until the whole figure is in front in every frame.
    """
    image = (shot.marks - shot.middle) / np.exp(log_focal)
    rows = (image[..., None] * rotations[:, None, 2:, :] - rotations[:, None, :2, :]) * shot.seen[..., None, None]
    offset = np.einsum("fnac,fnc->fna", rows, shot.points)
    center = np.linalg.lstsq(rows.reshape(-1, 3), offset.ravel(), rcond=None)[0]
    depth = np.einsum("fc,fnc->fn", rotations[:, 2], shot.points - center)[shot.seen]
    ahead = rotations[:, 2].mean(axis=0)
    center = center - ahead / np.linalg.norm(ahead) * max(0.0, _NEAREST - float(depth.min()))
    return Cameras(np.array(rotations), np.broadcast_to(center, (len(rotations), 3)).copy(), log_focal)


def repeated(cameras: Cameras, frames: int) -> Cameras:
    """Return the first camera for every frame."""
    rotations, centers = (np.repeat(a[:1], frames, axis=0) for a in (cameras.rotations, cameras.centers))
    return Cameras(rotations, centers, cameras.log_focal)


def moving_start(shot: Shot, found: Views, keys: NDArray[np.intp], log_focal: float) -> Cameras:
    """Return a camera a frame along the cheapest path of directions through the frames ``keys`` of ``found``."""
    path = cheapest_path(found)
    turns = Rotation.from_matrix(found.rotations[path])
    frames = np.arange(len(shot.marks))
    if len(keys) > 1:
        rotations = Slerp(keys, turns)(np.clip(frames, keys[0], keys[-1])).as_matrix()
    else:
        rotations = np.repeat(turns.as_matrix(), len(frames), axis=0)
    ahead = np.array([found.depth[i, g] * found.ray[i, :, 2] for i, g in enumerate(path)])
    away = np.stack([np.interp(frames, keys, ahead[:, axis]) for axis in range(3)], axis=1)
    middle = np.stack([np.interp(frames, keys, found.middle[:, axis]) for axis in range(3)], axis=1)
    return Cameras(rotations, middle - np.einsum("fba,fb->fa", rotations, away), log_focal)


def cheapest_path(found: Views) -> NDArray[np.intp]:
    """Return the rotation (n,) of each frame whose misfits and turns from frame to frame are least together."""
    cosine = (np.einsum("gab,hab->gh", found.rotations, found.rotations) - 1) / 2
    angle = np.arccos(np.clip(cosine, -1, 1))
    turning = np.median(found.misfit.min(axis=1)) * (angle / np.radians(_USUAL_TURN)) ** 2
    total, steps = found.misfit[0], []
    for misfit in found.misfit[1:]:
        through = total[:, None] + turning
        steps.append(through.argmin(axis=0))
        total = through.min(axis=0) + misfit
    path = [int(total.argmin())]
    for step in reversed(steps):
        path.append(int(step[path[-1]]))
    return np.array(path[::-1])
