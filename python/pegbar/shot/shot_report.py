"""What every stage of a shot has left behind, on one page: settings, figures, overlays, plots, finished frames."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Collection, Mapping
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
from pegbar.report.figures import NEARNESS, SIDES, alignment_figures, lift_figures, secondary_figures
from pegbar.report.page import MEDIA, Figure, Picture, Section, data_address
from pegbar.shot.align_stage import AlignStage
from pegbar.shot.plan import Shot
from pegbar.shot.stages import CompositeStage, DepthStage, Stage

_WIDEST = 1600
_OVERLAYS = (
    "each drawing with the clip as broad pale lines and the drawn joints as thin ones (a ring: hidden there), and the "
    "same from the side, the camera to the left"
)
_WARP = "which of the clip's frames each drawing shows; below, how fast the clip runs there"
#: Of what stages leave in their folders the pictures to show, and what they show.
_CAPTIONS = {
    "animation": "the finished frames",
    "preview": "the result over the drawing, and turning on its floor",
    "sheet": "sheet of the results",
    "volumes": "limb boxes (thin lines; dashed: as wide as in other drawings) and collision volumes: left blue, right "
    "red, middle green",
}
_SHEETS = ("sheet", "volumes", "warp")
_Figures = Callable[[Mapping[str, Any]], tuple[Figure, ...]]
#: Larger animations than this are named, not held by the page.
_LARGEST = 12_000_000
_FRAMES = 12


def report_sections(shot: Shot) -> list[Section]:
    """Return a section for the shot and one for each stage that has run."""
    found = [_about(shot)]
    if shot.annotations is not None and shot.settings.clip is not None:
        found += _aligned(AlignStage(shot))
    # What was told of the alignment is not told again by what builds on it.
    told = {remark for section in found for remark in (*section.words, *section.warnings)}
    lift, secondary = shot.settings.lift, shot.settings.secondary
    for title, part, figures in (("Lift", lift, lift_figures), ("Secondary motion", secondary, secondary_figures)):
        folder = shot.folder / part.output if part is not None else None
        if folder is not None and (folder / "report.json").is_file():
            found.append(_stage_folder(title, folder, figures, told))
    return [*found, *_finished(shot)]


def has_results(sections: list[Section]) -> bool:
    """Whether `report_sections` found a stage that has run."""
    return len(sections) > 1


def _about(shot: Shot) -> Section:
    marks = shot.annotations
    rows = [
        Figure("frames", format_frames(list(shot.frames))),
        Figure("frames a second", f"{shot.settings.shot.frame_rate:g}"),
        Figure("drawings", f"{len({shot.exposure.drawing(frame) for frame in shot.frames})}"),
    ]
    if marks is not None:
        seen = marks.visible & np.isfinite(marks.markers).all(axis=2)
        rows += [
            Figure("joints", f"{len(marks.names)}"),
            Figure("joints seen in a drawing, on average", f"{seen.sum(axis=1).mean():.1f}"),
            Figure("size", "{} x {} pixels".format(*marks.image_size)),
        ]
    if shot.settings.clip is not None:
        rows.append(Figure("clip", shot.settings.clip.path or f"the best one in {shot.settings.clip.folder}"))
    return Section("The shot", table=tuple(rows))


def _aligned(stage: AlignStage) -> list[Section]:
    values, _, _, warp, sheet, *_ = stage.outputs()
    if not values.is_file():
        return []
    alignment = read_alignment(values)
    stale = () if stage.is_done() else ("Out of date: marks, clip or settings have changed. Run pegbar align.",)
    numbers = stage.numbers if len(stage.numbers) == len(alignment.errors) else range(len(alignment.errors))
    plot = error_plot(list(numbers), alignment.errors, alignment.figure_height)
    pictures = [_picture(path, caption) for path, caption in ((sheet, _OVERLAYS), (warp, _WARP)) if path.is_file()]
    return [
        Section(
            "Alignment",
            words=("The skeleton has to lie on the drawing in every picture.", *alignment.notes),
            warnings=(*stale, *alignment.warnings),
            table=alignment_figures(alignment, numbers),
            legend=SIDES,
            pictures=(*pictures, Picture(_embedded(plot), "how far the clip is from the drawn joints", wide=True)),
        )
    ]


def _stage_folder(title: str, folder: Path, figures: _Figures, told: Collection[str]) -> Section:
    """A stage that leaves a report.json, a sheet and perhaps an animation; without the remarks that were ``told``."""
    values: Mapping[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    notes, wrong = ([str(text) for text in values.get(key, ()) if text not in told] for key in ("notes", "warnings"))
    shown = [path for path in sorted(folder.iterdir()) if path.suffix.lower() in MEDIA and path.is_file()]
    shown = [path for path in shown if path.stem in _CAPTIONS]
    small = [path for path in shown if path.stem in _SHEETS or path.stat().st_size <= _LARGEST]
    # Others who get the page do not have this machine's folders.
    notes += [f"Too large for this page: {folder.name}/{path.name}" for path in shown if path not in small]
    pictures = tuple(_picture(path, _CAPTIONS[path.stem]) for path in small)
    legend = SIDES if title == "Lift" else ()
    return Section(title, tuple(notes), tuple(wrong), figures(values), legend, pictures=pictures)


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
        made = Figure("frames there", f"{len(there)} of {len(shot.frames)}")
        legend = NEARNESS if which else ()
        pictures = (Picture(_embedded(sheet), title.lower(), wide=True),)
        sections.append(Section(title, table=(made,), legend=legend, pictures=pictures))
    return sections


def _picture(path: Path, caption: str) -> Picture:
    """The file's picture, sheets no wider than a screen."""
    if path.stem in _SHEETS:
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
