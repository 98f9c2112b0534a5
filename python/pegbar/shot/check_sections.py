"""Preflight of what is not read frame by frame: marks, clip, lifting, and room on the disk."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path

import numpy as np

from pegbar.errors import describe
from pegbar.shot.align_stage import AlignStage
from pegbar.shot.clip_choice import check_part, read_clip
from pegbar.shot.plan import Shot
from pegbar.shot.secondary import secondary_problems

#: What a frame takes on the disk, bytes a pixel: a depth map, its picture, a finished frame, a rendered pass.
_DEPTH, _PICTURE, _FINISHED, _PASSES = 4, 1, 3, 12
_CLIPS = (".bvh", ".amc", ".c3d")


def section_problems(shot: Shot) -> list[str]:
    """Return what would stop or spoil `pegbar align`, `lift`, `secondary` and the frame stages, a line each."""
    section = shot.settings.secondary
    secondary = secondary_problems(section, shot.folder) if section is not None else []
    return [*_marks(shot), *_clip(shot), *_lift(shot), *secondary, *_disk(shot)]


def _marks(shot: Shot) -> list[str]:
    """Marks of too few joints, for shots that are to be aligned."""
    if shot.settings.clip is None:
        return []
    if shot.annotations is None:
        return ["clip: a clip is aligned with joint marks: drawing.annotations is missing"]
    stage = AlignStage(shot)
    if not stage.numbers:
        return ["drawing.annotations: they have no marks for the shot's drawings"]
    drawing = stage.drawing()
    seen = drawing.visible & np.isfinite(drawing.markers).all(axis=2)
    few = [number for number, row in zip(stage.numbers, seen, strict=True) if row.sum() < 4]
    return [f"drawing {number}: fewer than four joints are marked and seen: pegbar align needs them" for number in few]


def _clip(shot: Shot) -> list[str]:
    section = shot.settings.clip
    if section is None:
        return []
    if section.path is None:
        assert section.folder is not None
        folder = shot.folder / section.folder
        if not folder.is_dir():
            return [f"clip.folder: {folder}: no such folder"]
        if not any(path.suffix.lower() in _CLIPS for path in folder.rglob("*")):
            return [f"clip.folder: {folder}: no {', '.join(_CLIPS)} file in it"]
        return []
    try:
        motion = read_clip(section, shot.folder, shot.folder / section.path)
        check_part(motion, section)
    except (ValueError, OSError) as error:
        text = describe(error)
        return [text if text.startswith("clip") else f"clip: {text}"]
    if shot.annotations is None:
        return []
    there = {*motion.known_markers, *motion.names}
    lost = [name for name in shot.annotations.names if name not in there]
    if len(shot.annotations.names) - len(lost) < 4:
        return [f"clip.path: {section.path} has fewer than four of the drawing's joints: map them with clip.joints"]
    return [f"clip.path: {section.path} has no joint for {', '.join(lost)}: clip.joints maps them"] if lost else []


def _lift(shot: Shot) -> list[str]:
    section = shot.settings.lift
    problems = []
    for key in ("skeleton", "skeleton_joints"):
        name = getattr(section, key)
        if name is not None and not (shot.folder / name).is_file():
            problems.append(f"lift.{key}: {shot.folder / name}: no such file")
    if "usd" in section.formats and importlib.util.find_spec("pxr") is None:
        problems.append('lift.formats: USD needs more: pip install "pegbar[usd]"')
    return problems


def _disk(shot: Shot) -> list[str]:
    """Whether the frames fit on the disk, roughly."""
    size = shot.settings.shot.size or (shot.annotations.image_size if shot.annotations is not None else None)
    if size is None:
        return []
    rendered = shot.settings.passes is not None or shot.settings.secondary is not None
    per_pixel = _DEPTH + _PICTURE + (_FINISHED + _PASSES if rendered else 0)
    wanted = len(shot.frames) * size[0] * size[1] * per_pixel
    free = shutil.disk_usage(_existing(shot.folder)).free
    if wanted < free:
        return []
    return [f"output: the shot may take {wanted / 1e9:.1f} GB, and {shot.folder} has {free / 1e9:.1f} GB left"]


def _existing(folder: Path) -> Path:
    return next(path for path in (folder, *folder.absolute().parents) if path.exists())
