"""Where a value stands in a JSON text, so that an error can name its line, and checks that name the value."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import FormatError

Place = tuple[str | int, ...]
_SPACE = " \t\n\r"
_decode = json.JSONDecoder().raw_decode


class Misplaced(Exception):
    """A wrong value at ``place``; a reader turns it into a FormatError with path and line."""

    def __init__(self, place: Place, problem: str) -> None:
        self.place, self.problem = place, problem
        super().__init__(f"{describe(place)}: {problem}" if place else problem)

    def at(self, path: Any, text: str = "") -> FormatError:
        """The FormatError for file ``path``; with its JSON ``text``, with a line."""
        return FormatError(path, str(self), line=line_of(text, self.place) if text else None)


def describe(place: Place) -> str:
    """``("frames", 3, "xy")`` as ``frames[3].xy``."""
    words = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in place)
    return words.removeprefix(".")


def parse_json(path: Any, text: str) -> Any:
    """Parse JSON without NaN, Infinity or repeated keys; FormatError names the line."""

    def refuse(word: str) -> Any:
        at = text.find(word)
        raise FormatError(path, f"{word} is no JSON number; write null", line=text.count("\n", 0, at) + 1)

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        values = dict(pairs)
        if len(values) < len(pairs):
            keys = [key for key, _ in pairs]
            raise FormatError(path, f"the key {next(key for key in keys if keys.count(key) > 1)!r} stands twice")
        return values

    try:
        return json.loads(text, parse_constant=refuse, object_pairs_hook=unique)
    except json.JSONDecodeError as error:
        raise FormatError(path, f"not JSON: {error.msg} (column {error.colno})", line=error.lineno) from None
    except RecursionError:
        raise FormatError(path, "not JSON that means anything: nested too deeply") from None
    except FormatError:
        raise
    except ValueError as error:
        raise FormatError(path, f"not JSON: {error}") from None


def line_of(text: str, place: Place) -> int:
    """The line, from 1, on which the value at ``place`` begins, or the last part of the way that exists."""
    at = _skip(text, 0)
    for key in place:
        found = _enter(text, at, key)
        if found is None:
            break
        at = found
    return text.count("\n", 0, at) + 1


def _enter(text: str, at: int, key: str | int) -> int | None:
    """Where the member ``key`` of the object or list at ``at`` begins."""
    if at >= len(text) or text[at] != ("[" if isinstance(key, int) else "{"):
        return None
    index, at = 0, _skip(text, at + 1)
    while at < len(text) and text[at] not in "]}":
        name: str | int = index
        if not isinstance(key, int):
            name, at = _decode(text, at)
            at = _skip(text, _skip(text, at) + 1)
        if name == key:
            return at
        at = _skip(text, _decode(text, at)[1])
        at = _skip(text, at + 1) if text[at] == "," else at
        index += 1
    return None


def _skip(text: str, at: int) -> int:
    while at < len(text) and text[at] in _SPACE:
        at += 1
    return at


def member(value: Any, place: Place, known: Mapping[str, bool]) -> dict[str, Any]:
    """``value`` as an object with no keys but those of ``known`` (true: needed)."""
    if not isinstance(value, dict):
        raise Misplaced(place, f"want an object, got {brief(value)}")
    for key in value:
        if key not in known:
            raise Misplaced((*place, key), f"unknown key; known are {', '.join(known)}")
    for key, needed in known.items():
        if needed and key not in value:
            raise Misplaced(place, f"lacks {key!r}")
    return value


def items(value: Any, place: Place) -> list[Any]:
    """``value`` as a list."""
    if not isinstance(value, list):
        raise Misplaced(place, f"want a list, got {brief(value)}")
    return value


def text(value: Any, place: Place) -> str:
    """``value`` as a word or more."""
    if not isinstance(value, str) or not value or "\0" in value:
        raise Misplaced(place, f"want a text, got {brief(value)}")
    return value


def number(value: Any, place: Place, *, low: float = -math.inf, high: float = math.inf) -> float:
    """``value`` as a finite number in ``low``..``high``."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e300:
        raise Misplaced(place, f"want a number, got {brief(value)}")
    if not low <= value <= high:
        raise Misplaced(place, f"want a number in {low}..{high}, got {value}")
    return float(value)


def whole(value: Any, place: Place, *, low: int, high: int) -> int:
    """``value`` as a whole number in ``low``..``high``."""
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise Misplaced(place, f"want a whole number in {low}..{high}, got {brief(value)}")
    return value


def table(value: Any, place: Place, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """``value``, nested lists of numbers, as an array of ``shape``; a wrong number or count is named by its place."""
    if not shape:
        return np.array(number(value, place))
    rows = items(value, place)
    if len(rows) != shape[0]:
        raise Misplaced(place, f"want {shape[0]} entries, got {len(rows)}")
    entries = [table(row, (*place, index), shape[1:]) for index, row in enumerate(rows)]
    return np.array(entries, dtype=np.float64).reshape(shape)


def brief(value: Any) -> str:
    """``value`` for a message, in one short line."""
    words = json.dumps(value, ensure_ascii=False, default=str)
    return words if len(words) <= 40 else f"{words[:37]}..."
