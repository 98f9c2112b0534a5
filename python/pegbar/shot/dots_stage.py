"""The stage that makes joint marks of a layer of coloured dots, and carries them to drawings that have none."""

from __future__ import annotations

import difflib
import hashlib
import json
import tomllib
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import FormatError, ShotError
from pegbar.io.annotations_writer import write_annotations
from pegbar.io.frames import read_picture
from pegbar.io.numbers import format_frames
from pegbar.io.sequence import FrameSequence
from pegbar.layer.carry import carry_marks
from pegbar.layer.dots import Dots, find_dots
from pegbar.layer.matte import ink_alpha
from pegbar.scene.body import LIMBS, MARKERS, limbs_between
from pegbar.scene.drawing import Drawing
from pegbar.scene.joints import EXTRA
from pegbar.shot.find import find_input
from pegbar.shot.load import load_shot
from pegbar.shot.model import DotsSection, ShotFile, parse_color
from pegbar.shot.record import fingerprint, is_up_to_date, write_record

VERSION = 2


@dataclass(frozen=True, eq=False)
class DotsStage:
    """Reads the dots of the shot file ``path`` into its annotations, unless they are up to date."""

    path: Path
    overwrite: bool = False

    @cached_property
    def settings(self) -> ShotFile:
        """The shot file."""
        return load_shot(self.path)

    @property
    def is_wanted(self) -> bool:
        """Whether the shot has a layer of dots."""
        return self.settings.dots is not None

    @property
    def output(self) -> Path:
        """The annotations that are written."""
        name = self.settings.drawing.annotations
        if name is None:
            raise ShotError([f"{self.path}: dots: drawing.annotations must say where the marks go"])
        return self.path.absolute().parent / name

    def run(self) -> tuple[tuple[str, ...], bool]:
        """Read the dots and write the annotations; return what to know of them, and whether they were made.

        Raises ShotError for a shot without dots or drawings, FormatError for a broken palette, ValueError for colours
        that are too near to each other.
        """
        section, joints = self._section(), self.joints()
        drawings, dots, keys = self.sequences()
        inputs = [drawings.path(number) for number in drawings.numbers] + [dots.path(number) for number in keys]
        recipe = self._recipe(joints)
        if not self.overwrite and is_up_to_date([self.output], recipe, inputs):
            return (), False
        numbers = drawings.numbers if section.carry != "none" else keys
        colors = np.array([parse_color(color) for color in joints], np.uint8).reshape(-1, 3)
        found = {n: find_dots(read_picture(dots.path(n)), colors, tolerance=section.tolerance) for n in keys}
        drawing = self._drawing(numbers, found, drawings, tuple(joints.values()))
        write_annotations(self.output, drawing)
        write_record([self.output], recipe, [fingerprint(path) for path in inputs])
        return tuple(_remarks(found, tuple(joints.values()), numbers)), True

    def sequences(self) -> tuple[FrameSequence, FrameSequence, list[int]]:
        """Return drawings, dots, and the drawings that have dots; ShotError where there are none."""
        drawings, dots = self._sequence("drawing.frames"), self._sequence("dots.frames")
        keys = [number for number in drawings.numbers if number in set(dots.numbers)]
        if not keys:
            raise ShotError([f"{self.path}: dots.frames: no file has the number of a drawing"])
        return drawings, dots, keys

    def joints(self) -> dict[str, str]:
        """Which joint each colour stands for."""
        given = self._section().joints
        table = given if isinstance(given, dict) else _read_palette(self.path.absolute().parent / given)
        if problem := _problem(table):
            raise ShotError([f"{self.path}: dots.joints: {problem}"])
        twice = [name for name in table.values() if list(table.values()).count(name) > 1]
        if twice:
            raise ShotError([f"{self.path}: dots.joints: {twice[0]} has more than one colour"])
        return table

    def _section(self) -> DotsSection:
        if self.settings.dots is None:
            raise ShotError([f"{self.path}: the shot has no [dots]: name the layer of dots and their colours"])
        return self.settings.dots

    def _sequence(self, key: str) -> FrameSequence:
        section, name = key.split(".")
        pattern = getattr(getattr(self.settings, section), name)
        try:
            found = find_input(self.path.absolute().parent, pattern)
        except (ValueError, OSError) as error:
            raise ShotError([f"{self.path}: {key}: {error}"]) from None
        assert found is not None
        return found

    def _drawing(
        self, numbers: tuple[int, ...] | list[int], found: dict[int, Dots], files: FrameSequence, names: tuple[str, ...]
    ) -> Drawing:
        section = self._section()
        marks = np.full((len(numbers), len(names), 2), np.nan)
        for row, number in enumerate(numbers):
            if number in found:
                marks[row] = found[number].places
        there = np.isfinite(marks).all(axis=2)
        keyed = np.array([number in found for number in numbers])
        height, width = read_picture(files.path(numbers[0])).shape[:2]

        def gray(row: int) -> NDArray[np.uint8]:
            return np.rint(255 - 255 * ink_alpha(read_picture(files.path(numbers[row])))).astype(np.uint8)

        follows = section.carry == "flow" and not keyed.all()
        carried, _ = carry_marks(marks, there, gray if follows else None, average=section.average)
        colors = {name: parse_color(color) for name, color in section.limbs.items()}
        limbs = tuple(replace(limb, color=colors.get(limb.name)) for limb in limbs_between(names))
        known = [limb.name for limb in limbs]
        if strange := [name for name in colors if name not in known]:
            raise ShotError([f"{self.path}: dots.limbs: {_undotted(strange, names, known)}"])
        between = [number for number, key in zip(numbers, keyed, strict=True) if not key]
        return Drawing(
            names=names,
            markers=carried,
            # What a key drawing does not show is hidden there; between keys marks follow the nearest keys.
            visible=np.where(keyed[:, None], there, _near(there, keyed)) & np.isfinite(carried).all(axis=2),
            image_size=(width, height),
            frame_rate=self._rate(),
            holds=self._holds(len(numbers)),
            images=tuple(files.path(number) for number in numbers),
            limbs=limbs,
            notes={"carried": f"drawings {format_frames(between)}"} if between else {},
        )

    def _rate(self) -> float | None:
        """Film frames a second; None where the shot file leaves them open, for the search to find."""
        shot = self.settings.shot
        return shot.frame_rate if "frame_rate" in shot.model_fields_set else None

    def _holds(self, count: int) -> tuple[int, ...]:
        """For how many film frames the drawings are held, where the shot file says it with a number."""
        hold = self.settings.drawing.hold
        if isinstance(hold, list):
            return tuple(hold) if len(hold) == count else ()
        return (hold,) * count if isinstance(hold, int) and hold > 1 else ()

    def _recipe(self, joints: dict[str, str]) -> str:
        parts: list[Any] = [VERSION, self._section().model_dump(), joints, self._rate(), self.settings.drawing.hold]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def _undotted(strange: list[str], names: tuple[str, ...], known: list[str]) -> str:
    """Why there are no limbs ``strange`` between the joints ``names``: ends without a dot, or no such limb."""
    ends = {limb.name: (limb.start, limb.end) for limb in LIMBS}
    lost = dict.fromkeys(end for name in strange for end in ends.get(name, ()) if end not in names)
    told = f"no limb {', '.join(strange)} between joints that have dots"
    if lost:
        return f"{told}: dot {', '.join(lost)} too, at least once, where it would be (or leave the limb out)"
    return f"{told} (there are {', '.join(known)})"


