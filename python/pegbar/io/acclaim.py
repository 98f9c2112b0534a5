"""Reads ASF and AMC, Acclaim's skeleton and motion, in which CMU's clips were published."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.errors import FormatError
from pegbar.io.acclaim_skeleton import Bone, Skeleton, read_skeleton
from pegbar.io.motion_bytes import number, read_bytes
from pegbar.io.recording import Recording

Floats = NDArray[np.float64]
_Path = str | os.PathLike[str]
_ORDER = ("tx", "ty", "tz", "rx", "ry", "rz")
_INCH = 0.0254
# As many joints in all frames are read from any file, though most bones do not move.
_JOINTS_OF_SMALL_FILE = 1 << 22


def read_acclaim(path: _Path, skeleton: _Path | None = None) -> Recording:
    """Return the clip of an AMC file with every frame, forward kinematics done.

    A joint stands where its bone begins and bears its name; ``root`` comes first, and a bone without children has a
    joint ``<bone>_end`` at its tip. Lengths are taken as inches divided by the skeleton's ``length``, as Vicon wrote
    them: with CMU's 0.45 a unit is 5.644 cm; a ``length`` of 1 says nothing.

    Parameters
    ----------
    path : path
        The motion, ``.amc``.
    skeleton : path, optional
        Its skeleton, ``.asf``. None: one beside it, of the same name (``lambada``), of its subject (``02`` or
        ``02-walk`` for ``02_01``), or the only one.

    Returns
    -------
    Recording
        In the file's unit and axes; AMC files seldom say their frame rate.

    Raises
    ------
    FormatError
        For a broken file or a frame that is not whole, with the line; for a skeleton that is not found.
    OSError
        When a file cannot be read.
    """
    text = read_bytes(path)
    found, chosen = (skeleton, ()) if skeleton is not None else _beside(path)
    bones = read_skeleton(found)
    return _record(path, text, bones, chosen)


def _beside(path: _Path) -> tuple[Path, tuple[str, ...]]:
    """The skeleton beside a motion, and a note where it was taken for want of another."""
    motion = Path(path)
    there = sorted(file for file in motion.parent.iterdir() if file.suffix.lower() == ".asf" and file.is_file())
    subject = motion.stem.partition("_")[0].lower()
    same = [file for file in there if file.stem.lower() == motion.stem.lower()]
    named = [file for file in there if file.stem.lower() == subject]
    akin = [file for file in there if re.match(rf"{re.escape(subject)}([^0-9a-z]|$)", file.stem.lower())]
    for files in (same, named, akin):
        if len(files) == 1:
            return files[0], ()
    if len(there) == 1:
        return there[0], (f"its skeleton is {there[0].name}, the only one beside it",)
    listed = f"there are {', '.join(file.name for file in there[:12])}" if there else "no .asf file is there"
    raise FormatError(path, f"its skeleton is not beside it: {listed}; name it with skeleton=")


def _record(path: _Path, text: bytes, skeleton: Skeleton, notes: tuple[str, ...]) -> Recording:
    bones = _depth_first(skeleton)
    numbers = [("root", len(skeleton.order)), *((bone.name, len(bone.turns)) for bone in bones)]
    keywords, first, step, values = _kernels.parse_amc(os.fspath(path), text, numbers)
    names, parents, offsets, axes = _joints(skeleton, bones)
    if len(values) * len(names) > len(text) + _JOINTS_OF_SMALL_FILE:
        raise FormatError(path, f"{len(values)} frames of {len(names)} joints, most of which never move", line=1)
    degrees = skeleton.degrees if not {":degrees", ":radians"} & set(keywords) else ":degrees" in keywords
    counts, codes, table = _channels(skeleton, bones, names, values, degrees)
    positions, rotations = _kernels.forward_kinematics((parents, offsets, axes, counts, codes), table, degrees)
    if (first, step) != (1, 1):
        notes += (f"its frames are numbered from {first} in steps of {step}",)
    if not text.endswith((b"\n", b"\r")):
        notes += ("its last line has no end: if it was cut short there, frames are missing",)
    return Recording(
        path=path,
        names=tuple(names),
        parents=tuple(parents),
        offsets=offsets,
        positions=positions,
        rotations=rotations,
        frame_rate=_frame_rate(path, keywords),
        unit=None if skeleton.length == 1 else _INCH / skeleton.length,
        notes=notes,
    )


def _depth_first(skeleton: Skeleton) -> list[Bone]:
    """The bones, each after its parent and each limb as one stretch."""
    bones, waiting = [], skeleton.children.get("root", [])[::-1]
    while waiting:
        name = waiting.pop()
        bones.append(skeleton.bones[name])
        waiting += skeleton.children.get(name, [])[::-1]
    return bones


def _joints(skeleton: Skeleton, bones: list[Bone]) -> tuple[list[str], list[int], Floats, Floats]:
    """Names, parents, offsets and rest axes of the root, the bones' starts, and the tips of the outermost."""
    names, parents, offsets, axes = ["root"], [-1], [skeleton.position], [np.eye(3)]
    parent_of = {child: parent for parent, children in skeleton.children.items() for child in children}
    place = {"root": 0}
    for bone in bones:
        parent = parent_of[bone.name]
        place[bone.name] = len(names)
        names.append(bone.name)
        parents.append(place[parent])
        offsets.append(np.zeros(3) if parent == "root" else skeleton.bones[parent].reach)
        axes.append(bone.axes)
        if not skeleton.children.get(bone.name):
            names.append(_tip(bone.name, skeleton))
            parents.append(place[bone.name])
            offsets.append(bone.reach)
            axes.append(np.eye(3))
    return names, parents, np.array(offsets), np.array(axes)


