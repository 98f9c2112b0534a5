"""Depth that is known better than from the clip: a foot that stands is where its ray meets the floor.

When a foot stands, the drawing says better than the clip, whose steps are seldom quite as long: its mark then stays
where the camera sees one point of the floor. The floor's answer is worth much where the camera looks down on it and
nothing where it looks along it: an error of the ankle's height, or of the mark, counts in depth divided by the ray's
slope. So floor and clip are weighted by their variances, once for every step; in the air the foot moves as in the clip.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.lift.backprojection import camera_rays
from pegbar.scene.contacts import FEET, foot_places, runs_with

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
#: A step begins where the mark moves slower over the floor than the first (m/s) and lasts while slower than the second.
BEGIN, LAST = 0.25, 0.4
#: Floor and clip may differ by so many of their standard deviations before the foot counts as in the air.
AGREEMENT = 3.0


@dataclass(frozen=True)
class ContactNoise:
    """How far things are from the truth, as standard deviations.

    ``depth`` is the clip's depth of a foot in metres, ``height`` an ankle's height over the floor in metres, ``mark``
    a drawn mark in pixels.
    """

    depth: float = 0.1
    height: float = 0.02
    mark: float = 2.0


@dataclass(frozen=True)
class GroundedDepths:
    """``depths`` (F, N) float in metres, and in which frames the left and the right foot stand, (F, 2) bool."""

    depths: Floats
    standing: Flags


def ground_depths(
    markers: ArrayLike,
    matrices: ArrayLike,
    depths: ArrayLike,
    names: Sequence[str],
    frame_rate: float,
    *,
    standing: ArrayLike | None = None,
    floor: float = 0.0,
    ankle_height: ArrayLike = 0.08,
    knee: float = 0.5,
    noise: ContactNoise | None = None,
) -> GroundedDepths:
    """Correct the depths of feet that stand on the floor, and of their knees.

    Parameters
    ----------
    markers : (F, N, 2) float
        Drawn markers in pixels; from NaN no correction is taken.
    matrices : (F, 3, 4) float
        A camera matrix per frame, of any scale.
    depths : (F, N) float
        Planar depths in metres, from the clip; NaN stays.
    names : sequence of N str
        The markers' names, "left_foot" and "right_foot" (ankles) among them.
    frame_rate : float
        Drawings a second.
    standing : (F, 2) bool, optional
        The frames in which the left and the right foot stand. None: where the mark keeps to a point of the floor that
        is about as deep as the clip's foot.
    floor : float
        Height of the level floor in metres.
    ankle_height : float or (2,) float
        How high the ankles rest over the floor, metres: `pegbar.scene.contacts.ankle_heights` of the clip.
    knee : float
        The share of its foot's correction that a knee takes.
    noise : ContactNoise, optional
        What floor and clip are weighted by.

    Returns
    -------
    GroundedDepths
        A step's correction is one number; between two steps it runs linearly in time, before the first and after the
        last it is held. Other markers keep their depths.

    Raises
    ------
    ValueError
        For a wrong shape, a foot that is not among the names, or a frame rate that is not positive.

    Examples
    --------
    >>> from pegbar import PerspectiveCamera
    >>> camera = PerspectiveCamera.look_at((0, 3, 4), (0, 1, 0), (640, 360), 0.7)
    >>> foot = camera.project([0.1, 0.08, 0])
    >>> depths = camera.depth([[0.1, 0.05, 0.1], [0.1, 0.05, 2]])
    >>> grounded = ground_depths([[foot, foot]], [camera.matrix], [depths], ["left_foot", "right_foot"], 24)
    >>> grounded.standing.tolist()
    [[True, False]]
    """
    marks = arrays.floats("markers", markers, ("F", len(names), 2), allow="nan")
    frames, feet, noise = len(marks), foot_places(names), noise or ContactNoise()
    matrices = arrays.floats("matrices", matrices, (frames, 3, 4))
    corrected = arrays.floats("depths", depths, (frames, len(names)), allow="nan").copy()
    rest = arrays.floats("ankle_height", ankle_height, (2,) if np.ndim(ankle_height) else ())
    heights = float(arrays.floats("floor", floor, ())) + np.broadcast_to(rest, 2)
    if not (np.isfinite(frame_rate) and frame_rate > 0):
        raise ValueError(f"frame_rate: want a positive number, got {frame_rate}")
    met, spread = _floor_depths(marks[:, feet], matrices, heights, noise)
    differences = met - corrected[:, feet]
    if standing is None:
        slow = _floor_speeds(marks[:, feet], matrices, met, frame_rate)
        near = np.abs(differences) < AGREEMENT * np.hypot(noise.depth, spread)
        stood = np.stack([runs_with(near[:, s] & (slow[:, s] < LAST), slow[:, s] < BEGIN) for s in range(2)], axis=1)
    else:
        stood = arrays.flags("standing", standing, (frames, 2))
    for side, foot in enumerate(FEET):
        weights = noise.depth**2 / (noise.depth**2 + spread[:, side] ** 2)
        change = _steps(differences[:, side], weights, stood[:, side])
        corrected[:, feet[side]] += change
        joint = foot.replace("foot", "knee")
        if joint in names:
            corrected[:, list(names).index(joint)] += knee * change
    return GroundedDepths(corrected, stood)


def _floor_depths(marks: Floats, matrices: Floats, heights: Floats, noise: ContactNoise) -> tuple[Floats, Floats]:
    """Depths (F, 2) where the feet's rays meet the level of resting ankles, NaN where they do not, and their errors."""
    centres, rays = camera_rays(marks, matrices)
    with np.errstate(divide="ignore", invalid="ignore"):
        met = (heights - centres[:, 1:2]) / rays[..., 1]
        met = np.where(np.isfinite(met) & (met > 0), met, np.nan)
        spread = np.hypot(noise.height, met * noise.mark / _focal_lengths(matrices)[:, None]) / np.abs(rays[..., 1])
    return met, spread


