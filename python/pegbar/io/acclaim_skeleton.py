"""Reads ASF, Acclaim's skeleton: bones with a direction, a length and axes about which they turn.

Numbers stand in the file's units; commas and brackets are white, ``#`` begins a comment (Acclaim Skeleton File
Definition V1.10).
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pegbar.errors import FormatError
from pegbar.io.motion_bytes import decoded, number, read_bytes

_WHITE = str.maketrans(",()", "   ")
_AXES = ("x", "y", "z")
_TURNS = tuple(f"r{axis}" for axis in _AXES)
_MOVES = tuple(f"t{axis}" for axis in _AXES)

_Path = str | os.PathLike[str]
_Line = tuple[int, list[str]]


@dataclass
class Bone:
    """One bone: ``reach`` (3,) from its start to its end in the file's axes, at rest.

    ``turns`` are the axes ("x", "y", "z") of its numbers in the AMC file, in their order; ``axes`` (3, 3) has the
    bone's own axes as columns. ``line`` is where it stands.
    """

    name: str
    line: int
    reach: NDArray[np.float64]
    axes: NDArray[np.float64]
    turns: tuple[str, ...] = ()


@dataclass
class Skeleton:
    """An ASF file.

    ``order`` are the root's numbers in the AMC file as "tx" or "rx", ``position`` (3,) and ``orientation`` (angles in
    the file's unit about fixed axes, by axis, the first first) move the whole clip; ``children`` are names by the
    parent's, bones by name; ``length`` and ``degrees`` are its units.
    """

    path: _Path
    length: float = 1.0
    degrees: bool = True
    order: tuple[str, ...] = (*_MOVES, *_TURNS)
    position: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    orientation: dict[str, float] = field(default_factory=dict)
    bones: dict[str, Bone] = field(default_factory=dict)
    children: dict[str, list[str]] = field(default_factory=dict)


def read_skeleton(path: _Path) -> Skeleton:
    """Return the skeleton of an ASF file; FormatError with the line for a broken one."""
    sections = _sections(path, decoded(read_bytes(path)))
    for name in ("root", "bonedata", "hierarchy"):
        if name not in sections:
            raise FormatError(path, f"the skeleton lacks :{name}; not an ASF file, or cut short", line=1)
    skeleton = Skeleton(path)
    _read_units(skeleton, sections.get("units", []))
    _read_root(skeleton, sections["root"])
    _read_bones(skeleton, sections["bonedata"])
    _read_hierarchy(skeleton, sections["hierarchy"])
    return skeleton


def _sections(path: _Path, text: str) -> dict[str, list[_Line]]:
    """The lines of words under each keyword; a keyword's own line counts when it holds more than it."""
    sections: dict[str, list[_Line]] = {}
    inside: list[_Line] | None = None
    for line, raw in enumerate(re.split(r"\r\n|\r|\n", text), 1):
        words = raw.partition("#")[0].translate(_WHITE).split()
        if words and words[0].startswith(":"):
            keyword = words.pop(0)[1:].lower()
            if keyword in sections:
                raise FormatError(path, f"a second :{keyword}", line=line)
            inside = sections.setdefault(keyword, [])
        if words and inside is not None:
            inside.append((line, words))
        elif words:
            raise FormatError(path, f"want a keyword that begins with a colon, got {words[0][:24]!r}", line=line)
    return sections


def _numbers(path: _Path, line: int, words: list[str], count: int) -> list[float]:
    if len(words) < count:
        raise FormatError(path, f"want {count} numbers, got {len(words)}", line=line)
    return [number(path, word, line) for word in words[:count]]


def _angles(path: _Path, line: int, words: list[str], order: str) -> dict[str, float]:
    """The angles about x, y and z by axis, in the order in which they turn about the fixed axes."""
    if sorted(order.lower()) != list(_AXES):
        raise FormatError(path, f"want an order of axes as XYZ, got {order[:24]!r}", line=line)
    angles = dict(zip(_AXES, _numbers(path, line, words, 3), strict=True))
    return {axis: angles[axis] for axis in order.lower()}


def _read_units(skeleton: Skeleton, lines: list[_Line]) -> None:
    for line, words in lines:
        key, value = words[0].lower(), words[1] if len(words) > 1 else ""
        if key == "angle":
            if value.lower() not in ("deg", "rad"):
                raise FormatError(skeleton.path, f"want the angle deg or rad, got {value[:24]!r}", line=line)
            skeleton.degrees = value.lower() == "deg"
        elif key == "length":
            skeleton.length = number(skeleton.path, value, line)
            if skeleton.length <= 0:
                raise FormatError(skeleton.path, f"want a length above 0, got {value[:24]!r}", line=line)


