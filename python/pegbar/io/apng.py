"""Animated PNG, written as its frames come: exact, and of each frame only the rectangle that changed."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterable, Iterator
from typing import BinaryIO, NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.io import atomic
from pegbar.io.ahead import map_ahead

Pixels = NDArray[np.uint8]
_TO_BGR = {3: cv2.COLOR_RGB2BGR, 4: cv2.COLOR_RGBA2BGRA}


class _Patch(NamedTuple):
    """What changes: ``pixels`` with their corner at column ``left``, row ``top``."""

    left: int
    top: int
    pixels: Pixels


def write_apng(path: str | os.PathLike[str], frames: Iterable[ArrayLike], durations: Iterable[int]) -> None:
    """Write pictures as an APNG that repeats for ever, complete or not at all.

    Parameters
    ----------
    path : path
    frames : iterable of (H, W, 3|4) uint8
        RGB or straight RGBA of one size and as many channels, taken as they come.
    durations : iterable of int
        Thousandths of a second, as many as frames.

    Raises
    ------
    ValueError
        For no frames or frames that differ in size or channels.
    """
    with atomic.complete_file(path) as part, open(part, "wb") as file:
        _write(file, map_ahead(_encoded, _patches(frames)), iter(durations))


def _write(file: BinaryIO, encoded: Iterator[tuple[_Patch, bytes]], durations: Iterator[int]) -> None:
    count = order = place = 0
    for patch, png in encoded:
        chunks = list(_chunks(png))
        if not count:
            file.write(b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", chunks[0][1]))
            place = file.tell()
            file.write(_chunk(b"acTL", bytes(8)))
        height, width = patch.pixels.shape[:2]
        # Not disposed of; what is there is replaced, alpha as well.
        control = struct.pack(">IIIIHHBB", width, height, patch.left, patch.top, next(durations), 1000, 0, 0)
        file.write(_chunk(b"fcTL", struct.pack(">I", order) + control))
        order += 1
        for data in (data for kind, data in chunks if kind == b"IDAT"):
            if count:
                file.write(_chunk(b"fdAT", struct.pack(">I", order) + data))
                order += 1
            else:
                file.write(_chunk(b"IDAT", data))
        count += 1
    if not count:
        raise ValueError("frames: want at least one")
    file.write(_chunk(b"IEND", b""))
    file.seek(place)
    file.write(_chunk(b"acTL", struct.pack(">II", count, 0)))


def _patches(frames: Iterable[ArrayLike]) -> Iterator[_Patch]:
    """What is new in each frame; one pixel where nothing is."""
    before: Pixels | None = None
    for picture in arrays.images("frames", frames):
        if before is None:
            yield _Patch(0, 0, picture)
        else:
            changed = (picture != before).any(axis=2)
            rows, columns = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
            top, bottom, left, right = (rows[0], rows[-1], columns[0], columns[-1]) if len(rows) else (0, 0, 0, 0)
            yield _Patch(int(left), int(top), picture[top : bottom + 1, left : right + 1])
        before = picture


def _encoded(patch: _Patch) -> tuple[_Patch, bytes]:
    good, data = cv2.imencode(".png", cv2.cvtColor(patch.pixels, _TO_BGR[patch.pixels.shape[2]]))
    assert good
    return patch, data.tobytes()


def _chunks(png: bytes) -> Iterator[tuple[bytes, bytes]]:
    place = 8
    while place < len(png):
        (length,) = struct.unpack_from(">I", png, place)
        yield png[place + 4 : place + 8], png[place + 8 : place + 8 + length]
        place += length + 12


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
