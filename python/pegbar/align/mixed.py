"""Drawings of which arms or legs are marked on the wrong sides, told by the clip that the others are like."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pegbar.align.marks import Line, internal

Floats = NDArray[np.float64]
#: What is looked at together: marks of one side are mistaken for the other's by whole arms and legs.
GROUPS = {"arms": ("upper_arm", "forearm"), "legs": ("thigh", "shin", "feet")}
# Exchanged marks must fit better by this mean angle, and leave at most this share of the difference.
_BETTER, _LEFT = np.radians(20.0), 0.5


def mixed_up(drawn: Floats, clip: Floats, trust: Floats, lines: Sequence[Line]) -> dict[str, NDArray[np.intp]]:
    """Return the drawings whose arms or legs fit the clip much better with left and right exchanged.

    ``drawn`` and ``clip`` (F, K) are the lines' angles in radians where the drawings were matched, ``trust`` (F, K)
    how much each counts.
    """
    found = {}
    names = [line.name for line in lines]
    for group, kinds in GROUPS.items():
        pairs = [
            (names.index(f"left_{kind}"), names.index(f"right_{kind}"))
            for kind in kinds
            if f"left_{kind}" in names and f"right_{kind}" in names
        ]
        own = [place for pair in pairs for place in pair]
        other = [place for pair in pairs for place in reversed(pair)]
        turned = np.zeros(len(own))
        if "feet" in kinds and "feet" in names and pairs:
            own, other = [*own, names.index("feet")], [*other, names.index("feet")]
            turned = np.append(turned, np.pi)
        if not pairs:
            continue
        weights = trust[:, own]
        sums = np.where(weights.sum(axis=1) > 0, weights.sum(axis=1), 1)
        as_marked = (internal(drawn[:, own] - clip[:, own]) * weights).sum(axis=1) / sums
        exchanged = (internal(drawn[:, own] - clip[:, other] - turned) * weights).sum(axis=1) / sums
        frames = np.flatnonzero((as_marked - exchanged > _BETTER) & (exchanged < _LEFT * as_marked))
        if len(frames):
            found[group] = frames
    return found