def _read_root(skeleton: Skeleton, lines: list[_Line]) -> None:
    found = {words[0].lower(): (line, words[1:]) for line, words in lines}
    line, words = found.get("order", (0, list(skeleton.order)))
    skeleton.order = tuple(word.lower() for word in words)
    if len(set(words)) < len(words) or not set(skeleton.order) <= {*_MOVES, *_TURNS}:
        raise FormatError(skeleton.path, "want an order as TX TY TZ RX RY RZ", line=line)
    if "position" in found:
        line, words = found["position"]
        skeleton.position = np.array(_numbers(skeleton.path, line, words, 3))
    if "orientation" in found:
        line, words = found["orientation"]
        skeleton.orientation = _angles(skeleton.path, line, words, "".join(found.get("axis", (0, ["xyz"]))[1]))


def _read_bones(skeleton: Skeleton, lines: list[_Line]) -> None:
    start = 0
    inside: dict[str, _Line] | None = None
    for line, words in lines:
        key = words[0].lower()
        if key == "begin" and inside is None:
            start, inside = line, {}
        elif key == "end" and inside is not None:
            bone = _bone(skeleton, start, inside)
            if bone.name in skeleton.bones or bone.name == "root":
                raise FormatError(skeleton.path, f"a second bone {bone.name!r}", line=start)
            skeleton.bones[bone.name] = bone
            inside = None
        elif inside is None:
            raise FormatError(skeleton.path, f"want begin, got {key[:24]!r}", line=line)
        elif key in inside:
            raise FormatError(skeleton.path, f"a second {key[:24]!r} in one bone", line=line)
        elif not _is_number(key):  # further limits stand on lines of their own
            inside[key] = (line, words[1:])
    if inside is not None or not skeleton.bones:
        raise FormatError(skeleton.path, "the file ends inside :bonedata", line=lines[-1][0] if lines else 1)


def _is_number(word: str) -> bool:
    return word[0] in "+-.0123456789" or word in ("inf", "nan")


def _bone(skeleton: Skeleton, start: int, found: dict[str, _Line]) -> Bone:
    path = skeleton.path
    for key in ("name", "direction", "length"):
        if not found.get(key, (0, []))[1]:
            raise FormatError(path, f"a bone without {key}", line=start)
    direction = np.array(_numbers(path, *found["direction"], 3))
    (length,) = _numbers(path, *found["length"], 1)
    axes = np.eye(3)
    if "axis" in found:
        line, words = found["axis"]
        angles = _angles(path, line, words, words[3] if len(words) > 3 else "xyz")
        axes = Rotation.from_euler("".join(angles), list(angles.values()), degrees=skeleton.degrees).as_matrix()
    line, words = found.get("dof", (start, []))
    turns = tuple(word.lower() for word in words)
    if len(set(turns)) < len(turns) or not set(turns) <= set(_TURNS):
        raise FormatError(
            path, f"want dof to name some of rx ry rz, each once, got {' '.join(words)[:24]!r}", line=line
        )
    return Bone(found["name"][1][0].lower(), start, direction * length, axes, tuple(turn[1] for turn in turns))


def _read_hierarchy(skeleton: Skeleton, lines: list[_Line]) -> None:
    """Parents and children; every bone has one parent and hangs, in the end, on the root."""
    path, last = skeleton.path, lines[-1][0] if lines else 1
    if len(lines) < 2 or lines[0][1] != ["begin"] or lines[-1][1] != ["end"]:
        raise FormatError(path, "want :hierarchy to run from begin to end; the file may be cut short", line=last)
    has_parent: set[str] = set()
    for line, words in lines[1:-1]:
        parent, *children = (word.lower() for word in words)
        for name in (parent, *children):
            if name != "root" and name not in skeleton.bones:
                raise FormatError(path, f"the hierarchy names {name[:24]!r}, which is no bone", line=line)
        for name in children:
            if name in has_parent or name == "root":
                raise FormatError(path, f"{name!r} has two parents", line=line)
            has_parent.add(name)
        skeleton.children.setdefault(parent, []).extend(children)
    reached, waiting = set(), ["root"]
    while waiting:
        name = waiting.pop()
        reached.add(name)
        waiting += skeleton.children.get(name, [])
    for name in skeleton.bones:
        if name not in reached:
            raise FormatError(path, f"the bone {name!r} does not hang on the root", line=skeleton.bones[name].line)
