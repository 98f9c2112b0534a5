"""What a shot's `[secondary]` section means: which frames, whose volumes, what is simulated, what it depends on."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from pegbar.errors import ShotError
from pegbar.scene.driving import Driving
from pegbar.shot.characters import drawn_rows, film_cameras, film_character, seen_by
from pegbar.shot.driving_stage import DrivingStage
from pegbar.shot.find import place_of, plan_output
from pegbar.shot.load import key_lines, load_shot
from pegbar.shot.model import ElementEntry, SecondarySection
from pegbar.shot.plan import Shot
from pegbar.simulate.blender.locate import Blender, find_blender
from pegbar.simulate.elements import Element
from pegbar.simulate.materials import Wind
from pegbar.simulate.presets import check_preset, preset_elements
from pegbar.simulate.scene import Character, PreRoll, SimulationScene

VERSION = 2
# Fields that change how an element looks and not how it moves.
_LOOKS = {"color", "second", "pattern", "pattern_size", "colors"}


@dataclass(frozen=True, eq=False)
class Secondary:
    """The secondary motion of the shot file ``path``; ``engine`` and ``renderer`` go before the file's own."""

    path: Path
    overwrite: bool = False
    engine: Literal["pegbar", "blender"] | None = field(default=None, kw_only=True)
    renderer: Literal["pegbar", "blender"] | None = field(default=None, kw_only=True)

    @cached_property
    def section(self) -> SecondarySection:
        """The shot's ``[secondary]``."""
        found = load_shot(self.path).secondary
        if found is None:
            raise ShotError([f'{self.path}: the shot has no [secondary]: elements = ["skirt"] is enough'])
        chosen = {"engine": self.engine, "renderer": self.renderer}
        return found.model_copy(update={key: value for key, value in chosen.items() if value is not None})

    def check(self) -> None:
        """Raise ShotError for what the section asks for and there is not, before any work."""
        if problems := secondary_problems(self.section, self.path.absolute().parent):
            lines = key_lines(self.path.read_text(encoding="utf-8-sig"))
            keys = [tuple(problem.partition(":")[0].split(".")) for problem in problems]
            raise ShotError(
                [f"{place_of(str(self.path), lines, key)}: {line}" for key, line in zip(keys, problems, strict=True)]
            )
        if "blender" in (self.section.engine, self.section.renderer):
            _ = self.blender

    @cached_property
    def blender(self) -> Blender:
        """The Blender to use; BlenderError where there is none."""
        return find_blender(self.section.blender, folder=self.path.absolute().parent)

    @property
    def folder(self) -> Path:
        """Where the results go."""
        return self.path.absolute().parent / self.section.output

    @cached_property
    def stages(self) -> tuple[DrivingStage, ...]:
        """For every character the stage that puts it into 3D, the shot's own first."""
        own = DrivingStage(self.path, self.section, self.folder, self.overwrite)
        others = []
        for index, name in enumerate(self.section.characters, 2):
            path = self.path.absolute().parent / name
            others.append(DrivingStage(path, self.section, self.folder / f"character_{index}", self.overwrite))
        return (own, *others)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The characters' names: those of their shots, else of the shot files' folders."""
        names: list[str] = []
        for stage in self.stages:
            given = stage.bare.settings.shot.name or stage.path.absolute().parent.name
            names.append(given if given not in names else f"{given} {len(names) + 1}")
        return tuple(names)

    @property
    def frames(self) -> tuple[int, ...]:
        """The film frames that are simulated: all from the shot's first to its last."""
        own = self.stages[0].bare.frames
        return tuple(range(min(own), max(own) + 1))

    def characters(self, drivings: Sequence[Driving]) -> tuple[list[Character], SimulationScene]:
        """Return the characters over the film frames, and a scene of them without elements."""
        shots = [stage.shot for stage in self.stages]
        rows = drawn_rows(shots[0], drivings[0], self.frames)
        cameras = film_cameras(drivings[0], rows)
        found = [film_character(self.names[0], drivings[0], rows)]
        for name, shot, driving in zip(self.names[1:], shots[1:], drivings[1:], strict=True):
            moved, places = seen_by(driving, drawn_rows(shot, driving, self.frames), cameras)
            found.append(film_character(name, moved, places))
        section = self.section
        scene = SimulationScene(
            frame_rate=shots[0].settings.shot.frame_rate,
            frames=len(self.frames),
            elements=(),
            characters=tuple(found),
            cameras=cameras,
            ground=None if section.ground == "none" else drivings[0].ground,
            gravity=(0.0, -section.gravity, 0.0),
            wind=Wind(section.wind.velocity, section.wind.gusts, section.wind.size, section.seed),
            pre_roll=PreRoll(section.pre_roll, min(8, section.pre_roll)),
            seed=section.seed,
        )
        return found, scene

    def scene(self, drivings: Sequence[Driving]) -> SimulationScene:
        """Return what is simulated; ShotError, naming the entry, for elements that cannot be."""
        characters, bare = self.characters(drivings)
        elements: list[Element] = []
        problems = []
        for entry in self.section.elements:
            try:
                elements += self._elements(entry, characters, bare)
            except (ValueError, TypeError) as error:
                problems.append(f"{self.path}: secondary.elements: {error}")
        try:
            if not problems:
                return dataclasses.replace(bare, elements=tuple(elements))
        except ValueError as error:
            problems.append(f"{self.path}: secondary.elements: {error}")
        raise ShotError(problems)

    def _elements(
        self, entry: ElementEntry, characters: Sequence[Character], scene: SimulationScene
    ) -> tuple[Element, ...]:
        """What one entry makes, for the character that it names or the first."""
        wanted = [c for c in characters if entry.character is None or c.name == entry.character]
        if not wanted:
            known = ", ".join(character.name for character in characters)
            raise ValueError(f"{entry.preset}: no character {entry.character!r}: there is {known}")
        return preset_elements(
            entry.preset,
            wanted[0],
            name=entry.name,
            ground=scene.ground,
            seed=self.section.seed,
            cameras=scene.cameras,
            **entry.fields,
        )

    def recipe(self) -> str:
        """A hash of what decides the simulation besides the characters."""
        section = self.section
        entries = [
            {key: value for key, value in entry.model_dump().items() if key not in _LOOKS} for entry in section.elements
        ]
        parts: list[Any] = [VERSION, entries, section.ground, section.gravity, section.wind.model_dump()]
        parts += [section.pre_roll, section.seed, self.frames, self.names]
        parts += [self.stages[0].bare.settings.shot.frame_rate]
        parts += [] if section.engine == "pegbar" else [section.engine, self.blender.version]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()

    def inputs(self) -> list[Path]:
        """The files that the simulation depends on."""
        return [stage.outputs()[0] for stage in self.stages]

    def drawn_shots(self, drivings: Sequence[Driving]) -> list[Shot]:
        """Return every character's shot with the depths that the volumes have, under its own cameras."""
        shots = []
        for stage, driving in zip(self.stages, drivings, strict=True):
            shot = stage.shot
            marks = shot.annotations
            assert marks is not None
            depths = np.einsum("fi,fni->fn", driving.matrices[:, 2, :3], driving.positions)
            depths += driving.matrices[:, 2, 3:]
            places, all_depths = marks.markers.copy(), np.full(marks.markers.shape[:2], np.nan)
            rows = [shot.marks[number] for number in driving.numbers]
            places[rows], all_depths[rows] = driving.markers, depths
            shots.append(
                dataclasses.replace(shot, annotations=dataclasses.replace(marks, markers=places, depths=all_depths))
            )
        return shots


def secondary_problems(section: SecondarySection, folder: Path) -> list[str]:
    """Return which presets, settings of them, and kinds of pictures ``section`` names that there are not."""
    problems = []
    for entry in section.elements:
        try:
            check_preset(entry.preset, entry.fields)
        except ValueError as error:
            problems.append(f"secondary.elements: {error}")
    try:
        plan_output(folder, "frames", section.frames)
    except ValueError as error:
        problems.append(f"secondary.frames: {error}")
    return problems
