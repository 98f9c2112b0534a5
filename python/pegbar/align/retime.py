"""Clips sampled at fractional frames; Jain et al. 2009, section 3.3, and 2010, section 3.1.1, take whole ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from pegbar import arrays
from pegbar.align.times import smooth_curve
from pegbar.scene.motion import Motion

Floats = NDArray[np.float64]


def retime(motion: Motion, times: ArrayLike, *, frame_rate: float, root_smoothing: float = 0.0) -> Motion:
    """Sample a clip at ``times``, between its frames where they are fractions.

    A skeleton's joints turn along the shortest way (slerp of their rotations against their parents), their places in
    their parents' axes and the roots' places run linearly, and the pose is put together again from the root: bones
    keep their lengths. Points without parents run linearly; one that is missing in a frame that is used is missing.

    Parameters
    ----------
    motion : Motion
        The clip, F frames.
    times : (T,) float
        Frames of ``motion``, 0 to F - 1. The frame of an inserted T-pose (``rest_frame``) is never used: what lies
        between it and the next frame takes that frame, and inside a clip its two neighbours are joined.
    frame_rate : float
        Of the result, in frames a second: the film's.
    root_smoothing : float
        Seconds: smooths the roots' travel over the ground, as far as the warp still makes it uneven. Swings of twice
        this period pass by nine tenths or more, of half of it by a tenth at most. The whole figure is moved along.

    Returns
    -------
    Motion
        T frames, without a rest frame.

    Raises
    ------
    ValueError
        For times of a wrong shape, that are not finite or outside the clip, a frame rate that is not positive, a
        negative smoothing, or a clip that has no frame but the T-pose.

    Examples
    --------
    >>> turn = Rotation.from_euler("y", [[0], [90]], degrees=True).as_matrix()
    >>> places = np.array([[[0, 1, 0], [1, 1, 0]], [[2, 1, 0], [2, 1, -1]]], float)
    >>> clip = Motion(("Hips", "Leg"), (-1, 0), places, np.stack([turn, turn], axis=1), 120)
    >>> retime(clip, [0.5], frame_rate=24).positions.round(3).tolist()
    [[[1.0, 1.0, 0.0], [1.707, 1.0, -0.707]]]
    """
    before, after, share = _frames_around(times, len(motion.positions), motion.rest_frame)
    rate, smoothing = arrays.floats("frame_rate", [frame_rate, root_smoothing], (2,)).tolist()
    if not (rate > 0 and smoothing >= 0):
        raise ValueError(f"frame_rate, root_smoothing: want positive, and zero or more, got {rate} and {smoothing}")
    if any(parent >= 0 for parent in motion.parents):
        positions, rotations = _skeleton(motion, before, after, share)
    else:
        positions = _between(motion.positions, before, after, share)
        rotations = motion.rotations[np.where(share < 0.5, before, after)]
    if smoothing:
        positions = positions + _steadier(positions, motion.parents, smoothing * rate)
    return motion.changed(positions=positions, rotations=rotations, frame_rate=rate, rest_frame=None)


def sample_markers(markers: ArrayLike, times: ArrayLike, *, rest_frame: int | None = None) -> Floats:
    """Sample marker tracks at fractional frames: linear between frames.

    Parameters
    ----------
    markers : (F, N, 3) float
        Any unit; NaN where a marker is missing.
    times : (T,) float
        Frames, 0 to F - 1.
    rest_frame : int, optional
        A frame that is no part of the movement and never used.

    Returns
    -------
    (T, N, 3) float
        NaN where a frame that is used is; at a whole frame only that frame is used.

    Raises
    ------
    ValueError
        For a wrong shape, an infinite number, times outside the frames, or no frame but the rest frame.

    Examples
    --------
    >>> sample_markers([[[0.0, 0, 0]], [[1.0, 2, 0]]], [0.25, 1]).tolist()
    [[[0.25, 0.5, 0.0]], [[1.0, 2.0, 0.0]]]
    """
    tracks = arrays.floats("markers", markers, ("F", "N", 3), allow="nan")
    return _between(tracks, *_frames_around(times, len(tracks), rest_frame))


def _frames_around(
    times: ArrayLike, count: int, rest_frame: int | None
) -> tuple[NDArray[np.intp], NDArray[np.intp], Floats]:
    """The frames before and after each time and how far it is from the first to the second, 0 to below 1."""
    wanted = arrays.floats("times", times, ("T",))
    if wanted.size and not (wanted.min() >= 0 and wanted.max() <= count - 1):
        outside = wanted[(wanted < 0) | (wanted > count - 1)][0]
        raise ValueError(f"times: want 0 to {count - 1}, the clip's frames, got {outside}")
    used = np.array([frame for frame in range(count) if frame != rest_frame], dtype=np.intp)
    if not len(used):
        raise ValueError("times: the clip has no frame but the rest frame")
    first = np.clip(np.searchsorted(used, wanted, side="right") - 1, 0, len(used) - 1)
    before, after = used[first], used[np.minimum(first + 1, len(used) - 1)]
    share = np.clip((wanted - before) / np.maximum(after - before, 1), 0, None)
    share[after == before] = 0
    return before, after, share


def _between(tracks: Floats, before: NDArray[np.intp], after: NDArray[np.intp], share: Floats) -> Floats:
    part = share.reshape(-1, *[1] * (tracks.ndim - 1))
    return np.where(part > 0, (1 - part) * tracks[before] + part * tracks[after], tracks[before])


def _skeleton(
    motion: Motion, before: NDArray[np.intp], after: NDArray[np.intp], share: Floats
) -> tuple[Floats, Floats]:
    parents = np.array(motion.parents)
    above = np.where(parents < 0, np.arange(len(parents)), parents)
    rooted = (parents < 0)[:, None]
    frame = np.where(rooted[..., None], np.eye(3), motion.rotations[:, above])
    offsets = np.where(rooted, motion.positions, motion.positions - motion.positions[:, above])
    offsets = _between(np.einsum("fjba,fjb->fja", frame, offsets), before, after, share)
    rotations = _slerp(np.einsum("fjba,fjbc->fjac", frame, motion.rotations), before, after, share)
    positions = offsets.copy()
    for joint in _parents_first(motion.parents):
        parent = motion.parents[joint]
        if parent >= 0:
            positions[:, joint] = positions[:, parent] + np.einsum(
                "fab,fb->fa", rotations[:, parent], offsets[:, joint]
            )
            rotations[:, joint] = rotations[:, parent] @ rotations[:, joint]
    return positions, rotations


def _slerp(local: Floats, before: NDArray[np.intp], after: NDArray[np.intp], share: Floats) -> Floats:
    start = Rotation.from_matrix(local[before].reshape(-1, 3, 3))
    turn = (start.inv() * Rotation.from_matrix(local[after].reshape(-1, 3, 3))).as_rotvec()
    part = np.repeat(share, local.shape[1])[:, None]
    turned: Floats = (start * Rotation.from_rotvec(part * turn)).as_matrix()
    return turned.reshape(-1, *local.shape[1:])


def _parents_first(parents: tuple[int, ...]) -> list[int]:
    def depth(joint: int) -> int:
        levels = 0
        while parents[joint] >= 0:
            joint, levels = parents[joint], levels + 1
        return levels

    return sorted(range(len(parents)), key=depth)


def _steadier(positions: Floats, parents: tuple[int, ...], period: float) -> Floats:
    """How far every joint (T, J, 3) is to be moved for its root to travel smoothly over the ground."""
    moved = np.zeros_like(positions)
    root_of = list(range(len(parents)))
    for joint in _parents_first(parents):
        if parents[joint] >= 0:
            root_of[joint] = root_of[parents[joint]]
    for root in sorted(set(root_of)):
        track = positions[:, root, ::2]
        if np.isfinite(track).all():
            moved[:, np.array(root_of) == root, ::2] = (smooth_curve(track, period) - track)[:, None]
    return moved