def _tip(name: str, skeleton: Skeleton) -> str:
    tip = f"{name}_end"
    while tip in skeleton.bones:
        tip += "_end"
    return tip


def _channels(
    skeleton: Skeleton, bones: list[Bone], names: list[str], values: Floats, degrees: bool
) -> tuple[list[int], NDArray[np.uint8], Floats]:
    """How many channels each joint has, their codes, and the numbers (F, C) in that order.

    Turns about fixed axes, the first of the file first, are the product of the channels from the last to the first.
    The root's preset orientation comes before its motion, its preset position is added to it.
    """
    width = len(skeleton.order)
    order = sorted(range(width), key=lambda column: (skeleton.order[column][0] == "r", -column))
    columns = [values[:, column] for column in order]
    codes = [_ORDER.index(skeleton.order[column]) for column in order]
    for column, code in enumerate(codes):
        if code < 3:
            columns[column] = columns[column] + skeleton.position[code]
    for axis, turn in reversed(skeleton.orientation.items()):
        codes.append(3 + "xyz".index(axis))
        radians = math.radians(turn) if skeleton.degrees else turn
        columns.append(np.full(len(values), math.degrees(radians) if degrees else radians))
    counts, start, turns = [len(codes)], width, {bone.name: bone.turns for bone in bones}
    for name in names[1:]:
        own = turns.get(name, ())
        counts.append(len(own))
        codes += [3 + "xyz".index(axis) for axis in reversed(own)]
        columns += [values[:, column] for column in reversed(range(start, start + len(own)))]
        start += len(own)
    return counts, np.array(codes, np.uint8), np.ascontiguousarray(np.stack(columns, axis=1))


def _frame_rate(path: _Path, keywords: list[str]) -> float | None:
    for keyword in keywords:
        name, *words = keyword.split()
        if name == ":samples-per-second":
            rate = number(path, words[0] if words else "", 1)
            if not 1e-3 <= rate <= 1e5:
                raise FormatError(path, f"want samples per second above 0, got {rate:g}", line=1)
            return rate
    return None
