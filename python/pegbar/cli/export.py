"""`pegbar export`: an aligned shot for other 3D packages."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from pegbar.cli.secondary import bars
from pegbar.io.hold import hold

_ALL = "usd,gltf,npz,blender,exposure"


def export(
    shot: Path,
    /,
    *,
    output: Annotated[
        Path | None, Parameter(name=["--output", "-o"], help="Folder (default: export, beside the shot file).")
    ] = None,
    formats: Annotated[str, Parameter(help="What to write, with commas.")] = _ALL,
    camera: Annotated[
        Literal["sheet", "drawn"], Parameter(help="As the exposure sheet's camera sees it, or as it is drawn.")
    ] = "sheet",
    overwrite: Annotated[bool, Parameter(negative="", help="Align and measure again what is up to date.")] = False,
) -> int:
    """Write an aligned shot for other 3D packages; see `pegbar export --help`.

    Parameters
    ----------
    shot
        The shot file.
    """
    from pegbar.shot.export_stage import export_notes, parse_formats, usable_formats, write_shot
    from pegbar.shot.shot_scene import Tracked, film_scene, shot_scene

    usable, lacking = usable_formats(parse_formats(formats))
    if not usable:
        raise ValueError(lacking[0])
    folder = output or shot.absolute().parent / "export"
    tracked = Tracked(shot, overwrite, folder)
    with bars() as tell:
        scene, remarks = shot_scene(tracked, tell)
    if camera == "sheet":
        scene = film_scene(scene, tracked)
    remarks.add(export_notes(scene, usable), made=True)
    for line in remarks.lines(shot):
        print(f"pegbar: {line}", file=sys.stderr)
    with hold(folder):
        written = write_shot(folder, scene, usable)
    width, height = scene.image_size
    print(
        f"export: frames {scene.frames[0]}-{scene.frames[-1]}, {width} x {height} pixels, "
        f"{', '.join(character.name for character in scene.characters)}"
    )
    print(f"export: written: {', '.join(path.name for path in written)}, in {os.path.relpath(folder)}")
    for problem in lacking:
        print(f"pegbar: {problem}; the other formats are written", file=sys.stderr)
    return 1 if lacking and formats != _ALL else 0
