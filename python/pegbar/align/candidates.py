"""The first pass of the search: every clip from every side, at the clips' even rate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.align.marks import Marks
from pegbar.scene.clip import Clip

#: Where the camera may stand at first, in degrees. Twice as many azimuths and elevations rank the clips no better
#: (docs/papers.md); between these the second pass climbs.
AZIMUTHS = tuple(range(0, 360, 30))
ELEVATIONS = (0, 20)
# Drawings a second that the first pass looks at: half the warp's reach at the clips' 30 frames a second.
_DRAWN_RATE = 12.5
# Clips are taken together up to so many frames, and cut into pieces of so many: a piece's rows stay in the cache.
_TOGETHER = 1 << 16
_PIECE = 4096
_PER_CLIP = 4
# Exchanged sides must fit better by this share and angle to be believed: a walk is nearly its own mirror image.
_EXCHANGE_SHARE, _EXCHANGE_ANGLE = 1.08, float(np.radians(0.4))
Cost = TypeVar("Cost", float, NDArray[np.float32])


@dataclass(frozen=True)
class Candidate:
    """A stretch of a clip that may be what was drawn.

    ``clip`` counts the clips, ``end`` is the clip frame of the last drawing; ``exchanged`` is 1 where left and right
    are exchanged in the drawing; ``turn`` is the drawing at which the cycle is begun, ``which`` the tried rate;
    ``cost`` is the mean angle in radians.
    """

    clip: int
    end: int
    azimuth: float
    elevation: float
    exchanged: int
    turn: int
    which: int
    cost: float


def find_candidates(clips: Sequence[Clip], marks: Marks, speed: float, count: int) -> list[Candidate]:
    """Return the ``count`` best stretches of all clips, the best first, a few at most of each clip."""
    drawings = marks.thinned(_DRAWN_RATE)
    orders = marks.orders(drawings)
    found: list[Candidate] = []
    for group in _groups(clips):
        rate = clips[group[0]].rate
        steps = np.stack([marks.steps(o, which, rate, speed) for which in range(len(marks.times)) for o in orders])
        tables = _Tables(marks, np.tile(orders, (len(marks.times), 1)), drawings, steps)
        found += _search([clips[index] for index in group], group, marks, tables)
        found = sorted(found, key=_rank)[: 4 * count]
    return found[:count]


def believed(cost: Cost, exchanged: int) -> Cost:
    """What a cost in radians counts in the ranking: more where sides are exchanged."""
    return cost * _EXCHANGE_SHARE + _EXCHANGE_ANGLE if exchanged else cost


def _rank(candidate: Candidate) -> tuple[float, int, int]:
    return believed(candidate.cost, candidate.exchanged), candidate.clip, candidate.end


class _Tables:
    """What the kernel is told of the drawing."""

    def __init__(
        self, marks: Marks, orders: NDArray[np.intp], drawings: NDArray[np.intp], steps: NDArray[np.uint32]
    ) -> None:
        self.orders = orders
        self.angles = np.ascontiguousarray(marks.angles[:, drawings], np.float32)
        shares = marks.shares()[:, drawings]
        self.shares = np.ascontiguousarray(shares * (marks.angles.shape[1] / len(drawings)), np.float32)
        places = np.full(marks.angles.shape[1], -1)
        places[drawings] = np.arange(len(drawings))
        self.rows = places[orders].astype(np.uint32)
        self.steps = np.ascontiguousarray(steps)
        self.reach = int(steps[..., 1].sum(axis=1).max())
        self.least = int(steps[..., 0].sum(axis=1).min())


def _groups(clips: Sequence[Clip]) -> Iterator[list[int]]:
    """Clips of one rate that are searched together."""
    for rate in sorted({clip.rate for clip in clips}):
        group: list[int] = []
        size = 0
        for index, clip in enumerate(clips):
            if clip.rate == rate:
                group.append(index)
                size += len(clip.markers)
            if size > _TOGETHER:
                yield group
                group, size = [], 0
        if group:
            yield group


def views(
    azimuths: Sequence[float], elevations: Sequence[float]
) -> tuple[NDArray[np.float32], list[tuple[float, float]]]:
    """The picture's axes (V, 2, 3) of every view, right and down, and its azimuth and elevation in degrees."""
    places = [(float(azimuth), float(elevation)) for elevation in elevations for azimuth in azimuths]
    (sa, ca), (se, ce) = ((np.sin(angle), np.cos(angle)) for angle in np.radians(places).T)
    right = np.stack([ca, 0 * ca, -sa], axis=1)
    down = np.stack([sa * se, -ce, ca * se], axis=1)
    return np.stack([right, down], axis=1).astype(np.float32), places


