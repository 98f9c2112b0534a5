"""What a clip does not say and its poses tell: its unit, which way is up, and an inserted T-pose.

All functions are pure and take markers as marker -> points (..., 3); what a function needs and is not there makes it
answer None. Angles follow the world: Y up, azimuth 0 along +Z, 90 along +X.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Markers = Mapping[str, Floats]

#: Metres in a unit. CMU's unit is 1/0.45 inch: the ASF files say "length 0.45", and their inches are divided by it.
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "foot": 0.3048, "cmu": 0.0254 / 0.45}
#: Heights of people for whom a known unit is believed; neighbouring units differ by more than these.
HEIGHTS = (1.35, 2.05)
#: The height a clip is scaled to when no known unit makes it a person.
USUAL_HEIGHT = 1.7
#: Rotations that take an up axis to +Y. Points of a laboratory walk along X, which becomes Z (`up_rotation`).
_UP = {
    "y": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "z": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "x": ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
    "-y": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
    "-z": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "-x": ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
}
_SIDES = ("left", "right")


def up_rotation(up: str, *, laboratory: bool = False) -> Floats:
    """Return the rotation (3, 3) from a file's axes with ``up`` ("y", "z", "-x", ...) to Y up.

    Characters with Z up face -Y (Blender's habit), which becomes +Z. In a ``laboratory``, whose Z is up, X becomes Z,
    as in CMU's own conversion of its C3D files to AMC: (x, y, z) becomes (y, z, x).
    """
    if up not in _UP:
        raise ValueError(f"up: want one of {', '.join(_UP)}, got {up!r}")
    return np.array(((0, 1, 0), (0, 0, 1), (1, 0, 0)) if laboratory and up == "z" else _UP[up], np.float64)


def up_axis(markers: Markers) -> tuple[str, float] | None:
    """Return the axis along which heads are over feet, and the share of the frames that say so.

    ``markers``: head (or neck, or chest) and both feet (..., 3), in any unit and axes.
    """
    top = next((markers[name] for name in ("head", "neck", "chest") if name in markers), None)
    feet = _middle(markers, "foot")
    if top is None or feet is None:
        return None
    upright = (top - feet).reshape(-1, 3)
    upright = upright[np.isfinite(upright).all(axis=1) & (np.abs(upright).max(axis=1) > 0)]
    if not len(upright):
        return None
    axes = np.abs(upright).argmax(axis=1)
    signs = np.sign(np.take_along_axis(upright, axes[:, None], axis=1)[:, 0]).astype(int)
    kinds, counts = np.unique(axes * 2 + (signs < 0), return_counts=True)
    kind = int(kinds[counts.argmax()])
    return ("-" if kind % 2 else "") + "xyz"[kind // 2], float(counts.max() / len(upright))


def is_standing(markers: Markers) -> bool:
    """Whether a rest pose (points (3,)) stands: legs straight, and the head beyond the hips seen from the feet."""
    feet, knees, hips = (_middle(markers, joint) for joint in ("foot", "knee", "hip"))
    top = next((markers[name] for name in ("head", "neck", "chest") if name in markers), None)
    if feet is None or knees is None or hips is None or top is None:
        return False
    return _angle(hips - knees, knees - feet) < 40 and _angle(top - hips, hips - feet) < 40


def person_height(markers: Markers, top: Floats | None = None, *, head: float = 0.88) -> float | None:
    """Return the height of the person standing straight, from the chain ankle, knee, hip, neck, head.

    Medians over frames of the bones' lengths, so that no frame needs to stand straight. ``top`` (..., 3) is the top of
    the skull where it is known. An ankle is at 4 % of a person's height and the head's joint at 88 % (Winter 2009), or
    where ``head`` says: the middle of markers round the forehead is at 94 %.
    """
    legs = [
        _length(markers[f"{side}_foot"], markers[f"{side}_knee"])
        + _length(markers[f"{side}_knee"], markers[f"{side}_hip"])
        for side in _SIDES
        if all(f"{side}_{joint}" in markers for joint in ("foot", "knee", "hip"))
    ]
    hips = _middle(markers, "hip")
    if not legs or hips is None or "neck" not in markers or "head" not in markers:
        return None
    trunk = [hips, *(markers[name] for name in ("chest", "neck", "head") if name in markers)]
    chain = sum(legs) / len(legs) + sum(_length(low, high) for low, high in pairwise(trunk))
    skull = 0.0 if top is None else _length(markers["head"], top)
    # A tip on the head's joint or far away is a helper, not a skull.
    height = (chain + skull) / 0.96 if 0.04 * chain < skull < 0.3 * chain else chain / (head - 0.04)
    return height if math.isfinite(height) and height > 0 else None


def guess_unit(height: float) -> tuple[str, float]:
    """Return the unit, name and metres, in which ``height`` (file units) is that of a person.

    The name is "" where no known unit fits: then the unit makes the person 1.7 m tall.
    """
    fitting = [(name, unit) for name, unit in UNITS.items() if HEIGHTS[0] <= height * unit <= HEIGHTS[1]]
    return min(
        fitting, key=lambda pair: abs(math.log(height * pair[1] / USUAL_HEIGHT)), default=("", USUAL_HEIGHT / height)
    )


def inserted_pose(markers: Markers, positions: Floats, rotations: Floats) -> int | None:
    """Return the index of a T-pose or rest pose that was put before (or behind) the movement, or None.

    The pose jumps from there to the next frame by more than five times the usual step and twice the large ones, and is
    one of arms stretched out sideways and straight legs, or that in which no joint is turned. ``positions``
    (F, J, 3) and ``rotations`` (F, J, 3, 3) are the skeleton's; fewer than four frames tell nothing.
    """
    if len(positions) < 4:
        return None
    seen = positions - positions[:, :1]
    steps = np.linalg.norm(np.diff(seen, axis=0), axis=2).mean(axis=1)
    for frame, jump, others in ((0, steps[0], steps[1:]), (len(positions) - 1, steps[-1], steps[:-1])):
        far = jump > max(5 * np.median(others), 2 * np.percentile(others, 95))
        unturned = np.abs(rotations[frame, 1:] - np.eye(3)).max(initial=0) < 0.01
        if far and (unturned or is_t_pose({name: points[frame] for name, points in markers.items()})):
            return frame
    return None


def is_t_pose(markers: Markers) -> bool:
    """Whether arms are straight and point sideways, away from each other, and legs are straight; points are (3,)."""
    if not all(f"{side}_{joint}" in markers for side in _SIDES for joint in ("shoulder", "elbow", "hand", "hip")):
        return False
    arms = []
    for side in _SIDES:
        upper = markers[f"{side}_elbow"] - markers[f"{side}_shoulder"]
        if _angle(upper, markers[f"{side}_hand"] - markers[f"{side}_elbow"]) > 25:
            return False
        arms.append(upper)
        if f"{side}_knee" in markers and f"{side}_foot" in markers:
            thigh = markers[f"{side}_knee"] - markers[f"{side}_hip"]
            if _angle(thigh, markers[f"{side}_foot"] - markers[f"{side}_knee"]) > 25:
                return False
    across = markers["left_hip"] - markers["right_hip"]
    return _angle(arms[0], -arms[1]) < 40 and _angle(arms[0], across) < 40 and _angle(-arms[1], across) < 40


def _middle(markers: Markers, joint: str) -> Floats | None:
    if not all(f"{side}_{joint}" in markers for side in _SIDES):
        return None
    middle: Floats = (markers[f"left_{joint}"] + markers[f"right_{joint}"]) / 2
    return middle


def _length(first: Floats, second: Floats) -> float:
    lengths = np.linalg.norm(first - second, axis=-1)
    return float(np.nanmedian(lengths)) if np.isfinite(lengths).any() else math.nan


def _angle(first: Floats, second: Floats) -> float:
    """Degrees between two vectors; 180 for one of no length."""
    product = float(np.linalg.norm(first) * np.linalg.norm(second))
    return math.degrees(math.acos(np.clip(first @ second / product, -1, 1))) if product > 0 else 180.0
