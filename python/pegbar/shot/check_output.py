"""Preflight of what is written: folders that can be written, codecs that are there, and room on the disk."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import cv2

from pegbar.shot.plan import Shot
from pegbar.shot.problem import Problem

#: What a frame takes on the disk, bytes a pixel: a depth map, its picture, a finished frame, a rendered pass.
_DEPTH, _PICTURE, _FINISHED, _PASSES = 4, 1, 3, 12


def output_problems(shot: Shot) -> list[Problem]:
    """Return what stands in the way of writing the results of ``shot``."""
    return [*_folders(shot), *_codecs(shot), *_disk(shot)]


def _outputs(shot: Shot) -> dict[str, Path]:
    """Files or folders that the shot writes, by key; those of sections that it has not are left out."""
    settings = shot.settings
    found = {f"output.{key}": Path(sequence.pattern) for key, sequence in shot.outputs.items()}
    if settings.clip is not None:
        found |= {"align.output": shot.folder / settings.align.output / "alignment.npz"}
        found |= {"lift.output": shot.folder / settings.lift.output / f"preview.{settings.lift.preview}"}
    if settings.secondary is not None:
        found |= {"secondary.output": shot.folder / settings.secondary.output / "animation.png"}
        found |= {"secondary.frames": shot.folder / settings.secondary.frames}
    return found


def _folders(shot: Shot) -> Iterator[Problem]:
    refused: set[Path] = set()
    for key, path in _outputs(shot).items():
        folder = _existing(path.parent)
        if folder in refused:
            continue
        if not folder.is_dir() or not os.access(folder, os.W_OK | os.X_OK):
            refused.add(folder)
            what = f"{folder}: " + ("cannot be written" if folder.is_dir() else "is a file, not a folder")
            yield Problem(what, "give yourself the right to write there, or name another place", key, shot.place(key))


def _codecs(shot: Shot) -> Iterator[Problem]:
    """Pictures that this installation of OpenCV does not write; EXR files, arrays and GIFs need none."""
    for key, path in _outputs(shot).items():
        suffix = path.suffix.lower()
        if suffix in (".png", ".tif", ".tiff", ".jpg", ".jpeg", ".webp") and not cv2.haveImageWriter(f"a{suffix}"):
            what = f"no codec for {suffix} files here"
            yield Problem(what, "name another suffix, or install opencv-contrib-python-headless", key, shot.place(key))


def _disk(shot: Shot) -> Iterator[Problem]:
    """Whether the frames fit on the disk, roughly."""
    size = shot.settings.shot.size or (shot.annotations.image_size if shot.annotations is not None else None)
    if size is None:
        return
    rendered = shot.settings.passes is not None or shot.settings.secondary is not None
    per_pixel = _DEPTH + _PICTURE + (_FINISHED + _PASSES if rendered else 0)
    wanted = len(shot.frames) * size[0] * size[1] * per_pixel
    free = shutil.disk_usage(_existing(shot.folder)).free
    if wanted >= free:
        what = f"the shot may take {wanted / 1e9:.1f} GB, and {shot.folder} has {free / 1e9:.1f} GB left"
        yield Problem(what, "make room, or name outputs on another disk", "output", shot.place("output"))


def _existing(folder: Path) -> Path:
    return next(path for path in (folder, *folder.absolute().parents) if path.exists())
