"""Exposure sheets as files: which drawing of each level every frame shows, as CSV and as XDTS.

XDTS (exchange Digital Time Sheet, Celsys and Toei Animation, 29 November 2018) is a line of text and then JSON; Clip
Studio Paint and OpenToonz read and write it. Its field 0 holds cells and field 5 camera work; frames count from 0 and
a cell holds until the next one.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pegbar.errors import FormatError
from pegbar.io.atomic import write_bytes
from pegbar.io.camera_cells import CameraCell, camera_tracks, read_camera_work
from pegbar.scene.camera_moves import TRACKS

Cells = tuple[int | None, ...]
_XDTS = "exchangeDigitalTimeSheet Save Data"
_CELLS, _CAMERA_WORK, _VERSION = 0, 5, 5
_HELD = {"", "SYMBOL_HYPHEN", "SYMBOL_TICK_1", "SYMBOL_TICK_2"}
_NOTHING = {"x", "X", "\u00d7", "-", "SYMBOL_NULL_CELL"}
#: Columns of a CSV file, and tracks of camera work, that say how the camera moves.
CAMERA = (*TRACKS, "ease")
_MOST = 1_000_000


@dataclass(frozen=True)
class ExposureSheet:
    """For every level the drawing of each frame from ``first_frame`` on, None where it shows none.

    ``camera`` are the cells of the camera's columns that are not empty, and ``instructions`` what camera work says in
    words that are no numbers.
    """

    levels: dict[str, Cells]
    first_frame: int = 1
    camera: tuple[CameraCell, ...] = ()
    instructions: tuple[str, ...] = ()

    def level(self, name: str | None = None) -> Cells:
        """Return the cells of a level, without a name of the only one; ValueError lists what there is."""
        if name is None and len(self.levels) == 1:
            return next(iter(self.levels.values()))
        known = ", ".join(self.levels)
        if name is None:
            raise ValueError(f"the sheet has several levels, name one: {known}")
        if name not in self.levels:
            raise ValueError(f"the sheet has no level {name!r}: it has {known}")
        return self.levels[name]


def read_exposure_sheet(path: str | Path) -> ExposureSheet:
    """Read an exposure sheet, CSV or XDTS as its content says.

    Raises FormatError, with the line or the place in the file, for what is neither, has no cells, or has a cell that
    names no drawing.

    Examples
    --------
    >>> import tempfile
    >>> sheet = Path(tempfile.mkdtemp()) / "sheet.csv"
    >>> _ = sheet.write_text("frame,A\\n1,1\\n3,2\\n6,x\\n")
    >>> read_exposure_sheet(sheet).level("A")
    (1, 1, 2, 2, 2)
    """
    path = Path(path)
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError(path, "not UTF-8 text", byte=error.start) from None
    return _read_xdts(path, text) if text.startswith(_XDTS) else _read_csv(path, text)


def write_exposure_sheet(path: str | Path, sheet: ExposureSheet) -> None:
    """Write ``sheet`` as CSV, or as XDTS where the name ends so; complete or not at all."""
    is_xdts = Path(path).suffix.lower() == ".xdts"
    write_bytes(path, (xdts_text(sheet, Path(path).stem) if is_xdts else csv_text(sheet)).encode())


def csv_text(sheet: ExposureSheet) -> str:
    """Return ``sheet`` as CSV: a row a frame, x where a level shows nothing."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    moves = {(cell.frame, cell.column): cell.text for cell in sheet.camera}
    tracks = [column for column in CAMERA if any(cell.column == column for cell in sheet.camera)]
    table.writerow(["frame", *sheet.levels, *tracks])
    for row in range(_length(sheet)):
        frame = sheet.first_frame + row
        cells = [column[row] if row < len(column) else None for column in sheet.levels.values()]
        shown = ["x" if cell is None else cell for cell in cells]
        table.writerow([frame, *shown, *(moves.get((frame, track), "") for track in tracks)])
    return text.getvalue()


def xdts_text(sheet: ExposureSheet, name: str) -> str:
    """Return ``sheet`` as XDTS, its first frame being frame 0 there."""
    tracks = []
    for number, column in enumerate(sheet.levels.values()):
        cells: list[int | None] = [*column, None]
        changes = [row for row, cell in enumerate(cells) if not row or cell != cells[row - 1] or row == len(column)]
        frames = [{"data": [{"id": 0, "values": [_symbol(cells[row])]}], "frame": row} for row in changes]
        tracks.append({"frames": frames, "trackNo": number})
    table: dict[str, Any] = {
        "fields": [{"fieldId": _CELLS, "tracks": tracks}],
        "duration": _length(sheet),
        "name": name,
        "timeTableHeaders": [{"fieldId": _CELLS, "names": list(sheet.levels)}],
    }
    if work := camera_tracks(sheet.camera, sheet.first_frame):
        table["fields"].append({"fieldId": _CAMERA_WORK, "tracks": [track for _, track in work]})
        table["timeTableHeaders"].append({"fieldId": _CAMERA_WORK, "names": [name for name, _ in work]})
    content = {"header": {"cut": "1", "scene": "1"}, "timeTables": [table], "version": _VERSION}
    return f"{_XDTS}\n{json.dumps(content, indent=1, ensure_ascii=False)}\n"


