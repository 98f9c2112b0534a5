"""The time warp: which frames of a clip go with which drawn frames (Jain et al. 2009, section 3.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import _kernels, arrays
from pegbar.align.times import smooth_times

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TimeWarp:
    """The cheapest alignment of F drawn frames with a clip.

    ``path`` (L, 2) int are the aligned pairs (drawn frame, clip frame) from begin to end, ``cost`` the sum of their
    costs. ``frames`` (F,) int holds for each drawn frame the cheapest of its partners (the first of equals), never
    decreasing; ``times`` (F,) float are the same smoothed to fractions of a clip frame, never decreasing.
    """

    path: NDArray[np.int64]
    cost: float
    frames: NDArray[np.int64]
    times: Floats

    @property
    def partners(self) -> NDArray[np.int64]:
        """For each drawn frame its first and last partner (F, 2)."""
        return _partners(self.path)


def time_warp(
    cost: ArrayLike,
    *,
    open_begin: bool = False,
    open_end: bool = False,
    slope_limit: int | None = None,
    holds: ArrayLike | None = None,
    stiffness: float = 10.0,
    slack: float = 0.5,
) -> TimeWarp:
    """Align a drawn sequence with a clip so that the costs of the aligned pairs add up to the least.

    Dynamic time warping with steps (1, 1), (1, 0), (0, 1) of weight 1 (the paper leaves them open), ties to the
    diagonal, then to the next drawn frame.

    Parameters
    ----------
    cost : (F, G) float
        Cost of pairing each drawn frame (row) with each clip frame (column), as `pose_distance` gives it. NaN and
        infinite costs are refused: a large finite cost keeps a pair apart.
    open_begin, open_end : bool
        All drawn frames against a segment of a longer clip: the path may begin or end at any clip frame. Without, it
        runs from (0, 0) to (F - 1, G - 1).
    slope_limit : int, optional
        The most partners a frame may have on either side: between two diagonal steps at most slope_limit - 1 others,
        all of one kind, so that the clip runs nowhere more than slope_limit times faster or slower than it was
        captured (Sakoe and Chiba 1978, P = 1 / (slope_limit - 1)). 1 to 128; 1 is the diagonal alone.
    holds : (F,) float, optional
        For how long each drawing is shown, in any unit: the speed of the smoothed times is per film time.
    stiffness : float
        How much changes of speed count against the distance of ``times`` from ``frames``; 0 leaves the frames.
    slack : float
        How far, in clip frames, the smoothed times may leave the range of a drawn frame's partners.

    Returns
    -------
    TimeWarp
        Path, cost, a frame and a time for each drawn frame.

    Raises
    ------
    ValueError
        For a wrong shape or dtype, a cost that is not finite, no frame on either side, costs that add up to infinity,
        a slope limit outside 1..128 or one that no path can meet, holds that are not positive, a negative stiffness,
        or a slack that is not positive.

    Examples
    --------
    >>> drawn, clip = np.array([0.0, 1.0, 2.0]), np.array([5.0, 0.0, 1.0, 2.0, 7.0])
    >>> warp = time_warp(abs(drawn[:, None] - clip), open_begin=True, open_end=True)
    >>> warp.cost, warp.frames.tolist()
    (0.0, [1, 2, 3])
    """
    table = arrays.floats("cost", cost, ("F", "G"), allow="any")
    limit = _slope_limit(slope_limit, table.shape, open_begin or open_end)
    spacing = _durations(holds, len(table))
    for name, value in (("stiffness", stiffness), ("slack", slack)):
        if not (np.isfinite(value) and value >= 0 and (value or name != "slack")):
            raise ValueError(f"{name}: want a {'positive' if name == 'slack' else 'finite'} number, got {value}")
    total, path = _kernels.time_warp(table, bool(open_begin), bool(open_end), limit)
    frames = _cheapest(table, path)
    first, last = _partners(path).T
    low, high = np.maximum(first - slack, 0), np.minimum(last + slack, table.shape[1] - 1)
    times = smooth_times(frames.astype(float), low, high, spacing[:-1], stiffness)
    return TimeWarp(path, total, frames, times)


def _slope_limit(value: int | None, shape: tuple[int, ...], is_open: bool) -> int | None:
    if value is None:
        return None
    limit = int(arrays.integers("slope_limit", value, (), low=1, high=128))
    drawn, clip = shape
    if clip * limit < drawn or (drawn * limit < clip and not is_open):
        least = -(-max(drawn, clip) // max(min(drawn, clip), 1))
        raise ValueError(
            f"slope_limit: {drawn} drawn frames and {clip} clip frames cannot be aligned within {limit}; "
            f"want {least} at least" + ("" if is_open or clip * limit < drawn else ", or an open begin or end")
        )
    return limit


def _durations(holds: ArrayLike | None, count: int) -> Floats:
    if holds is None:
        return np.ones(count)
    durations: Floats = arrays.floats("holds", holds, (count,))
    if not (durations > 0).all():
        raise ValueError(f"holds: want positive durations, got {durations.min()} at {int(np.argmin(durations))}")
    return durations


def _partners(path: NDArray[np.int64]) -> NDArray[np.int64]:
    starts = np.flatnonzero(np.diff(path[:, 0], prepend=-1))
    ends = np.append(starts[1:], len(path)) - 1
    return np.stack([path[starts, 1], path[ends, 1]], axis=1)


def _cheapest(table: Floats, path: NDArray[np.int64]) -> NDArray[np.int64]:
    order = np.lexsort((path[:, 1], table[path[:, 0], path[:, 1]], path[:, 0]))
    firsts = np.flatnonzero(np.diff(path[order, 0], prepend=-1))
    frames: NDArray[np.int64] = path[order[firsts], 1]
    return frames