def _focal_lengths(matrices: Floats) -> Floats:
    """Horizontal focal lengths (F,) in pixels."""
    across, along = matrices[:, 0, :3], matrices[:, 2, :3]
    lengths: Floats = np.linalg.norm(np.cross(across, along), axis=1) / np.sum(along**2, axis=1)
    return lengths


def _floor_speeds(marks: Floats, matrices: Floats, met: Floats, frame_rate: float) -> Floats:
    """How fast (m/s) the feet's marks leave the floor's points (F, 2), seen across the picture from frame to frame.

    The point of the floor under the mark a frame earlier is seen again a frame later: only so far does the mark's
    error count as speed, whereas along the ray it would count many times.
    """
    frames = np.arange(len(marks))
    before, after = np.maximum(frames - 1, 0), np.minimum(frames + 1, max(len(marks) - 1, 0))
    centres, rays = camera_rays(marks, matrices)
    points = (centres[:, None] + met[..., None] * rays)[before]
    image = np.einsum("fij,fnj->fni", matrices[after, :, :3], points) + matrices[after, None, :, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        moved = np.linalg.norm(image[..., :2] / image[..., 2:] - marks[after], axis=2)
    speeds: Floats = moved * met * (frame_rate / np.maximum(after - before, 1) / _focal_lengths(matrices))[:, None]
    return speeds


def _steps(differences: Floats, weights: Floats, standing: Flags) -> Floats:
    """One correction (F,) from the differences (F,) of every step: weighted mean times mean weight, held in between."""
    usable = standing & np.isfinite(differences) & np.isfinite(weights)
    edges = np.flatnonzero(np.diff(standing, prepend=False, append=False))
    moments, values = [], []
    for first, stop in edges.reshape(-1, 2):
        inside = first + np.flatnonzero(usable[first:stop])
        if len(inside):
            moments += [first, stop - 1]
            values += [float(np.mean(weights[inside] * differences[inside]))] * 2
    if not moments:
        return np.zeros(len(standing))
    return np.asarray(np.interp(np.arange(len(standing)), moments, values), np.float64)
