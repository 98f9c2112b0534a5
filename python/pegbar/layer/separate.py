"""Volumes that run into each other are moved apart in depth: what is drawn stays where it is (2010 paper, section 5).

The paper lets volumes interpenetrate, since markers are placed without looking at them. A marker may move along its
ray without leaving its mark, so two limbs that cross in the picture can always be put one behind the other. Which is
in front stays as it was found, for as long as they touch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import gaussian_filter1d, label

from pegbar import arrays
from pegbar.layer.volumes import collision_volumes
from pegbar.lift.backprojection import camera_rays
from pegbar.scene.body import HANGS_ON
from pegbar.scene.camera import metric

Floats = NDArray[np.float64]
#: Places along each limb that are compared.
STATIONS = np.linspace(0, 1, 9)
# Rounds of moving pairs apart, and of smoothing what has moved; drawings that the smoothing reaches over.
_ROUNDS, _SWEEPS, _REACH = 6, 8, 1.2
# Drawings that are compared at once: all places of all pairs of limbs take 0.4 MB a drawing.
_TOGETHER = 64
# How much more easily a marker moves than the trunk, which everything hangs on.
_LIGHT = 10.0
_TRUNK = frozenset({"pelvis", "chest", "neck", "left_hip", "right_hip", "left_shoulder", "right_shoulder"})


@dataclass(frozen=True, eq=False)
class Separated:
    """Depths (F, N) of markers whose volumes touch less, and the deepest overlap (F,) before and after, metres."""

    depths: Floats
    before: Floats
    after: Floats


def separate_volumes(
    boxes: ArrayLike,
    matrices: ArrayLike,
    markers: ArrayLike,
    depths: ArrayLike,
    limbs: ArrayLike,
    names: Sequence[str],
    *,
    clearance: float = 0.0,
    measure_only: bool = False,
) -> Separated:
    """Move markers along their rays until limbs that are not joined do not run into each other.

    Limbs are joined that share a marker or hang on the same one (thighs on the pelvis), or on each other: those may
    overlap. Markers of the trunk hardly move, others do.

    Parameters
    ----------
    boxes : (F, V, 4, 2) float
        Limb boxes in pixels as `collision_volumes` takes them, NaN where unknown.
    matrices : (F, 3, 4) float
        The cameras.
    markers : (F, N, 2) float
        Markers in pixels, NaN where unknown.
    depths : (F, N) float
        Their planar depths in metres.
    limbs : (V, 2) int
        Each limb's two markers.
    names : sequence of N str
        The markers' names.
    clearance : float
        Metres that are left between limbs that are moved apart: room for cloth.
    measure_only : bool
        Move nothing, say how deep volumes overlap.

    Returns
    -------
    Separated

    Raises
    ------
    ValueError
        For a wrong shape.
    DegenerateError
        As `collision_volumes` does.

    Examples
    --------
    >>> camera = [[[100.0, 0, 0, 0], [0, 100.0, 0, 0], [0, 0, 1, 0]]]
    >>> marks = [[[0.0, -20], [0, 20], [-20, 0], [20, 0]]]
    >>> boxes = [[[[-5, -20], [-5, 20], [5, 20], [5, -20]], [[-20, 5], [20, 5], [20, -5], [-20, -5]]]]
    >>> names = ["left_knee", "left_foot", "right_elbow", "right_hand"]
    >>> found = separate_volumes(boxes, camera, marks, [[2.0, 2.0, 2.1, 2.1]], [[0, 1], [2, 3]], names)
    >>> bool(found.before[0] > 0.1), bool(found.after[0] < 0.001)
    (True, True)
    """
    matrices = metric(arrays.floats("matrices", matrices, ("F", 3, 4)))
    marks = arrays.floats("markers", markers, (len(matrices), len(names), 2), allow="nan")
    start = arrays.floats("depths", depths, marks.shape[:2], allow="nan")
    pairs = arrays.integers("limbs", limbs, ("V", 2), low=0, high=len(names) - 1)
    corners = arrays.floats("boxes", boxes, (len(marks), len(pairs), 4, 2), allow="nan")
    if not (np.isfinite(clearance) and clearance >= 0):
        raise ValueError(f"clearance: want metres of 0 or more, got {clearance}")
    body = _Body(corners, matrices, marks, pairs, names, clearance)
    before, _ = body.overlaps(start)
    deepest = _deepest(before - clearance)
    if measure_only or not (before > 0).any():
        return Separated(start, deepest, deepest)
    order = body.order(start, before)
    moved = start.copy()
    for _ in range(_ROUNDS):
        for _ in range(_SWEEPS):
            moved = body.pushed(moved, order)
        known = np.isfinite(moved - start)
        moved = start + gaussian_filter1d(np.where(known, moved - start, 0.0), _REACH, axis=0, mode="nearest")
    for _ in range(2 * _SWEEPS):
        moved = body.pushed(moved, order)
    after, _ = body.overlaps(moved)
    return Separated(moved, deepest, _deepest(after - clearance))


def _deepest(overlaps: Floats) -> Floats:
    known = np.nan_to_num(overlaps, nan=0.0, neginf=0.0)
    return np.asarray(known.max(axis=1, initial=0.0))


class _Body:
    """The limbs of a drawn character as functions of its markers' depths."""

    def __init__(
        self,
        boxes: Floats,
        matrices: Floats,
        marks: Floats,
        limbs: NDArray[np.int64],
        names: Sequence[str],
        clearance: float,
    ) -> None:
        self.clearance = clearance
        self.boxes, self.matrices, self.limbs = boxes, matrices, limbs
        self.centres, self.rays = camera_rays(marks, matrices)
        self.first, self.second = _free_pairs(limbs, names)
        self.ease = np.array([1.0 if name in _TRUNK else _LIGHT for name in names])

    def overlaps(self, depths: Floats) -> tuple[Floats, tuple[Floats, ...]]:
        """How deep each pair overlaps or lacks clearance (F, P), and where: stations, depth between, depth needed."""
        starts = range(0, max(len(depths), 1), _TOGETHER)
        parts = [self._overlaps(depths, slice(start, start + _TOGETHER)) for start in starts]
        deepest, *where = (np.concatenate(values) for values in zip(*parts, strict=True))
        return deepest, tuple(where)

    def _overlaps(self, depths: Floats, part: slice) -> tuple[Floats, ...]:
        """The five arrays of `overlaps` for the drawings of ``part``."""
        matrices = self.matrices[part]
        points = self.centres[part, None] + depths[part, :, None] * self.rays[part]
        volumes = collision_volumes(self.boxes[part], matrices, points, self.limbs)
        axis = volumes.start[:, :, None] + STATIONS[:, None] * (volumes.end - volumes.start)[:, :, None]
        radii = volumes.start_radius[..., None] + STATIONS * (volumes.end_radius - volumes.start_radius)[..., None]
        apart = axis[:, self.second, None, :] - axis[:, self.first, :, None]
        wide = radii[:, self.second, None, :] + radii[:, self.first, :, None] + self.clearance
        gaps = wide - np.linalg.norm(apart, axis=-1)
        shape = (*gaps.shape[:2], -1)
        deepest = np.where(np.isnan(gaps), -np.inf, gaps).reshape(shape).argmax(axis=2)[..., None]
        at = [np.take_along_axis(value.reshape(shape), deepest, axis=2)[..., 0] for value in (gaps, wide)]
        between = np.einsum("fi,fpsti->fpst", matrices[:, 2, :3], apart)
        deep = np.take_along_axis(between.reshape(shape), deepest, axis=2)[..., 0]
        lateral = np.maximum((at[1] - at[0]) ** 2 - deep**2, 0)
        needed = np.sqrt(np.maximum(at[1] ** 2 - lateral, 0))
        along = np.divmod(deepest[..., 0], len(STATIONS))
        return at[0], STATIONS[along[0]], STATIONS[along[1]], deep, needed

    def order(self, depths: Floats, overlaps: Floats) -> Floats:
        """Which limb of each pair is behind (F, P): 1 the second, -1 the first; the same while they touch."""
        deep = self.overlaps(depths)[1][2]
        order = np.where(deep >= 0, 1.0, -1.0)
        touching = np.nan_to_num(overlaps, nan=-1.0) > 0
        for pair in range(order.shape[1]):
            runs, count = label(touching[:, pair])
            for run in range(1, count + 1):
                order[runs == run, pair] = 1.0 if deep[runs == run, pair].sum() >= 0 else -1.0
        return order

    def pushed(self, depths: Floats, order: Floats) -> Floats:
        """``depths`` after every overlapping pair has been pushed towards touching, all pairs at once."""
        overlaps, (s, t, deep, needed) = self.overlaps(depths)
        lacking = np.where(np.nan_to_num(overlaps, nan=-1.0) > 1e-4, needed - order * deep, 0.0)
        total, count = np.zeros_like(depths), np.zeros_like(depths)
        ends = (
            (self.limbs[self.first, 0], -(1 - s)),
            (self.limbs[self.first, 1], -s),
            (self.limbs[self.second, 0], 1 - t),
            (self.limbs[self.second, 1], t),
        )
        weight = sum(self.ease[marker] * share**2 for marker, share in ends)
        push = np.where(lacking > 0, order * lacking / np.maximum(weight, 1e-9), 0.0)
        frames = np.arange(len(depths))[:, None]
        for marker, share in ends:
            move = self.ease[marker] * share * push
            np.add.at(total, (frames, marker), move)
            np.add.at(count, (frames, marker), (np.abs(move) > 1e-7).astype(float))
        moved: Floats = depths + total / np.maximum(count, 1)
        return np.maximum(moved, 0.05)


def _free_pairs(limbs: NDArray[np.int64], names: Sequence[str]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The pairs of limbs that are not joined."""
    bases = [{names[marker] for marker in limb} for limb in limbs]
    near = [base | {HANGS_ON[name] for name in base if name in HANGS_ON} for base in bases]
    found = [
        (a, b)
        for a in range(len(limbs))
        for b in range(a + 1, len(limbs))
        if not _joined(near[a], near[b], bases, a, b)
    ]
    pairs = np.array(found, np.intp).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]


def _joined(a: set[str], b: set[str], bases: Sequence[set[str]], first: int, second: int) -> bool:
    return bool(a & b) or bool(a & bases[second]) or bool(b & bases[first])
