"""The second pass of the search: the best view and times of one candidate, with the exact costs of equation 4."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.align.candidates import Candidate, line_vectors, views
from pegbar.align.descriptor import pose_descriptor, pose_distance
from pegbar.align.marks import TURNS, Marks, internal
from pegbar.scene.clip import Clip, interpolate
from pegbar.scene.orthographic import OrthographicCamera

Floats = NDArray[np.float64]
# Frames a second at which times are found (CMU's own rate), and at which views are tried with a part of the drawings.
_RATE, _VIEW_RATE, _DRAWN_RATE = 120.0, 60.0, 12.5
# Degrees by which the view is moved, in turn, until no neighbour is better.
_TURNS = (15.0, 7.5, 3.75, 1.5, 0.75)
_LOWEST, _HIGHEST = -45.0, 60.0
# Drawings whose costs are held at once: all of a long shot's would be hundreds of megabytes.
_ROWS = 64


@dataclass(frozen=True, eq=False)
class Aligned:
    """A candidate from its best side: clip frame of every drawing (F,), angles and differences (F, K) in radians."""

    candidate: Candidate
    azimuth: float
    elevation: float
    times: Floats
    angles: Floats
    differences: Floats
    cost: float


class Refiner:
    """Finds view and times of candidates for one drawing."""

    def __init__(self, marks: Marks, speed: float) -> None:
        self.marks, self.speed = marks, speed
        self.shares = marks.shares()

    def refine(self, clip: Clip, candidate: Candidate) -> Aligned | None:
        """Return the candidate's best alignment, or None where the clip is too short about it.

        The rate that the first pass found may be one whose paths are too long for the clip here: then others are tried.
        """
        others = (which for which in range(len(self.marks.times)) if which != candidate.which)
        for which in (candidate.which, *others):
            if found := self._refine(clip, replace(candidate, which=which)):
                return found
        return None

    def _refine(self, clip: Clip, candidate: Candidate) -> Aligned | None:
        place = self._climb(clip, candidate)
        camera = OrthographicCamera.from_angles(*place)
        times, cost = self._align(clip, candidate, camera)
        if not np.isfinite(cost):
            return None
        angles = pose_descriptor(camera.project(interpolate(clip.markers, times)), self.marks.pairs)
        differences = internal(angles - self.marks.angles[candidate.exchanged])
        return Aligned(candidate, place[0] % 360, place[1], times, angles, differences, cost)

    def _order(self, drawings: NDArray[np.intp], candidate: Candidate) -> NDArray[np.intp]:
        return np.roll(drawings, -int(np.searchsorted(drawings, candidate.turn)))

    def _climb(self, clip: Clip, candidate: Candidate) -> tuple[float, float]:
        """The view, in degrees, that no view near it betters."""
        drawings = self.marks.thinned(_DRAWN_RATE)
        order = self._order(drawings, candidate)
        steps = self.marks.steps(order, candidate.which, _VIEW_RATE, self.speed)
        window = _Window(clip, candidate.end, int(steps[:, 1].sum()), _VIEW_RATE)
        vectors = line_vectors(window.markers, self.marks.pairs)
        which = slice(candidate.exchanged, candidate.exchanged + 1)
        drawn = (
            np.ascontiguousarray(self.marks.angles[which, order], np.float32),
            np.ascontiguousarray(self.shares[which, order], np.float32),
            np.arange(len(order), dtype=np.uint32)[None],
            steps[None],
        )
        whole = np.array([[0, len(window.markers)]], np.uint64)
        place = (candidate.azimuth, candidate.elevation)
        for turn in _TURNS:
            for _ in range(6):
                rises = sorted({min(max(place[1] + step * turn, _LOWEST), _HIGHEST) for step in (-1, 0, 1)})
                axes, around = views([place[0] + step * turn for step in (-1, 0, 1)], rises)
                costs = _kernels.search_clips(vectors, whole, axes, drawn, len(window.markers))[0][0]
                best = around[int(costs.argmin())]
                if best == place:
                    break
                place = best
        return place

    def _align(self, clip: Clip, candidate: Candidate, camera: OrthographicCamera) -> tuple[Floats, float]:
        """Times (F,) in clip frames on the cheapest path, and its mean angle in radians."""
        marks = self.marks
        drawings = np.arange(marks.angles.shape[1])
        ways = []
        for turn in self._turns(candidate):
            order = np.roll(drawings, -turn)
            ways.append((order, marks.steps(order, candidate.which, _RATE, self.speed)))
        window = _Window(clip, candidate.end, max(int(steps[:, 1].sum()) for _, steps in ways), _RATE)
        projected = pose_descriptor(camera.project(window.markers), marks.pairs)
        times, best = np.zeros(len(drawings)), np.inf
        for order, steps in ways:
            path, cost = cheapest_path(self._costs(candidate, projected, order), steps, len(projected))
            if cost < best:
                best = cost
                times[order] = window.times[path]
        return times, best / (marks.weights.sum() * len(drawings))

    def _costs(self, candidate: Candidate, projected: Floats, order: NDArray[np.intp]) -> Iterator[Floats]:
        """The costs (n, G) of a few drawings at a time and all poses of the clip."""
        marks, exchanged = self.marks, candidate.exchanged
        for start in range(0, len(order), _ROWS):
            rows = order[start : start + _ROWS]
            angles, trust = marks.angles[exchanged, rows], marks.trust[exchanged, rows]
            yield pose_distance(angles, projected, weights=marks.weights, a_trust=trust)

    def _turns(self, candidate: Candidate) -> list[int]:
        """Drawings at which a cycle may begin: the first pass tries only some of them."""
        count = self.marks.angles.shape[1]
        if not self.marks.loops:
            return [candidate.turn]
        reach = -(-count // TURNS)
        return sorted({(candidate.turn + turn) % count for turn in range(-reach, reach + 1)})


def cheapest_path(parts: Iterable[Floats], steps: NDArray[np.uint32], length: int) -> tuple[NDArray[np.intp], float]:
    """The clip frame of every drawing (F,) on the cheapest path, and the sum of its costs; +inf where none fits.

    ``parts`` are the rows of costs (F, ``length``), some at a time; ``steps`` (F, 2) the least and most clip frames
    from the drawing before, 0 for the first. The path may begin and end at any clip frame.
    """
    sums, taken = np.zeros(length), []
    row = 0
    for costs in parts:
        sums, moved = _kernels.segment_rows(costs, steps[row : row + len(costs)], sums)
        taken.append(moved)
        row += len(costs)
    column = int(sums.argmin())
    cost, path = float(sums[column]), np.zeros(row, np.intp)
    if np.isfinite(cost):
        for moved in reversed(taken):
            for step in moved[::-1]:
                row -= 1
                path[row] = column
                column -= int(step[column])
    return path, cost


class _Window:
    """The part of a clip that paths of ``reach`` frames to about frame ``end`` may use, at another ``rate``."""

    def __init__(self, clip: Clip, end: int, reach: int, rate: float) -> None:
        finer = rate / clip.rate
        first = max(end - int(np.ceil(reach / finer)) - 2, 0)
        # The end was found among frames of the even rate and of a part of the drawings.
        last = min(end + int(np.ceil(0.25 * clip.rate)), len(clip.markers) - 1)
        self.times = first + np.arange(int((last - first) * finer + 1e-6) + 1) / finer
        self.markers = interpolate(clip.markers, self.times).astype(np.float32)
