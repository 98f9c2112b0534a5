"""A shot's cameras and characters for other packages, from its shot file: aligned and measured where out of date."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from pegbar.export.shot_scene import ShotScene, filmed
from pegbar.shot.dots_stage import DotsStage
from pegbar.shot.load import load_shot
from pegbar.shot.model import SecondarySection
from pegbar.shot.plan import Shot
from pegbar.shot.remarks import Remarks
from pegbar.shot.secondary import Secondary
from pegbar.shot.secondary_stage import Progress


@dataclass(frozen=True, eq=False)
class Tracked(Secondary):
    """The characters of the shot file ``path`` in 3D, also of one without a ``[secondary]`` section.

    Its results are then in ``spare``, else where `pegbar secondary` has them.
    """

    spare: Path = Path("export")

    @cached_property
    def section(self) -> SecondarySection:
        """The shot's ``[secondary]``, or one that asks for nothing."""
        return load_shot(self.path).secondary or SecondarySection()

    @property
    def folder(self) -> Path:
        """Where the characters' volumes are kept."""
        if load_shot(self.path).secondary is None:
            return self.spare
        return super().folder


def shot_scene(tracked: Tracked, progress: Progress | None = None) -> tuple[ShotScene, Remarks]:
    """Return the shot's cameras and characters for every film frame, and what was assumed or looks wrong.

    Reads dots, aligns, and finds limb boxes and volumes where that is out of date; raises what these stages raise.
    """
    remarks = Remarks()
    dots = DotsStage(tracked.path, tracked.overwrite)
    if dots.is_wanted:
        told, made = dots.run()
        remarks.add(told, made=made)
    for stage in tracked.stages:
        tell = None if progress is None else lambda done, total: progress("align", done, total)
        alignment, made = stage.align(tell)
        if alignment is not None:
            remarks.add(alignment.notes, alignment.warnings, made=made)
    drivings = []
    for stage in tracked.stages:
        tell = None if progress is None else lambda done, total: progress("volumes", done, total)
        driving, made = stage.run(tell)
        remarks.add(warnings=driving.notes, made=made)
        drivings.append(driving)
    characters, scene = tracked.characters(drivings)
    shot, known = tracked.stages[0].bare, set(drivings[0].numbers)
    drawings = tuple(_drawing(shot, frame) for frame in tracked.frames)
    if lost := sum(number not in known for number in drawings):
        told = (f"{lost} of {len(drawings)} frames show no drawing with marks: characters are hidden there",)
        remarks.add(told, made=True)
    found = ShotScene(
        tracked.names[0],
        tracked.frames,
        scene.frame_rate,
        drawings,
        scene.cameras,
        tuple(characters),
        scene.ground,
        tuple(None if number is None else shot.drawings.path(number) for number in drawings),
    )
    return found, remarks


def film_scene(scene: ShotScene, tracked: Tracked) -> ShotScene:
    """Return ``scene`` as the camera of the shot's exposure sheet sees it, if it has one that is to be used."""
    shot = tracked.stages[0].bare
    return filmed(scene, shot.moves, shot.settings.output.size)


def _drawing(shot: Shot, frame: int) -> int | None:
    try:
        return shot.exposure.drawing(frame)
    except ValueError:
        return None
