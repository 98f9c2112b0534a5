"""Marks on key drawings carried to the drawings between them: straight, or along with the drawing's own motion."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
# How far a mark and the way back from it may be apart, in pixels of the picture, for the flow to be believed.
_ROUND_TRIP = 2.0
# Side of the patch around a mark whose motion is that of the mark, as a part of the picture's longer side.
_PATCH = 0.012


def carry_marks(
    markers: ArrayLike,
    marked: ArrayLike,
    pictures: Callable[[int], NDArray[np.uint8]] | None = None,
    *,
    average: int = 1,
) -> tuple[Floats, Flags]:
    """Give every drawing marks, from those that are marked before and after it.

    With ``pictures`` a mark follows the drawing: optical flow from the key before forwards and from the key after
    backwards, the two blended in time so that both keys are met; where the flow is not to be trusted (the way there
    and back does not end where it began) the mark goes straight. Before the first and after the last key marks are
    carried from one side.

    Parameters
    ----------
    markers : (F, N, 2) float
        Marks in pixels; looked at only where ``marked``.
    marked : (F, N) bool
        Which marks are drawn.
    pictures : callable, optional
        Returns drawing f as (H, W) uint8 in grey; None: marks go straight.
    average : int
        Window of a moving average over time in drawings, odd (2009 paper, section 3.2); 1 leaves the marks as they are.

    Returns
    -------
    carried : (F, N, 2) float
        Marks; NaN for a marker that no drawing shows.
    flags : (F, N) bool
        True where the mark is not drawn.

    Raises
    ------
    ValueError
        For a wrong shape, a mark that is not finite, or a window that is not odd.

    Examples
    --------
    >>> carried, flags = carry_marks([[[0.0, 0]], [[9, 9]], [[4, 2]]], [[True], [False], [True]])
    >>> carried[1].tolist(), flags[1].tolist()
    ([[2.0, 1.0]], [True])
    """
    marks = arrays.floats("markers", markers, ("F", "N", 2), allow="any")
    there = arrays.flags("marked", marked, marks.shape[:2])
    if not np.isfinite(marks[there]).all():
        raise ValueError("markers: want finite numbers where marked")
    if average < 1 or average % 2 == 0:
        raise ValueError(f"average: want an odd number of drawings, got {average}")
    carried = _straight(marks, there)
    if pictures is not None:
        carried = _flowing(carried, there, pictures)
    return moving_average(carried, average), ~there


def moving_average(markers: ArrayLike, window: int) -> Floats:
    """Return ``markers`` (F, N, 2) averaged over ``window`` drawings; narrower at the ends, so that they stay there.

    Examples
    --------
    >>> moving_average([[[0.0, 0]], [[3, 0]], [[0, 3]]], 3)[1].tolist()
    [[1.0, 1.0]]
    """
    marks = arrays.floats("markers", markers, ("F", "N", 2), allow="nan")
    smooth = np.empty_like(marks)
    for frame in range(len(marks)):
        reach = min(window // 2, frame, len(marks) - 1 - frame)
        smooth[frame] = marks[frame - reach : frame + reach + 1].mean(axis=0)
    return smooth


def _straight(marks: Floats, there: Flags) -> Floats:
    """Linear in time between marks, held before the first and after the last.

    A marker that some of the drawings with marks lack keeps its place to the others there: a figure that walks on takes
    a hidden elbow along.
    """
    moments, carried = np.arange(len(marks)), np.full(marks.shape, np.nan)
    steady: Flags = np.all(there[there.any(axis=1)], axis=0)
    body = np.zeros((len(marks), 2))
    for marker in (*np.flatnonzero(steady), *np.flatnonzero(there.any(axis=0) & ~steady)):
        keys = moments[there[:, marker]]
        origin = np.zeros_like(body) if steady[marker] else body
        for axis in range(2):
            way = np.interp(moments, keys, marks[keys, marker, axis] - origin[keys, axis])
            carried[:, marker, axis] = way + origin[:, axis]
        if steady[marker]:
            body += carried[:, marker] / steady.sum()
    return carried


def _flowing(straight: Floats, there: Flags, pictures: Callable[[int], NDArray[np.uint8]]) -> Floats:
    """Marks along the flow: forwards and backwards from the keys, blended."""
    frames = len(straight)
    forward, backward = straight.copy(), straight.copy()
    trust = np.ones((2, frames, straight.shape[1]))
    steps = _Flow(pictures)
    for frame in range(1, frames):
        free = ~there[frame]
        forward[frame, free], trust[0, frame, free] = steps.follow(forward[frame - 1, free], frame - 1, frame)
        trust[0, frame, free] *= trust[0, frame - 1, free]
    for frame in range(frames - 2, -1, -1):
        free = ~there[frame]
        backward[frame, free], trust[1, frame, free] = steps.follow(backward[frame + 1, free], frame + 1, frame)
        trust[1, frame, free] *= trust[1, frame + 1, free]
    carried = straight.copy()
    for marker in np.flatnonzero(there.any(axis=0)):
        _blend(carried[:, marker], forward[:, marker], backward[:, marker], trust[:, :, marker], there[:, marker])
    return carried


def _blend(straight: Floats, forward: Floats, backward: Floats, trust: Floats, there: Flags) -> None:
    """Mix one marker's ways (F, 2) in place; what trust is missing goes to the straight way."""
    keys = np.flatnonzero(there)
    for frame in np.flatnonzero(~there):
        before, after = keys[keys < frame], keys[keys > frame]
        if not len(before):
            straight[frame] += trust[1, frame] * (backward[frame] - straight[frame])
        elif not len(after):
            straight[frame] += trust[0, frame] * (forward[frame] - straight[frame])
        else:
            share = (frame - before[-1]) / (after[0] - before[-1])
            weights = np.array([(1 - share) * trust[0, frame], share * trust[1, frame]])
            mixed = weights[0] * (forward[frame] - straight[frame]) + weights[1] * (backward[frame] - straight[frame])
            straight[frame] += mixed


class _Flow:
    """Dense optical flow between neighbouring drawings, each made once."""

    def __init__(self, pictures: Callable[[int], NDArray[np.uint8]]) -> None:
        self._pictures = pictures
        self._engine = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
        self._flows: dict[tuple[int, int], NDArray[np.float32]] = {}

    def follow(self, places: Floats, start: int, stop: int) -> tuple[Floats, Floats]:
        """Where ``places`` (n, 2) of drawing ``start`` are in ``stop``, and whether (1 or 0) to believe it."""
        if not len(places):
            return places, np.ones(0)
        there = places + self._motion(places, start, stop)
        back = there + self._motion(there, stop, start)
        apart = np.linalg.norm(back - places, axis=1)
        return np.where(np.isfinite(there), there, places), (apart <= _ROUND_TRIP).astype(float)

    def _motion(self, places: Floats, start: int, stop: int) -> Floats:
        """The median motion of the patch around each place."""
        if (start, stop) not in self._flows:
            pair = self._pictures(start), self._pictures(stop)
            self._flows[start, stop] = self._engine.calc(*pair, None)
        flow = self._flows[start, stop]
        height, width = flow.shape[:2]
        reach = max(1, round(_PATCH * max(height, width) / 2))
        moved = np.zeros_like(places)
        for index, place in enumerate(places):
            if np.isfinite(place).all():
                column, row = (round(float(value)) for value in np.clip(place, 0, (width - 1, height - 1)))
                patch = flow[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1]
                moved[index] = np.median(patch.reshape(-1, 2), axis=0)
        return moved
