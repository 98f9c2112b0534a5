"""How values that come in parts are spread, without keeping them: for measures over all frames of a long shot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_FARTHEST = 1_000_000


class Spread:
    """Counts values in bins of ``width``; the smallest and largest are exact.

    Values farther from zero than a million widths count as if they were there, so that memory is bounded.

    Examples
    --------
    >>> spread = Spread(0.01)
    >>> for part in ([1.0, 2.0], [3.0, 4.0, 5.0]):
    ...     spread.add(np.array(part))
    >>> [round(value, 2) for value in spread.percentiles([0, 50, 99, 100])]
    [1.0, 3.0, 4.96, 5.0]
    """

    def __init__(self, width: float) -> None:
        self.width = width
        self.count = 0
        self._least, self._most = np.inf, -np.inf
        self._first, self._counts = 0, np.empty(0, np.int64)

    def add(self, values: Floats) -> None:
        """Count ``values``, of any shape and finite."""
        if not values.size:
            return
        self.count += values.size
        self._least, self._most = min(self._least, float(values.min())), max(self._most, float(values.max()))
        bins = np.floor(np.clip(values.ravel() / self.width, -_FARTHEST, _FARTHEST)).astype(np.int64)
        low, high = int(bins.min()), int(bins.max())
        if len(self._counts):
            low, high = min(low, self._first), max(high, self._first + len(self._counts) - 1)
        counts = np.bincount(bins - low, minlength=high - low + 1)
        counts[self._first - low :][: len(self._counts)] += self._counts
        self._first, self._counts = low, counts

    def percentiles(self, shares: list[float]) -> list[float]:
        """The values that ``shares`` in 100 are below, linearly between neighbours, to ``width``.

        Raises ValueError where nothing was added.
        """
        if not self.count:
            raise ValueError("no values to tell percentiles of")
        ends = np.cumsum(self._counts)
        found = []
        for share in shares:
            place = share / 100 * (self.count - 1)
            below, above = (self._ranked(int(rank), ends) for rank in (np.floor(place), np.ceil(place)))
            found.append(float(below + (place - np.floor(place)) * (above - below)))
        return found

    def _ranked(self, rank: int, ends: NDArray[np.int64]) -> float:
        """The value with ``rank`` smaller ones: its bin's middle, but for the smallest and the largest."""
        if rank == 0:
            return self._least
        if rank == self.count - 1:
            return self._most
        middle = (self._first + int(np.searchsorted(ends, rank, side="right")) + 0.5) * self.width
        return min(max(middle, self._least), self._most)
