"""Camera moves as the cells of an exposure sheet: read as keys, written as cells, and XDTS camera work."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from pegbar.scene.camera_moves import EASES, TRACKS, CameraKey, CameraMoves, Track

_COLUMNS = (*TRACKS, "ease")
_NUMBER = r"[-+]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][-+]?\d+)?"
# Camera work in words that are numbers: "zoom 1.5", "pan_x = 20, pan_y = -4".
_SAID = re.compile(rf"(pan_x|pan_y|zoom|rotate)\s*[=:]?\s*({_NUMBER})(?:\s*[,;]\s*|\s+|$)", re.IGNORECASE)


@dataclass(frozen=True)
class CameraCell:
    """What a sheet says at ``frame`` in one of the camera's columns; ``line`` of the file, where it has lines."""

    frame: int
    column: str
    text: str
    line: int | None = field(default=None, compare=False)


def camera_moves(cells: Iterable[CameraCell], source: str) -> tuple[CameraMoves | None, list[str]]:
    """Return the moves that ``cells`` say, None for none, and every wrong cell as ``source:line: what is wrong``."""
    tracks: dict[Track, dict[int, float]] = {track: {} for track in TRACKS}
    eases: dict[int, CameraCell] = {}
    problems: list[str] = []
    for cell in cells:
        try:
            if cell.column == "ease":
                _check_ease(cell)
                eases[cell.frame] = cell
            else:
                track = next(track for track in TRACKS if track == cell.column)
                tracks[track][cell.frame] = _number(cell)
        except ValueError as error:
            problems.append(f"{_place(source, cell)}: {error}")
    keyed = {frame for values in tracks.values() for frame in values}
    for frame, cell in eases.items():
        if frame not in keyed and not problems:
            problems.append(f"{_place(source, cell)}: ease: no pan, zoom or rotation begins there: write its value")
    if problems or not keyed:
        return None, problems
    words = {frame: next(ease for ease in EASES if ease == cell.text.lower()) for frame, cell in eases.items()}
    keys = {
        track: tuple(CameraKey(frame, values[frame], words.get(frame, "linear")) for frame in sorted(values))
        for track, values in tracks.items()
        if values
    }
    return CameraMoves(keys), []


def camera_cells(moves: CameraMoves) -> tuple[CameraCell, ...]:
    """Return the cells that say ``moves``, by frame; `camera_moves` gives them back."""
    found: list[CameraCell] = []
    for frame in moves.frames:
        ease = "linear"
        for track in TRACKS:
            for key in moves.tracks.get(track, ()):
                if key.frame == frame:
                    text = f"{key.value:.0f}" if key.value.is_integer() else repr(key.value)
                    found.append(CameraCell(frame, track, text))
                    ease = key.ease
        if ease != "linear":
            found.append(CameraCell(frame, "ease", ease))
    return tuple(found)


def camera_tracks(cells: Sequence[CameraCell], first_frame: int) -> list[tuple[str, dict[str, Any]]]:
    """Return XDTS tracks of camera work, a column each, with their names."""
    found: list[tuple[str, dict[str, Any]]] = []
    for column in _COLUMNS:
        own = [cell for cell in cells if cell.column == column]
        frames = [{"data": [{"id": 0, "values": [cell.text]}], "frame": cell.frame - first_frame} for cell in own]
        if frames:
            found.append((column, {"frames": frames, "trackNo": len(found)}))
    return found


def read_camera_work(
    tracks: Sequence[dict[str, Any]], names: Sequence[str], duration: int
) -> tuple[tuple[CameraCell, ...], tuple[str, ...]]:
    """Return XDTS camera work as cells, and as instructions what is no numbers; film frame 1 is its frame 0.

    Numbers are those of a track that is called like a column, and texts like ``zoom 1.5`` or ``pan_x=20, pan_y=4``.
    """
    cells: dict[tuple[int, str], CameraCell] = {}
    words: list[str] = []
    for track in tracks:
        number = int(track["trackNo"])
        column = str(names[number]).strip().lower() if number < len(names) else ""
        for entry in track["frames"]:
            frame = int(entry["frame"]) + 1
            for text in (str(value).strip() for data in entry["data"] for value in data.get("values", [])):
                said = _said(column, text)
                if not said and text and not text.startswith("SYMBOL_"):
                    words.append(text)
                for name, value in said.items() if 1 <= frame <= duration else ():
                    cells[frame, name] = CameraCell(frame, name, value)
    return tuple(cells[place] for place in sorted(cells)), tuple(dict.fromkeys(words))


def _said(column: str, text: str) -> dict[str, str]:
    if column in TRACKS and re.fullmatch(_NUMBER, text):
        return {column: text}
    if column == "ease" and text.lower() in EASES:
        return {column: text}
    found: dict[str, str] = defaultdict(str)
    place = 0
    while place < len(text):
        part = _SAID.match(text, place)
        if part is None:
            return {}
        found[part[1].lower()], place = part[2], part.end()
    return found


def _check_ease(cell: CameraCell) -> None:
    if cell.text.lower() not in EASES:
        raise ValueError(f"ease: want {', '.join(EASES)}, got {cell.text!r}")


def _number(cell: CameraCell) -> float:
    text = cell.text
    value = float(text.replace(",", ".")) if re.fullmatch(_NUMBER, text) else math.nan
    if not math.isfinite(value):
        raise ValueError(f"{cell.column}: want a number, got {text!r}")
    if cell.column == "zoom" and value <= 0:
        raise ValueError(f"zoom: want a number above 0, got {text!r}")
    return value


def _place(source: str, cell: CameraCell) -> str:
    return f"{source}:{cell.line}: frame {cell.frame}" if cell.line else f"{source}: frame {cell.frame}"
