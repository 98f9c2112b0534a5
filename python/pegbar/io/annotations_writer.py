"""Writes an annotated drawing as the JSON that ``read_annotations`` reads, one key or frame entry a line."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import FormatError
from pegbar.io import atomic
from pegbar.io.annotations import KEYS, parse
from pegbar.scene.drawing import Drawing

_Path = str | os.PathLike[str]


def write_annotations(path: _Path, drawing: Drawing) -> None:
    """Write ``drawing`` as annotation JSON, complete or not at all; ``read_annotations`` gives the same drawing.

    Parameters
    ----------
    path : path
        The file to make or replace. Picture paths are written relative to it.
    drawing : Drawing
        Cameras and depths that are the same in all frames are written once.

    Raises
    ------
    ValueError
        For a drawing whose arrays do not fit its names and limbs, or hold what JSON cannot (inf).
    OSError
        When the file cannot be written; it names ``path``.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from pegbar import read_annotations
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "dot.json"
    >>> dot = Drawing(("head",), np.array([[[4.0, 5.0]]]), np.array([[True]]), (9, 9))
    >>> write_annotations(file, dot)
    >>> read_annotations(file).markers.tolist()
    [[[4.0, 5.0]]]
    """
    _check(drawing)
    folder = Path(path).absolute().parent
    count = len(drawing.markers)
    top: dict[str, Any] = {"markers": list(drawing.names), "image_size": list(drawing.image_size)}
    if drawing.frame_rate is not None:
        top["fps"] = drawing.frame_rate
    if drawing.loops:
        top["loops"] = True
    if drawing.limbs:
        top["limbs"] = [
            {"name": limb.name, "from": limb.start, "to": limb.end, "color": limb.color} for limb in drawing.limbs
        ]
    for key, note in drawing.notes.items():
        if key in KEYS:
            raise ValueError(f"drawing: notes: {key!r} is a key of the format")
        top[key] = note
    frames = [_frame(drawing, index, folder) for index in range(count)]
    for key in ("camera", "depths"):
        values = [frame[key] for frame in frames if key in frame]
        if values and all(value == values[0] for value in values):
            top[key] = values[0]
            for frame in frames:
                del frame[key]
    layout = _layout(top, frames)
    try:
        parse(path, layout)
    except FormatError as error:
        raise ValueError(f"drawing: {error.problem}") from None
    atomic.write_bytes(path, layout.encode())


def _check(drawing: Drawing) -> None:
    count, markers, limbs = len(drawing.markers), len(drawing.names), len(drawing.limbs)
    if not count or not markers:
        raise ValueError("drawing: want at least one frame and one marker")
    arrays: dict[str, tuple[Any, tuple[int, ...]]] = {
        "markers": (drawing.markers, (count, markers, 2)),
        "visible": (drawing.visible, (count, markers)),
        "boxes": (drawing.boxes, (count, limbs, 4, 2)),
        "extents": (drawing.extents, (count, limbs, 4)),
        "depths": (drawing.depths, (count, markers)),
    }
    for name, (array, shape) in arrays.items():
        if array is not None and np.shape(array) != shape:
            raise ValueError(f"drawing: {name}: want shape {shape}, got {np.shape(array)}")
        if array is not None and name in ("boxes", "depths") and not np.isfinite(array).all():
            raise ValueError(f"drawing: {name}: want finite numbers")
        if array is not None and np.isinf(array).any():
            raise ValueError(f"drawing: {name}: JSON has no infinity")
    if any(camera.image_size != drawing.image_size for camera in drawing.cameras):
        raise ValueError("drawing: cameras: want the drawing's image size")
    for name in ("images", "segmentations", "masks", "cameras", "holds"):
        if len(getattr(drawing, name)) not in (0, count):
            raise ValueError(f"drawing: {name}: want none or one a frame ({count}), got {len(getattr(drawing, name))}")


def _frame(drawing: Drawing, index: int, folder: Path) -> dict[str, Any]:
    frame: dict[str, Any] = {}
    for key, files in (
        ("image", drawing.images),
        ("segmentation", drawing.segmentations),
        ("mask", drawing.masks),
    ):
        if files:
            frame[key] = _relative(files[index], folder)
    if drawing.holds:
        frame["hold"] = drawing.holds[index]
    frame["xy"] = _rows(drawing.markers[index])
    frame["visible"] = drawing.visible[index].tolist()
    if drawing.boxes is not None:
        frame["boxes"] = drawing.boxes[index].tolist()
    if drawing.extents is not None:
        names = (limb.name for limb in drawing.limbs)
        frame["extents"] = dict(zip(names, _rows(drawing.extents[index]), strict=True))
    if drawing.cameras:
        frame["camera"] = {"matrix": drawing.cameras[index].matrix.tolist()}
    if drawing.depths is not None:
        frame["depths"] = drawing.depths[index].tolist()
    return frame


def _rows(array: NDArray[np.float64]) -> list[list[float] | None]:
    """The rows as lists, null where a row has a NaN."""
    return [None if np.isnan(row).any() else row.tolist() for row in array]


def _relative(file: Path, folder: Path) -> str:
    """``file`` as seen from ``folder``, with forward slashes; absolute where there is no way (another drive)."""
    try:
        return Path(os.path.relpath(file.absolute(), folder)).as_posix()
    except ValueError:
        return file.absolute().as_posix()


def _layout(top: dict[str, Any], frames: list[dict[str, Any]]) -> str:
    """JSON with one line for each key, limb and entry of a frame: readable, and a change shows as few lines."""
    lines = []
    for key, value in top.items():
        if key == "limbs":
            limbs = ",\n".join(f"    {_compact(limb)}" for limb in value)
            lines.append(f'  "limbs": [\n{limbs}\n  ]')
        else:
            lines.append(f"  {_compact(key)}: {_compact(value)}")
    entries = (
        "    {\n" + ",\n".join(f"      {_compact(key)}: {_compact(value)}" for key, value in frame.items()) + "\n    }"
        for frame in frames
    )
    lines.append('  "frames": [\n' + ",\n".join(entries) + "\n  ]")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _compact(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
