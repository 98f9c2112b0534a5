"""Annotated drawings: joint marks, limbs and their colours, camera and depths in one JSON file.

The format is described in docs/file-formats.md. Writing what was read gives the same drawing.
"""

from __future__ import annotations

import difflib
import os
from pathlib import Path
from typing import Any

import numpy as np

from pegbar.errors import DegenerateError, FormatError
from pegbar.io import animated_drawings, coco, places
from pegbar.io.places import Misplaced, Place, items, member, number, table, text, whole
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.drawing import Color, Drawing, Limb

_Path = str | os.PathLike[str]
#: The longest side a picture may have.
MAX_SIDE = 1 << 20
#: The keys of the file itself; true: needed. Others are notes.
KEYS = {
    "markers": True,
    "image_size": True,
    "fps": False,
    "loops": False,
    "limbs": False,
    "camera": False,
    "depths": False,
    "frames": True,
}
_FRAME = {
    "image": False,
    "segmentation": False,
    "mask": False,
    "xy": True,
    "visible": False,
    "extents": False,
    "boxes": False,
    "camera": False,
    "depths": False,
    "hold": False,
    "note": False,
}


def read_annotations(path: _Path) -> Drawing:
    """Read an annotated drawing: pegbar's own JSON, COCO keypoints (JSON) or an AnimatedDrawings ``char_cfg.yaml``.

    What the file is is told from its content. For COCO files with several persons or sizes see
    ``pegbar.io.coco.read_coco_keypoints``.

    Parameters
    ----------
    path : path
        The annotation file. Picture paths in it are relative to it.

    Returns
    -------
    Drawing

    Raises
    ------
    FormatError
        For anything wrong in the file; it names path, line and place (``frames[3].xy``).
    OSError
        When the file cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "dot.json"
    >>> _ = file.write_text('{"markers": ["head"], "image_size": [9, 9], "frames": [{"xy": [[4, 5]]}]}')
    >>> read_annotations(file).markers
    array([[[4., 5.]]])
    """
    return parse(path, _read_text(path))


def parse(path: _Path, content: str) -> Drawing:
    """As ``read_annotations``, for a file whose text was read already."""
    if not content.lstrip().startswith(("{", "[")):
        return animated_drawings.parse(path, content)
    value = places.parse_json(path, content)
    try:
        if isinstance(value, dict) and "annotations" in value:
            return coco.parse(path, value)
        return _drawing(Path(path).parent, value)
    except Misplaced as problem:
        raise problem.at(path, content) from None


def _read_text(path: _Path) -> str:
    data = Path(path).read_bytes()
    try:
        content = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError(path, "not text in UTF-8", byte=error.start) from None
    if not content.strip():
        raise FormatError(path, "the file is empty")
    return content


def _drawing(folder: Path, value: Any) -> Drawing:
    if not isinstance(value, dict):
        raise Misplaced((), f"want an object, got {places.brief(value)}")
    notes = {key: note for key, note in value.items() if key not in KEYS and _is_note(note)}
    top = member({key: entry for key, entry in value.items() if key not in notes}, (), KEYS)
    names = _names(top["markers"])
    width, height = (
        whole(side, ("image_size", i), low=1, high=MAX_SIDE) for i, side in enumerate(_pair(top["image_size"]))
    )
    limbs = _limbs(top.get("limbs", []), names)
    frames = items(top["frames"], ("frames",))
    if not frames:
        raise Misplaced(("frames",), "want at least one frame")
    for index, frame in enumerate(frames):
        member(frame, ("frames", index), _FRAME)
    markers, visible = _markers(frames, len(names))
    fps, loops = top.get("fps"), top.get("loops", False)
    if not isinstance(loops, bool):
        raise Misplaced(("loops",), f"want true or false, got {places.brief(loops)}")
    boxes = _all_or_none(frames, "boxes", lambda entry, place: table(entry, place, (len(limbs), 4, 2)))
    extents = _all_or_none(frames, "extents", lambda entry, place: _extents(entry, place, limbs))
    depths = _depths(top, frames, len(names))
    holds = [whole(f.get("hold", 1), ("frames", i, "hold"), low=1, high=100_000) for i, f in enumerate(frames)]
    return Drawing(
        names=names,
        markers=markers,
        visible=visible,
        image_size=(width, height),
        frame_rate=None if fps is None else number(fps, ("fps",), low=1e-3, high=1e5),
        images=_files(folder, frames, "image"),
        segmentations=_files(folder, frames, "segmentation"),
        limbs=limbs,
        boxes=None if boxes is None else np.stack(boxes),
        cameras=_cameras(top, frames, (width, height)),
        depths=depths,
        loops=loops,
        extents=None if extents is None else np.stack(extents),
        masks=_files(folder, frames, "mask"),
        holds=() if all(hold == 1 for hold in holds) else tuple(holds),
        notes=notes,
    )


def _is_note(value: Any) -> bool:
    return isinstance(value, str) or (isinstance(value, dict) and all(isinstance(word, str) for word in value.values()))


def _pair(value: Any) -> list[Any]:
    sides = items(value, ("image_size",))
    if len(sides) != 2:
        raise Misplaced(("image_size",), f"want width and height, got {places.brief(value)}")
    return sides


def _names(value: Any) -> tuple[str, ...]:
    names = [text(name, ("markers", index)) for index, name in enumerate(items(value, ("markers",)))]
    if not names:
        raise Misplaced(("markers",), "want at least one marker")
    for index, name in enumerate(names):
        if name in names[:index]:
            raise Misplaced(("markers", index), f"the marker {name!r} stands twice")
    return tuple(names)


