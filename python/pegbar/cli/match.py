"""`pegbar match`: the clip that a drawn sequence is like."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from pegbar.errors import describe
from pegbar.io.numbers import format_frames, parse_frames

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pegbar.align.match import Matches
    from pegbar.io.clip_folder import ClipFolder
    from pegbar.scene.drawing import Drawing

# Drawings and matches on the contact sheet.
_KEYS, _ROWS = 6, 8


def match(
    annotations: Path,
    clips: Path,
    *,
    top: Annotated[int, Parameter(help="How many clips and segments to show.")] = 10,
    output: Annotated[
        Path | None, Parameter(name=("--output", "-o"), help="Folder for a contact sheet, match.png.")
    ] = None,
    frames: Annotated[str | None, Parameter(help="Drawings to look at, counted from 1, like 1-24.")] = None,
    frame_rate: Annotated[
        float | None, Parameter(help="Film frames a second, where the annotations do not say.")
    ] = None,
    write: Annotated[Path | None, Parameter(help="Shot file to put the best clip into.")] = None,
    index: Annotated[bool, Parameter(help="Keep an index, so that clips are read once.")] = True,
) -> int:
    """Rank clips and segments for a drawn sequence; see `pegbar match --help`.

    Parameters
    ----------
    annotations
        The drawing's joint marks.
    clips
        The folder of clips.
    """
    from pegbar.io.annotations import read_annotations
    from pegbar.report.match_table import report_left_out, report_matches
    from pegbar.shot.load import load_shot

    if frame_rate is not None and not frame_rate > 0:
        raise ValueError(f"--frame-rate: want frames a second above 0, got {frame_rate}")
    if write is not None:
        load_shot(write)
    if annotations.suffix.lower() == ".toml":
        raise ValueError(f"{annotations}: a shot file; want its joint marks, which drawing.annotations names")
    drawing = read_annotations(annotations)
    chosen = _chosen(frames, len(drawing.markers))
    folder = _read(clips, index)
    if not folder.clips:
        report_left_out(folder.broken, folder.skipped)
        print(f"pegbar: {clips}: no clip that can be used", file=sys.stderr)
        return 1
    found = _search(drawing, chosen, folder, frame_rate, top)
    report_left_out(folder.broken, {**folder.skipped, **found.skipped})
    report_matches(folder, found, [place + 1 for place in chosen])
    if output is not None and found.matches:
        _write_sheet(output, drawing, chosen, folder, found)
    _write_choice(write, clips, found)
    return 0


def _chosen(frames: str | None, count: int) -> list[int]:
    """Indices of the drawings to look at."""
    if frames is None:
        return list(range(count))
    wanted = sorted(parse_frames(frames))
    if strange := [number for number in wanted if not 1 <= number <= count]:
        raise ValueError(f"--frames: there is no drawing {format_frames(strange)} (there are {count})")
    return [number - 1 for number in wanted]


def _read(clips: Path, index: bool) -> ClipFolder:
    from pegbar.io.clip_folder import read_clips

    if not sys.stderr.isatty():
        return read_clips(clips, use_index=index)
    from rich.progress import Progress

    with Progress(transient=True) as bar:
        task = bar.add_task("read clips", total=None)
        return read_clips(
            clips, use_index=index, progress=lambda done, total: bar.update(task, completed=done, total=total)
        )


def _search(drawing: Drawing, chosen: list[int], folder: ClipFolder, frame_rate: float | None, top: int) -> Matches:
    import numpy as np

    from pegbar.align.match import match_clips

    holds = np.array(drawing.holds or [1] * len(drawing.markers), float)
    return match_clips(
        drawing.markers[chosen],
        drawing.names,
        folder.clips,
        visible=drawing.visible[chosen],
        frame_rate=frame_rate or drawing.frame_rate,
        holds=holds[chosen],
        loops=drawing.loops and len(chosen) == len(drawing.markers),
        top=top,
    )


def _write_sheet(output: Path, drawing: Drawing, chosen: list[int], folder: ClipFolder, found: Matches) -> None:
    # Pictures take long to import, and the table does without.
    import numpy as np

    from pegbar.io.frames import write_image
    from pegbar.report.match_sheet import SheetRow, match_sheet
    from pegbar.report.match_table import describe_match
    from pegbar.scene.body import MARKERS

    keys = np.unique(np.linspace(0, len(chosen) - 1, min(len(chosen), _KEYS)).round().astype(int))
    shown = [chosen[key] for key in keys]
    marks = np.full((len(keys), len(MARKERS), 2), np.nan)
    for place, name in enumerate(drawing.names):
        if name in MARKERS:
            marks[:, MARKERS.index(name)] = drawing.markers[shown, place]
    clips = {clip.name: clip for clip in folder.clips}
    rows = []
    for rank, match in enumerate(found.matches[:_ROWS], 1):
        points = match.camera.project(match.markers(clips[match.clip])[keys])
        captions = tuple(f"frame {match.times[key]:.1f}" for key in keys)
        rows.append(SheetRow(describe_match(rank, match, clips[match.clip]), points, captions))
    titles = [f"drawing {number + 1}" for number in shown]
    sheet = match_sheet(marks, titles, [_picture(drawing, number) for number in shown], rows)
    output.mkdir(parents=True, exist_ok=True)
    write_image(output / "match.png", sheet)
    print(f"match: wrote {output / 'match.png'}")


def _picture(drawing: Drawing, number: int) -> NDArray[np.uint8] | None:
    """The drawing's picture where there is one to be read; the sheet does without."""
    from pegbar.io.frames import read_picture

    try:
        return read_picture(drawing.images[number]) if drawing.images else None
    except (OSError, ValueError) as error:
        print(f"pegbar: warning: {describe(error)}", file=sys.stderr)
        return None


def _write_choice(shot: Path | None, clips: Path, found: Matches) -> None:
    """Put the best match into the shot file, or print what to put there."""
    from pegbar.shot.clip import clip_text, write_clip

    if not found.found:
        if shot is not None:
            print(f"match: {shot} is left as it is")
        return
    best, folder = found.matches[0], shot.parent if shot is not None else Path()
    section = {
        "path": Path(os.path.relpath(clips / best.clip, folder)).as_posix(),
        "start": best.start,
        "stop": best.stop,
        "azimuth": round(best.azimuth, 1),
        "elevation": round(best.elevation, 1),
        "mirrored": best.mirrored,
        "swapped": best.swapped,
    }
    if shot is None:
        print(f"\nFor the shot file:\n\n{clip_text(section)}", end="")
        return
    write_clip(shot, section)
    print(f"match: wrote [clip] to {shot}")
