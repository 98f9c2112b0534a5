"""The index of a folder of clips: one file with the markers of all of them.

A line that says what it is, the length of the header and the hash of all that follows; the header in JSON: of every
clip its files, rates and number of frames; then the markers as float32, clip after clip. An index that is broken, cut
short, or written by another version is as good as none.
"""

from __future__ import annotations

import json
import os
import platform
import struct
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.io.atomic import complete_file
from pegbar.io.fingerprint import File
from pegbar.scene.body import MARKERS
from pegbar.scene.clip import RATE, Clip

NAME = ".pegbar-clips.index"
_MAGIC = b"pegbar clip index 1\n"
_HEAD = struct.Struct("<Q16s")
_ROW = len(MARKERS) * 3 * 4
_MOST = 1 << 32


@dataclass(frozen=True, eq=False)
class Entry:
    """A clip of the index: its files, and the clip, or why there is none and whether the file is broken."""

    name: str
    files: tuple[File, ...]
    clip: Clip | None
    problem: str
    broken: bool

    def with_files(self, files: tuple[File, ...]) -> Entry:
        """The same with its files as they are now."""
        return replace(self, files=files)


def load_index(folder: Path) -> tuple[Path | None, dict[str, Entry]]:
    """Return where the index of ``folder`` is, and its entries by name; nothing where there is no good one."""
    for place in _places(folder):
        try:
            return place, {entry.name: entry for entry in _read(place)}
        except (OSError, ValueError, KeyError, TypeError, struct.error):
            continue
    return None, {}


def save_index(folder: Path, entries: list[Entry]) -> Path | None:
    """Write the index where it can be written and return the place, or None."""
    for place in _places(folder):
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            _write(place, entries)
        except OSError:
            continue
        return place
    return None


def _places(folder: Path) -> list[Path]:
    """In the folder, unless it is marked read-only (which does not stop everybody), else in the user's cache."""
    import xxhash

    unlike = xxhash.xxh3_64_hexdigest(os.fsencode(folder.resolve()))
    own = [folder / NAME] if folder.stat().st_mode & 0o222 else []
    return [*own, _cache() / "pegbar" / f"clips-{unlike}.index"]


def _cache() -> Path:
    if given := os.environ.get("XDG_CACHE_HOME"):
        return Path(given)
    if platform.system() == "Windows" and (given := os.environ.get("LOCALAPPDATA")):
        return Path(given)
    home = Path(os.path.expanduser("~"))
    return home / ("Library/Caches" if platform.system() == "Darwin" else ".cache")


def _stamp() -> dict[str, Any]:
    return {"version": version("pegbar"), "rate": RATE, "markers": list(MARKERS)}


def _write(place: Path, entries: list[Entry]) -> None:
    import xxhash

    clips = [_record(entry) for entry in entries]
    header = json.dumps({**_stamp(), "clips": clips}, ensure_ascii=False).encode()
    header += b" " * (-(len(_MAGIC) + _HEAD.size + len(header)) % 64)
    digest = xxhash.xxh3_128(header)
    markers = [np.ascontiguousarray(entry.clip.markers, "<f4") for entry in entries if entry.clip is not None]
    for array in markers:
        digest.update(array.data)
    with complete_file(place) as part, open(part, "wb") as file:
        file.write(_MAGIC + _HEAD.pack(len(header), digest.digest()) + header)
        for array in markers:
            file.write(array.data)


def _record(entry: Entry) -> dict[str, Any]:
    record: dict[str, Any] = {"name": entry.name, "files": [list(file) for file in entry.files]}
    if entry.clip is None:
        return record | {"problem": entry.problem, "broken": entry.broken}
    clip = entry.clip
    numbers = {"frame_rate": clip.frame_rate, "first": clip.first, "frames": clip.frames, "length": len(clip.markers)}
    return record | numbers


def _read(place: Path) -> list[Entry]:
    import xxhash

    with open(place, "rb") as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            raise ValueError("no index")
        length, digest = _HEAD.unpack(file.read(_HEAD.size))
        header = file.read(min(length, _MOST))
        start = file.tell()
    rest = place.stat().st_size - start
    if rest < 0 or rest % _ROW:
        raise ValueError("cut short")
    shape = (rest // _ROW, len(MARKERS), 3)
    markers = np.memmap(place, "<f4", "r", start, shape) if rest else np.empty(shape, np.float32)
    found = xxhash.xxh3_128(header)
    found.update(markers.data if rest else b"")
    if found.digest() != digest:
        raise ValueError("broken")
    table = json.loads(header)
    if {key: table[key] for key in _stamp()} != _stamp():
        raise ValueError("of another version")
    return _entries(table["clips"], markers)


def _entries(records: list[dict[str, Any]], markers: NDArray[np.float32]) -> list[Entry]:
    entries, at = [], 0
    for record in records:
        files = tuple(File(*file) for file in record["files"])
        if "problem" in record:
            entries.append(Entry(record["name"], files, None, record["problem"], record["broken"]))
            continue
        part = markers[at : at + record["length"]]
        at += record["length"]
        clip = Clip(record["name"], part, RATE, record["frame_rate"], record["first"], record["frames"])
        entries.append(Entry(record["name"], files, clip, "", False))
    return entries
