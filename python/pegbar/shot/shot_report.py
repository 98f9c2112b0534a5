"""What every stage of a shot has left behind, on one page: settings, figures, overlays, plots, finished frames."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.io.alignment import read_alignment
from pegbar.io.frames import read_picture
from pegbar.io.numbers import format_frames
from pegbar.report.contact_sheet import contact_sheet
from pegbar.report.error_plot import error_plot
from pegbar.report.page import MEDIA, Picture, Section, data_address
from pegbar.scene.alignment import Alignment
from pegbar.shot.align_stage import AlignStage
from pegbar.shot.plan import Shot
from pegbar.shot.stages import CompositeStage, DepthStage, Stage

_WIDEST = 1600
#: Larger animations than this are named, not held by the page.
_LARGEST = 12_000_000
_FRAMES = 12


def report_sections(shot: Shot) -> list[Section]:
    """Return a section for the shot and one for each stage that has run."""
    found = [_about(shot)]
    if shot.annotations is not None and shot.settings.clip is not None:
        found += _aligned(AlignStage(shot))
    for title, part in (("Lift", shot.settings.lift), ("Secondary motion", shot.settings.secondary)):
        folder = shot.folder / part.output if part is not None else None
        if folder is not None and (folder / "report.json").is_file():
            found.append(_stage_folder(title, folder))
    return [*found, *_finished(shot)]


def has_results(sections: list[Section]) -> bool:
    """Whether `report_sections` found a stage that has run."""
    return len(sections) > 1


def _about(shot: Shot) -> Section:
    marks = shot.annotations
    rows = [
        ("frames", format_frames(list(shot.frames))),
        ("frames a second", f"{shot.settings.shot.frame_rate:g}"),
        ("drawings", f"{len({shot.exposure.drawing(frame) for frame in shot.frames})}"),
    ]
    if marks is not None:
        seen = marks.visible & np.isfinite(marks.markers).all(axis=2)
        rows += [("joints", f"{len(marks.names)}"), ("joints seen in a drawing", f"{seen.sum(axis=1).mean():.1f}")]
        rows += [("size", "{} x {}".format(*marks.image_size))]
    if shot.settings.clip is not None:
        rows.append(("clip", shot.settings.clip.path or f"the best one in {shot.settings.clip.folder}"))
    return Section("The shot", table=tuple(rows))


def _aligned(stage: AlignStage) -> list[Section]:
    values, _, _, warp, sheet, *_ = stage.outputs()
    if not values.is_file():
        return []
    alignment = read_alignment(values)
    stale = () if stage.is_done() else ("Out of date: marks, clip or settings have changed. Run pegbar align.",)
    heights = np.nanmax(alignment.markers[..., 1], axis=1) - np.nanmin(alignment.markers[..., 1], axis=1)
    numbers = stage.numbers if len(stage.numbers) == len(alignment.errors) else range(len(alignment.errors))
    plot = error_plot(list(numbers), alignment.errors, float(np.median(heights)))
    pictures = [
        _picture(path, caption) for path, caption in ((sheet, "overlays"), (warp, "time warp")) if path.is_file()
    ]
    return [
        Section(
            "Alignment",
            words=alignment.notes,
            warnings=(*stale, *alignment.warnings),
            table=tuple(_alignment_rows(alignment, float(np.median(heights)))),
            pictures=(*pictures, Picture(_embedded(plot), "how far the clip is from the marks", wide=True)),
        )
    ]


def _alignment_rows(alignment: Alignment, height: float) -> list[tuple[str, str]]:
    camera, usual = alignment.cameras[0], float(np.median(alignment.errors))
    return [
        ("clip", alignment.clip_path),
        ("camera", f"{alignment.mode}, {math.degrees(camera.field_of_view):.0f} degrees wide"),
        ("the clip's root", alignment.root.replace("_", " ")),
        ("clip to marks, median", f"{usual:.1f} px, {usual / height:.1%} of the figure's height"),
        ("clip to marks, worst drawing", f"{alignment.errors.max():.1f} px"),
        ("hidden joints guessed", f"{int(alignment.estimated.sum())} of {alignment.estimated.size}"),
        ("feet put on the ground", f"{int(alignment.grounded.sum())}"),
    ]


def _stage_folder(title: str, folder: Path) -> Section:
    """A stage that leaves a report.json, a sheet and perhaps an animation."""
    values: Mapping[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    words = [str(note) for note in values.get("notes", ())]
    shown = [path for path in sorted(folder.iterdir()) if path.suffix.lower() in MEDIA and path.is_file()]
    shown = [path for path in shown if path.stem in ("sheet", "preview", "animation")]
    small = [path for path in shown if path.stem == "sheet" or path.stat().st_size <= _LARGEST]
    words += [f"Too large for this page: {path}" for path in shown if path not in small]
    pictures = [_picture(path, path.stem) for path in small]
    wrong = tuple(str(warning) for warning in values.get("warnings", ()))
    return Section(title, words=tuple(words), warnings=wrong, table=tuple(_rows(values)), pictures=tuple(pictures))


def _rows(values: Mapping[str, Any], prefix: str = "") -> list[tuple[str, str]]:
    """The plain numbers and words of a report, those of its parts after theirs."""
    rows = []
    for key, value in values.items():
        name = f"{prefix}{key.replace('_', ' ')}"
        if isinstance(value, Mapping):
            rows += _rows(value, f"{name}: ")
        elif isinstance(value, bool) or value is None or isinstance(value, str):
            rows.append((name, "-" if value is None else str(value)))
        elif isinstance(value, int | float):
            rows.append((name, f"{value:.4g}" if isinstance(value, float) else str(value)))
    return rows


def _finished(shot: Shot) -> list[Section]:
    """Depth pictures and finished frames, as many as are there."""
    sections = []
    stages: dict[str, tuple[Stage, int]] = {"Depth of the drawing": (DepthStage(shot), 1)}
    if shot.settings.passes is not None:
        stages["Finished frames"] = (CompositeStage(shot), 0)
    for title, (stage, which) in stages.items():
        paths = [stage.outputs(frame)[which:][:1] for frame in shot.frames]
        there = [path for found in paths for path in found if path.is_file() and path.suffix.lower() != ".exr"]
        if not there:
            continue
        chosen = [there[index * len(there) // min(len(there), _FRAMES)] for index in range(min(len(there), _FRAMES))]
        sheet = contact_sheet([read_picture(path) for path in chosen], columns=4, width=380)
        made = ("frames there", f"{len(there)} of {len(shot.frames)}")
        sections.append(Section(title, table=(made,), pictures=(Picture(_embedded(sheet), title.lower(), wide=True),)))
    return sections


def _picture(path: Path, caption: str) -> Picture:
    """The file's picture, sheets no wider than a screen."""
    if path.stem in ("sheet", "warp"):
        return Picture(_embedded(read_picture(path)), caption, wide=True)
    return Picture(data_address(path.read_bytes(), path.suffix), caption)


def _embedded(picture: NDArray[np.uint8]) -> str:
    height, width = picture.shape[:2]
    if width > _WIDEST:
        size = (_WIDEST, max(1, round(height * _WIDEST / width)))
        picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.uint8)
    order = cv2.COLOR_RGBA2BGRA if picture.shape[2] == 4 else cv2.COLOR_RGB2BGR
    held = io.BytesIO(cv2.imencode(".png", cv2.cvtColor(picture, order))[1].tobytes())
    return data_address(held.getvalue(), ".png")
