"""A motion that runs on into its own beginning: pose and speed are blended over the seam."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pegbar.lift.attachments import parents_first
from pegbar.scene.motion import Motion

Floats = NDArray[np.float64]
#: A figure that comes farther than this over the ground, in metres, travels: it does not come back at the seam.
TRAVELS = 0.25
#: The seam is blended into this part of the frames on either side, and into no more than so many.
SHARE, MOST = 0.3, 8
#: A loop has as many frames at least.
FEWEST = 3


@dataclass(frozen=True, eq=False)
class Loop:
    """``motion`` as one turn of a loop that begins again ``travel`` (3,) metres from where it began."""

    motion: Motion
    travel: Floats


def close_loop(motion: Motion, *, blend: int | None = None) -> Loop:
    """Blend the end of a motion into its beginning, so that it repeats without a jolt.

    Frame 0 follows frame F - 1. What is missing there, of pose and of speed, is shared out by a curve over the frames
    on either side of the seam; a smooth motion that loops already hardly changes. A figure that travels keeps its
    travel; only the rest of its movement is closed.

    Parameters
    ----------
    motion : Motion
        A skeleton in motion, F frames: one turn of the loop.
    blend : int, optional
        Frames on either side of the seam that may change. None: three tenths of the frames, at most 8.

    Returns
    -------
    Loop
        The F frames, and how far the next turn is from this one.

    Raises
    ------
    ValueError
        For fewer than 3 frames, a motion without a skeleton, or a blend that is not in 1..F / 2.

    Examples
    --------
    >>> angle = np.array([0.0, 0.2, 0.4, 0.2])
    >>> turns = Rotation.from_rotvec(np.outer(angle, [0, 0, 1])).as_matrix()[:, None]
    >>> spin = Motion(("a",), (-1,), np.zeros((4, 1, 3)), turns, 24.0)
    >>> close_loop(spin).travel.tolist()
    [0.0, 0.0, 0.0]
    """
    frames = len(motion.positions)
    if frames < FEWEST:
        raise ValueError(f"motion: want {FEWEST} frames or more to close a loop, got {frames}")
    reach = max(min(round(SHARE * frames), MOST), 1) if blend is None else blend
    if not 1 <= reach <= frames / 2:
        raise ValueError(f"blend: want 1 to {frames // 2} frames, got {blend}")
    order = parents_first(motion.parents)
    travel = _travel(motion)
    even = np.arange(frames)[:, None, None] / frames * travel
    offsets, turns = _local(motion, motion.positions - even)
    offsets += _ramp(frames, reach, *_missing(offsets))
    seam = _missing_turns(turns)
    bends = Rotation.from_rotvec(_ramp(frames, reach, *seam).reshape(-1, 3)).as_matrix().reshape(turns.shape)
    turns = bends @ turns
    positions, rotations = offsets.copy(), turns.copy()
    for joint in order:
        parent = motion.parents[joint]
        if parent >= 0:
            step = np.einsum("fij,fj->fi", rotations[:, parent], offsets[:, joint])
            positions[:, joint] = positions[:, parent] + step
            rotations[:, joint] = rotations[:, parent] @ turns[:, joint]
    return Loop(motion.changed(positions=positions + even, rotations=rotations), travel)


def _travel(motion: Motion) -> Floats:
    """How far over the ground the root is after one turn; a figure that hardly moves comes back."""
    root = motion.positions[:, motion.parents.index(-1)]
    speed = (root[1] - root[0] + root[-1] - root[-2]) / 2
    way = (root[-1] - root[0] + speed) * [1.0, 0.0, 1.0]
    return way if np.linalg.norm(way) > TRAVELS else np.zeros(3)


def _local(motion: Motion, positions: Floats) -> tuple[Floats, Floats]:
    """Offsets (F, J, 3) and rotations (F, J, 3, 3) in the parents' axes; a root's in the world's."""
    parents = np.array(motion.parents)
    above, root = np.maximum(parents, 0), (parents < 0)[:, None]
    frame = np.where(root[..., None], np.eye(3), motion.rotations[:, above])
    apart = positions - np.where(root, 0.0, positions[:, above])
    return np.einsum("fjki,fjk->fji", frame, apart), np.einsum("fjki,fjkl->fjil", frame, motion.rotations)


def _missing(tracks: Floats) -> tuple[Floats, Floats]:
    """What a loop of ``tracks`` (F, ...) lacks at its seam: place, and speed a frame, between last frame and first."""
    steps = np.diff(tracks, axis=0)
    return _seam(tracks[0] - tracks[-1], steps[:2], steps[-2:])


def _missing_turns(turns: Floats) -> tuple[Floats, Floats]:
    """The same for rotations (F, J, 3, 3), as rotation vectors."""

    def steps(after: Floats, before: Floats) -> Floats:
        flat = (after @ np.swapaxes(before, -1, -2)).reshape(-1, 3, 3)
        vectors: Floats = Rotation.from_matrix(flat).as_rotvec()
        return vectors.reshape(after.shape[:-1])

    between = steps(turns[1:], turns[:-1])
    return _seam(steps(turns[:1], turns[-1:])[0], between[:2], between[-2:])


def _seam(step: Floats, begin: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Missing place and speed, from the step over the seam and the steps (n, ...) after and before it."""
    place = step - (begin[0] + end[-1]) / 2
    speed = begin[0] - end[-1]
    # Two frames lie between those steps: so much change of speed is the motion's own.
    return place, speed - (begin[1] - begin[0]) - (end[1] - end[0])


def _ramp(frames: int, reach: int, place: Floats, speed: Floats) -> Floats:
    """The correction (F, ...): half of what is missing at the seam, nothing ``reach`` frames away from it.

    The seam lies half a frame before frame 0 and after frame F - 1.
    """
    after = (np.arange(frames) + 0.5) / reach
    before = after[::-1]
    ramp = np.zeros((frames, *place.shape))
    for times, side in ((after, -1.0), (before, 1.0)):
        near = np.minimum(times, 1.0).reshape(-1, *[1] * place.ndim)
        value = 1 - 3 * near**2 + 2 * near**3
        slope = reach * near * (1 - near) ** 2
        # Away from the seam time runs forwards after it and backwards before it: both slopes count alike.
        ramp += side * value * place / 2 - slope * speed / 2
    return ramp
