"""Reads C3D, the points of optical motion capture."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import FormatError
from pegbar.io.c3d_header import Header, dec_floats, read_header
from pegbar.io.motion_bytes import read_bytes, unique
from pegbar.io.recording import Recording

_Path = str | os.PathLike[str]
_UNITS = {"mm": 0.001, "cm": 0.01, "dm": 0.1, "m": 1.0, "in": 0.0254, "inch": 0.0254, "ft": 0.3048}
#: What Plug-in-Gait and its kin write as points though it is none.
_OUTPUTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
# A place farther away, in any unit, is damage.
_FARTHEST = 1e12


def read_c3d(path: _Path) -> Recording:
    """Return the points of a C3D file with every frame.

    Points that the file marks as missing are NaN. Angles, forces, moments and powers that are stored as points, and
    points without a label of their own (``*12``), are left out; a subject's name before every label (``Anna:LHIP``) is
    taken off; the notes say so.

    Parameters
    ----------
    path : path
        The file, of Intel, DEC or MIPS processors, in integers or floats.

    Returns
    -------
    Recording
        Points without parents, in the file's unit and axes.

    Raises
    ------
    FormatError
        For a file that is no C3D, is cut short, or whose counts disagree; it names the byte.
    OSError
        When the file cannot be read.
    """
    data = read_bytes(path)
    header = read_header(path, data)
    labels, columns, notes = _labels(header)
    if not columns:
        raise FormatError(path, "the file holds no labelled points", byte=header.start)
    names, renamed = _names(labels)
    positions = _positions(path, data, header)[:, columns]
    unit = _UNITS.get(header.word("UNITS").lower())
    up = header.word("Y_SCREEN").lower().removeprefix("+")
    return Recording(
        path=path,
        names=names,
        parents=(-1,) * len(names),
        offsets=None,
        positions=positions,
        rotations=np.broadcast_to(np.eye(3), (*positions.shape[:2], 3, 3)),
        frame_rate=header.rate,
        unit=unit,
        up=up if up.removeprefix("-") in ("x", "y", "z") else None,
        notes=(*notes, *renamed),
    )


def _labels(header: Header) -> tuple[list[str], list[int], tuple[str, ...]]:
    """The labels of the points that are kept, their columns, and notes on what is not."""
    labels = header.words("LABELS")[: header.points]
    labels += ["*"] * (header.points - len(labels))
    outputs = {word for name in _OUTPUTS for word in header.words(name)}
    bare = {word.rpartition(":")[2] for word in outputs}
    is_output = [label in outputs or (":" in label and label.rpartition(":")[2] in bare) for label in labels]
    is_unlabelled = [not label or label.rpartition(":")[2].startswith("*") for label in labels]
    columns = [at for at in range(len(labels)) if not is_output[at] and not is_unlabelled[at]]
    notes = []
    if any(is_output):
        notes.append(f"{sum(is_output)} angles, forces, moments and powers are left out")
    if any(is_unlabelled):
        notes.append(f"{sum(is_unlabelled)} points without a label are left out")
    return [labels[at] for at in columns], columns, tuple(notes)


def _names(labels: list[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The labels without a subject's name that all share, each once."""
    subjects = {label.partition(":")[0] if ":" in label else "" for label in labels}
    notes: tuple[str, ...] = ()
    if len(subjects) == 1 and (subject := subjects.pop()):
        labels = [label.partition(":")[2] for label in labels]
        notes = (f"the subject's name {subject!r} is taken off the labels",)
    names, renamed = unique(labels)
    return names, notes + renamed


def _positions(path: _Path, data: bytes, header: Header) -> NDArray[np.float64]:
    """All points (F, N, 3); NaN where one is missing: its fourth number is negative, or it has no place at all."""
    rows = np.frombuffer(data, np.uint8, header.frames * header.stride, header.start).reshape(header.frames, -1)
    size = 2 if header.scale else 4
    raw = np.ascontiguousarray(rows[:, : 4 * header.points * size])
    kind = "i2" if header.scale else "u4"
    stored: NDArray[Any] = raw.view(np.dtype(kind).newbyteorder(header.order)).reshape(header.frames, -1, 4)
    if not header.scale:
        stored = dec_floats(stored) if header.is_dec else stored.view(np.dtype("f4").newbyteorder(header.order))
    with np.errstate(invalid="ignore"):  # a signalling NaN is a missing point like any other
        points: NDArray[np.float64] = stored[..., :3].astype(np.float64)
    wrong = np.abs(points) > _FARTHEST
    if wrong.any():
        frame, point, _ = (int(index) for index in np.argwhere(wrong)[0])
        byte = header.start + frame * header.stride + point * 4 * size
        raise FormatError(path, f"point {point} of frame {frame} is no place", byte=byte)
    if header.scale:
        points *= header.scale
    missing = (stored[..., 3] < 0) | ~np.isfinite(points).all(axis=-1) | ~points.any(axis=-1)
    points[missing] = np.nan
    return points
