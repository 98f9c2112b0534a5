"""Picture files made byte by byte, so that tests do not read what the code under test wrote."""

from __future__ import annotations

import struct
import zlib

import numpy as np


def png_chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width, height, bits, color, rows, *, before=b"", data=None):
    """A PNG of colour type ``color`` whose ``rows`` are packed bytes; ``before`` goes between header and data."""
    header = struct.pack(">IIBBBBB", width, height, bits, color, 0, 0, 0)
    if data is None:
        data = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows))
    chunks = png_chunk(b"IHDR", header) + before + png_chunk(b"IDAT", data) + png_chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + chunks


def palette(colors, alphas=()):
    chunk = png_chunk(b"PLTE", bytes(np.ravel(colors).tolist()))
    return chunk + png_chunk(b"tRNS", bytes(alphas)) if alphas else chunk


def tiff(width, height, channels, pixels, *, bits=8, sample_format=1, order="<"):
    """An uncompressed TIFF with one strip."""
    entries = [
        (256, 4, width),
        (257, 4, height),
        (258, 3, bits),
        (259, 3, 1),
        (262, 3, 2 if channels >= 3 else 1),
        (273, 4, 0),
        (277, 3, channels),
        (278, 4, height),
        (279, 4, len(pixels)),
        (339, 3, sample_format),
    ]
    start = 8 + 2 + 12 * len(entries) + 4
    depths = start
    if channels > 2:
        start += 2 * channels
    body = b""
    for tag, kind, value in entries:
        count = 1
        packed = struct.pack(order + ("I" if kind == 4 else "HH"), *((value,) if kind == 4 else (value, 0)))
        if tag == 273:
            packed = struct.pack(order + "I", start)
        if tag in (258, 339) and channels > 1:
            count = channels
            packed = struct.pack(order + "HH", value, value) if channels == 2 else struct.pack(order + "I", depths)
            if channels > 2 and tag == 339:
                count, packed = 1, struct.pack(order + "HH", value, 0)
        body += struct.pack(order + "HHI", tag, kind, count) + packed
    magic = b"II*\0" if order == "<" else b"MM\0*"
    extra = struct.pack(f"{order}{channels}H", *[bits] * channels) if channels > 2 else b""
    return (
        magic + struct.pack(order + "I", 8) + struct.pack(order + "H", len(entries)) + body + bytes(4) + extra + pixels
    )
