"""Animated PNG, written as its frames come: exact, and of each frame only the rectangle that changed."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterable, Iterator
from typing import BinaryIO

import cv2
from numpy.typing import ArrayLike

from pegbar.io import atomic
from pegbar.io.ahead import map_ahead
from pegbar.io.patches import Patch, changed_patches

_TO_BGR = {3: cv2.COLOR_RGB2BGR, 4: cv2.COLOR_RGBA2BGRA}


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
        _write(file, map_ahead(_encoded, changed_patches(frames)), iter(durations))


def _write(file: BinaryIO, encoded: Iterator[tuple[Patch, bytes]], durations: Iterator[int]) -> None:
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


def _encoded(patch: Patch) -> tuple[Patch, bytes]:
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
