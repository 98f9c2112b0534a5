"""A shot made ready for work: which drawing, marks and passes belong to each frame. Nothing large is read here."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import ShotError
from pegbar.io.annotations import read_annotations
from pegbar.io.exposure import Exposure
from pegbar.io.numbers import parse_frames
from pegbar.io.sequence import FrameSequence
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.drawing import Drawing
from pegbar.shot.load import key_lines, load_shot
from pegbar.shot.model import ShotFile, parse_color

T = TypeVar("T")
OUTPUTS = ("frames", "depth", "depth_picture", "holdout")


@dataclass(frozen=True, eq=False)
class Palette:
    """Which limb every colour of the label pictures stands for: ``labels[i]`` is limb + 1 of ``colors[i]``."""

    colors: NDArray[np.uint8]
    labels: NDArray[np.uint8]
    background: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Shot:
    """A validated shot with its sequences found, its marks read and its frames known."""

    settings: ShotFile
    folder: Path
    frames: tuple[int, ...]
    drawings: FrameSequence
    exposure: Exposure
    labels: FrameSequence | None
    drawing_depth: FrameSequence | None
    beauty: FrameSequence | None
    depth: FrameSequence | None
    annotations: Drawing | None
    palette: Palette
    outputs: dict[str, FrameSequence]

    def output(self, key: str, frame: int) -> Path | None:
        """Return where ``frame`` of ``[output] key`` goes, or None where the shot file asks for none."""
        return self.outputs[key].path(frame) if key in self.outputs else None

    def annotation_index(self, frame: int) -> int:
        """Return which frame of the annotations belongs to shot frame ``frame``.

        Annotations that name their pictures are matched by file name; else they follow the drawings in order.
        ValueError where there is none.
        """
        assert self.annotations is not None
        number = self.exposure.drawing(frame)
        names = [path.name for path in self.annotations.images]
        if (name := self.drawings.path(number).name) in names:
            return names.index(name)
        numbers = self.drawings.numbers
        if number in numbers and numbers.index(number) < len(self.annotations.markers):
            return numbers.index(number)
        raise ValueError(f"frame {frame}: the annotations have no marks for drawing {number}")


def open_shot(path: str | Path) -> Shot:
    """Read the shot file at ``path`` and find all that it names.

    Raises ShotError with every problem at once (missing sequences, unknown limbs, unusable frames), each with its
    line; FormatError or FileNotFoundError for an unreadable shot file.
    """
    path = Path(path)
    text = path.read_text(encoding="utf-8-sig", errors="replace") if path.is_file() else ""
    return plan_shot(load_shot(path), path.absolute().parent, str(path), text)


def plan_shot(settings: ShotFile, folder: Path, source: str = "options", text: str = "") -> Shot:
    """Return the shot of validated ``settings`` whose paths start at ``folder``; see `open_shot`."""
    finder = _Finder(folder, source, key_lines(text))
    drawing, passes = settings.drawing, settings.passes
    drawings = finder.sequence("drawing.frames", drawing.frames)
    labels = finder.sequence("drawing.labels", drawing.labels)
    drawing_depth = finder.sequence("drawing.depth", drawing.depth)
    beauty = finder.sequence("passes.beauty", passes.beauty if passes else None)
    depth = finder.sequence("passes.depth", passes.depth if passes else None)
    annotations = finder.call("drawing.annotations", _read_marks, folder, drawing.annotations)
    palette = finder.call("drawing.palette", _palette, settings, annotations)
    if settings.camera:
        size = settings.shot.size or (annotations.image_size if annotations else (1, 1))
        finder.call("camera.matrix", PerspectiveCamera, settings.camera.matrix, size)
    patterns = {key: getattr(settings.output, key) for key in OUTPUTS}
    outputs = {key: finder.call(f"output.{key}", _output, folder, text) for key, text in patterns.items() if text}
    if drawings is not None:
        exposure = finder.call("drawing.hold", Exposure.of, drawing.hold, drawings.numbers)
        frames = finder.call("shot.frames", _frames, settings, drawings, exposure, beauty)
    if finder.problems:
        raise ShotError(finder.problems)
    assert drawings is not None
    assert palette is not None
    assert exposure is not None
    assert frames is not None
    return Shot(
        settings,
        folder,
        frames,
        drawings,
        exposure,
        labels,
        drawing_depth,
        beauty,
        depth or beauty,
        annotations,
        palette,
        {key: sequence for key, sequence in outputs.items() if sequence},
    )


class _Finder:
    """Collects what is wrong, each with its place in the shot file."""

    def __init__(self, folder: Path, source: str, lines: dict[tuple[str, ...], int]) -> None:
        self.folder, self.source, self.lines = folder, source, lines
        self.problems: list[str] = []

    def call(self, key: str, function: Callable[..., T], *arguments: object) -> T | None:
        try:
            return function(*arguments)
        except (ValueError, OSError) as error:
            path = getattr(error, "key", ()) or tuple(key.split("."))
            line = self.lines.get(path)
            place = f"{self.source}:{line}" if line else self.source
            self.problems.append(f"{place}: {'.'.join(path)}: {error}")
            return None

    def sequence(self, key: str, pattern: str | None) -> FrameSequence | None:
        return self.call(key, _find_sequence, self.folder, pattern) if pattern else None


class _KeyedError(ValueError):
    """A wrong value under a key of its own."""

    def __init__(self, key: tuple[str, ...], problem: str) -> None:
        self.key = key
        super().__init__(problem)


def _find_sequence(folder: Path, pattern: str) -> FrameSequence:
    sequence = FrameSequence.parse(str(folder / pattern))
    if not sequence.numbers:
        raise FileNotFoundError(f"no such file: {folder / pattern}")
    return sequence


def _output(folder: Path, pattern: str) -> FrameSequence:
    # A folder of that name, or files that are there already, must not decide how new frames are called.
    if not re.search(r"#|@|%0?\d*d", Path(pattern).name):
        raise ValueError(f'want a pattern with a frame number, like "final.####.png", got "{pattern}"')
    sequence = FrameSequence.parse(folder / pattern)
    return FrameSequence(sequence.folder, sequence.prefix, sequence.suffix, sequence.padding, ())


def _read_marks(folder: Path, name: str | None) -> Drawing | None:
    return read_annotations(folder / name) if name else None


def _palette(settings: ShotFile, annotations: Drawing | None) -> Palette:
    limbs = annotations.limbs if annotations else ()
    order = {limb.name: index for index, limb in enumerate(limbs)}
    known = {limb.color: index + 1 for index, limb in enumerate(limbs) if limb.color}
    for text, name in settings.drawing.palette.items():
        if name not in order:
            known_names = ", ".join(order) or "none: there are no annotations"
            raise _KeyedError(("drawing", "palette", text), f'"{name}" is no limb of the annotations ({known_names})')
        known[parse_color(text)] = order[name] + 1
    background = [parse_color(text) for text in settings.drawing.background]
    return Palette(
        np.array(list(known), np.uint8).reshape(-1, 3),
        np.array(list(known.values()), np.uint8),
        np.array(background, np.uint8).reshape(-1, 3),
    )


def _frames(
    settings: ShotFile, drawings: FrameSequence, exposure: Exposure, beauty: FrameSequence | None
) -> tuple[int, ...]:
    if settings.shot.frames:
        return tuple(parse_frames(settings.shot.frames))
    return tuple(beauty.numbers if beauty else exposure.frames)
