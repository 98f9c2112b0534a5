"""The stage that makes a 3D animation of a shot's drawing, and the files that 3D packages open."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.io import atomic
from pegbar.io.animation import write_animation
from pegbar.io.frames import read_picture, write_image
from pegbar.io.hold import hold
from pegbar.io.motion import read_motion
from pegbar.io.numbers import format_frames, parse_frames
from pegbar.report.lift_preview import preview_frames
from pegbar.report.lift_quality import notes, quality
from pegbar.report.lift_sheet import lift_sheet
from pegbar.scene.alignment import Alignment
from pegbar.scene.lifted import Lifted
from pegbar.scene.motion import Motion
from pegbar.shot.align_stage import AlignStage
from pegbar.shot.alignment import as_drawn
from pegbar.shot.clip_choice import read_clip
from pegbar.shot.film import film_moments
from pegbar.shot.lift_choices import Hold, LiftOptions, Range
from pegbar.shot.lift_files import FILES, film_of, write_film
from pegbar.shot.lifting import lift_drawing
from pegbar.shot.record import fingerprint, forget, is_up_to_date, write_record

VERSION = 2
#: A preview has no more pictures than this: of longer films every second or third.
_PREVIEW = 240


@dataclass(frozen=True, eq=False)
class LiftStage:
    """Lifts the drawing that ``align`` aligns, unless that is up to date and not to be overwritten."""

    align: AlignStage
    overwrite: bool = False

    @property
    def folder(self) -> Path:
        """Where the results go."""
        return self.align.shot.folder / self.align.shot.settings.lift.output

    def outputs(self) -> list[Path]:
        """The files that the stage writes, the report first."""
        section = self.align.shot.settings.lift
        names = ["report.json", "sheet.png", *(FILES[kind] for kind in dict.fromkeys(section.formats))]
        if section.preview != "none":
            names.insert(2, f"preview.{section.preview}")
        return [self.folder / name for name in names]

    def run(self) -> tuple[dict[str, Any], bool]:
        """Align what is out of date, lift, and write; return the report and whether anything was made.

        Raises ShotError, ValueError and OSError as `AlignStage.run` does, ValueError for what `lift_drawing` refuses,
        and MissingExtraError for a format whose library is not installed.
        """
        alignment, _ = self.align.run()
        report = self.outputs()[0]
        if self.is_done():
            found: dict[str, Any] = json.loads(report.read_text(encoding="utf-8"))
            return found, False
        with hold(self.folder):
            return self._lift(alignment), True

    def _lift(self, alignment: Alignment) -> dict[str, Any]:
        shot, prints = self.align.shot, [fingerprint(path) for path in self._inputs() if path.is_file()]
        assert shot.settings.clip is not None
        motion = read_clip(shot.settings.clip, shot.folder, Path(alignment.clip_path))
        clip = as_drawn(motion, alignment.mirrored, alignment.swapped, shot.settings.align.floor)
        rate = shot.settings.shot.frame_rate / float(self.align.holds().mean())
        lifted = lift_drawing(alignment, clip, rate, self.options())
        values = quality(alignment, lifted, self.align.numbers)
        values["notes"] = notes(alignment, lifted, self.align.numbers, values, shot.settings.lift.stretch)
        forget(self.outputs())
        self._write(alignment, lifted)
        atomic.write_bytes(self.outputs()[0], json.dumps(values, indent=1).encode())
        write_record(self.outputs(), self._recipe(), prints)
        return values

    def is_done(self) -> bool:
        """Whether the results stand and nothing that they depend on has changed."""
        return not self.overwrite and is_up_to_date(self.outputs(), self._recipe(), self._inputs())

    def options(self) -> LiftOptions:
        """Return what the shot's section means; ValueError or OSError, naming the key or file, for what cannot be."""
        section = self.align.shot.settings.lift
        planted: bool | dict[str, list[Range]] = isinstance(section.planted, bool) and section.planted
        if not isinstance(section.planted, bool):
            planted = {foot: self._runs("planted", drawings) for foot, drawings in section.planted.items()}
        return LiftOptions(
            depth=section.depth,
            stretch=section.stretch,
            lengths=section.lengths,
            planted=planted,
            held=tuple(
                Hold(entry.joint, part, entry.at)
                for entry in section.held
                for part in self._runs("held", entry.drawings)
            ),
            flips=tuple((entry.joint, part) for entry in section.flips for part in self._runs("flips", entry.drawings)),
            skeleton=self._skeleton(),
            fitted=(section.proportions or ("drawing" if section.skeleton is None else "skeleton")) == "drawing",
            loop=section.loop,
        )

    def _skeleton(self) -> Motion | None:
        section, folder = self.align.shot.settings.lift, self.align.shot.folder
        if section.skeleton is None:
            return None
        joints = folder / section.skeleton_joints if section.skeleton_joints else None
        return read_motion(folder / section.skeleton, joints=joints)

    def _runs(self, key: str, drawings: str) -> list[Range]:
        """The runs of neighbouring drawings that ``drawings`` names, as places: first, one past the last."""
        numbers = self.align.numbers
        places = []
        for number in parse_frames(drawings):
            if number not in numbers:
                raise ValueError(f"lift.{key}: there is no drawing {number} with marks, only {format_frames(numbers)}")
            places.append(numbers.index(number))
        places.sort()
        starts = [place for place in places if place - 1 not in places]
        return [
            (start, next(end for end in range(start + 1, len(numbers) + 2) if end not in places)) for start in starts
        ]

    def _inputs(self) -> list[Path]:
        section, folder = self.align.shot.settings.lift, self.align.shot.folder
        skeleton = [folder / name for name in (section.skeleton, section.skeleton_joints) if name]
        return [self.align.outputs()[0], *skeleton]

    def _recipe(self) -> str:
        settings = self.align.shot.settings
        parts = [VERSION, settings.lift.model_dump(), settings.shot.frame_rate, self.align.holds().tolist()]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()

    def _write(self, alignment: Alignment, lifted: Lifted) -> None:
        shot, section, numbers = self.align.shot, self.align.shot.settings.lift, self.align.numbers
        rate, holds = shot.settings.shot.frame_rate, self.align.holds().astype(int).tolist()
        film = film_of(lifted, numbers, holds, rate, section)
        for kind in dict.fromkeys(section.formats):
            write_film(self.folder / FILES[kind], kind, film, lifted, section)
        labels = [str(number) for number in numbers]

        def picture(place: int) -> NDArray[np.uint8]:
            return read_picture(shot.drawings.path(numbers[place]))

        write_image(self.folder / "sheet.png", lift_sheet(picture, labels, alignment, lifted))
        if section.preview != "none":
            _, places = film_moments(holds, rate, stepped=True, rate=rate, loop=False)
            step = -(-len(places) // _PREVIEW)
            frames = preview_frames(picture, labels, alignment, lifted, places[::step].astype(int).tolist())
            write_animation(self.folder / f"preview.{section.preview}", frames, rate / step)
