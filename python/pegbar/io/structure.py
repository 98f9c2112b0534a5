"""Whether a PNG, JPEG or TIFF file is whole, told from its structure before anything is decoded.

Decoders fill what is missing with grey, print to standard error, or reserve what an absurd header asks for. Each
function here takes the file's bytes, raises FormatError with the place of the fault, and returns what the decoder's
caller must know.
"""

from __future__ import annotations

import os
import struct
import zlib
from dataclasses import dataclass

from pegbar.errors import FormatError

#: Pictures with more pixels are refused before memory is reserved: 16384 x 16384, 1 GB as 8-bit RGBA.
MAX_PIXELS = 1 << 28

_Path = str | os.PathLike[str]
# Deflate cannot shrink data more than this (RFC 1951: 258 bytes from 2 bits).
_DEFLATE_LIMIT = 1032
_PNG_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
_TIFF_SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8, 13: 4, 16: 8, 17: 8, 18: 8}
_TIFF_CODES = {1: "B", 3: "H", 4: "I", 13: "I", 16: "Q", 18: "Q"}


@dataclass(frozen=True)
class PngHeader:
    """Size, and the grey level that a grey PNG declares transparent (None: none), in the file's own bits."""

    width: int
    height: int
    bits: int
    transparent_grey: int | None


def check_size(path: _Path, width: int, height: int) -> None:
    """Refuse a picture without pixels or with more than ``MAX_PIXELS``."""
    if width < 1 or height < 1:
        raise FormatError(path, f"the header says {width}x{height} pixels")
    if width * height > MAX_PIXELS:
        raise FormatError(path, f"the header says {width}x{height} pixels, more than the limit of {MAX_PIXELS}")


def check_png(path: _Path, data: bytes) -> PngHeader:
    """Walk the chunks of a PNG to its end and compare every checksum."""
    view, place, length, transparent = memoryview(data), 8, 0, None
    header: tuple[int, ...] = ()
    while True:
        if place + 12 > len(data):
            raise FormatError(path, "the PNG is cut short", byte=len(data))
        size, kind = struct.unpack_from(">I4s", data, place)
        end = place + 12 + size
        if end > len(data):
            raise FormatError(path, "the PNG is cut short", byte=len(data))
        if zlib.crc32(view[place + 4 : end - 4]) != int.from_bytes(view[end - 4 : end], "big"):
            raise FormatError(path, f"the PNG is damaged: wrong checksum in its {_chunk_name(kind)} chunk", byte=place)
        if not header:
            header = _png_header(path, data, size, kind)
        if kind == b"IEND":
            break
        if kind == b"IDAT":
            length += size
        if kind == b"tRNS" and header[3] == 0 and size == 2:
            transparent = int.from_bytes(view[place + 8 : place + 10], "big")
        place = end
    width, height, bits, color = header
    if length * _DEFLATE_LIMIT < (width * bits * _PNG_CHANNELS[color] + 7) // 8 * height:
        raise FormatError(path, f"the PNG holds too little data for {width}x{height} pixels", byte=place)
    return PngHeader(width, height, bits, transparent)


def _png_header(path: _Path, data: bytes, size: int, kind: bytes) -> tuple[int, int, int, int]:
    if kind != b"IHDR" or size != 13:
        raise FormatError(path, "the PNG does not begin with a header", byte=8)
    width, height, bits, color = struct.unpack_from(">IIBB", data, 16)
    check_size(path, width, height)
    if color not in _PNG_CHANNELS or bits not in (1, 2, 4, 8, 16):
        raise FormatError(path, f"the PNG has colour type {color} with {bits} bits, which do not exist", byte=24)
    return width, height, bits, color


def _chunk_name(kind: bytes) -> str:
    return kind.decode("ascii") if kind.isalpha() else repr(kind)


def check_jpeg(path: _Path, data: bytes) -> None:
    """Walk a JPEG's segments to its scan and find the mark that ends it."""
    place, sized = 2, False
    while place + 4 <= len(data):
        if data[place] != 0xFF:
            raise FormatError(path, "the JPEG is damaged: no marker where one is due", byte=place)
        marker = data[place + 1]
        if marker == 0xFF:
            place += 1
            continue
        if marker == 0xDA:
            break
        (size,) = struct.unpack_from(">H", data, place + 2)
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            if place + 9 > len(data):
                break
            height, width = struct.unpack_from(">HH", data, place + 5)
            check_size(path, width, height)
            sized = True
        place += 2 + size
    if not sized or data.rfind(b"\xff\xd9", place) < 0:
        raise FormatError(path, "the JPEG is cut short", byte=len(data))


def check_tiff(path: _Path, data: bytes) -> None:
    """Read a TIFF's first directory; its size must be sane and its strips or tiles must lie inside the file."""
    order = "<" if data[:2] == b"II" else ">"
    try:
        big = struct.unpack_from(order + "H", data, 2)[0] == 43
        tags = _tiff_tags(data, order, big)
    except struct.error:
        raise FormatError(path, "the TIFF is cut short", byte=len(data)) from None
    if 256 not in tags or 257 not in tags:
        raise FormatError(path, "the TIFF has no size")
    check_size(path, tags[256][0], tags[257][0])
    starts, sizes = tags.get(273, tags.get(324, ())), tags.get(279, tags.get(325, ()))
    if not starts or len(starts) != len(sizes):
        raise FormatError(path, "the TIFF is damaged: it does not say where its pixels are")
    if max(start + size for start, size in zip(starts, sizes, strict=True)) > len(data):
        raise FormatError(path, "the TIFF is cut short", byte=len(data))


def _tiff_tags(data: bytes, order: str, big: bool) -> dict[int, tuple[int, ...]]:
    """Whole-number tags of the first directory; struct.error where the file ends too soon."""
    (place,) = struct.unpack_from(order + ("Q" if big else "I"), data, 8 if big else 4)
    (count,) = struct.unpack_from(order + ("Q" if big else "H"), data, place)
    place += 8 if big else 2
    entry, inline, counter, offset = (20, 8, "Q", "Q") if big else (12, 4, "I", "I")
    tags = {}
    for index in range(min(count, 4096)):
        here = place + index * entry
        tag, kind, number = struct.unpack_from(f"{order}HH{counter}", data, here)
        if kind not in _TIFF_CODES or number > len(data):
            continue
        where = here + entry - inline
        if number * _TIFF_SIZES[kind] > inline:
            (where,) = struct.unpack_from(order + offset, data, where)
        tags[tag] = struct.unpack_from(f"{order}{number}{_TIFF_CODES[kind]}", data, where)
    return tags
