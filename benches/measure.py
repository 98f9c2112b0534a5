"""What the comparisons share: works timed in turn, and the row that is printed."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import NamedTuple


class Row(NamedTuple):
    """One comparison: what, ours, the peer, their ratio, what was promised, and what says both did the same work."""

    name: str
    ours: str
    peer: str
    ratio: str
    promise: str = ""
    correctness: str = ""


def alternate(*works: Callable[[], object], rounds: int = 15) -> list[float]:
    """Return the median milliseconds of each of ``works``, taken in turn, so that a noisy machine treats them alike.

    One round before the counted ones warms up.
    """
    times: list[list[float]] = [[] for _ in works]
    for turn in range(rounds + 1):
        for work, found in zip(works, times, strict=True):
            begin = time.perf_counter()
            work()
            if turn:
                found.append(1e3 * (time.perf_counter() - begin))
    return [statistics.median(found) for found in times]


def milliseconds(value: float) -> str:
    """Return a time to print."""
    return f"{value:.1f} ms"
