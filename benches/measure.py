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

    @classmethod
    def left_out(cls, name: str, reason: object) -> Row:
        """A comparison that could not be made here, and why."""
        return cls(name, "", "", "", "", f"left out: {reason}")

    @property
    def line(self) -> str:
        """The row of a Markdown table."""
        return "| " + " | ".join(cell.replace("|", "/") for cell in self) + " |"


#: What stands above the rows.
HEADER = "| what | ours | peer | ratio | promised | in the same run |\n|---|---|---|---|---|---|"


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
