"""Pictures and clips to animations: what `pegbar animate` does with files (2007 paper)."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pegbar.io.ahead import map_ahead
from pegbar.io.film import check_film, write_film
from pegbar.io.frames import PICTURE_SUFFIXES, read_picture
from pegbar.io.motion import read_motion
from pegbar.io.puppet_input import find_joints
from pegbar.puppet.performance import Direction, Performance, perform
from pegbar.puppet.staging import Setting, Stage
from pegbar.report.contact_sheet import over_paper
from pegbar.scene.mirror import mirrored
from pegbar.scene.motion import Motion
from pegbar.shot.puppet import PuppetOptions, kept_puppet

Advance = Callable[[int, int], None]
#: The field of view of drawings, radians: they show less perspective than a photo, whose own is found.
DRAWN_VIEW = math.radians(20)
#: Suffixes of clips, for folders.
CLIP_SUFFIXES = (".bvh", ".amc", ".c3d")


@dataclass(frozen=True, kw_only=True)
class Casting:
    """How a figure is found in its picture.

    Attributes
    ----------
    joints, mask : Path, optional
        Files; None: looked for beside the picture.
    drives : dict of str to str
        Joint -> the marker that moves it, where another than found is wanted.
    options : PuppetOptions
        Without a field of view it is `DRAWN_VIEW` for drawings, and found for photos.
    mirror : bool
        Perform the clip's mirror image.
    keep : Path, optional
        The folder in which puppets are kept for the next run.
    """

    joints: Path | None = None
    mask: Path | None = None
    drives: Mapping[str, str] = field(default_factory=dict)
    options: PuppetOptions = field(default_factory=PuppetOptions)
    mirror: bool = False
    keep: Path | None = None


@dataclass(frozen=True)
class Part:
    """One figure in a scene: its ``picture``, and the ``clips`` that it performs one after another."""

    picture: Path
    clips: tuple[Path, ...]


@dataclass(frozen=True)
class Outcome:
    """What an animation came to: seconds before the first picture, seconds for all, ``frames``, and ``notes``."""

    output: Path
    setup: float
    seconds: float
    frames: int
    notes: tuple[str, ...]


def animate_parts(
    parts: Sequence[Part],
    output: Path,
    *,
    casting: Casting | None = None,
    direction: Direction | None = None,
    setting: Setting | None = None,
    progress: Advance | None = None,
) -> Outcome:
    """Animate the figures of ``parts`` in one scene and write it to ``output``.

    Parameters
    ----------
    parts : sequence of Part
        Several stand side by side; pictures behind them are the first one's.
    output : Path
        See `pegbar.io.film.check_film`.
    casting, direction, setting : optional
    progress : function, optional
        Told how many pictures are done, and of how many.

    Raises
    ------
    ValueError, OSError, MissingExtraError
        Before any work where ``output`` cannot be written; for broken files and impossible figures, naming them.
    """
    casting, direction, setting = casting or Casting(), direction or Direction(), setting or Setting()
    alpha = setting.background == "transparent"
    check_film(output, alpha=alpha)
    start = time.perf_counter()
    performances = [cast(part, casting, direction, setting) for part in parts]
    picture = over_paper(read_picture(_picture_of(parts[0]))) if setting.background == "picture" else None
    stage = Stage.of_performances(performances, setting, picture)
    ready = time.perf_counter()
    pictures = map_ahead(stage.picture, range(len(stage)))
    write_film(output, _told(pictures, len(stage), progress), performances[0].frame_rate, alpha=alpha)
    notes = tuple(dict.fromkeys(_told_by(parts, performances)))
    return Outcome(output, ready - start, time.perf_counter() - start, len(stage), notes)


def _told_by(parts: Sequence[Part], performances: Sequence[Performance]) -> Iterator[str]:
    """What a user should know; of several figures with the figure's name."""
    for part, made in zip(parts, performances, strict=True):
        name = f"{picture_name(part.picture)}: " if len(parts) > 1 else ""
        yield from (name + note for note in (*made.puppet.notes, *made.notes))


def cast(part: Part, casting: Casting, direction: Direction, setting: Setting) -> Performance:
    """Make a figure's puppet, or take the one that is kept, and let it perform its clips."""
    motions = [_clip(path, casting) for path in part.clips]
    options = dataclasses.replace(casting.options, background=setting.background == "completed")
    if options.field_of_view is None and not is_photo(part.picture):
        options = dataclasses.replace(options, field_of_view=DRAWN_VIEW)
    puppet = kept_puppet(
        part.picture,
        motions[0],
        clip=part.clips[0].stem,
        joints=casting.joints,
        mask=casting.mask,
        map=casting.drives,
        options=options,
        keep=casting.keep,
    )
    return perform(puppet, motions, direction)


def is_photo(picture: Path) -> bool:
    """Whether a picture is taken for a photo: a JPEG without a mask beside it."""
    return picture.suffix.lower() in (".jpg", ".jpeg") and not (picture.parent / "mask.png").is_file()


def find_pictures(path: Path) -> list[Path]:
    """The pictures with joint marks in a folder, or in the folders in it; a file is itself."""
    if not path.is_dir():
        return [path]
    found = []
    for folder in (path, *sorted(child for child in path.iterdir() if child.is_dir())):
        files = [file for file in sorted(folder.iterdir()) if file.suffix.lower() in PICTURE_SUFFIXES]
        texture = [file for file in files if file.name == "texture.png"]
        found += [file for file in texture or files if find_joints(file) is not None]
    return found


def find_clips(path: Path) -> list[Path]:
    """The clips in a folder; a file is itself."""
    if not path.is_dir():
        return [path]
    return sorted(file for file in path.iterdir() if file.suffix.lower() in CLIP_SUFFIXES)


def picture_name(picture: Path) -> str:
    """What to call an animation of ``picture``: its stem, or its folder's name for AnimatedDrawings' textures."""
    return picture.resolve().parent.name if picture.stem == "texture" else picture.stem


def _clip(path: Path, casting: Casting) -> Motion:
    motion = read_motion(path)
    return mirrored(motion) if casting.mirror else motion


def _picture_of(part: Part) -> Path:
    """The picture itself, where the part names the file that marks it."""
    if part.picture.suffix.lower() in PICTURE_SUFFIXES:
        return part.picture
    raise ValueError(f"picture: {part.picture} is no picture: name the picture itself to have it behind the figure")


def _told(pictures: Iterator[NDArray[np.uint8]], total: int, progress: Advance | None) -> Iterator[NDArray[np.uint8]]:
    for number, picture in enumerate(pictures, 1):
        yield picture
        if progress is not None:
            progress(number, total)
