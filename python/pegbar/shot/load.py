"""Reads a shot file; every wrong key or value is named with its line, all of them at once."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from pegbar.errors import FormatError, ShotError
from pegbar.shot.model import ShotFile

Key = str | int


def load_shot(path: str | Path) -> ShotFile:
    """Read and validate the shot file at ``path``.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    FormatError
        For text that is not TOML, with its line.
    ShotError
        For wrong keys or values: one line each, ``path:line: section.key: what is wrong``.
    """
    path = Path(path)
    if path.is_dir():
        raise FormatError(path, "a folder, not a shot file (pegbar init makes one)")
    data = path.read_bytes()
    try:
        text = data.decode("utf-8-sig")
        table = tomllib.loads(text)
    except UnicodeDecodeError as error:
        raise FormatError(path, "not UTF-8 text", byte=error.start) from None
    except tomllib.TOMLDecodeError as error:
        raise _syntax_error(path, str(error), text) from None
    return validate_shot(table, str(path), text)


def validate_shot(table: dict[str, Any], source: str, text: str = "") -> ShotFile:
    """Return the validated shot of a parsed ``table``; ShotError names ``source`` and the line in ``text``."""
    try:
        return ShotFile.model_validate(table)
    except ValidationError as error:
        places = key_lines(text)
        raise ShotError([_describe(source, places, table, e) for e in _distinct(error)]) from None


def key_lines(text: str) -> dict[tuple[str, ...], int]:
    """Return the line (from 1) where each section and key of TOML ``text`` stands, by its path of names."""
    lines: dict[tuple[str, ...], int] = {}
    section: tuple[str, ...] = ()
    for number, line in enumerate(text.splitlines(), 1):
        if header := re.match(r"\s*\[\[?\s*([^\]]+?)\s*\]", line):
            section = _names(header[1])
            lines.setdefault(section, number)
        elif assignment := re.match(r"""\s*((?:[\w-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[\w-]+|"[^"]*"))*)\s*=""", line):
            lines.setdefault(section + _names(assignment[1]), number)
    return lines


def _names(dotted: str) -> tuple[str, ...]:
    parts = re.findall(r""""[^"]*"|'[^']*'|[^\s."']+""", dotted)
    return tuple(part.strip("\"'") for part in parts)


def _syntax_error(path: Path, message: str, text: str) -> FormatError:
    found = re.search(r"\(at line (\d+)", message)
    line = int(found[1]) if found else len(text.splitlines())
    return FormatError(path, "not TOML: " + re.sub(r"\s*\(at [^)]*\)$", "", message), line=line)


def _distinct(error: ValidationError) -> Iterator[dict[str, Any]]:
    """One error a key: where a value may be of several kinds, each kind complains about the same value."""
    merged: dict[tuple[Key, ...], dict[str, Any]] = {}
    for item in error.errors():
        place = tuple(part for part in item["loc"] if not _is_kind(part))
        if place in merged:
            merged[place]["msg"] += f" or {item['msg'].removeprefix('Input should be ')}"
        else:
            merged[place] = {**item, "loc": place}
    yield from merged.values()


def _is_kind(part: Key) -> bool:
    return isinstance(part, str) and (part in ("int", "float", "str") or "[" in part or part.startswith("constrained-"))


def _describe(source: str, places: dict[tuple[str, ...], int], table: dict[str, Any], error: dict[str, Any]) -> str:
    keys = tuple(str(part) for part in error["loc"])
    line = next((places[keys[:n]] for n in range(len(keys), 0, -1) if keys[:n] in places), None)
    name, problem = ".".join(keys), error["msg"].removeprefix("Value error, ")
    if error["type"] == "extra_forbidden":
        near = difflib.get_close_matches(keys[-1], _known(keys[:-1]), 1)
        problem = "no such key" + (f' (did you mean "{near[0]}"?)' if near else "")
    elif error["type"] == "missing":
        problem = "is missing"
    elif error["type"] in ("model_type", "dict_type"):
        problem = f"want a section, like [{name}]"
    elif isinstance(error["input"], str | int | float) and "got" not in problem:
        problem = f"{problem[0].lower()}{problem[1:]}, got {error['input']!r}"
    place = f"{source}:{line}" if line else source
    return f"{place}: {name}: {problem}" if name else f"{place}: {problem}"


def _known(section: tuple[str, ...]) -> list[str]:
    """The keys that the model knows in ``section``."""
    model: type[BaseModel] | None = ShotFile
    for name in section:
        field = model.model_fields.get(name) if model else None
        kinds = [field.annotation, *getattr(field.annotation, "__args__", ())] if field else []
        model = next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel)), None)
    return list(model.model_fields) if model else []
