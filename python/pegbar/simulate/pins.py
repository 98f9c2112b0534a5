"""Pins: what holds the points of an element."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar import arrays

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
PIN_KINDS = ("marker", "limb", "path", "world")


@dataclass(frozen=True, eq=False)
class Pin:
    """Holds vertices where something is.

    ``kind`` "marker" keeps them at their distance from the marker ``target``, "limb" at their place on the limb
    ``target`` (which turns, grows and thickens), "world" where they are. ``vertices`` (p,) are the indices held, None
    all of them; ``character`` names whose marker or limb it is (None: the scene's first).
    """

    kind: str
    target: str = ""
    vertices: Integers | None = None
    character: str | None = None
    path: Floats | None = None

    def __post_init__(self) -> None:
        if self.kind not in PIN_KINDS:
            raise ValueError(f"kind: want one of {', '.join(PIN_KINDS)}, got {self.kind!r}")
        if (self.kind == "path") != (self.path is not None):
            raise ValueError(f"path: want one for the kind 'path', and for no other, got {self.kind!r}")
        if self.path is not None:
            object.__setattr__(self, "path", arrays.floats("path", self.path, ("F", 3, 4)))
        if self.kind in ("marker", "limb") and not self.target:
            raise ValueError(f"target: a pin to a {self.kind} wants its name")
        if self.vertices is not None:
            object.__setattr__(self, "vertices", arrays.integers("vertices", self.vertices, ("p",), low=0))


def check_pins(name: str, pins: tuple[Pin, ...], count: int) -> None:
    """Refuse, with a ValueError, ``pins`` of the element ``name`` to other vertices than its ``count``."""
    for pin in pins:
        if pin.vertices is not None and pin.vertices.size and pin.vertices.max() >= count:
            raise ValueError(f"pins: {name}: vertex {pin.vertices.max()} is not one of {count}")
