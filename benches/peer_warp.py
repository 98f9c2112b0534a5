"""time_warp of 2000 drawn with 5000 clip frames beside librosa's, and the pose distances beside vectorised numpy."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benches.measure import Row, alternate, milliseconds
from pegbar import pose_distance, time_warp

DRAWN, CLIP, LIMBS = 2000, 5000, 8


def angles(count: int, seed: int) -> np.ndarray:
    """Limbs that swing like a walk's, each at its own pace."""
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.normal(0, 0.05, (count, LIMBS)), axis=0)
    return np.remainder(walk + np.pi, 2 * np.pi) - np.pi


def run() -> Iterator[Row]:
    """Yield a row for the distances and one for each kind of warp."""
    a, b = angles(DRAWN, 0), angles(CLIP, 1)
    cost = pose_distance(a, b)

    def by_numpy() -> np.ndarray:
        total = np.zeros((DRAWN, CLIP))
        for one, other in zip(a.T, b.T, strict=True):
            turn = np.abs(one[:, None] - other)
            total += np.minimum(turn, 2 * np.pi - turn)
        return total

    ours, numpys = alternate(lambda: pose_distance(a, b), by_numpy, rounds=5)
    error = np.abs(by_numpy() - cost).max()
    name = f"pose_distance {DRAWN} x {CLIP}, {LIMBS} limbs"
    peer = f"vectorised numpy {milliseconds(numpys)}"
    yield Row(name, milliseconds(ours), peer, f"{numpys / ours:.1f}x", "", f"largest difference {error:.0e}")
    try:
        from librosa.sequence import dtw
    except ImportError:
        yield Row.left_out("time_warp", "librosa is missing")
        return
    for name, options, theirs in (
        ("closed", {}, {}),
        ("open begin and end", {"open_begin": True, "open_end": True}, {"subseq": True}),
    ):
        ours, librosas = alternate(
            lambda options=options: time_warp(cost, **options),
            lambda theirs=theirs: dtw(C=cost, backtrack=True, **theirs),
            rounds=7,
        )
        table, path = dtw(C=cost, **theirs)
        best = table[-1, path[0, 1]]
        yield Row(
            f"time_warp {DRAWN} x {CLIP}, {name}",
            milliseconds(ours),
            f"librosa {milliseconds(librosas)}",
            f"{librosas / ours:.1f}x",
            "promise 5x" if not options else "",
            f"costs differ by {abs(best - time_warp(cost, **options).cost):.0e}",
        )
