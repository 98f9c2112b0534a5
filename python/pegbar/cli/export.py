"""`pegbar export`: an aligned shot for other 3D packages."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated, get_args

from cyclopts import Parameter

from pegbar.cli.secondary import bars
from pegbar.shot.export_stage import Format, export_notes, usable_formats, write_shot
from pegbar.shot.shot_scene import Tracked, shot_scene

_ALL = ",".join(get_args(Format))


def export(
    shot: Path,
    *,
    output: Annotated[
        Path | None, Parameter(name=["--output", "-o"], help="Folder (default: export beside it).")
    ] = None,
    formats: Annotated[str, Parameter(help="Which of usd, gltf, npz and blender to write, with commas.")] = _ALL,
    overwrite: Annotated[bool, Parameter(negative="", help="Align and measure again what is up to date.")] = False,
) -> int:
    """Write an aligned shot for other 3D packages; see `pegbar export --help`.

    Parameters
    ----------
    shot
        The shot file.
    """
    wanted, given = _formats(formats), formats != _ALL
    usable, lacking = usable_formats(wanted)
    if lacking and (given and not usable):
        raise ValueError(lacking[0])
    folder = output or shot.absolute().parent / "export"
    with bars() as tell:
        scene, notes = shot_scene(Tracked(shot, overwrite, folder), tell)
    for note in [*notes, *export_notes(scene, usable)]:
        print(f"pegbar: note: {note}", file=sys.stderr)
    written = write_shot(folder, scene, usable)
    width, height = scene.image_size
    print(
        f"export: frames {scene.frames[0]}-{scene.frames[-1]}, {width} x {height} pixels, "
        f"{', '.join(character.name for character in scene.characters)}"
    )
    print(f"export: written: {', '.join(path.name for path in written)}, in {os.path.relpath(folder)}")
    for problem in lacking:
        print(f"pegbar: {problem}; the other formats are written", file=sys.stderr)
    return 1 if lacking and given else 0


def _formats(text: str) -> list[Format]:
    known = {str(kind): kind for kind in get_args(Format)}
    names = [name.strip() for name in text.split(",") if name.strip()]
    if unknown := [name for name in names if name not in known]:
        raise ValueError(f"--formats: no format {', '.join(unknown)}: there is {', '.join(known)}")
    if not names:
        raise ValueError(f"--formats: want at least one of {', '.join(known)}")
    return [known[name] for name in names]
