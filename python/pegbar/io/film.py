"""Finished pictures to one file that plays, or to a numbered sequence: what can be written is known beforehand."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from numpy.typing import ArrayLike

from pegbar import arrays
from pegbar.io import video
from pegbar.io.animation import write_animation
from pegbar.io.atomic import clean_leftovers
from pegbar.io.frames import write_image
from pegbar.io.sequence import FrameSequence

_Path = str | os.PathLike[str]
#: Files that need no further library.
ANIMATIONS = (".gif", ".png", ".apng", ".webp")
#: Suffixes whose files keep alpha only as "shown or not", and those that have none.
ONE_BIT, OPAQUE = (".gif",), (".mp4",)


def is_sequence(path: _Path) -> bool:
    """Whether ``path`` names numbered files, as ``walk.####.png`` does."""
    return "#" in Path(path).name or "%" in Path(path).name


def check_film(path: _Path, *, alpha: bool = False) -> None:
    """Refuse what cannot be written, before any work: an unknown suffix, a codec or library that is missing, a folder.

    Parameters
    ----------
    path : path
        .gif, .png or .apng, .webp, .mp4, .mov, .webm, or a sequence like ``walk.####.png``.
    alpha : bool
        Whether what is transparent must stay so.

    Raises
    ------
    ValueError, MissingExtraError, FileNotFoundError
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise FileNotFoundError(2, "no such folder", str(path.parent))
    suffix = path.suffix.lower()
    if is_sequence(path):
        if suffix not in (".png", ".tif", ".tiff"):
            raise ValueError(f"{path}: want .png or .tif for a sequence, got {suffix!r}")
        FrameSequence.parse(path)
    elif suffix in video.SUFFIXES:
        video.find_codec(path, alpha=alpha)
    elif suffix not in ANIMATIONS:
        raise ValueError(
            f"{path}: want a suffix of {', '.join((*ANIMATIONS, *video.SUFFIXES))} or a sequence like walk.####.png, "
            f"got {suffix!r}"
        )


def write_film(path: _Path, frames: Iterable[ArrayLike], frame_rate: float, *, alpha: bool = False) -> None:
    """Write pictures (H, W, 3|4) uint8 as ``path`` says, see `check_film`; sequences count from 1.

    What killed runs left in its folder is cleared first.

    Raises
    ------
    ValueError
        As `check_film`, and for no frames or frames that differ in size.
    OSError
        When a file cannot be written.
    """
    check_film(path, alpha=alpha)
    clean_leftovers(Path(path).parent)
    if is_sequence(path):
        sequence, shape = FrameSequence.parse(path), None
        for number, frame in enumerate(frames, 1):
            picture = arrays.image(f"frames[{number - 1}]", frame)
            arrays.same_size(f"frames[{number - 1}]", picture, "the first frame", shape or picture.shape)
            shape = picture.shape
            write_image(sequence.path(number), picture)
    elif Path(path).suffix.lower() in video.SUFFIXES:
        video.write_video(path, frames, frame_rate, alpha=alpha)
    else:
        write_animation(path, frames, frame_rate)