def _problem(table: dict[str, str]) -> str | None:
    """What is wrong with the names of joints: none, not filled in, or misspelt."""
    if not table:
        return 'no colour has a joint yet: write them as "#ff0000" = "left_hand"'
    for color, name in table.items():
        if name.strip(" ?") == "":
            return f"{color} has no joint yet: write which one its dot is"
        near = difflib.get_close_matches(name, (*MARKERS, *EXTRA), 1, 0.88)
        if near and near[0] not in table.values():
            return f"{color}: no joint {name!r} (did you mean {near[0]!r}?)"
    return None


def _near(there: NDArray[np.bool_], keyed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """For each drawing which marks the key drawing nearest to it has."""
    keys = np.flatnonzero(keyed)
    nearest = keys[np.argmin(np.abs(np.arange(len(keyed))[:, None] - keys), axis=1)]
    return np.asarray(there[nearest])


def _read_palette(path: Path) -> dict[str, str]:
    """Read a TOML or JSON table from colours to joints."""
    text = path.read_text(encoding="utf-8-sig")
    try:
        table = json.loads(text) if path.suffix.lower() == ".json" else tomllib.loads(text)
    except ValueError as error:
        raise FormatError(path, f"no table of colours: {error}") from None
    if not isinstance(table, dict) or not all(isinstance(name, str) for name in table.values()):
        raise FormatError(path, 'want a table like "#ff0000" = "left_hand"')
    try:
        for color in table:
            parse_color(color)
    except ValueError as error:
        raise FormatError(path, str(error)) from None
    return {color.lower(): name for color, name in table.items()}


def _remarks(found: dict[int, Dots], names: tuple[str, ...], numbers: tuple[int, ...] | list[int]) -> list[str]:
    """Joints without a dot, and colours with more than one."""
    said = []
    for index, name in enumerate(names):
        lacking = [number for number, dots in found.items() if np.isnan(dots.places[index]).any()]
        if len(lacking) == len(found):
            said.append(f"no drawing has a dot for {name}")
        elif lacking:
            said.append(f"{name} has no dot in drawings {format_frames(lacking)}: hidden there")
        for number, dots in found.items():
            if len(dots.rivals[index]):
                where = " and ".join(str(np.round(place).astype(int).tolist()) for place in dots.rivals[index])
                said.append(f"drawing {number}: {name} has another spot of its colour at {where}")
    between = [number for number in numbers if number not in found]
    if between:
        said.append(f"marks carried to drawings {format_frames(between)}")
    return said
