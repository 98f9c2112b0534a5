"""Reads a motion file of any kind, told apart by its suffix or else by how it begins."""

from __future__ import annotations

import os
from pathlib import Path

from pegbar.errors import FormatError
from pegbar.io.bvh_reader import read_bvh
from pegbar.io.motion_bytes import read_bytes
from pegbar.io.recording import Recording

_Path = str | os.PathLike[str]


def read_recording(path: _Path, skeleton: _Path | None = None) -> Recording:
    """Return what the motion file ``path`` says: every frame, in the file's unit and axes.

    Parameters
    ----------
    path : path
        A ``.bvh`` file.
    skeleton : path, optional
        The ``.asf`` file of an ``.amc`` file.

    Returns
    -------
    Recording
        Names, parents, positions and rotations, and what the file says of rate, unit and up axis.

    Raises
    ------
    FormatError
        For a broken file; it names path and line (or byte).
    OSError
        When the file cannot be read.
    """
    kind = Path(path).suffix.lower()
    if kind != ".bvh" and not read_bytes(path).lstrip(b"\xef\xbb\xbf \t\r\n")[:9].upper() == b"HIERARCHY":
        raise FormatError(path, "neither the name's ending nor the content is that of a motion file: want .bvh")
    return read_bvh(path)
