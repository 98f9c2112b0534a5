"""The drawn side of the search: angles of the limbs, how much each counts, and when each drawing is shown.

Compared are the paper's eight limbs, the torso, and the line from foot to foot: without it a walk seen from the front,
whose limbs hardly swing in the picture, is like any standing figure (docs/papers.md has the figures).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pegbar.align.descriptor import limb_trust, pose_descriptor
from pegbar.scene.body import LIMBS, MARKERS

Floats = NDArray[np.float64]
Integers = NDArray[np.intp]


class Line(NamedTuple):
    """Two markers whose direction is compared, and how much it counts."""

    name: str
    start: str
    end: str
    weight: float = 1.0


#: What is compared of two poses.
LINES = (
    *(Line(limb.name, limb.start, limb.end) for limb in LIMBS if limb.name != "head"),
    Line("feet", "left_foot", "right_foot", 2.0),
)
#: Rates that are tried for drawings that do not say theirs, drawings a second.
RATES = (8.0, 12.0, 24.0)
# A line that is shorter than this share of its usual length counts less, as its marks' noise turns it more.
_FORESHORTENED = 0.5
# The usual length of a line is at least this share of the others': one that always points at the viewer has none.
_LEAST = 0.25
_HIDDEN = 0.5
_FEWEST = 4
#: At how many of its drawings a cycle is begun at first: between these the warp reaches.
TURNS = 8


def exchange(names: Sequence[str]) -> list[int]:
    """For each marker the index of its namesake on the other side, or its own."""
    other = {"left": "right", "right": "left"}

    def twin(name: str) -> str:
        side, _, joint = name.partition("_")
        return f"{other[side]}_{joint}" if side in other and joint else name

    return [names.index(twin(name)) if twin(name) in names else index for index, name in enumerate(names)]


#: The canonical markers with left and right exchanged.
EXCHANGED = exchange(MARKERS)


@dataclass(frozen=True, eq=False)
class Marks:
    """A drawn sequence of F drawings, compared by K lines.

    ``angles`` (2, F, K) float are radians, as marked and with left and right exchanged; ``trust`` (2, F, K) how much
    each counts, 0 to 1, ``weights`` (K,) times so much; ``times`` (R, F) seconds at which the drawings come, for each
    rate that is tried; ``periods`` (R,) when a cycle begins again. ``source`` (D,) is the drawing that each of the D
    given frames shows: frames with the same marks in a row are one.
    """

    lines: tuple[Line, ...]
    angles: Floats
    trust: Floats
    weights: Floats
    times: Floats
    periods: Floats
    rates: tuple[float, ...]
    loops: bool
    source: Integers

    @property
    def pairs(self) -> Integers:
        """The lines' markers (K, 2), as indices into the canonical ones."""
        return np.array([(MARKERS.index(line.start), MARKERS.index(line.end)) for line in self.lines])

    def shares(self) -> Floats:
        """How much each angle counts (2, F, K) in the mean over the whole sequence: they sum to 1 over F and K."""
        shares = self.trust * self.weights
        sums = shares.sum(axis=-1, keepdims=True)
        normed: Floats = np.where(sums > 0, shares / np.where(sums > 0, sums, 1), 0) / self.angles.shape[1]
        return normed

    def movement(self) -> float:
        """How far the drawings are from a held pose: the mean angle in radians to the one that is nearest to all."""
        angles, shares = self.angles[0], self.shares()[0]
        candidates = range(0, len(angles), max(1, len(angles) // 24))
        return min(float((internal(angles - angles[index]) * shares).sum()) for index in candidates)

    def thinned(self, rate: float) -> Integers:
        """Indices of drawings that come at most ``rate`` times a second, and of at most 64."""
        times = self.times[0]
        kept = [0]
        for index in range(1, len(times)):
            if times[index] - times[kept[-1]] >= 1 / rate - 1e-9:
                kept.append(index)
        return np.array(kept)[:: -(-len(kept) // 64)]

    def orders(self, drawings: Integers) -> Integers:
        """Orders (n, f) in which ``drawings`` (f,) may be gone through: a cycle may begin anywhere."""
        if not self.loops or len(drawings) < 2:
            return drawings[None]
        step = max(1, len(drawings) // TURNS)
        return np.stack([np.roll(drawings, -turn) for turn in range(0, len(drawings), step)])

    def steps(self, order: Integers, which: int, rate: float, speed: float) -> NDArray[np.uint32]:
        """Least and largest number of clip frames (f, 2) between each drawing of ``order`` and the one before.

        ``which`` is the tried rate, ``rate`` the clip's frames a second, ``speed`` how much faster or slower the clip
        may go than it was captured.
        """
        times = self.times[which][order]
        apart = np.diff(times, prepend=times[0])
        apart = np.where(apart < 0, apart + self.periods[which], apart) * rate
        low = np.maximum(np.rint(apart / speed), 1)
        steps = np.stack([low, np.maximum(np.rint(apart * speed), low)], axis=1)
        steps[0] = 0
        return steps.astype(np.uint32)


def internal(difference: Floats) -> Floats:
    """The internal angle 0..pi of a difference of angles in radians."""
    around: Floats = np.abs(np.remainder(difference + np.pi, 2 * np.pi) - np.pi)
    return around


def read_marks(
    markers: Floats,
    names: Sequence[str],
    visible: NDArray[np.bool_],
    *,
    frame_rate: float | None,
    holds: Floats,
    loops: bool,
) -> Marks:
    """Return what the search compares of the marks (D, N, 2) of a drawn sequence.

    Raises
    ------
    ValueError
        Where fewer than four of the lines have marks.
    """
    full = np.full((len(markers), len(MARKERS), 2), np.nan)
    seen = np.zeros(full.shape[:2], bool)
    for index, name in enumerate(names):
        if name in MARKERS:
            full[:, MARKERS.index(name)] = markers[:, index]
            seen[:, MARKERS.index(name)] = visible[:, index]
    first = np.ones(len(full), bool)
    first[1:] = [not np.array_equal(a, b, equal_nan=True) for a, b in zip(full[1:], full[:-1], strict=True)]
    known = np.isfinite(full).all(axis=-1)
    lines = tuple(line for line in LINES if _both(known, line).mean() >= 0.5)
    if len(lines) < _FEWEST:
        raise ValueError(
            f"names: want marks of at least {_FEWEST} limbs to compare, got {', '.join(line.name for line in lines)}"
            f"{'' if lines else 'none'} from {', '.join(names)}"
        )
    pairs = np.array([(MARKERS.index(line.start), MARKERS.index(line.end)) for line in lines])
    shown, hidden = full[first], ~seen[first]
    angles, trust = zip(*(_compare(shown[:, o], hidden[:, o], pairs) for o in (range(16), EXCHANGED)), strict=True)
    begins = np.concatenate([[0], np.cumsum(holds)])
    rates = RATES if frame_rate is None and len(shown) > 1 else (frame_rate or RATES[-1],)
    times = np.stack([begins[:-1][first] / rate for rate in rates])
    return Marks(
        lines=lines,
        angles=np.stack(angles),
        trust=np.stack(trust),
        weights=np.array([line.weight for line in lines]),
        times=times,
        periods=np.array([begins[-1] / rate for rate in rates]),
        rates=tuple(rates),
        loops=loops,
        source=np.cumsum(first) - 1,
    )


def _both(flags: NDArray[np.bool_], line: Line) -> NDArray[np.bool_]:
    both: NDArray[np.bool_] = flags[:, MARKERS.index(line.start)] & flags[:, MARKERS.index(line.end)]
    return both


def _compare(points: Floats, hidden: NDArray[np.bool_], pairs: Integers) -> tuple[Floats, Floats]:
    """Angles (F, K) of the lines between ``points`` (F, 16, 2), and how far each is to be trusted."""
    lengths = np.linalg.norm(points[:, pairs[:, 1]] - points[:, pairs[:, 0]], axis=-1)
    usual = np.nan_to_num(np.nanpercentile(np.where(np.isnan(lengths).all(axis=0), 0, lengths), 90, axis=0))
    usual = np.maximum(usual, max(_LEAST * float(np.median(usual)), 1e-9))
    trust = limb_trust(points, pairs, lengths=_FORESHORTENED * usual)
    trust = trust * np.where(hidden[:, pairs].any(axis=-1), _HIDDEN, 1.0)
    return np.nan_to_num(pose_descriptor(points, pairs)), trust
