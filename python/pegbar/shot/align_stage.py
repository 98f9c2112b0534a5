"""The stage that aligns a shot's drawing with a clip, for all its drawings at once, unless that is up to date."""

from __future__ import annotations

import csv
import dataclasses
import hashlib
import io
import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import DegenerateError, FormatError, ShotError, describe
from pegbar.io import atomic
from pegbar.io.alignment import read_alignment, write_alignment
from pegbar.io.annotations_writer import write_annotations
from pegbar.io.frames import read_picture, write_image
from pegbar.io.hold import hold
from pegbar.report.align_overlay import align_overlay
from pegbar.report.contact_sheet import contact_sheet, over_paper
from pegbar.report.warp_plot import warp_picture
from pegbar.scene.alignment import Alignment
from pegbar.scene.drawing import Drawing
from pegbar.scene.joints import misspelt_markers
from pegbar.shot.alignment import AlignOptions, align_drawing
from pegbar.shot.clip_choice import Choice, choose_clip
from pegbar.shot.drawn import check_drawing, check_drawings
from pegbar.shot.marks import ALIGNED, outside_warnings
from pegbar.shot.plan import Shot
from pegbar.shot.record import fingerprint, forget, is_up_to_date, write_record
from pegbar.shot.registered import CameraOptions
from pegbar.shot.retiming import Retiming

VERSION = 5
_SHEET = 24


