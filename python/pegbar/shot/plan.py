"""A shot made ready for work: which drawing, marks and passes belong to each frame. Nothing large is kept here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import ShotError
from pegbar.io.exposure import Exposure
from pegbar.io.frames import read_picture
from pegbar.io.numbers import parse_frames
from pegbar.io.sequence import FrameSequence
from pegbar.layer.matte import Mode
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.camera_moves import CameraMoves
from pegbar.scene.drawing import Drawing
from pegbar.scene.film_view import FilmView
from pegbar.shot.find import (
    KeyedError,
    Problems,
    check_clash,
    find_exposure,
    find_input,
    find_moves,
    match_marks,
    place_of,
    plan_output,
)
from pegbar.shot.load import key_lines, load_shot
from pegbar.shot.marks import read_marks
from pegbar.shot.model import ShotFile, parse_color

OUTPUTS = ("frames", "depth", "depth_picture", "holdout", "visible", "layers")


@dataclass(frozen=True, eq=False)
class Palette:
    """Which limb every colour of the label pictures stands for: ``labels[i]`` is limb + 1 of ``colors[i]``."""

    colors: NDArray[np.uint8]
    labels: NDArray[np.uint8]
    background: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Shot:
    """A validated shot with its sequences found, its marks read and its frames known.

    ``marks`` tells which frame of the annotations belongs to a drawing number; ``matte`` is the one that all frames
    get. ``source`` is the shot file as the user named it, ``lines`` where its keys stand. ``moves`` are those of the
    exposure sheet's camera over the drawings.
    """

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
    marks: dict[int, int]
    palette: Palette
    matte: Mode
    outputs: dict[str, FrameSequence]
    source: str = "options"
    lines: Mapping[tuple[str, ...], int] = field(default_factory=dict)
    moves: CameraMoves | None = None

    def place(self, key: str) -> str:
        """Return where ``key`` stands, as ``shot.toml:14``: its own line, or that of the section it would be in."""
        return place_of(self.source, self.lines, tuple(key.split(".")))

    def output(self, key: str, frame: int) -> Path | None:
        """Return where ``frame`` of ``[output] key`` goes, or None where the shot file asks for none."""
        return self.outputs[key].path(frame) if key in self.outputs else None

    def view(self, frame: int, paper: tuple[int, int]) -> FilmView | None:
        """Return what film ``frame`` shows of drawings of ``paper`` (width, height), None for all as it is."""
        size = self.settings.output.size or paper
        view = FilmView(paper, size) if self.moves is None else FilmView(paper, size, **self.moves.at(frame))
        return None if view.is_whole else view

    def framing(self, frame: int) -> list[Any]:
        """Return what decides of the drawings' part in film ``frame``, for records; empty for the whole."""
        size = self.settings.output.size
        return [] if size is None and self.moves is None else [size, self.moves and self.moves.at(frame)]

    def annotation_index(self, frame: int) -> int:
        """Return which frame of the annotations belongs to shot frame ``frame``; ValueError where there is none."""
        number = self.exposure.drawing(frame)
        if number not in self.marks:
            raise ValueError(f"frame {frame}: the annotations have no marks for drawing {number}")
        return self.marks[number]


def open_shot(path: str | Path, *, aligned: bool = True) -> Shot:
    """Read the shot file at ``path`` and find all that it names.

    ``aligned`` False takes the marks as annotated, without what `pegbar align` found.

    Raises ShotError with every problem at once (missing sequences, unknown limbs, outputs that would replace inputs),
    each with its line; FormatError or FileNotFoundError for an unreadable shot file.
    """
    path = Path(path)
    text = path.read_text(encoding="utf-8-sig", errors="replace") if path.is_file() else ""
    return plan_shot(load_shot(path), path.absolute().parent, str(path), text, aligned=aligned)


