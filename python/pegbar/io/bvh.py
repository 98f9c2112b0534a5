"""Writes a clip as BVH, the motion capture format that 3D packages open."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.io import atomic
from pegbar.scene.conventions import UNITS
from pegbar.scene.motion import Motion

Floats = NDArray[np.float64]


def write_bvh(
    path: str | os.PathLike[str],
    motion: Motion,
    *,
    unit: float | str = "cm",
    stretch: bool = False,
    offsets: Mapping[str, ArrayLike] | None = None,
) -> None:
    """Write ``motion`` as a BVH file, Y up, complete or not at all.

    A joint's offset is its place in its parent's axes in the first frame. Rotation channels are Z, X, Y: the joint's
    axes in its parent's are ``Rz Rx Ry``. A joint without children gets an end site.

    Parameters
    ----------
    path : path
        The file to make or replace.
    motion : Motion
        One skeleton: exactly one joint has the parent -1.
    unit : float or {"cm", "m", "mm", "inch", "foot", "cmu"}
        The unit of lengths in the file, by name or in metres.
    stretch : bool
        Joints whose offset changes by more than a tenth of a millimetre get position channels too, so that squash and
        stretch is kept; some readers take these on the root only. False: every bone keeps its first frame's length.
    offsets : dict of (3,) float, optional
        End sites by joint name, metres in that joint's axes. Else half the joint's own offset.

    Raises
    ------
    ValueError
        For a motion with several roots, a parent that is no joint, two joints of one name, or numbers that are not
        finite.
    OSError
        When the file cannot be written; it names ``path``.
    """
    scale = _scale(unit)
    order = _depth_first(motion)
    names = [re.sub(r"[\s{}]", "_", name) or "_" for name in motion.names]
    if len(set(names)) < len(names):
        raise ValueError("motion: two joints have the same name")
    if not 0 < motion.frame_rate < math.inf:
        raise ValueError(f"motion: want a frame rate above 0, got {motion.frame_rate}")
    local_positions, local_rotations = _local(motion)
    local_positions = local_positions / scale
    moving = np.ptp(local_positions, axis=0).max(axis=1) * scale > 1e-4 if stretch else np.zeros(len(names), bool)
    moving[order[0]] = True
    ends = {name: arrays.floats(f"offsets[{name}]", end, (3,)) / scale for name, end in (offsets or {}).items()}
    unknown = set(ends) - set(motion.names)
    if unknown:
        raise ValueError(f"offsets: no joints are called {sorted(unknown)}")
    base = local_positions[0].copy()
    base[order[0]] = 0
    hierarchy = _hierarchy(motion, names, base, moving, ends)
    angles = np.degrees(np.unwrap(_euler_zxy(local_rotations), axis=0))
    columns = [
        block
        for joint in order
        for block in ([local_positions[:, joint]] if moving[joint] else []) + [angles[:, joint]]
    ]
    rows = "\n".join(" ".join(f"{value:.6f}" for value in row) for row in np.concatenate(columns, axis=1).tolist())
    header = f"MOTION\nFrames: {len(local_positions)}\nFrame Time: {1 / motion.frame_rate:.9f}\n"
    atomic.write_bytes(path, f"HIERARCHY\n{hierarchy}{header}{rows}\n".encode())


def _scale(unit: float | str) -> float:
    scale = UNITS.get(unit) if isinstance(unit, str) else unit
    if scale is None or not 0 < scale < math.inf:
        raise ValueError(f"unit: want metres above 0 or one of {', '.join(UNITS)}, got {unit!r}")
    return scale


def _depth_first(motion: Motion) -> list[int]:
    """The joints, each parent before its children and each limb as one stretch."""
    count = len(motion.names)
    parents = arrays.integers("motion.parents", motion.parents, (count,), low=-1, high=count - 1).tolist()
    roots = [joint for joint in range(count) if parents[joint] < 0]
    if len(roots) != 1:
        raise ValueError(f"motion: want one joint without a parent, got {len(roots)}")
    children: dict[int, list[int]] = {}
    for joint in range(count - 1, -1, -1):
        children.setdefault(parents[joint], []).append(joint)
    order, waiting = [], roots
    while waiting:
        joint = waiting.pop()
        order.append(joint)
        waiting += children.get(joint, [])
    if len(order) < count:
        raise ValueError("motion: its parents run in a circle")
    return order


def _local(motion: Motion) -> tuple[Floats, Floats]:
    """Positions (F, J, 3) and rotations (F, J, 3, 3) in the parent's axes; the root's stay in the world's."""
    count = len(motion.names)
    positions = arrays.floats("motion.positions", motion.positions, ("F", count, 3))
    rotations = arrays.floats("motion.rotations", motion.rotations, (len(positions), count, 3, 3))
    if not len(positions):
        raise ValueError("motion: want at least one frame")
    local_positions, local_rotations = positions.copy(), rotations.copy()
    for joint, parent in enumerate(motion.parents):
        if parent >= 0:
            back = rotations[:, parent].transpose(0, 2, 1)
            local_positions[:, joint] = np.einsum("fij,fj->fi", back, positions[:, joint] - positions[:, parent])
            local_rotations[:, joint] = back @ rotations[:, joint]
    return local_positions, local_rotations


def _euler_zxy(rotations: Floats) -> Floats:
    """Angles (..., 3) about z, x, y in radians with ``R = Rz Rx Ry``; where x is upright, y is taken as 0."""
    sine = np.clip(rotations[..., 2, 1], -1, 1)
    upright = np.abs(sine) > 1 - 1e-10
    z = np.where(
        upright,
        np.arctan2(rotations[..., 1, 0], rotations[..., 0, 0]),
        np.arctan2(-rotations[..., 0, 1], rotations[..., 1, 1]),
    )
    y = np.where(upright, 0.0, np.arctan2(-rotations[..., 2, 0], rotations[..., 2, 2]))
    return np.stack([z, np.arcsin(sine), y], axis=-1)


def _hierarchy(
    motion: Motion, names: list[str], base: Floats, moving: NDArray[np.bool_], ends: Mapping[str, Floats]
) -> str:
    children: list[list[int]] = [[] for _ in names]
    for child, parent in enumerate(motion.parents):
        if parent >= 0:
            children[parent].append(child)
    lines: list[str] = []

    def begin(title: str, offset: Floats, depth: int) -> None:
        tabs = "\t" * depth
        lines.extend((f"{tabs}{title}", tabs + "{"))
        lines.append(f"{tabs}\tOFFSET " + " ".join(f"{number:.6f}" for number in offset.tolist()))

    # A joint waits once to be begun and once, as its complement, to be ended.
    waiting, depth = [motion.parents.index(-1)], 0
    while waiting:
        joint = waiting.pop()
        if joint < 0:
            depth -= 1
            lines.append("\t" * depth + "}")
            continue
        begin(f"{'JOINT' if depth else 'ROOT'} {names[joint]}", base[joint], depth)
        depth += 1
        places = "6 Xposition Yposition Zposition" if moving[joint] else "3"
        lines.append("\t" * depth + f"CHANNELS {places} Zrotation Xrotation Yrotation")
        if not children[joint]:
            begin("End Site", ends.get(motion.names[joint], base[joint] / 2), depth)
            lines.append("\t" * depth + "}")
        waiting += [~joint, *reversed(children[joint])]
    return "\n".join(lines) + "\n"