@dataclass(frozen=True, eq=False)
class AlignStage:
    """Aligns all drawings of ``shot``, unless that is up to date and not to be overwritten.

    ``shot`` is to be opened without what was aligned before.
    """

    shot: Shot
    overwrite: bool = False

    @property
    def folder(self) -> Path:
        """Where the results go."""
        return self.shot.folder / self.shot.settings.align.output

    @property
    def numbers(self) -> list[int]:
        """The drawings that have marks and a picture, in order."""
        return sorted(set(self.shot.marks) & set(self.shot.drawings.numbers))

    def outputs(self) -> list[Path]:
        """The files that the stage writes, the main one first."""
        overlays = [self.folder / f"overlay.{number:04d}.png" for number in self.numbers]
        names = ("alignment.npz", ALIGNED, "errors.csv", "warp.png", "sheet.png")
        return [*(self.folder / name for name in names), *overlays]

    def run(self, progress: Callable[[int, int], None] | None = None) -> tuple[Alignment, bool]:
        """Align, or read what is up to date; return the alignment and whether it was made.

        Raises
        ------
        ShotError
            For a shot without marks or clip.
        ValueError, OSError
            For a clip that cannot be read or does not fit, and marks that determine nothing; BusyError where another
            run is aligning the shot.
        """
        self._check()
        drawing, holds = self.drawing(), self.holds()
        if self.is_done():
            return read_alignment(self.outputs()[0]), False
        self._check_marks(drawing)
        check_drawings(self.shot, self.numbers)
        with hold(self.folder):
            return self._align(drawing, holds, progress), True

    def _align(
        self, drawing: Drawing, holds: NDArray[np.float64], progress: Callable[[int, int], None] | None
    ) -> Alignment:
        rate = self.shot.settings.shot.frame_rate
        # What is changed while this works is out of date afterwards.
        prints = [fingerprint(path) for path in self._inputs() if path.is_file()]
        choice = self._choice(drawing, holds, rate)
        self._check_names(drawing, (*choice.motion.known_markers, *choice.motion.names))
        alignment, retiming = align_drawing(drawing, choice.motion, choice.view, holds, rate, self._options())
        alignment = dataclasses.replace(
            alignment,
            clip_path=str(choice.path),
            mirrored=choice.view.mirrored,
            swapped=choice.view.swapped,
            notes=(*choice.notes, *alignment.notes),
            warnings=(*choice.warnings, *alignment.warnings, *self._outside()),
        )
        forget(self.outputs())
        self._write(drawing, choice, alignment, retiming, progress)
        write_record(self.outputs(), self._recipe(), prints)
        return alignment

    def is_done(self) -> bool:
        """Whether the results stand and nothing that they depend on has changed."""
        return not self.overwrite and is_up_to_date(self.outputs(), self._recipe(), self._inputs())

    def drawing(self) -> Drawing:
        """The marked drawings in order, with their own pictures."""
        marks = self.shot.annotations
        assert marks is not None
        rows = [self.shot.marks[number] for number in self.numbers]
        return dataclasses.replace(
            marks,
            markers=marks.markers[rows],
            visible=marks.visible[rows],
            boxes=None if marks.boxes is None else marks.boxes[rows],
            extents=None if marks.extents is None else marks.extents[rows],
            images=tuple(self.shot.drawings.path(number) for number in self.numbers),
            segmentations=tuple(self.shot.labels.path(number) for number in self.numbers) if self.shot.labels else (),
            masks=tuple(marks.masks[row] for row in rows) if marks.masks else (),
            holds=tuple(marks.holds[row] for row in rows) if marks.holds else (),
            cameras=(),
            depths=None,
        )

    def holds(self) -> NDArray[np.float64]:
        """For how many film frames each drawing is shown."""
        exposure = self.shot.exposure
        shown = [exposure.drawing(frame) for frame in exposure.frames]
        counts = [shown.count(number) for number in self.numbers]
        holds: NDArray[np.float64] = np.maximum(np.array(counts, float), 1.0)
        return holds

    def _check(self) -> None:
        problems = []
        if self.shot.annotations is None:
            problems.append("the shot has no drawing.annotations: joint marks are needed")
        elif not self.numbers:
            problems.append("the shot's annotations have no marks for its drawings")
        if self.shot.settings.clip is None:
            problems.append(
                f"{self.shot.folder}: the shot has no [clip]: name a path, or a folder of clips to look in "
                "(pegbar match helps)"
            )
        if problems:
            raise ShotError(problems)

    def _check_marks(self, drawing: Drawing) -> None:
        """Refuse drawings with too few marks, by their numbers and the joints that they have."""
        seen = drawing.visible & np.isfinite(drawing.markers).all(axis=2)
        for number, row in zip(self.numbers, seen, strict=True):
            if row.sum() < 4:
                joints = ", ".join(name for name, there in zip(drawing.names, row, strict=True) if there) or "none"
                name = self.shot.settings.drawing.annotations
                raise DegenerateError(f"{name}: drawing {number}: too few visible marks ({joints}), want 4 or more")

    def _check_names(self, drawing: Drawing, known: tuple[str, ...]) -> None:
        """Refuse misspelt markers, which would be left out; ``known`` are the clip's."""
        if wrong := misspelt_markers(drawing.names, known):
            name = self.shot.settings.drawing.annotations
            raise ShotError(
                [f"{name}: no marker is called {word!r} (did you mean {near!r}?)" for word, near in wrong.items()]
            )

    def _choice(self, drawing: Drawing, holds: NDArray[np.float64], rate: float) -> Choice:
        """The shot's clip; ShotError, with its place in the shot file, for files that cannot be read."""
        section = self.shot.settings.clip
        assert section is not None
        try:
            return choose_clip(section, self.shot.folder, drawing, holds, rate)
        except (FormatError, OSError) as error:
            key = "clip.path" if section.path is not None else "clip.folder"
            raise ShotError([f"{self.shot.place(key)}: {key}: {describe(error)}"]) from error
        except ValueError:
            # Too few joints to compare may be for their names.
            self._check_names(drawing, ())
            raise

    def _outside(self) -> list[str]:
        marks = self.shot.annotations
        assert marks is not None
        return outside_warnings(marks, {number: self.shot.marks[number] for number in self.numbers})

    def _options(self) -> AlignOptions:
        section = self.shot.settings.align
        wide = None if section.field_of_view is None else math.radians(section.field_of_view)
        camera = CameraOptions(
            wide, section.mode, section.root, section.root_smoothing, section.level, section.proportions
        )
        return AlignOptions(camera, section.smoothing, section.ground, section.floor)

    def _inputs(self) -> list[Path]:
        """The files that the result depends on: marks, pictures, and the clip or all clips of the folder."""
        shot, clip = self.shot, self.shot.settings.clip
        assert clip is not None
        assert shot.settings.drawing.annotations is not None
        found = [shot.folder / shot.settings.drawing.annotations]
        found += [shot.drawings.path(number) for number in self.numbers]
        found += [shot.folder / name for name in (clip.path, clip.skeleton, clip.joints) if name]
        if clip.path is None and clip.folder is not None:
            kinds = (".bvh", ".amc", ".asf", ".c3d")
            found += sorted(path for path in (shot.folder / clip.folder).rglob("*") if path.suffix.lower() in kinds)
        return found

    def _recipe(self) -> str:
        settings = self.shot.settings
        assert settings.clip is not None
        parts: list[Any] = [VERSION, settings.clip.model_dump(), settings.align.model_dump(exclude={"use"})]
        parts += [settings.shot.frame_rate, self.numbers, self.holds().tolist()]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()

    def _write(
        self,
        drawing: Drawing,
        choice: Choice,
        alignment: Alignment,
        retiming: Retiming,
        progress: Callable[[int, int], None] | None,
    ) -> None:
        values, marks, errors, warp, sheet, *overlays = self.outputs()
        write_alignment(values, alignment)
        aligned = dataclasses.replace(
            drawing,
            markers=alignment.markers,
            visible=~alignment.estimated,
            cameras=alignment.cameras,
            depths=alignment.depths,
        )
        write_annotations(marks, aligned)
        atomic.write_bytes(errors, _error_table(self.numbers, alignment).encode())
        step = float(np.mean(np.diff(retiming.moments))) if len(retiming.moments) > 1 else 1.0
        offset = float(retiming.moments[0])
        plot = warp_picture(
            retiming.cost,
            retiming.warp,
            clip_offset=offset,
            clip_step=step,
            title=choice.path.name,
            thinned=retiming.thinned,
        )
        write_image(warp, plot)
        # Of a long shot only the sheet's pictures are kept.
        chosen = set(np.linspace(0, len(overlays) - 1, min(_SHEET, len(overlays))).round().astype(int).tolist())
        pictures = []
        for frame, (number, path) in enumerate(zip(self.numbers, overlays, strict=True)):
            label = f"drawing {number}  clip frame {alignment.times[frame]:.1f}  {alignment.errors[frame]:.1f} px"
            picture = read_picture(self.shot.drawings.path(number))
            check_drawing(self.shot, number, picture)
            overlay = align_overlay(picture, alignment, frame, label)
            write_image(path, overlay)
            if frame in chosen:
                pictures.append(over_paper(overlay))
            if progress is not None:
                progress(frame + 1, len(self.numbers))
        write_image(sheet, contact_sheet(pictures, columns=4, width=480))


def _error_table(numbers: list[int], alignment: Alignment) -> str:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["drawing", "clip_frame", "error_px", "camera_x", "camera_y", "camera_z"])
    for row, number in enumerate(numbers):
        place = [round(float(value), 4) for value in alignment.cameras[row].position]
        table.writerow([number, round(float(alignment.times[row]), 3), round(float(alignment.errors[row]), 3), *place])
    return text.getvalue()
