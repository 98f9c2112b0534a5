"""`pegbar effects`: the presets of secondary motion, their settings, and a picture of each."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pegbar.cli.batch import progress
from pegbar.errors import PegbarError


def effects(
    name: Annotated[str | None, Parameter(help="A preset, to list all its settings (default: all presets).")] = None,
    *,
    gallery: Annotated[Path | None, Parameter(help="Folder for a picture of every preset, or of NAME.")] = None,
    shot: Annotated[Path | None, Parameter(help="Shot file for the pictures (default: the sample shot).")] = None,
    frame: Annotated[int | None, Parameter(help="Frame of the pictures (default: the shot's middle).")] = None,
    width: Annotated[int, Parameter(help="Width of the pictures in pixels.")] = 480,
) -> int:
    """List the effects; see `pegbar effects --help`."""
    from pegbar.sample.shot import write_sample
    from pegbar.simulate.preset_help import effect_line, effect_settings
    from pegbar.simulate.presets import PRESETS

    if name is not None and name not in PRESETS:
        raise ValueError(f"no preset {name!r}: there are {', '.join(PRESETS)}")
    if gallery is None:
        if shot is not None or frame is not None:
            raise ValueError("--shot and --frame want --gallery DIR, the folder for the pictures")
        print(effect_settings(name) if name else "\n".join(effect_line(preset) for preset in PRESETS))
        if name is None:
            print("\nAll settings of one: pegbar effects NAME")
        return 0
    if width < 16:
        raise ValueError(f"--width: want 16 or more, got {width}")
    presets = list(PRESETS) if name is None else [name]
    if shot is not None:
        return _draw(gallery, shot, presets, frame, width)
    with tempfile.TemporaryDirectory() as folder:
        return _draw(gallery, write_sample(folder), presets, frame, width)


def _draw(folder: Path, shot: Path, presets: list[str], frame: int | None, width: int) -> int:
    """Write the pictures; presets that the shot cannot have are named and make the exit code 1."""
    from pegbar.io.palette_png import write_palette_png
    from pegbar.shot.gallery import effect_pictures

    folder.mkdir(parents=True, exist_ok=True)
    failed = 0
    try:
        with progress("effects", len(presets)) as advance:
            for preset, picture in effect_pictures(shot, presets, frame=frame, width=width):
                advance()
                if isinstance(picture, str):
                    failed += 1
                    print(f"pegbar: {preset}: {picture}", file=sys.stderr)
                else:
                    write_palette_png(folder / f"{preset}.png", picture)
    except PegbarError as error:
        print(f"pegbar: {error}", file=sys.stderr)
        return 1
    print(f"effects: {len(presets) - failed} pictures in {folder}")
    return 1 if failed else 0
