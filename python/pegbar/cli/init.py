"""`pegbar init`: a shot file for a folder of drawn frames."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def init(
    folder: Path,
    /,
    *,
    drawings: Annotated[str | None, Parameter(help="The drawn frames, like d.####.png, if there is a choice.")] = None,
    exposure: Annotated[
        Path | None, Parameter(help="An exposure sheet (CSV or XDTS): which frame shows which.")
    ] = None,
    output: Annotated[Path | None, Parameter(help="The shot file (default: FOLDER/shot.toml).")] = None,
    overwrite: Annotated[bool, Parameter(negative="", help="Replace a shot file that is there.")] = False,
) -> int:
    """Write a shot file for the drawn frames in a folder; see `pegbar init --help`.

    Parameters
    ----------
    folder
        The folder with the drawn frames.
    """
    from pegbar.io.atomic import complete_file
    from pegbar.shot.start import start_shot

    if not folder.is_dir():
        raise NotADirectoryError(f"{folder}: no such folder")
    target = output or folder / "shot.toml"
    if target.exists() and not overwrite:
        raise FileExistsError(f"{target}: is there already (--overwrite replaces it)")
    text = start_shot(folder, drawings, exposure)
    with complete_file(target) as part:
        part.write_text(text, encoding="utf-8")
    if exposure is not None:
        _tell_of_camera(exposure)
    print(f"init: wrote {target}; look it over, then run: pegbar check {target}")
    return 0


def _tell_of_camera(exposure: Path) -> None:
    from pegbar.io.exposure_sheet import read_exposure_sheet

    sheet = read_exposure_sheet(exposure)
    if sheet.camera:
        columns = ", ".join(dict.fromkeys(cell.column for cell in sheet.camera))
        print(
            f"init: the sheet moves the camera ({columns}): finished frames are what it sees of the drawings; if these "
            'are seen through it already, write drawing.camera = "drawn"'
        )
    if sheet.instructions:
        print(f"init: camera work in words is not used ({', '.join(sheet.instructions)}): write it as numbers")
