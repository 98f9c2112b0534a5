"""When a clip is at each drawing: a time warp, then times between the clip's frames, near the first ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.align.descriptor import limb_trust, longest_seen, pose_descriptor, pose_distance
from pegbar.align.times import smooth_weighted
from pegbar.align.timewarp import TimeWarp, time_warp
from pegbar.scene.body import limbs_between

Floats = NDArray[np.float64]
#: The clip's poses with these indices as a drawing, given by its place, sees them: (n, N, 2).
Look = Callable[[int, NDArray[np.intp] | slice], Floats]
#: A warp chooses among one clip pose a drawing. More poses would make every drawing that the clip takes longer for
#: dearer. Then each time is settled among so many poses between.
FINE = 4
# The clip runs at most so many times faster or slower than drawn.
_SLOPE = 3
# How much changes of the clip's speed count against its distance from each drawing's cheapest time.
_STIFFNESS = 4.0
# So many poses, spread over a clip, tell how long its limbs are seen: all of them in a shot of five hundred drawings.
# And so many drawings and poses are compared for the plot. With more, every drawing of a longer shot would take longer.
_POSES, _SHOWN = 2000, 1000


@dataclass(frozen=True, eq=False)
class Marks:
    """A drawing's marks (F, N, 2), which are seen (F, N), their names, and the time that each drawing is shown (F,)."""

    places: Floats
    seen: NDArray[np.bool_]
    names: tuple[str, ...]
    holds: Floats
    image_size: tuple[int, int]


@dataclass(frozen=True, eq=False)
class Retiming:
    """The time warp of F drawings and the clip at frames ``moments`` (G,).

    ``times`` (F,) is the clip's frame at each drawing, in fractions. ``cost`` has the distances of the drawn poses from
    the clip's: of every so manieth drawing and moment, as ``thinned`` says, which is (1, 1) for all but long shots.
    """

    cost: Floats
    thinned: tuple[int, int]
    moments: Floats
    warp: TimeWarp
    times: Floats