def line_vectors(markers: NDArray[np.float32], pairs: NDArray[np.intp]) -> NDArray[np.float32]:
    """The lines' vectors (K, 3, T) of clip markers (T, 16, 3), as the kernel takes them."""
    vectors: NDArray[np.float32] = np.ascontiguousarray(
        (markers[:, pairs[:, 1]] - markers[:, pairs[:, 0]]).transpose(1, 2, 0), np.float32
    )
    return vectors


def _search(clips: list[Clip], numbers: list[int], marks: Marks, tables: _Tables) -> Iterator[Candidate]:
    starts = np.concatenate([[0], np.cumsum([len(clip.markers) for clip in clips])])
    block = max(tables.least // 2, 8)
    ranges = [piece for a, b in pairwise(starts.tolist()) for piece in _pieces(a, b, tables.reach)]
    vectors = np.concatenate([line_vectors(clip.markers, marks.pairs) for clip in clips], axis=2)
    axes, places = views(AZIMUTHS, ELEVATIONS)
    drawn = (tables.angles, tables.shares, tables.rows, tables.steps)
    costs, ends = _kernels.search_clips(vectors, np.array(ranges, np.uint64), axes, drawn, block)
    shape = (len(costs), len(places), 2, len(tables.orders))
    ranked = costs.reshape(shape).copy()
    ranked[:, :, 1] = believed(ranked[:, :, 1], 1)
    best = ranked.reshape(len(costs), -1).argmin(axis=1)
    rows = np.arange(len(costs))
    cost, end = costs[rows, best], ends[rows, best].astype(np.intp)
    owner = np.searchsorted(starts, end, side="right") - 1
    turns = len(tables.orders) // len(marks.times)
    for row in _apart(cost, end, owner, max(tables.least, block)):
        view, exchanged, order = np.unravel_index(best[row], shape[1:])
        clip = int(owner[row])
        yield Candidate(
            clip=numbers[clip],
            end=int(end[row] - starts[clip]),
            azimuth=places[view][0],
            elevation=places[view][1],
            exchanged=int(exchanged),
            turn=int(tables.orders[order, 0]),
            which=int(order) // turns,
            cost=float(cost[row]),
        )


def _pieces(start: int, stop: int, reach: int) -> Iterator[tuple[int, int]]:
    """A clip's frames cut into pieces that overlap by what a path may reach over."""
    length = max(_PIECE, 2 * reach)
    for begin in range(start, max(stop - reach, start + 1), length):
        yield begin, min(begin + length + reach, stop)


def _apart(cost: NDArray[np.float32], end: NDArray[np.intp], owner: NDArray[np.intp], space: int) -> Iterator[int]:
    """Rows with a path, the cheapest first, that do not end near a cheaper one of the same clip; a few a clip."""
    taken: dict[int, list[int]] = {}
    for row in np.argsort(cost, kind="stable"):
        if not np.isfinite(cost[row]):
            return
        ends = taken.setdefault(int(owner[row]), [])
        if len(ends) < _PER_CLIP and all(abs(end[row] - other) >= space for other in ends):
            ends.append(int(end[row]))
            yield int(row)
