"""`pegbar effects`: the presets of secondary motion, their settings, and a picture of each."""

from __future__ import annotations

import dataclasses
import re
import sys
import tempfile
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from pegbar.cli.batch import progress
from pegbar.errors import PegbarError
from pegbar.io.palette_png import write_palette_png
from pegbar.sample.shot import write_sample
from pegbar.shot.gallery import effect_pictures
from pegbar.simulate.presets import PRESETS


def effects(
    name: Annotated[str | None, Parameter(help="A preset, to list all its settings (default: all presets).")] = None,
    *,
    gallery: Annotated[Path | None, Parameter(help="Folder for a picture of every preset, or of NAME.")] = None,
    shot: Annotated[Path | None, Parameter(help="Shot file for the pictures (default: the sample shot).")] = None,
    frame: Annotated[int | None, Parameter(help="Frame of the pictures (default: the shot's middle).")] = None,
    width: Annotated[int, Parameter(help="Width of the pictures in pixels.")] = 480,
) -> int:
    """List the effects; see `pegbar effects --help`."""
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


def effect_line(preset: str) -> str:
    """Return what a preset makes, and its own settings with their defaults."""
    own = [field for field in dataclasses.fields(PRESETS[preset]) if field.name in _own(preset)]
    shown = ", ".join(f"{field.name} {_shown(field.default)}" for field in own)
    return f"{preset:<12} {_summary(preset)}\n{'':<12} {shown}"


def effect_settings(preset: str) -> str:
    """Return what a preset makes, what its settings mean, and all of them with their defaults."""
    kind = PRESETS[preset]
    words = [_plain(part.__doc__ or "") for part in kind.__mro__ if dataclasses.is_dataclass(part)]
    fields = dataclasses.fields(kind)
    widest = max(len(field.name) for field in fields)
    lines = [f"{field.name:<{widest}} = {_shown(field.default)}" for field in fields]
    return "\n".join([f'elements = [{{ preset = "{preset}" }}]', "", "\n\n".join(words), "", *lines])


def _draw(folder: Path, shot: Path, presets: list[str], frame: int | None, width: int) -> int:
    """Write the pictures; presets that the shot cannot have are named and make the exit code 1."""
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


def _own(preset: str) -> set[str]:
    """The settings that a preset does not share with others of its kind: those of its own class."""
    shared = {
        field.name
        for part in PRESETS[preset].__mro__[1:]
        if dataclasses.is_dataclass(part)
        for field in dataclasses.fields(part)
    }
    return {field.name for field in dataclasses.fields(PRESETS[preset])} - shared


def _summary(preset: str) -> str:
    """The first sentence of a preset's description."""
    first = re.split(r"(?<=[.:])\s", _plain(PRESETS[preset].__doc__ or ""), maxsplit=1)[0]
    return first.rstrip(".:")


def _plain(docstring: str) -> str:
    return "\n".join(line.strip() for line in docstring.strip().splitlines()).replace("``", "")


def _shown(value: Any) -> str:
    """A default as TOML has it; linear colours as #rrggbb."""
    if value is None:
        return "(from the character)"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        if len(value) == 4 and all(isinstance(part, float) for part in value) and value[3] == 1:
            return f'"#{"".join(f"{round(255 * _display(part)):02x}" for part in value[:3])}"'
        return f"[{', '.join(_shown(part) for part in value)}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _display(value: float) -> float:
    """Linear light to sRGB."""
    return 12.92 * value if value <= 0.0031308 else 1.055 * float(value) ** (1 / 2.4) - 0.055
