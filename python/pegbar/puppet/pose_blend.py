"""From one pose to another, and a movement's end to its beginning (what the 2007 paper leaves for later, section 9)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def blend_poses(bones: Ints, first: Floats, second: Floats, shares: Floats) -> Floats:
    """Return poses (F, J, 3) between two: roots go straight, bones turn the shortest way at an even pace.

    ``bones`` (B, 2) lie from the root outwards; ``first`` and ``second`` are (J, 3) or (F, J, 3); ``shares`` (F,) is
    0 for the first and 1 for the second. Lengths are the first's.
    """
    shares = np.asarray(shares, np.float64)
    start, end = (np.broadcast_to(pose, (len(shares), *np.shape(pose)[-2:])) for pose in (first, second))
    result: Floats = start + shares[:, None, None] * (end - start)
    for parent, child in bones.tolist():
        result[:, child] = result[:, parent] + _turned(
            start[:, child] - start[:, parent], end[:, child] - end[:, parent], shares
        )
    return result


def ease(count: int) -> Floats:
    """Return shares (count,) between 0 and 1, both left out, that start and end slowly (a smooth step of degree 5)."""
    share = np.arange(1, count + 1) / (count + 1)
    smooth: Floats = share**3 * (share * (share * 6 - 15) + 10)
    return smooth


def closed_loop(bones: Ints, poses: Floats, frame_rate: float) -> tuple[Floats, int]:
    """Return poses (G, J, 3) that repeat without a jump, and how many frames of ``poses`` (F, J, 3) they take.

    The end is where, after at least half the frames, pose and movement are most like at the beginning; the rest of the
    difference is spread over the last third of a second before it. Roots must be in place.
    """
    count = len(poses)
    if count < 4:
        return poses, count
    seen = poses - poses[:, :1]
    speed = np.gradient(seen, axis=0) * frame_rate
    ends = np.arange(max(2, count // 2), count)
    unlike = np.linalg.norm(seen[ends] - seen[0], axis=2).mean(axis=1)
    unlike += 0.1 * np.linalg.norm(speed[ends] - speed[0], axis=2).mean(axis=1)
    end = int(ends[unlike.argmin()])
    fade = min(end - 1, max(2, round(frame_rate / 3)))
    looped = poses[: end + 1].copy()
    # What is left at the end is taken away before it, so that frame `end` would be frame 0 again.
    looped[-fade:] = blend_poses(bones, poses[end + 1 - fade : end + 1], _ahead(poses, end, fade), ease_to_end(fade))
    return looped[:-1], end


def ease_to_end(count: int) -> Floats:
    """Return shares (count,) that rise slowly from above 0 to 1."""
    return np.append(ease(count - 1), 1.0)


def _ahead(poses: Floats, end: int, fade: int) -> Floats:
    """The poses moved so that at ``end`` they are the first pose: bone directions at the end are the first's."""
    difference = poses[0] - poses[end]
    moved: Floats = poses[end + 1 - fade : end + 1] + difference
    return moved


def _turned(first: Floats, second: Floats, shares: Floats) -> Floats:
    """Vectors (F, 3) between two by the shortest turn; opposite ones go straight."""
    lengths = np.stack([np.linalg.norm(vectors, axis=1) for vectors in (first, second)])
    safe = np.maximum(lengths, 1e-12)
    a, b = first / safe[0, :, None], second / safe[1, :, None]
    angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))
    sine = np.sin(angle)
    small = sine < 1e-6
    sine = np.where(small, 1.0, sine)
    left = np.where(small, 1 - shares, np.sin((1 - shares) * angle) / sine)
    right = np.where(small, shares, np.sin(shares * angle) / sine)
    turned: Floats = (left[:, None] * a + right[:, None] * b) * lengths[0][:, None]
    return turned
