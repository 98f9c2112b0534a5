"""Small PNG files: at most 255 colours, found as for a GIF."""

from __future__ import annotations

import os
import struct
import zlib

import numpy as np
from numpy.typing import ArrayLike

from pegbar import arrays
from pegbar.io import atomic
from pegbar.io.gif import Scene


def write_palette_png(path: str | os.PathLike[str], picture: ArrayLike) -> None:
    """Write ``picture`` (H, W, 3) uint8 RGB as a PNG of at most 255 colours: some third of the size of an exact one.

    Examples
    --------
    >>> import tempfile
    >>> file = tempfile.mkdtemp() + "/dots.png"
    >>> write_palette_png(file, np.full((2, 3, 3), 200, np.uint8))
    >>> from pegbar.io.frames import read_image
    >>> read_image(file)[0, 0].tolist()
    [200, 200, 200]
    """
    pixels = arrays.image("picture", picture, (3,))
    known = Scene(pixels[None])
    red, green, blue = (pixels.astype(np.int64) >> 3).transpose(2, 0, 1)
    rows = known.table[red << 10 | green << 5 | blue]
    height, width = rows.shape
    # No filter: neighbouring numbers of a palette are not alike.
    raw = np.concatenate([np.zeros((height, 1), np.uint8), rows], axis=1).tobytes()
    header = struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)
    parts = ((b"IHDR", header), (b"PLTE", known.palette), (b"IDAT", zlib.compress(raw, 9)), (b"IEND", b""))
    atomic.write_bytes(path, b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, data) for kind, data in parts))


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
