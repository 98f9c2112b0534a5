"""Finds what a shot file names: sequences, outputs that harm nothing, and which marks belong to which drawing."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from pegbar.errors import ShotError, describe
from pegbar.io.camera_cells import camera_moves
from pegbar.io.exposure import Exposure
from pegbar.io.exposure_sheet import read_exposure_sheet
from pegbar.io.frames import PICTURE_SUFFIXES
from pegbar.io.numbers import format_frames
from pegbar.io.sequence import FrameSequence
from pegbar.scene.camera_moves import CameraMoves
from pegbar.scene.drawing import Drawing
from pegbar.shot.model import DrawingSection

T = TypeVar("T")
OUTPUT_SUFFIXES: dict[str, tuple[str, ...]] = {
    "frames": PICTURE_SUFFIXES,
    "depth": (".exr",),
    "depth_picture": (".png",),
    "holdout": (".png", ".tif", ".tiff"),
    "visible": (".png", ".tif", ".tiff"),
    "layers": (".exr",),
}


class KeyedError(ValueError):
    """A wrong value under a key of its own."""

    def __init__(self, key: tuple[str, ...], problem: str) -> None:
        self.key = key
        super().__init__(problem)


@dataclass
class Problems:
    """Collects what is wrong, each with its place in the shot file ``source``."""

    source: str
    lines: Mapping[tuple[str, ...], int]
    found: list[str] = field(default_factory=list)

    def call(self, key: str, function: Callable[..., T], *arguments: object) -> T | None:
        """Return what ``function`` returns, or None and note why it did not."""
        try:
            return function(*arguments)
        except (ValueError, OSError) as error:
            path = getattr(error, "key", ()) or tuple(key.split("."))
            place = f"{place_of(self.source, self.lines, path)}: {'.'.join(path)}"
            self.found += [f"{place}: {line}" for line in getattr(error, "problems", [describe(error)])]
            return None


def place_of(source: str, lines: Mapping[tuple[str, ...], int], key: tuple[str, ...]) -> str:
    """Return where ``key`` stands in ``source``: at its line, or at that of the section it would be in."""
    line = next((lines[key[:size]] for size in range(len(key), 0, -1) if key[:size] in lines), None)
    return f"{source}:{line}" if line else source


def find_input(folder: Path, pattern: str | None) -> FrameSequence | None:
    """Return the sequence of files that ``pattern`` names, None for no pattern; FileNotFoundError for no file."""
    if not pattern:
        return None
    sequence = FrameSequence.parse(str(folder / pattern))
    if not sequence.numbers:
        raise FileNotFoundError(f"no such file: {folder / pattern}")
    return sequence


def find_exposure(drawing: DrawingSection, folder: Path, drawings: FrameSequence) -> Exposure:
    """Return which drawing every frame shows; ValueError or OSError for a sheet that cannot be read or lacks it."""
    if drawing.exposure is None:
        return Exposure.of(drawing.hold, drawings.numbers)
    sheet = read_exposure_sheet(folder / drawing.exposure)
    try:
        cells = sheet.level(drawing.level)
    except ValueError as error:
        raise KeyedError(("drawing", "level"), f"{drawing.exposure}: {error}") from None
    if missing := sorted({cell for cell in cells if cell is not None} - {*drawings.numbers}):
        raise ValueError(f"{drawing.exposure} shows drawing {format_frames(missing)}: there is no such picture")
    return Exposure.of_cells(cells, sheet.first_frame)


def find_moves(drawing: DrawingSection, folder: Path) -> CameraMoves | None:
    """Return the moves of the sheet's camera, None where there are none; ShotError with every wrong row."""
    if drawing.exposure is None or drawing.camera == "drawn":
        return None
    try:
        sheet = read_exposure_sheet(folder / drawing.exposure)
    except (ValueError, OSError):
        # `find_exposure` tells.
        return None
    moves, problems = camera_moves(sheet.camera, drawing.exposure)
    if problems:
        raise ShotError(problems)
    return moves


def plan_output(folder: Path, key: str, pattern: str) -> FrameSequence:
    """Return the sequence that output ``key`` is written to; ValueError for a pattern that cannot hold it."""
    suffixes = OUTPUT_SUFFIXES[key]
    if Path(pattern).suffix.lower() not in suffixes:
        raise ValueError(f'want a name that ends in {", ".join(suffixes)}, got "{pattern}"')
    if not re.search(r"#|@|%0?\d*d", Path(pattern).name):
        raise ValueError(f'want a pattern with a frame number, like "final.####.png", got "{pattern}"')
    # Files that are there already must not decide how new frames are called.
    sequence = FrameSequence.parse(folder / pattern)
    return FrameSequence(sequence.folder, sequence.prefix, sequence.suffix, sequence.padding, ())


def check_clash(output: FrameSequence, others: Mapping[str, FrameSequence | None]) -> None:
    """Refuse an output whose files are those of one of ``others``: nothing that was given is ever replaced."""
    for name, other in others.items():
        if other is not None and _files(output) == _files(other):
            raise ValueError(f"{output.pattern} is also {name}: writing would replace it")


def _files(sequence: FrameSequence) -> tuple[Path, str, str]:
    return sequence.folder.resolve(), sequence.prefix, sequence.suffix


def match_marks(annotations: Drawing, drawings: FrameSequence, settings: DrawingSection) -> dict[int, int]:
    """Return which frame of the annotations belongs to each drawing number.

    By file name where the annotations name pictures of the sequence; else from ``first_marked`` on; else in order,
    which needs as many annotated frames as there are drawings, missing ones counted.
    """
    count, numbers = len(annotations.markers), drawings.numbers
    named = {path.name: index for index, path in enumerate(annotations.images)}
    by_name = {number: named[drawings.path(number).name] for number in numbers if drawings.path(number).name in named}
    if by_name:
        return by_name
    if settings.first_marked is not None:
        return {settings.first_marked + index: index for index in range(count)}
    if (settings.hold == "sparse" or settings.exposure is not None) and len(numbers) == count:
        return {number: index for index, number in enumerate(numbers)}
    if settings.hold != "sparse" and numbers[-1] - numbers[0] + 1 == count:
        return {numbers[0] + index: index for index in range(count)}
    raise ValueError(
        f"{count} frames are marked, the drawings are {format_frames(numbers)}: name the pictures in the annotations, "
        "or say with drawing.first_marked which drawing the first marks belong to"
    )