def _limbs(value: Any, names: tuple[str, ...]) -> tuple[Limb, ...]:
    limbs: list[Limb] = []
    keys = {"name": True, "from": True, "to": True, "color": False}
    for index, entry in enumerate(items(value, ("limbs",))):
        place: Place = ("limbs", index)
        limb = member(entry, place, keys)
        name = text(limb["name"], (*place, "name"))
        if name in (other.name for other in limbs):
            raise Misplaced((*place, "name"), f"the limb {name!r} stands twice")
        for end in ("from", "to"):
            if limb[end] not in names:
                near = difflib.get_close_matches(str(limb[end]), names, 1)
                hint = f' (did you mean "{near[0]}"?)' if near else ""
                raise Misplaced((*place, end), f"no marker is called {places.brief(limb[end])}{hint}")
        color = _color(limb.get("color"), (*place, "color"))
        for other in limbs:
            if color is not None and color == other.color:
                raise Misplaced((*place, "color"), f"the limb {name!r} has the colour of {other.name!r}")
        limbs.append(Limb(name, limb["from"], limb["to"], color))
    return tuple(limbs)


def _color(value: Any, place: Place) -> Color | None:
    if value is None:
        return None
    parts = items(value, place)
    if len(parts) != 3:
        raise Misplaced(place, f"want red, green and blue, got {places.brief(value)}")
    red, green, blue = (whole(part, (*place, i), low=0, high=255) for i, part in enumerate(parts))
    if red == green == blue == 0:
        raise Misplaced(place, "black is the background, no limb's colour")
    return red, green, blue


def _markers(frames: list[Any], count: int) -> tuple[Any, Any]:
    """Positions (F, N, 2) and visibility (F, N); a marker that is null is NaN and not visible."""
    markers = np.full((len(frames), count, 2), np.nan)
    visible = np.ones((len(frames), count), bool)
    for index, frame in enumerate(frames):
        place: Place = ("frames", index, "xy")
        points = items(frame["xy"], place)
        if len(points) != count:
            raise Misplaced(place, f"want {count} points, one a marker, got {len(points)}")
        flags = items(frame.get("visible", [True] * count), ("frames", index, "visible"))
        if len(flags) != count or not all(isinstance(flag, bool) for flag in flags):
            raise Misplaced(("frames", index, "visible"), f"want {count} times true or false")
        for which, (point, flag) in enumerate(zip(points, flags, strict=True)):
            if point is not None:
                markers[index, which] = table(point, (*place, which), (2,))
            elif flag and "visible" in frame:
                raise Misplaced((*place, which), "a visible marker needs a place")
            visible[index, which] = flag and point is not None
    return markers, visible


def _all_or_none(frames: list[Any], key: str, read: Any) -> list[Any] | None:
    """What each frame says under ``key``, or None when no frame has it; some with and some without is an error."""
    having = [frame.get(key) is not None for frame in frames]
    if not any(having):
        return None
    if not all(having):
        raise Misplaced(("frames", having.index(False)), f"lacks {key!r}, which other frames have")
    return [read(frame[key], ("frames", index, key)) for index, frame in enumerate(frames)]


def _files(folder: Path, frames: list[Any], key: str) -> tuple[Path, ...]:
    return tuple(_all_or_none(frames, key, lambda entry, place: folder / text(entry, place)) or ())


def _extents(value: Any, place: Place, limbs: tuple[Limb, ...]) -> Any:
    entry = member(value, place, dict.fromkeys((limb.name for limb in limbs), False))
    extents = np.full((len(limbs), 4), np.nan)
    for index, limb in enumerate(limbs):
        if entry.get(limb.name) is not None:
            extents[index] = table(entry[limb.name], (*place, limb.name), (4,))
    return extents


def _depths(top: dict[str, Any], frames: list[Any], count: int) -> Any:
    """Depths (F, N) from every frame, or else from the top, or None."""
    shared = None
    if top.get("depths") is not None:
        place: Place = ("depths",)
        shared = top["depths"]
        if isinstance(shared, dict):
            shared, place = member(shared, place, {"values": True, "note": False})["values"], ("depths", "values")
        shared = table(shared, place, (count,))
    if shared is None:
        depths = _all_or_none(frames, "depths", lambda entry, place: table(entry, place, (count,)))
        return None if depths is None else np.stack(depths)
    own = [frame.get("depths") for frame in frames]
    return np.stack([shared if d is None else table(d, ("frames", i, "depths"), (count,)) for i, d in enumerate(own)])


def _cameras(top: dict[str, Any], frames: list[Any], size: tuple[int, int]) -> tuple[PerspectiveCamera, ...]:
    """One camera a frame, its own or the top's, or none."""
    if top.get("camera") is None:
        return tuple(_all_or_none(frames, "camera", lambda entry, place: _camera(entry, place, size)) or ())
    shared = _camera(top["camera"], ("camera",), size)
    own = [frame.get("camera") for frame in frames]
    return tuple(shared if c is None else _camera(c, ("frames", i, "camera"), size) for i, c in enumerate(own))


def _camera(value: Any, place: Place, size: tuple[int, int]) -> PerspectiveCamera:
    entry = member(value, place, {"matrix": True, "note": False})
    try:
        return PerspectiveCamera(table(entry["matrix"], (*place, "matrix"), (3, 4)), size)
    except DegenerateError as error:
        raise Misplaced((*place, "matrix"), str(error).removeprefix("matrix: ")) from None
