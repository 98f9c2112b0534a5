"""What a simulation leaves behind: arrays for every element and frame, from which it can be taken up again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

State = Mapping[str, NDArray[Any]]


class Cache(Protocol):
    """Arrays by group (an element's name, or an engine's own) and frame.

    A cloth's or prop's ``positions`` are its vertices (n, 3); balls and boxes have ``positions`` (n, 3) and
    ``rotations`` (n, 4), quaternions x y z w. World metres. Other arrays are the engine's, to go on from that frame.
    """

    def write(self, group: str, frame: int, state: State) -> None:
        """Keep ``state``, complete or not at all."""

    def read(self, group: str, frame: int) -> State:
        """Return the state of a frame; KeyError where there is none."""

    def frames(self, group: str) -> list[int]:
        """Return the frames that are there, in order."""

    def clear(self, group: str, start: int) -> None:
        """Forget the frames from ``start`` on."""


class MemoryCache:
    """A cache that lives as long as the program.

    Examples
    --------
    >>> cache = MemoryCache()
    >>> cache.write("skirt", 0, {"positions": np.zeros((1, 3))})
    >>> cache.frames("skirt"), cache.read("skirt", 0)["positions"].shape
    ([0], (1, 3))
    """

    def __init__(self) -> None:
        self._states: dict[str, dict[int, State]] = {}

    def write(self, group: str, frame: int, state: State) -> None:
        """Keep copies of ``state``'s arrays."""
        self._states.setdefault(group, {})[frame] = {name: np.array(array) for name, array in state.items()}

    def read(self, group: str, frame: int) -> State:
        """Return the state of a frame; KeyError where there is none."""
        return self._states[group][frame]

    def frames(self, group: str) -> list[int]:
        """Return the frames that are there, in order."""
        return sorted(self._states.get(group, {}))

    def clear(self, group: str, start: int) -> None:
        """Forget the frames from ``start`` on."""
        kept = self._states.get(group, {})
        for frame in [frame for frame in kept if frame >= start]:
            del kept[frame]


def complete_until(cache: Cache, group: str) -> int:
    """Return how many frames of ``group`` are there from frame 0 on without a gap."""
    count = 0
    for frame in cache.frames(group):
        if frame != count:
            break
        count += 1
    return count