@dataclass(frozen=True, eq=False)
class DrawnLimbs:
    """The drawn limbs (K, 2) as marks, their angles and how far these are to be trusted (F, K), and the holds (F,)."""

    limbs: list[tuple[int, int]]
    angles: Floats
    trust: Floats
    holds: Floats

    @classmethod
    def of(cls, marks: Marks) -> DrawnLimbs:
        """The limbs of ``marks``, as far as these are seen."""
        limbs = [(marks.names.index(limb.start), marks.names.index(limb.end)) for limb in limbs_between(marks.names)]
        drawn = np.where(marks.seen[..., None], marks.places, np.nan)
        return cls(limbs, pose_descriptor(drawn, limbs), limb_trust(drawn, limbs), marks.holds)

    def warped(self, seen: Floats, moments: Floats) -> Floats:
        """The columns (F,) of ``moments`` that a time warp finds for poses (G, N, 2) as all drawings see them.

        Raises ValueError where the clip has too few frames.
        """
        cost = self._costs(slice(None), seen[::FINE], longest_seen(seen, self.limbs))
        if cost.shape[1] * _SLOPE < len(cost):
            shown = f"{moments[0]:.0f} to {moments[-1]:.0f}"
            raise ValueError(f"clip.start, clip.stop: frames {shown} are too few for {len(cost)} drawings")
        warp = time_warp(cost, open_begin=True, open_end=True, slope_limit=_SLOPE, holds=self.holds)
        return warp.times * FINE

    def settled(self, seen: Floats, columns: Floats) -> Floats:
        """The columns (F,) of poses (G, N, 2), as all drawings see them, that are cheap near ``columns`` (F,)."""
        lengths = longest_seen(seen, self.limbs)
        return self._settled(lambda _, which: seen[which], [lengths] * len(columns), len(seen), columns)

    def retimed(self, look: Look, moments: Floats, columns: Floats) -> Retiming:
        """The clip retimed to the drawings, near ``columns`` (F,) of ``moments`` (G,), its poses seen by ``look``.

        Each drawing is compared with the poses near its own time; time and memory grow with the drawings.
        """
        coarse = moments[::FINE]
        spread, thinned = _thinned(len(columns), len(moments))
        lengths, shown = [], []
        for row in range(len(columns)):
            seen = look(row, slice(None, None, spread))
            lengths.append(longest_seen(seen, self.limbs))
            if row % thinned[0] == 0:
                shown.append(self._costs(row, seen[:: FINE * thinned[1] // spread], lengths[row]))
        columns = self._settled(look, lengths, len(moments), columns)
        frames = np.rint(columns / FINE).astype(np.int64).clip(0, len(coarse) - 1)
        paired = [
            self._costs(row, look(row, slice(FINE * at, FINE * at + 1)), lengths[row]) for row, at in enumerate(frames)
        ]
        path = np.stack([np.arange(len(frames)), frames], axis=1)
        warp = TimeWarp(path, float(np.sum(paired)), frames, columns / FINE)
        times = np.interp(columns, np.arange(len(moments)), moments)
        return Retiming(np.concatenate(shown), thinned, coarse, warp, times)

    def _settled(self, look: Look, lengths: list[Floats], count: int, columns: Floats) -> Floats:
        """The columns (F,) of ``count`` poses near ``columns`` that are cheap and run smoothly."""
        width = min(2 * FINE + 3, count)
        first = np.clip(np.rint(columns) - FINE - 1, 0, count - width).astype(np.intp)
        near = np.concatenate(
            [self._costs(row, look(row, slice(at, at + width)), lengths[row]) for row, at in enumerate(first.tolist())]
        )
        return _smoothly_cheap(near, first, count - 1, columns, self.holds)

    def _costs(self, rows: int | slice, seen: Floats, lengths: Floats) -> Floats:
        """Distances of drawings from poses (n, N, 2) whose limbs are seen as long as ``lengths`` (K,) at most."""
        part = slice(rows, rows + 1) if isinstance(rows, int) else rows
        trust = limb_trust(seen, self.limbs, lengths=np.where(lengths > 0, lengths, 1))
        angles = pose_descriptor(seen, self.limbs)
        return pose_distance(self.angles[part], angles, a_trust=self.trust[part], b_trust=trust)


def _thinned(drawings: int, poses: int) -> tuple[int, tuple[int, int]]:
    """Every so manieth pose tells how long limbs are seen; of coarse poses, every so manieth drawing and pose is shown.

    What is shown is among those that tell.
    """
    spread = next((step for step in (1, 2) if poses <= step * _POSES), FINE * -(-poses // (FINE * _POSES)))
    step = max(1, spread // FINE)
    return spread, (-(-drawings // _SHOWN), step * -(-poses // (FINE * _SHOWN * step)))


def _smoothly_cheap(cost: Floats, first: NDArray[np.intp], last: int, times: Floats, holds: Floats) -> Floats:
    """Times (F,) near ``times``, in columns up to ``last``, that are cheap and run smoothly.

    ``cost`` has each drawing's columns from ``first`` (F,) on. It is taken for a parabola about the cheapest column
    near by; where it is flat, neighbours decide.
    """
    if last < 2:
        return times
    rows = np.arange(len(cost))
    near = np.clip(np.rint(times)[:, None] + np.arange(-FINE, FINE + 1), 1, last - 1).astype(np.intp)
    best = near[rows, np.argmin(cost[rows[:, None], near - first[:, None]], axis=1)]
    before, here, after = (cost[rows, best - first + step] for step in (-1, 0, 1))
    bend = np.maximum(before - 2 * here + after, 1e-6)
    lowest = best + np.clip((before - after) / (2 * bend), -1, 1)
    return smooth_weighted(lowest, bend, holds[:-1], _STIFFNESS).clip(0, last)
