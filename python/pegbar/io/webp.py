"""Animated WebP, written as its frames come: lossless, and of each frame only the rectangle that changed.

The container is written here: chunks `VP8X`, `ANIM` and `ANMF` of a RIFF file, by Google's
"WebP Container Specification".
Frames are encoded by themselves, several at a time: by PyAV where it is installed, whose effort can be set, else by
OpenCV, which takes five times as long for files that are a seventh smaller.
"""

from __future__ import annotations

import importlib.util
import os
import struct
from collections.abc import Iterable, Iterator
from fractions import Fraction
from typing import Any, BinaryIO

import cv2
import numpy as np
from numpy.typing import ArrayLike

from pegbar.io import atomic
from pegbar.io.ahead import map_ahead
from pegbar.io.patches import Patch, changed_patches

_TO_BGRA = {3: cv2.COLOR_RGB2BGRA, 4: cv2.COLOR_RGBA2BGRA}
#: The longest side that the format has.
LONGEST = 16383
#: Flags of the file (alpha, animation) and of a frame (replaces what is there, and stays).
_ALPHA, _ANIMATION, _REPLACES = 0x10, 0x02, 0x02
# PyAV's libwebp: how hard it tries; more makes files little smaller.
_EFFORT = {"lossless": "1", "compression_level": "1", "quality": "0"}


def write_webp(path: str | os.PathLike[str], frames: Iterable[ArrayLike], durations: Iterable[int]) -> None:
    """Write pictures as a WebP that repeats for ever, complete or not at all.

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
        For no frames, frames that differ in size or channels, or sides of more than 16383 pixels.
    """
    with atomic.complete_file(path) as part, open(part, "wb") as file:
        _write(file, map_ahead(_encoded, changed_patches(frames, step=2)), iter(durations))


def _write(file: BinaryIO, encoded: Iterator[tuple[Patch, bytes]], durations: Iterator[int]) -> None:
    first = next(encoded, None)
    if first is None:
        raise ValueError("frames: want at least one")
    height, width, channels = first[0].pixels.shape
    flags = _ANIMATION | (_ALPHA if channels == 4 else 0)
    file.write(b"RIFF" + bytes(4) + b"WEBP")
    file.write(_chunk(b"VP8X", struct.pack("<I", flags) + _three(width - 1) + _three(height - 1)))
    file.write(_chunk(b"ANIM", bytes(4) + struct.pack("<H", 0)))
    _write_frame(file, *first, next(durations))
    for patch, data in encoded:
        _write_frame(file, patch, data, next(durations))
    size = file.tell() - 8
    file.seek(4)
    file.write(struct.pack("<I", size))


def _write_frame(file: BinaryIO, patch: Patch, data: bytes, duration: int) -> None:
    height, width = patch.pixels.shape[:2]
    place = b"".join(map(_three, (patch.left // 2, patch.top // 2, width - 1, height - 1, duration)))
    file.write(_chunk(b"ANMF", place + bytes([_REPLACES]) + data))


def _encoded(patch: Patch) -> tuple[Patch, bytes]:
    """A patch and the chunk of its pixels."""
    height, width = patch.pixels.shape[:2]
    if max(height, width) > LONGEST:
        raise ValueError(f"frames: want sides of {LONGEST} pixels at most for a WebP, got {width} x {height}")
    pixels = cv2.cvtColor(np.ascontiguousarray(patch.pixels), _TO_BGRA[patch.pixels.shape[2]])
    if importlib.util.find_spec("av"):
        file = _by_pyav(pixels)
    else:
        good, data = cv2.imencode(".webp", pixels, [cv2.IMWRITE_WEBP_QUALITY, 101])
        assert good
        file = data.tobytes()
    return patch, _lossless_chunk(file)


def _by_pyav(pixels: Any) -> bytes:
    import av

    encoder: Any = av.CodecContext.create("libwebp", "w")
    encoder.height, encoder.width = pixels.shape[:2]
    encoder.pix_fmt, encoder.time_base, encoder.options = "bgra", Fraction(1, 1000), _EFFORT
    packets = [*encoder.encode(av.VideoFrame.from_ndarray(pixels, "bgra")), *encoder.encode()]
    return b"".join(map(bytes, packets))


def _lossless_chunk(file: bytes) -> bytes:
    """The chunk of a lossless WebP file that holds its pixels."""
    place = 12
    while place + 8 <= len(file):
        kind, length = struct.unpack_from("<4sI", file, place)
        if kind == b"VP8L":
            return file[place : place + 8 + length + length % 2]
        place += 8 + length + length % 2
    raise ValueError("frames: the encoder gave no lossless WebP")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return kind + struct.pack("<I", len(data)) + data + bytes(len(data) % 2)


def _three(number: int) -> bytes:
    return struct.pack("<I", number)[:3]