def _symbol(cell: int | None) -> str:
    return "SYMBOL_NULL_CELL" if cell is None else str(cell)


def _length(sheet: ExposureSheet) -> int:
    return max(map(len, sheet.levels.values()), default=0)


def _read_csv(path: Path, text: str) -> ExposureSheet:
    first = text.partition("\n")[0]
    delimiter = max(",;\t", key=first.count)
    rows = [(line, row) for line, row in enumerate(csv.reader(io.StringIO(text), delimiter=delimiter), 1) if any(row)]
    if not rows or rows[0][1][0].strip().lower() != "frame":
        raise FormatError(path, 'no exposure sheet: want a first line like "frame,drawing", or XDTS', line=1)
    names = [name.strip() for name in rows[0][1][1:]]
    if len(set(names)) < len(names) or not all(names) or not set(names) - {*CAMERA}:
        raise FormatError(path, f"want a name for every level, each once, got {', '.join(names)}", line=1)
    columns: dict[str, list[int | None]] = {name: [] for name in names if name not in CAMERA}
    start: int | None = None
    camera: list[CameraCell] = []
    for line, row in rows[1:]:
        frame = _frame(path, row[0], line)
        start = frame if start is None else start
        length = len(next(iter(columns.values())))
        if frame < start + length or frame - start > _MOST:
            raise FormatError(path, f"frame {frame} does not come after the one before", line=line)
        for name, column in columns.items():
            _hold(column, frame - start)
            place = names.index(name) + 1
            column.append(_cell(path, row[place] if place < len(row) else "", column, f"frame {frame}", line))
        named = [(name, text.strip()) for name, text in zip(names, row[1:], strict=False) if name in CAMERA]
        camera += [CameraCell(frame, name, text, line) for name, text in named if text]
    if start is None:
        raise FormatError(path, "the sheet has no frames", line=1)
    return ExposureSheet(_levels(path, columns), start, tuple(camera))


def _frame(path: Path, text: str, line: int) -> int:
    try:
        return int(text)
    except ValueError:
        raise FormatError(path, f"want a frame number, got {text!r}", line=line) from None


def _hold(column: list[int | None], length: int) -> None:
    """Let the last cell stay until ``length`` frames are there."""
    column += [column[-1] if column else None] * (length - len(column))


def _cell(path: Path, text: str, before: Sequence[int | None], where: str, line: int | None) -> int | None:
    """The drawing that a cell names: a number, or a name with its number last, like A12 or d.0012.png."""
    text = text.strip()
    if text in _HELD:
        return before[-1] if before else None
    if text in _NOTHING:
        return None
    found = re.fullmatch(r"(?:.*?[^\d])??(-?\d+)(\.[A-Za-z]+)?", text)
    if not found:
        raise FormatError(path, f"{where}: {text!r} names no drawing: want a number", line=line)
    return int(found[1])


def _levels(path: Path, columns: dict[str, list[int | None]]) -> dict[str, Cells]:
    """Levels without what they do not show at their ends."""
    found: dict[str, Cells] = {}
    for name, column in columns.items():
        last = max((row for row, cell in enumerate(column) if cell is not None), default=-1)
        if last >= 0:
            found[name] = tuple(column[: last + 1])
    if not found:
        raise FormatError(path, "the sheet shows no drawing")
    return found


def _read_xdts(path: Path, text: str) -> ExposureSheet:
    try:
        table: dict[str, Any] = json.loads(text[len(_XDTS) :])["timeTables"][0]
        fields = {int(field["fieldId"]): field["tracks"] for field in table["fields"]}
        names = {int(head["fieldId"]): head["names"] for head in table["timeTableHeaders"]}
        duration = min(int(table["duration"]), _MOST)
        columns: dict[str, list[int | None]] = {}
        for track in fields.get(_CELLS, []):
            number = int(track["trackNo"])
            name = str(names[_CELLS][number]).strip() or f"level {number + 1}"
            while name in columns:
                name += "_"
            columns[name] = _track(path, track, duration, name)
        camera, instructions = read_camera_work(fields.get(_CAMERA_WORK, []), names.get(_CAMERA_WORK, []), duration)
    except (ValueError, KeyError, IndexError, TypeError, AttributeError) as error:
        if isinstance(error, FormatError):
            raise
        reason = f"{type(error).__name__} {error}" if not isinstance(error, json.JSONDecodeError) else str(error)
        raise FormatError(path, f"the XDTS is damaged: {reason}") from None
    return ExposureSheet(_levels(path, columns), 1, camera, instructions)


def _track(path: Path, track: dict[str, Any], duration: int, name: str) -> list[int | None]:
    column: list[int | None] = []
    for entry in sorted(track["frames"], key=lambda entry: int(entry["frame"])):
        row, values = int(entry["frame"]), entry["data"][0].get("values", [])
        # Clip Studio Paint writes what is shown before the first frame at negative ones.
        before = column if column else [None]
        cell = _cell(path, str(values[0]) if values else "SYMBOL_NULL_CELL", before, f"{name}, frame {row + 1}", None)
        if row < 0:
            column = [cell]
            continue
        if row >= duration:
            break
        _hold(column, row)
        column[row:] = [cell]
    _hold(column, duration)
    return column[:duration]
