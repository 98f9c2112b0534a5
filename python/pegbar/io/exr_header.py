"""The structure of an OpenEXR file: parts, channels and windows, and whether all of its pixel data is there.

The library prints to standard output and error when a file is cut short, reads only whole files, and reserves what an
absurd header asks for: so the structure is read here first. Layout after the OpenEXR file format, version 2:
https://openexr.com/en/latest/OpenEXRFileLayout.html
"""

from __future__ import annotations

import math
import os
import struct
from dataclasses import dataclass
from io import FileIO

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import FormatError
from pegbar.io.structure import check_size

_Path = str | os.PathLike[str]
_TILED, _DEEP, _MULTIPART = 0x200, 0x800, 0x1000
# Rows of one chunk by compression: none, rle, zips, zip, piz, pxr24, b44, b44a, dwaa, dwab, htj2k256, htj2k32.
_ROWS = (1, 1, 1, 16, 32, 16, 32, 32, 32, 256, 256, 32)
# More than any usual header and its table of chunks; what is longer is read again as a whole.
_HEAD = 1 << 18
_TYPES = ("uint32", "float16", "float32")


class _Short(Exception):
    """The bytes at hand end before the header does."""


@dataclass(frozen=True)
class Part:
    """One part: channel names with their dtypes, and windows (left, top, right, bottom), both ends inside."""

    name: str
    channels: dict[str, str]
    data_window: tuple[int, int, int, int]
    display_window: tuple[int, int, int, int]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the display window, the picture."""
        left, top, right, bottom = self.display_window
        return right - left + 1, bottom - top + 1


def read_header(path: _Path) -> list[Part]:
    """Return the parts of an EXR file; FormatError when it is none, cut short, deep, or absurdly large."""
    # Plain reads: a renderer that replaces a file which is mapped into memory would kill the process.
    with open(path, "rb", buffering=0) as file:
        size = os.fstat(file.fileno()).st_size
        for head in (_HEAD, size):
            file.seek(0)
            data = file.read(head)
            try:
                return _read_parts(path, data, file, size)
            except (struct.error, IndexError, _Short):
                if len(data) >= size:
                    break
        raise FormatError(path, "the EXR is empty or cut short", byte=size)


def _read_parts(path: _Path, data: bytes, file: FileIO, size: int) -> list[Part]:
    magic, version = struct.unpack_from("<II", data, 0)
    if magic != 20000630:
        raise FormatError(path, "not an EXR file", byte=0)
    if version & _DEEP:
        raise FormatError(path, "a deep EXR: render flat passes")
    place, headers = 8, []
    while True:
        attributes, place = _read_attributes(path, data, place)
        if not attributes:
            break
        headers.append(attributes)
        if not version & _MULTIPART:
            break
    if not headers:
        raise FormatError(path, "the EXR has no parts", byte=8)
    parts = [_part(path, attributes) for attributes in headers]
    for attributes, part in zip(headers, parts, strict=True):
        tiled = bool(version & _TILED) or attributes.get("type") == b"tiledimage"
        count = _chunk_count(path, attributes, part, tiled)
        if place + 8 * count > len(data):
            raise _Short
        starts = np.frombuffer(data, "<u8", count, place)
        _check_chunks(path, file, size, starts, (4 if version & _MULTIPART else 0) + (16 if tiled else 4))
        place += 8 * count
    return parts


def _read_attributes(path: _Path, data: bytes, place: int) -> tuple[dict[str, bytes], int]:
    attributes: dict[str, bytes] = {}
    while data[place] != 0:
        name, place = _text(path, data, place)
        _, place = _text(path, data, place)
        (size,) = struct.unpack_from("<I", data, place)
        place += 4
        if place + size > len(data):
            raise _Short
        attributes[name] = data[place : place + size]
        place += size
    return attributes, place + 1


def _text(path: _Path, data: bytes, place: int) -> tuple[str, int]:
    end = data.find(b"\0", place, place + 256)
    if end < 0 and place + 256 > len(data):
        raise _Short
    if end < 0:
        raise FormatError(path, "the EXR's header is damaged: a name without end", byte=place)
    try:
        return data[place:end].decode("utf-8"), end + 1
    except UnicodeDecodeError:
        raise FormatError(path, "the EXR's header is damaged: a name that is no text", byte=place) from None


def _part(path: _Path, attributes: dict[str, bytes]) -> Part:
    for name in ("channels", "compression", "dataWindow", "displayWindow"):
        if name not in attributes:
            raise FormatError(path, f"the EXR's header lacks {name}")
    if attributes.get("type", b"").startswith(b"deep"):
        raise FormatError(path, "a deep EXR: render flat passes")
    windows = []
    for name in ("dataWindow", "displayWindow"):
        left, top, right, bottom = struct.unpack_from("<iiii", attributes[name])
        check_size(path, right - left + 1, bottom - top + 1)
        windows.append((left, top, right, bottom))
    name = attributes.get("name", b"").decode("utf-8", "replace")
    return Part(name, _channels(path, attributes["channels"]), windows[0], windows[1])


def _channels(path: _Path, data: bytes) -> dict[str, str]:
    channels, place = {}, 0
    while data[place] != 0:
        end = data.find(b"\0", place)
        kind, _, across, down = struct.unpack_from("<IIII", data, end + 1)
        try:
            name = data[place:end].decode("utf-8")
        except UnicodeDecodeError:
            raise FormatError(path, "the EXR's header is damaged: a channel whose name is no text") from None
        if kind >= len(_TYPES):
            raise FormatError(path, f"the EXR's channel {name} has type {kind}, which does not exist")
        if (across, down) != (1, 1):
            raise FormatError(path, f"the EXR's channel {name} is subsampled; write it at full size")
        channels[name] = _TYPES[kind]
        place = end + 17
    return channels


def _chunk_count(path: _Path, attributes: dict[str, bytes], part: Part, tiled: bool) -> int:
    if "chunkCount" in attributes:
        (count,) = struct.unpack_from("<i", attributes["chunkCount"])
        if count < 1:
            raise FormatError(path, f"the EXR's header says {count} chunks")
        return int(count)
    left, top, right, bottom = part.data_window
    if tiled:
        return _tile_count(attributes, right - left + 1, bottom - top + 1)
    method = attributes["compression"][0]
    rows = _ROWS[method] if method < len(_ROWS) else 1 << 20
    return math.ceil((bottom - top + 1) / rows)


def _tile_count(attributes: dict[str, bytes], width: int, height: int) -> int:
    """Tiles of the largest level, which stand first in the table."""
    sides: tuple[int, int] = struct.unpack_from("<II", attributes.get("tiles", b""))
    return math.ceil(width / max(sides[0], 1)) * math.ceil(height / max(sides[1], 1))


def _check_chunks(path: _Path, file: FileIO, size: int, starts: NDArray[np.uint64], lead: int) -> None:
    """Every chunk must be there as a whole; ``lead`` bytes stand before its length."""
    wrong = np.flatnonzero((starts == 0) | (starts > max(size - lead - 4, 0)))
    if len(wrong):
        raise FormatError(path, f"the EXR is cut short: {len(wrong)} of its {len(starts)} chunks are missing")
    for start in starts.tolist():
        file.seek(start + lead)
        length = int.from_bytes(file.read(4), "little", signed=True)
        if length < 0 or start + lead + 4 + length > size:
            raise FormatError(path, "the EXR is cut short or damaged: a chunk ends after the file", byte=start)
