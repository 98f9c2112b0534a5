"""The bytes and numbers of a motion file, and names that stand once: what the readers of clips share."""

from __future__ import annotations

import math
import os
import re
import stat

from pegbar.errors import FormatError

#: Larger files are refused before memory is reserved.
MAX_BYTES = 1 << 30
# Larger numbers are no length or angle, and sums of them would overflow.
_LARGEST = 1e12
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.ASCII | re.IGNORECASE)


def read_bytes(path: str | os.PathLike[str]) -> bytes:
    """Return a whole file; a folder, a device, an empty or an absurdly large one is a FormatError."""
    status = os.stat(path)
    if not stat.S_ISREG(status.st_mode):
        raise FormatError(path, "a folder, want a motion file" if stat.S_ISDIR(status.st_mode) else "not a plain file")
    if status.st_size > MAX_BYTES:
        raise FormatError(path, f"the file has {status.st_size} bytes, more than the limit of {MAX_BYTES}")
    with open(path, "rb") as file:
        data = file.read()
    if not data or data.isspace():
        raise FormatError(path, "the file is empty", line=1)
    return data


def decoded(data: bytes) -> str:
    """Return a file's text: UTF-8, or else Latin-1, in which every byte is a letter."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def number(path: str | os.PathLike[str], word: str, line: int) -> float:
    """Return a word as a number; what is none, not finite or absurdly large is a FormatError."""
    value = float(word) if _NUMBER.fullmatch(word) else math.inf
    if abs(value) > _LARGEST:
        raise FormatError(path, f"want a number up to 1e12, got {word[:24]!r}", line=line)
    return value


def unique(names: list[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names, a number behind each that stood before, and a note for each that was changed."""
    taken, found, counts, notes = set(names), [], dict.fromkeys(names, 0), []
    for name in names:
        counts[name] += 1
        new = name
        while counts[name] > 1 and new in taken:
            new = f"{name}_{counts[name]}"
            counts[name] += new in taken
        if new != name:
            taken.add(new)
            notes.append(f"a second joint {name!r} is called {new!r}")
        found.append(new)
    return tuple(found), tuple(notes)
