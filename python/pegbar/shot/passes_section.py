"""Writes where a shot's rendered passes are into its shot file; the old lines stay as comments."""

from __future__ import annotations

import json
import os
import re
import tomllib
from pathlib import Path
from typing import Literal

from pegbar.errors import FormatError
from pegbar.io.atomic import complete_file
from pegbar.shot.load import load_shot, validate_shot

_HEADER = re.compile(r"\s*\[{1,2}\s*([^\]]+?)\s*\]{1,2}\s*(#.*)?$")
_OLD = "# before: "
Camera = Literal["sheet", "drawn"]


def passes_text(pattern: str, camera: Camera = "drawn") -> str:
    """Return the ``[passes]`` section for frames with colour and depth in one file, rendered with ``camera``."""
    text = f"[passes]\nbeauty = {json.dumps(pattern, ensure_ascii=False)}\n"
    return text + ('camera = "sheet"\n' if camera == "sheet" else "")


def write_passes(shot: Path, frames: Path, camera: Camera = "drawn") -> str:
    """Let the shot file name the passes ``frames``, a pattern, rendered with ``camera``; return the section.

    Raises ShotError or FormatError for a shot file with problems: it is left as it is.
    """
    load_shot(shot)
    folder = shot.absolute().parent
    try:
        pattern = Path(os.path.relpath(frames.absolute(), folder)).as_posix()
    except ValueError:
        pattern = frames.absolute().as_posix()
    text, section = shot.read_bytes().decode("utf-8-sig"), passes_text(pattern, camera)
    changed = replace_passes(text, section)
    if changed != text:
        try:
            validate_shot(tomllib.loads(changed), str(shot), changed)
        except tomllib.TOMLDecodeError:
            raise FormatError(shot, "the passes are written otherwise than as a [passes] section") from None
        with complete_file(shot) as part:
            part.write_text(changed, encoding="utf-8", newline="")
    return section


def replace_passes(text: str, section: str) -> str:
    """Return TOML ``text`` with ``section`` in it: in place of its own, whose lines become comments, or at the end."""
    lines = text.splitlines()
    headers = [(number, found[1]) for number, line in enumerate(lines) if (found := _HEADER.match(line))]
    begin = next((number for number, name in headers if name == "passes"), None)
    if begin is None:
        return text.rstrip("\n") + "\n\n" + section
    end = next((number for number, _ in headers if number > begin), len(lines))
    body = [line for line in lines[begin + 1 : end] if line.strip()]
    new = section.splitlines()
    if [line for line in body if not line.lstrip().startswith("#")] == new[1:]:
        return text
    old = [line if line.lstrip().startswith("#") else _OLD + line for line in body]
    rest = ["", *lines[end:]] if end < len(lines) else []
    return "\n".join([*lines[:begin], *new, *old, *rest]) + "\n"
