"""What tells whether a file has changed: size and time, or else its contents."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

_BLOCK = 1 << 20


class File(NamedTuple):
    """A file as it was: its name, size in bytes, time of change in ns, and its contents' hash."""

    name: str
    size: int
    time: int
    contents: str


def stat_of(path: Path) -> tuple[int, int]:
    """Return size in bytes and time of change in ns."""
    stat = path.stat()
    return stat.st_size, stat.st_mtime_ns


def fingerprint(path: Path) -> str:
    """Return the xxh3 hash of a file's contents."""
    import xxhash

    digest = xxhash.xxh3_128()
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()
