"""The stage that puts a drawn character into 3D for a simulation: aligned marks, limb boxes and collision volumes."""

from __future__ import annotations

import hashlib
import json
import math
import zipfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from pegbar.errors import DegenerateError, FormatError
from pegbar.io.alignment import read_alignment
from pegbar.io.atomic import complete_file
from pegbar.io.frames import read_picture, write_image
from pegbar.io.hold import hold
from pegbar.layer.box_edges import LimbEdges, ink_edges, label_edges
from pegbar.layer.matte import ink_alpha
from pegbar.layer.segmentation import grow_labels
from pegbar.report.contact_sheet import contact_sheet, over_paper
from pegbar.report.volume_overlay import volume_overlay
from pegbar.scene.alignment import Alignment
from pegbar.scene.drawing import Drawing
from pegbar.scene.driving import Driving
from pegbar.scene.volumes import TaperedCylinders
from pegbar.shot.align_stage import AlignStage
from pegbar.shot.drawn import check_drawing, read_labels
from pegbar.shot.driving import drive
from pegbar.shot.marks import ALIGNED, outside_warnings
from pegbar.shot.model import SecondarySection
from pegbar.shot.plan import Shot, open_shot
from pegbar.shot.record import fingerprint, forget, is_up_to_date, write_record

VERSION = 3
_SHEET, _SHEET_WIDTH = 24, 480
# Outlines beside coloured limbs belong to them, so many pixels at most.
_OUTLINE = 4.0
_VOLUMES = tuple(field.name for field in fields(TaperedCylinders))
_TEXTS = ("numbers", "names", "limb_names", "image_size", "notes")


@dataclass(frozen=True, eq=False)
class DrivingStage:
    """Aligns the shot file ``path`` where it needs that, and finds boxes and volumes, unless they are up to date.

    ``section`` is what the simulation wants of it, ``folder`` where the results go.
    """

    path: Path
    section: SecondarySection
    folder: Path
    overwrite: bool = False

    @cached_property
    def bare(self) -> Shot:
        """The shot with its marks as annotated."""
        return open_shot(self.path, aligned=False)

    @property
    def is_aligned(self) -> bool:
        """Whether cameras and depths come from `pegbar align`, not from the annotations."""
        use, marks = self.bare.settings.align.use, self.bare.annotations
        return use == "always" or (use == "auto" and (marks is None or marks.depths is None or not marks.cameras))

    @cached_property
    def shot(self) -> Shot:
        """The shot with the marks that it works with; what it needs is to be aligned before."""
        return open_shot(self.path) if self.is_aligned else self.bare

    @property
    def numbers(self) -> list[int]:
        """The drawings that have marks and a picture, in order."""
        return sorted(set(self.bare.marks) & set(self.bare.drawings.numbers))

    def outputs(self) -> list[Path]:
        """The files that the stage writes, the main one first."""
        return [self.folder / name for name in ("driving.npz", "volumes.png")]

    def align(self, progress: Callable[[int, int], None] | None = None) -> tuple[Alignment | None, bool]:
        """Align what has to be; return the alignment (None: the annotations know all) and whether it was made.

        Raises DegenerateError for a clip that fits no drawing, naming the worst.
        """
        if not self.is_aligned:
            return None, False
        alignment, made = AlignStage(self.bare, self.overwrite).run(progress)
        height, usual = alignment.figure_height, float(np.median(alignment.errors))
        worst = int(np.argmax(alignment.errors))
        if usual > self.section.misfit * height:
            raise DegenerateError(
                f"the clip {Path(alignment.clip_path).name} fits no drawing: it is {usual:.0f} px from the marks, "
                f"{usual / height:.0%} of the figure (secondary.misfit allows {self.section.misfit:.0%}); worst is "
                f"drawing {self.numbers[worst]} with {alignment.errors[worst]:.0f} px"
            )
        return alignment, made

    def remarks(self) -> list[str]:
        """Return what looks wrong with the annotations; of those that are aligned, `pegbar align` says it."""
        marks = self.bare.annotations
        if self.is_aligned or marks is None:
            return []
        return outside_warnings(marks, {number: self.bare.marks[number] for number in self.numbers})

    def run(self, progress: Callable[[int, int], None] | None = None) -> tuple[Driving, bool]:
        """Find boxes and volumes, or read what is up to date; return them and whether they were made.

        Raises ShotError, ValueError and OSError as `AlignStage.run` and `drive` do.
        """
        if self.is_done():
            return read_driving(self.outputs()[0]), False
        with hold(self.folder):
            return self._drive(progress), True

    def _drive(self, progress: Callable[[int, int], None] | None) -> Driving:
        prints, drawing = [fingerprint(path) for path in self._inputs()], self._drawing()
        with ThreadPoolExecutor(2) as pool:
            edges = []
            for done, found in enumerate(pool.map(self._edges, self.numbers), 1):
                edges.append(found)
                if progress is not None:
                    progress(done, len(self.numbers))
        driving = drive(
            drawing,
            self.numbers,
            edges,
            clip=self._clip(),
            ground=self.section.ground if isinstance(self.section.ground, float) else None,
            frame_rate=self.bare.settings.shot.frame_rate / self._hold(),
            clearance=self.section.clearance if self.section.separate else None,
        )
        forget(self.outputs())
        write_driving(self.outputs()[0], driving)
        self._write_sheet(driving)
        write_record(self.outputs(), self._recipe(), prints)
        return driving

    def is_done(self) -> bool:
        """Whether the results stand and nothing that they depend on has changed."""
        return not self.overwrite and is_up_to_date(self.outputs(), self._recipe(), self._inputs())

    def _drawing(self) -> Drawing:
        """The marked drawings with cameras and depths."""
        shot = self.shot
        marks = shot.annotations
        if marks is None or not marks.limbs:
            raise DegenerateError("the shot's annotations have no limbs: there is nothing to collide with")
        rows = [shot.marks[number] for number in self.numbers]
        own = _boxes_of(self.bare, self.numbers)
        return Drawing(
            names=marks.names,
            markers=marks.markers[rows],
            visible=marks.visible[rows],
            image_size=marks.image_size,
            limbs=marks.limbs,
            boxes=own,
            cameras=tuple(marks.cameras[row] for row in rows) if marks.cameras else (),
            depths=None if marks.depths is None else marks.depths[rows],
        )

    def _clip(self) -> np.ndarray | None:
        if not self.is_aligned:
            return None
        return read_alignment(AlignStage(self.bare).outputs()[0]).clip

    def _hold(self) -> float:
        """For how many film frames a drawing is shown, on average."""
        return max(1.0, float(AlignStage(self.bare).holds().mean()))

    def _edges(self, number: int) -> LimbEdges:
        """Measure the limbs of one drawing: by their colours, else by ink."""
        shot = self.shot
        assert shot.annotations is not None
        exposure = shot.exposure
        frame = next((frame for frame in exposure.frames if exposure.drawing(frame) == number), number)
        picture = read_picture(shot.drawings.path(number))
        check_drawing(shot, number, picture)
        marks = shot.annotations
        ends = marks.markers[shot.marks[number]][marks.limb_markers]
        labels = read_labels(shot, frame, picture)[0] if shot.labels is not None else None
        see_through = picture.shape[2] == 4 and bool((picture[..., 3] < 255).any())
        if labels is None:
            gray = np.rint(255 - 255 * ink_alpha(picture)).astype(np.uint8)
            paper = picture[..., 3] < 128 if see_through else None
            return ink_edges(gray, ends, threshold=shot.settings.drawing.threshold, paper=paper)
        figure = picture[..., 3] >= 128 if see_through else ink_alpha(picture) > 0.5
        return label_edges(grow_labels(labels, figure, reach=_OUTLINE), ends)

    def _inputs(self) -> list[Path]:
        shot, settings = self.bare, self.bare.settings
        assert settings.drawing.annotations is not None
        found = [shot.folder / settings.drawing.annotations]
        if self.is_aligned:
            stage = AlignStage(shot)
            found += [stage.outputs()[0], stage.folder / ALIGNED]
        found += [shot.drawings.path(number) for number in self.numbers]
        if shot.labels is not None:
            found += [shot.labels.path(number) for number in self.numbers]
        return found

    def _recipe(self) -> str:
        settings = self.bare.settings
        parts: list[Any] = [VERSION, settings.drawing.model_dump(), self.section.ground]
        parts += [self.section.separate, self.section.clearance]
        parts += [settings.shot.frame_rate, self.numbers, self.is_aligned, self._hold()]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()

    def _write_sheet(self, driving: Driving) -> None:
        chosen = np.unique(np.linspace(0, len(self.numbers) - 1, min(_SHEET, len(self.numbers))).round().astype(int))
        pictures = []
        for row in chosen.tolist():
            picture = read_picture(self.shot.drawings.path(self.numbers[row]))
            factor = _SHEET_WIDTH / picture.shape[1]
            way = cv2.INTER_AREA if factor < 1 else cv2.INTER_NEAREST
            small = cv2.resize(over_paper(picture), None, fx=factor, fy=factor, interpolation=way)
            pictures.append(over_paper(volume_overlay(small, driving, row)))
        write_image(self.outputs()[1], contact_sheet(pictures, columns=4, width=_SHEET_WIDTH))


