"""The skeleton of one drawn figure, also one with other limbs than a person's, and what of a clip moves it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.body import HANGS_ON, MARKERS
from pegbar.scene.joints import EXTRA

Floats = NDArray[np.float64]
#: What a person's limbs hang on: everything that hangs on one of these, and is none of them, begins a limb.
TRUNK = ("pelvis", "chest", "neck", "head")
_ARM, _LEG = ("shoulder", "elbow", "hand"), ("hip", "knee", "foot")
_FRONT = frozenset(("f", "front", "fore", "arm", "hand", "upper", "wing"))
_BACK = frozenset(("b", "back", "hind", "rear", "lower"))
_HALVES = {"pelvis": "hip", "neck": "shoulder"}


@dataclass(frozen=True, eq=False)
class DrawnSkeleton:
    """J joints with their ``marks`` (J, 2), ``bones`` (B, 2) from the root outwards, and ``drives``: joint -> marker.

    A joint that is not in ``drives`` is moved by no marker: it goes with its parent. ``notes`` say what was missing.
    """

    names: tuple[str, ...]
    marks: Floats
    visible: NDArray[np.bool_]
    bones: NDArray[np.int64]
    drives: dict[str, str]
    notes: tuple[str, ...]


def drawn_skeleton(
    names: Sequence[str],
    marks: Floats,
    visible: NDArray[np.bool_],
    parents: Mapping[str, str],
    drives: Mapping[str, str] | None = None,
) -> DrawnSkeleton:
    """Join the marked joints of a figure to a tree and tell what of a clip moves each of them.

    Parameters
    ----------
    names : sequence of str
    marks : (N, 2) float
        Pixels; NaN where a joint is not marked.
    visible : (N,) bool
    parents : dict of str to str
        What joints without a canonical name hang on.
    drives : dict of str to str, optional
        Joint -> canonical marker, for those that are to be moved by another than found; "" for none.

    Raises
    ------
    ValueError
        For a figure without a trunk (pelvis or both hips, and neck or both shoulders), joints that hang together in
        no tree, a joint in ``drives`` that the figure has not, or a marker that is none.
    """
    seen = {name: bool(flag) for name, flag in zip(names, visible, strict=True)}
    points = {name: mark for name, mark in zip(names, marks, strict=True) if np.isfinite(mark).all()}
    notes = [f"no {name} is marked" for name in names if name not in points]
    for middle, half in _HALVES.items():
        sides = [points.get(f"{side}_{half}") for side in ("left", "right")]
        if middle in points:
            continue
        if sides[0] is None or sides[1] is None:
            raise ValueError(f"joints: want a {middle}, or a left_{half} and a right_{half}")
        points[middle], seen[middle] = (sides[0] + sides[1]) / 2, True
        notes.append(f"the {middle} is put midway between left_{half} and right_{half}")
    hangs = {name: _above(name, points, parents) for name in points if name != "pelvis"}
    moved = _drives(points, hangs, drives or {})
    for name, parent in hangs.items():
        # An animal's front legs are marked on its hips in some formats: they belong to the shoulders.
        if parent == "pelvis" and name not in MARKERS and moved.get(name, "").endswith("shoulder"):
            hangs[name] = "neck"
    order = _outwards(hangs)
    bones = [(order.index(hangs[name]), order.index(name)) for name in order[1:]]
    return DrawnSkeleton(
        names=order,
        marks=np.stack([points[name] for name in order]),
        visible=np.array([seen[name] for name in order]),
        bones=np.array(bones, np.int64).reshape(-1, 2),
        drives=moved,
        notes=tuple(notes),
    )


def limb_chains(names: Sequence[str], bones: NDArray[np.int64]) -> list[list[int]]:
    """The limbs of a figure as lists of bones, from the trunk outwards; what is in none belongs to the trunk.

    A limb begins at the joint that hangs on the trunk, so the bones from the neck to the shoulders and from the pelvis
    to the hips are the trunk's. A joint that hangs on the trunk alone is a limb of that one bone.
    """
    chains = []
    for bone, (parent, child) in enumerate(bones):
        if names[parent] not in TRUNK or names[child] in TRUNK:
            continue
        chain, ends = [], {int(child)}
        for below, (above, end) in enumerate(bones):
            if int(above) in ends:
                chain.append(below)
                ends.add(int(end))
        chains.append(chain or [bone])
    return chains


def _above(name: str, points: Mapping[str, Floats], parents: Mapping[str, str]) -> str:
    """What ``name`` hangs on: the nearest marked joint that a person's does, or what the file says."""
    above: str | None = HANGS_ON.get(name, parents.get(name))
    while above is not None and above not in points:
        above = HANGS_ON.get(above, parents.get(above))
    return "pelvis" if above is None else above


def _outwards(hangs: Mapping[str, str]) -> tuple[str, ...]:
    """The joints, parents before children."""
    order = ["pelvis"]
    for parent in order:
        order += [name for name, above in hangs.items() if above == parent]
    lost = [name for name in hangs if name not in order]
    if lost:
        raise ValueError(f"joints: {', '.join(lost)} hang on each other in a ring")
    return tuple(order)


def _drives(points: Mapping[str, Floats], hangs: Mapping[str, str], given: Mapping[str, str]) -> dict[str, str]:
    known = (*MARKERS, *EXTRA)
    for name, marker in given.items():
        if name not in points:
            raise ValueError(f"map: the figure has no joint {name!r}; there are {', '.join(points)}")
        if marker and marker not in known:
            raise ValueError(f"map: no marker is called {marker!r}; there are {', '.join(known)}")
    moved = {name: name for name in points if name in known}
    for start, above in hangs.items():
        if start in known or above not in TRUNK:
            continue
        chain = [start]
        for joint in chain:
            chain += [name for name, parent in hangs.items() if parent == joint]
        moved |= _limb_drives(chain, points)
    return {name: marker for name, marker in (moved | dict(given)).items() if marker}


def _limb_drives(chain: Sequence[str], points: Mapping[str, Floats]) -> dict[str, str]:
    """What moves a limb that is no person's: an arm where it is in front, else a leg; nothing where it is no limb."""
    if len(chain) < 2:
        return {}
    words = {word for name in chain for word in re.split(r"[\W_\d]+", name.lower())}
    start, neck, pelvis = points[chain[0]], points["neck"], points["pelvis"]
    if bool(words & _FRONT) != bool(words & _BACK):
        front = bool(words & _FRONT)
    else:
        front = bool(np.linalg.norm(start - neck) < np.linalg.norm(start - pelvis))
    axis, off = neck - pelvis, start - pelvis
    side = next((side for side in ("left", "right") if words & {side, side[0]}), None)
    side = side or ("left" if axis[0] * off[1] - axis[1] * off[0] > 0 else "right")
    joints = _ARM if front else _LEG
    places = np.rint(np.linspace(0, len(chain) - 1, min(3, len(chain)))).astype(int)
    kinds = joints if len(places) == 3 else (joints[0], joints[2])
    return {chain[place]: f"{side}_{kind}" for place, kind in zip(places, kinds, strict=True)}
