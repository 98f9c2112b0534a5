"""The mapping from canonical markers to a file's joints as a small TOML file that people edit."""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Collection, Mapping
from difflib import get_close_matches
from pathlib import Path

from pegbar.errors import FormatError
from pegbar.io import atomic
from pegbar.scene.body import MARKERS
from pegbar.scene.joints import EXTRA

_KNOWN = (*MARKERS, *EXTRA)
_HEAD = """\
# Which joint of the clip each marker of the drawing is: marker = "joint of the clip".
# A line that is left out is found by name and shape again; marker = "" says that the clip has none.
"""


def write_joint_map(
    path: str | os.PathLike[str], joint_map: Mapping[str, str], *, derived: Collection[str] = ()
) -> None:
    """Write ``joint_map`` (canonical marker -> joint) as TOML; markers that are not in it stand there as comments.

    Parameters
    ----------
    path : path
        The file to make or replace.
    joint_map : dict of str to str
        As from `map_joints` or `Motion.joint_map`.
    derived : collection of str
        Markers that are found from several points of the clip: left as comments, so that this stays so.

    Raises
    ------
    OSError
        When the file cannot be written.

    Examples
    --------
    >>> write_joint_map("walk.toml", {"pelvis": "Hips"})
    >>> Path("walk.toml").read_text().splitlines()[2:4]
    ['pelvis = "Hips"', '# chest = ""']
    >>> Path("walk.toml").unlink()
    """
    lines = []
    for marker in (*_KNOWN, *(name for name in joint_map if name not in _KNOWN)):
        if marker in derived:
            lines.append(f"# {marker} is the middle of several points")
        elif marker in joint_map:
            key = marker if re.fullmatch(r"[\w-]+", marker, re.ASCII) else json.dumps(marker)
            # TOML's strings are JSON's, but for the character DEL.
            text = json.dumps(joint_map[marker], ensure_ascii=False).replace("\x7f", "\\u007f")
            lines.append(f"{key} = {text}")
        elif marker in MARKERS:
            lines.append(f'# {marker} = ""')
    atomic.write_bytes(path, (_HEAD + "\n".join(lines) + "\n").encode())


def read_joint_map(path: str | os.PathLike[str], names: Collection[str] | None = None) -> dict[str, str]:
    """Return the mapping of a TOML file as `write_joint_map` writes it.

    Parameters
    ----------
    path : path
        The file.
    names : collection of str, optional
        The clip's joints: a joint that is none of them is an error.

    Raises
    ------
    FormatError
        For text that is not TOML, a marker that is unknown or a joint that the clip does not have, with its line.
    OSError
        When the file cannot be read.

    Examples
    --------
    >>> _ = Path("walk.toml").write_text('pelvis = "Hips"')
    >>> read_joint_map("walk.toml", ["Hips", "Spine"])
    {'pelvis': 'Hips'}
    >>> Path("walk.toml").unlink()
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
        table = tomllib.loads(text)
    except UnicodeDecodeError as error:
        raise FormatError(path, "not UTF-8 text", byte=error.start) from None
    except tomllib.TOMLDecodeError as error:
        place = re.search(r"at line (\d+)", str(error))
        line = int(place[1]) if place else len(text.splitlines())
        raise FormatError(path, f"not TOML: {error}", line=line) from None
    for marker, joint in table.items():
        problem = wrong_entry(marker, joint, names)
        if problem:
            raise FormatError(path, problem, line=_line(text, marker))
    return table


def wrong_entry(marker: str, joint: object, names: Collection[str] | None) -> str:
    """Return what is wrong with one line of a mapping, or ""."""
    if marker not in _KNOWN:
        near = get_close_matches(marker, _KNOWN, 1)
        return f"no marker is called {marker!r}{f' (did you mean {near[0]!r}?)' if near else ''}"
    if not isinstance(joint, str):
        return f"{marker}: want a joint's name in quotes, got {joint!r}"
    if joint and names is not None and joint not in names:
        near = get_close_matches(joint, list(names), 1)
        return f"{marker}: the clip has no joint {joint!r}{f' (did you mean {near[0]!r}?)' if near else ''}"
    return ""


def _line(text: str, marker: str) -> int | None:
    wanted = re.compile(rf"""\s*["']?{re.escape(marker)}["']?\s*[=.\]]|\s*\[\s*["']?{re.escape(marker)}\b""")
    return next((number for number, line in enumerate(text.splitlines(), 1) if wanted.match(line)), None)