def _boxes_of(shot: Shot, numbers: list[int]) -> np.ndarray | None:
    marks = shot.annotations
    return None if marks is None or marks.boxes is None else marks.boxes[[shot.marks[number] for number in numbers]]


def write_driving(path: Path, driving: Driving) -> None:
    """Write ``driving`` as a .npz file whose arrays have its attributes' names, complete or not at all."""
    values: dict[str, Any] = {
        field.name: getattr(driving, field.name) for field in fields(Driving) if field.name != "volumes"
    }
    values |= {name: np.asarray(values[name]) for name in ("numbers", "image_size")}
    values |= {name: np.asarray(values[name], dtype=np.str_) for name in ("names", "limb_names", "notes")}
    values["ground"] = np.nan if driving.ground is None else driving.ground
    values |= {name: getattr(driving.volumes, name) for name in _VOLUMES}
    with complete_file(path) as part, part.open("wb") as file:
        np.savez_compressed(file, **values)


def read_driving(path: Path) -> Driving:
    """Read what `write_driving` wrote; FormatError for a file that is broken or something else."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as held:
            names = [field.name for field in fields(Driving) if field.name != "volumes"]
            values: dict[str, Any] = {name: held[name] for name in (*names, *_VOLUMES)}
    except (zipfile.BadZipFile, KeyError, ValueError, EOFError) as error:
        raise FormatError(path, f"no driving signal: {error}") from None
    volumes = TaperedCylinders(*(values.pop(name) for name in _VOLUMES))
    values |= {name: tuple(values[name].tolist()) for name in _TEXTS}
    ground = float(values.pop("ground"))
    return Driving(**values, volumes=volumes, ground=None if math.isnan(ground) else ground)