def plan_shot(
    settings: ShotFile, folder: Path, source: str = "options", text: str = "", *, aligned: bool = True
) -> Shot:
    """Return the shot of validated ``settings`` whose paths start at ``folder``; see `open_shot`."""
    problems = Problems(source, key_lines(text))
    drawing, passes = settings.drawing, settings.passes
    patterns = {"drawing.frames": drawing.frames, "drawing.labels": drawing.labels, "drawing.depth": drawing.depth}
    if passes is not None:
        patterns |= {"passes.beauty": passes.beauty, "passes.depth": passes.depth}
    inputs = {key: problems.call(key, find_input, folder, pattern) for key, pattern in patterns.items()}
    drawings, beauty = inputs["drawing.frames"], inputs.get("passes.beauty")
    if beauty is not None and passes is not None and not passes.depth and beauty.suffix.lower() != ".exr":
        problems.call("passes.beauty", _refuse, f"{beauty.pattern} has no depth: passes.depth must name the depth pass")
    annotations = problems.call("drawing.annotations", partial(read_marks, aligned=aligned), settings, folder)
    read = annotations is not None or not drawing.annotations
    # Without the marks that the shot names nothing can be said of limbs.
    palette = problems.call("drawing.palette", _palette, settings, annotations) if read else None
    if settings.camera:
        problems.call("camera.matrix", PerspectiveCamera, settings.camera.matrix, (1, 1))
    outputs = _outputs(settings, folder, inputs, problems)
    moves = problems.call("drawing.exposure", find_moves, drawing, folder)
    marks: dict[int, int] | None = {}
    exposure = frames = None
    if drawings is not None:
        key = "drawing.exposure" if drawing.exposure else "drawing.hold"
        exposure = problems.call(key, find_exposure, drawing, folder, drawings)
        frames = problems.call("shot.frames", _frames, settings, exposure, beauty) if exposure else None
        if annotations is not None and not drawing.depth:
            marks = problems.call("drawing.annotations", match_marks, annotations, drawings, drawing)
    if problems.found or drawings is None or palette is None or exposure is None or frames is None or marks is None:
        raise ShotError(problems.found)
    rest = inputs["drawing.labels"], inputs["drawing.depth"], beauty, inputs.get("passes.depth") or beauty
    matte = _matte(settings, drawings)
    found = settings, folder, frames, drawings, exposure, *rest, annotations, marks, palette, matte, outputs
    return Shot(*found, source, problems.lines, moves)


def _outputs(
    settings: ShotFile, folder: Path, inputs: dict[str, FrameSequence | None], problems: Problems
) -> dict[str, FrameSequence]:
    outputs: dict[str, FrameSequence] = {}
    for key in OUTPUTS:
        if pattern := getattr(settings.output, key):
            sequence = problems.call(f"output.{key}", plan_output, folder, key, pattern)
            others = {**inputs, **{f"output.{name}": other for name, other in outputs.items()}}
            if sequence is not None:
                problems.call(f"output.{key}", check_clash, sequence, others)
                outputs[key] = sequence
    return outputs


def _refuse(problem: str) -> None:
    raise ValueError(problem)


def _palette(settings: ShotFile, annotations: Drawing | None) -> Palette:
    limbs = annotations.limbs if annotations else ()
    order = {limb.name: index for index, limb in enumerate(limbs)}
    known = {limb.color: index + 1 for index, limb in enumerate(limbs) if limb.color}
    for text, name in settings.drawing.palette.items():
        if name not in order:
            known_names = ", ".join(order) or "none: there are no annotations"
            raise KeyedError(("drawing", "palette", text), f'"{name}" is no limb of the annotations ({known_names})')
        known[parse_color(text)] = order[name] + 1
    background = [parse_color(text) for text in settings.drawing.background]
    return Palette(
        np.array(list(known), np.uint8).reshape(-1, 3),
        np.array(list(known.values()), np.uint8),
        np.array(background, np.uint8).reshape(-1, 3),
    )


def _frames(settings: ShotFile, exposure: Exposure, beauty: FrameSequence | None) -> tuple[int, ...]:
    if settings.shot.frames:
        return tuple(parse_frames(settings.shot.frames))
    return tuple(beauty.numbers if beauty else exposure.frames)


def _matte(settings: ShotFile, drawings: FrameSequence) -> Mode:
    """The matte of all frames: what "auto" means is told by the first drawing that can be read."""
    if settings.drawing.matte != "auto":
        return settings.drawing.matte
    for number in drawings.numbers:
        try:
            picture = read_picture(drawings.path(number))
        except (ValueError, OSError):
            continue
        if picture.shape[2] == 4 and (picture[..., 3] < 255).any():
            return "alpha"
        break
    return "fill" if settings.drawing.labels else "unmix"
