"""Reads a motion file of any kind, told apart by its suffix or else by how it begins."""

from __future__ import annotations

import os
from pathlib import Path

from pegbar.errors import FormatError
from pegbar.io.acclaim import read_acclaim
from pegbar.io.bvh_reader import read_bvh
from pegbar.io.c3d import read_c3d
from pegbar.io.motion_bytes import read_bytes
from pegbar.io.recording import Recording

_Path = str | os.PathLike[str]
_KINDS = {".bvh": read_bvh, ".amc": read_acclaim, ".c3d": read_c3d}


def read_recording(path: _Path, skeleton: _Path | None = None) -> Recording:
    """Return what the motion file ``path`` says: every frame, in the file's unit and axes.

    Parameters
    ----------
    path : path
        A ``.bvh``, ``.amc`` or ``.c3d`` file; what has another name is told by its content.
    skeleton : path, optional
        The ``.asf`` file of an ``.amc`` file; else one beside it is taken.

    Returns
    -------
    Recording
        Names, parents, positions and rotations, and what the file says of rate, unit and up axis.

    Raises
    ------
    FormatError
        For a broken file; it names path and line (or byte).
    ValueError
        For a skeleton given with a file that has its own.
    OSError
        When the file cannot be read.
    """
    kind = Path(path).suffix.lower()
    if kind not in _KINDS:
        kind = _kind(path, read_bytes(path))
    if skeleton is not None and kind != ".amc":
        raise ValueError(f"skeleton: only .amc files have one, got {os.fspath(path)!r}")
    return read_acclaim(path, skeleton) if kind == ".amc" else _KINDS[kind](path)


def _kind(path: _Path, data: bytes) -> str:
    """The suffix that a file without a known one would have."""
    head = data[: 1 << 16].removeprefix(b"\xef\xbb\xbf").lstrip().upper()
    if head.startswith(b"HIERARCHY"):
        return ".bvh"
    # A PNG file's second byte is a C3D file's too.
    if len(data) > 512 and data[1] == 0x50 and not data.startswith(b"\x89PNG"):
        return ".c3d"
    if b":FULLY-SPECIFIED" in head:
        return ".amc"
    if b":BONEDATA" in head:
        raise FormatError(path, "a skeleton without motion; read its .amc file", line=1)
    raise FormatError(path, "neither its name nor its content is a motion file's: want .bvh, .amc or .c3d", byte=0)
