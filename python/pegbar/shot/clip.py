"""Writes the clip that a shot uses into its shot file; comments and all other sections stay as they are."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pegbar.errors import FormatError
from pegbar.io.atomic import complete_file

_READING = {"skeleton", "unit", "up", "frame_rate", "joints"}
_HEADER = re.compile(r"\s*\[{1,2}\s*([^\]]+?)\s*\]{1,2}\s*(#.*)?$")


def clip_text(section: Mapping[str, Any]) -> str:
    """Return the ``[clip]`` section as text."""
    return "\n".join(["[clip]", *(f"{key} = {value}" for key, value in _values(section).items()), ""])


def write_clip(path: Path, section: Mapping[str, Any], *, frame_rate: float | None = None) -> None:
    """Put ``section`` into the shot file at ``path``, in place of the one that is there, and the shot's frame rate.

    Raises
    ------
    FileNotFoundError, FormatError, ShotError
        Where there is no shot file, or one with problems: it is left as it is.
    """
    # The models of the shot file take long to import; printing a section does not need them.
    from pegbar.shot.load import load_shot, validate_shot

    load_shot(path)
    text = path.read_bytes().decode("utf-8-sig")
    changed = replace_clip(text, section)
    if frame_rate is not None:
        changed = replace_frame_rate(changed, frame_rate)
    try:
        table = tomllib.loads(changed)
    except tomllib.TOMLDecodeError:
        raise FormatError(path, "the clip is written otherwise than as a [clip] section") from None
    validate_shot(table, str(path), changed)
    with complete_file(path) as part:
        part.write_text(changed, encoding="utf-8", newline="")


def replace_clip(text: str, section: Mapping[str, Any]) -> str:
    """Return the TOML ``text`` with ``section`` in it: in place of its own, keeping its comments, or at the end.

    The folder to look in stays; what the old section says of how its clip is read stays where the clip stays.
    """
    lines = text.splitlines()
    headers = [(number, found[1]) for number, line in enumerate(lines) if (found := _HEADER.match(line))]
    begin = next((number for number, name in headers if name == "clip"), None)
    if begin is None:
        return text.rstrip("\n") + "\n\n" + clip_text(section)
    end = next((number for number, _ in headers if number > begin), len(lines))
    values, kept = _values(section), {"folder"}
    if tomllib.loads(text)["clip"].get("path") == section["path"]:
        kept |= _READING
    body = [line for old in lines[begin + 1 : end] if (line := _renewed(old, values, kept)) is not None]
    while body and not body[-1].strip():
        body.pop()
    body += [f"{key} = {value}" for key, value in values.items()]
    rest = ["", *lines[end:]] if end < len(lines) else []
    return "\n".join([*lines[: begin + 1], *body, *rest]) + "\n"


def replace_frame_rate(text: str, rate: float) -> str:
    """Return the TOML ``text`` with ``rate`` as the shot's: in the line that says it, or would without its ``#``."""
    lines = text.splitlines()
    headers = [(number, found[1]) for number, line in enumerate(lines) if (found := _HEADER.match(line))]
    begin = next((number for number, name in headers if name == "shot"), None)
    value = f"{rate:g}"
    if begin is None:
        return f"[shot]\nframe_rate = {value}\n\n{text}"
    end = next((number for number, _ in headers if number > begin), len(lines))
    for mark in ("", r"#\s*"):
        for number in range(begin + 1, end):
            if found := re.match(rf"\s*{mark}frame_rate\s*=\s*[^\s#]+(\s*#.*)?$", lines[number]):
                # What a line that was no setting says beside it is not true any more.
                lines[number] = f"frame_rate = {value}{(found[1] or '') if not mark else ''}"
                return "\n".join(lines) + "\n"
    lines.insert(begin + 1, f"frame_rate = {value}")
    return "\n".join(lines) + "\n"


def _renewed(line: str, values: dict[str, str], kept: set[str]) -> str | None:
    """A line of the old section: with the new value (taken out of ``values``), as it is, or None for an old key."""
    found = re.match(r"(\s*)([\w-]+)(\s*=\s*)(\"(?:[^\"\\]|\\.)*\"|'[^']*'|[^#]*?)(\s*(?:#.*)?)$", line)
    if not found or found[2] in kept:
        return line
    if found[2] not in values:
        return found[1] + found[5].strip() if found[5].strip() else None
    return f"{found[1]}{found[2]}{found[3]}{values.pop(found[2])}{found[5]}"


def _values(section: Mapping[str, Any]) -> dict[str, str]:
    return {key: _toml(value) for key, value in section.items()}


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        # What JSON escapes TOML escapes alike, but for one character.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)
