"""Which markers sit on which joint of a skeleton, and which are the next ones below it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.motion import Motion

# A marker this near to its joint, in metres, is the joint; else it is a point that the joint carries.
_ON_JOINT = 1e-6


@dataclass(frozen=True, eq=False)
class Attachments:
    """A skeleton's joints in ``order`` (parents first), and their markers by index.

    ``anchors`` (F, N, 3) are the markers on the clip; ``on[j]`` is the marker at joint j or None, ``own[j]`` all that
    j carries, ``below[j]`` those that j's rotation moves with nothing marked in between; ``is_leg`` (N,) tells the
    markers of hips and legs.
    """

    order: tuple[int, ...]
    anchors: NDArray[np.float64]
    on: tuple[int | None, ...]
    own: tuple[tuple[int, ...], ...]
    below: tuple[tuple[int, ...], ...]
    is_leg: tuple[bool, ...]


def attach(motion: Motion, names: Sequence[str]) -> Attachments:
    """Return how the markers ``names`` sit on the skeleton of ``motion``; ValueError where one cannot."""
    order = parents_first(motion.parents)
    anchors = motion.markers(names)
    index = {name: joint for joint, name in enumerate(motion.names)}
    own: list[list[int]] = [[] for _ in order]
    on: list[int | None] = [None for _ in order]
    carriers = [index[name if name in index else motion.joint_map[name]] for name in names]
    for marker, joint in enumerate(carriers):
        own[joint].append(marker)
        away = np.abs(anchors[:, marker] - motion.positions[:, joint]).max(initial=0.0)
        if away <= _ON_JOINT and on[joint] is None:
            on[joint] = marker
    below: list[list[int]] = [[m for m in markers if m != on[joint]] for joint, markers in enumerate(own)]
    for joint in reversed(order):
        parent, here = motion.parents[joint], on[joint]
        if parent >= 0:
            below[parent] += below[joint] if here is None else [here]
    lower = ("hip", "knee", "foot", "toe")
    return Attachments(
        order,
        anchors,
        tuple(on),
        tuple(map(tuple, own)),
        tuple(map(tuple, below)),
        tuple(any(part in name for part in lower) for name in names),
    )


def parents_first(parents: Sequence[int]) -> tuple[int, ...]:
    """Return the joints in an order in which each stands after its parent; ValueError for points and for circles."""
    if len(parents) > 1 and max(parents) < 0:
        raise ValueError("motion: it has no skeleton, only points, so it has no joint angles")
    order: list[int] = []
    placed = {-1}
    waiting = list(range(len(parents)))
    while waiting:
        ready = [joint for joint in waiting if parents[joint] in placed]
        if not ready:
            raise ValueError(f"motion: the parents of joints {waiting} go round in a circle")
        order += ready
        placed.update(ready)
        waiting = [joint for joint in waiting if joint not in placed]
    return tuple(order)
