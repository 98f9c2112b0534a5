"""The stage that makes a 3D animation of a shot's drawing, and the files that 3D packages open."""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.export.gltf import glb
from pegbar.export.usd import usd_layer
from pegbar.io import atomic
from pegbar.io.bvh import write_bvh
from pegbar.io.frames import read_picture, write_image
from pegbar.io.numbers import parse_frames
from pegbar.report.lift_sheet import lift_row
from pegbar.scene.alignment import Alignment
from pegbar.scene.motion import Motion
from pegbar.shot.align_stage import AlignStage
from pegbar.shot.alignment import as_drawn
from pegbar.shot.clip_choice import read_clip
from pegbar.shot.lifting import Lifted, LiftOptions, lift_drawing, on_film
from pegbar.shot.record import fingerprint, is_up_to_date, write_record

VERSION = 1
_SHEET = 12


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
        formats = dict.fromkeys(self.align.shot.settings.lift.formats)
        names = ["report.json", "sheet.png", *(_NAMES[kind] for kind in formats)]
        return [self.folder / name for name in names]

    def run(self) -> tuple[dict[str, Any], bool]:
        """Align what is out of date, lift, and write; return the report and whether anything was made.

        Raises ShotError, ValueError and OSError as `AlignStage.run` does, ValueError for a clip without a skeleton, and
        MissingExtraError for a format whose library is not installed.
        """
        alignment, _ = self.align.run()
        report = self.outputs()[0]
        if self.is_done():
            found: dict[str, Any] = json.loads(report.read_text(encoding="utf-8"))
            return found, False
        shot = self.align.shot
        assert shot.settings.clip is not None
        motion = read_clip(shot.settings.clip, shot.folder, Path(alignment.clip_path))
        clip = as_drawn(motion, alignment.mirrored, alignment.swapped, shot.settings.align.floor)
        holds = self.align.holds()
        rate = shot.settings.shot.frame_rate / float(holds.mean())
        lifted = lift_drawing(alignment, clip, rate, self._options())
        self.folder.mkdir(parents=True, exist_ok=True)
        values = quality(alignment, lifted)
        self._write(alignment, lifted, holds)
        atomic.write_bytes(report, json.dumps(values, indent=1).encode())
        write_record(self.outputs(), self._recipe(), [fingerprint(path) for path in self._inputs()])
        return values, True

    def is_done(self) -> bool:
        """Whether the results stand and nothing that they depend on has changed."""
        return not self.overwrite and is_up_to_date(self.outputs(), self._recipe(), self._inputs())

    def _options(self) -> LiftOptions:
        section, order = self.align.shot.settings.lift, self.align.numbers
        flips = []
        for flip in section.flips:
            for number in parse_frames(flip.drawings):
                if number not in order:
                    raise ValueError(f"lift.flips: there is no drawing {number}")
                place = order.index(number)
                flips.append((flip.joint, place, place + 1))
        return LiftOptions(section.depth, section.stretch, section.planted, tuple(flips))

    def _inputs(self) -> list[Path]:
        return [self.align.outputs()[0]]

    def _recipe(self) -> str:
        settings = self.align.shot.settings
        parts = [VERSION, settings.lift.model_dump(), settings.shot.frame_rate, self.align.holds().tolist()]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()

    def _write(self, alignment: Alignment, lifted: Lifted, holds: NDArray[np.float64]) -> None:
        shot = self.align.shot
        section, film_rate = shot.settings.lift, shot.settings.shot.frame_rate
        film = on_film(
            lifted.motion,
            holds.astype(int).tolist(),
            film_rate,
            stepped=section.interpolation == "step",
            rate=section.frame_rate or film_rate,
            loop=section.loop,
        )
        for kind in dict.fromkeys(section.formats):
            path = self.folder / _NAMES[kind]
            if kind == "bvh":
                write_bvh(path, film, stretch=section.stretch)
            elif kind == "glb":
                atomic.write_bytes(path, glb(film, interpolation=section.interpolation, name=path.stem))
            elif kind == "usd":
                _write_usd(path, film)
            elif kind == "csv":
                atomic.write_bytes(path, marker_table(self.align.numbers, lifted).encode())
            else:
                _write_arrays(path, lifted)
        numbers = self.align.numbers
        chosen = np.unique(np.linspace(0, len(numbers) - 1, min(_SHEET, len(numbers))).round().astype(int))
        rows = [
            lift_row(read_picture(shot.drawings.path(numbers[i])), alignment, lifted.markers[i], lifted.names, int(i))
            for i in chosen
        ]
        write_image(self.folder / "sheet.png", np.concatenate(rows))


_NAMES = {
    "bvh": "animation.bvh",
    "glb": "animation.glb",
    "usd": "animation.usda",
    "csv": "markers.csv",
    "npz": "markers.npz",
}


def quality(alignment: Alignment, lifted: Lifted) -> dict[str, Any]:
    """What a user asks of a lifted drawing, as numbers with their units in their names."""
    known = [alignment.names.index(name) for name in lifted.names]
    posed = lifted.motion.markers(lifted.names)
    seen = ~alignment.estimated[:, known]

    def off(points: NDArray[np.float64]) -> float:
        views = np.stack([view.project(place) for view, place in zip(alignment.cameras, points, strict=True)])
        distance = np.linalg.norm(views - alignment.markers[:, known], axis=2)[seen]
        return float(np.sqrt(np.mean(distance**2)))

    ends = np.array(lifted.bones)
    lengths = np.linalg.norm(lifted.markers[:, ends[:, 1]] - lifted.markers[:, ends[:, 0]], axis=2)
    usual = np.median(lengths, axis=0)
    both = lifted.planted[1:] & lifted.planted[:-1]
    slide = np.linalg.norm(np.diff(posed, axis=0), axis=2)[both]
    return {
        "drawings": len(posed),
        "marker_reprojection_px": off(lifted.markers),
        "skeleton_reprojection_px": off(posed),
        "limb_length_residual": float(np.sqrt(np.mean((lengths / np.maximum(usual, 1e-9) - 1) ** 2))),
        "skeleton_to_markers_m": float(np.sqrt(np.mean(np.sum((posed - lifted.markers) ** 2, axis=2)))),
        "foot_slide_m_per_drawing": float(slide.mean()) if slide.size else None,
        "to_clip_m": float(np.sqrt(np.mean(np.sum((posed - alignment.clip[:, known]) ** 2, axis=2)))),
    }


def marker_table(numbers: Sequence[int], lifted: Lifted) -> str:
    """The markers as CSV: one row a drawing and marker, metres."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["drawing", "marker", "x", "y", "z"])
    for number, places in zip(numbers, lifted.markers, strict=True):
        for name, place in zip(lifted.names, places.tolist(), strict=True):
            table.writerow([number, name, *(round(value, 6) for value in place)])
    return text.getvalue()


def _write_usd(path: Path, film: Motion) -> None:
    with atomic.complete_file(path) as part:
        if not usd_layer(film).Export(str(part)):
            raise OSError(f"{path}: could not be written")


def _write_arrays(path: Path, lifted: Lifted) -> None:
    with atomic.complete_file(path) as part, part.open("wb") as file:
        np.savez_compressed(
            file, names=np.array(lifted.names), markers=lifted.markers, planted=lifted.planted, bones=lifted.bones
        )
