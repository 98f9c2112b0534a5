"""`pegbar match`: the clip that a drawn sequence is like."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from pegbar.errors import describe
from pegbar.io.numbers import file_numbers, format_frames, parse_frames

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pegbar.align.match import Matches
    from pegbar.io.clip_folder import ClipFolder
    from pegbar.scene.drawing import Drawing
    from pegbar.shot.drawn_timing import Timing

# Drawings and matches on the contact sheet.
_KEYS, _ROWS = 6, 8


def match(
    annotations: Path,
    clips: Path,
    /,
    *,
    top: Annotated[int, Parameter(help="How many clips and segments to show.")] = 10,
    output: Annotated[
        Path | None, Parameter(name=("--output", "-o"), help="Folder for a contact sheet, match.png.")
    ] = None,
    frames: Annotated[str | None, Parameter(help="Drawings to look at, by their files' numbers, like 1-24.")] = None,
    frame_rate: Annotated[
        float | None, Parameter(help="Film frames a second (default: the marks' or shot file's; else found).")
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
    from pegbar.scene.joints import misspelt_markers
    from pegbar.shot.drawn_timing import drawn_timing

    if frame_rate is not None and not frame_rate > 0:
        raise ValueError(f"--frame-rate: want frames a second above 0, got {frame_rate}")
    if annotations.suffix.lower() == ".toml":
        raise ValueError(f"{annotations}: a shot file; want its joint marks, which drawing.annotations names")
    drawing = read_annotations(annotations)
    if wrong := misspelt_markers(drawing.names):
        known = ", ".join(f"{name!r} (did you mean {near!r}?)" for name, near in wrong.items())
        raise ValueError(f"{annotations}: no marker is called {known}")
    timing = drawn_timing(drawing, write, frame_rate)
    chosen = _chosen(frames, _numbers(drawing))
    folder = _read(clips, index)
    if not folder.clips:
        report_left_out(folder.broken, folder.skipped)
        print(f"pegbar: {clips}: no clip that can be used", file=sys.stderr)
        return 1
    found = _search(drawing, chosen, folder, timing, top)
    report_left_out(folder.broken, {**folder.skipped, **found.skipped})
    words = timing.words(found.matches[0].drawing_rate) if found.matches else ""
    report_matches(folder, found, words, [_numbers(drawing)[place] for place in chosen])
    if output is not None and found.matches:
        _write_sheet(output, drawing, chosen, folder, found, write)
    _write_choice(write, clips, found, timing)
    return 0


def _numbers(drawing: Drawing) -> list[int]:
    """The drawings' numbers, as their files have them; counted from 1 where they have none."""
    return file_numbers(drawing.images) or list(range(1, len(drawing.markers) + 1))


def _chosen(frames: str | None, numbers: list[int]) -> list[int]:
    """Indices of the drawings to look at."""
    if frames is None:
        return list(range(len(numbers)))
    wanted = sorted(parse_frames(frames))
    if strange := [number for number in wanted if number not in numbers]:
        raise ValueError(f"--frames: there is no drawing {format_frames(strange)} (there are {format_frames(numbers)})")
    return [numbers.index(number) for number in wanted]


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


def _search(drawing: Drawing, chosen: list[int], folder: ClipFolder, timing: Timing, top: int) -> Matches:
    from pegbar.align.match import match_clips

    return match_clips(
        drawing.markers[chosen],
        drawing.names,
        folder.clips,
        visible=drawing.visible[chosen],
        frame_rate=timing.rate,
        holds=timing.holds[chosen],
        loops=drawing.loops and len(chosen) == len(drawing.markers),
        top=top,
    )


def _write_sheet(
    output: Path, drawing: Drawing, chosen: list[int], folder: ClipFolder, found: Matches, shot: Path | None
) -> None:
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
        captions = tuple(f"clip frame {match.times[key]:.1f}" for key in keys)
        rows.append(SheetRow(describe_match(rank, match, clips[match.clip]), points, captions))
    titles = [f"drawing {_numbers(drawing)[place]}" for place in shown]
    sheet = match_sheet(marks, titles, _pictures(drawing, shown, shot), rows)
    output.mkdir(parents=True, exist_ok=True)
    write_image(output / "match.png", sheet)
    print(f"match: wrote {output / 'match.png'}")


def _pictures(drawing: Drawing, places: list[int], shot: Path | None) -> list[NDArray[np.uint8] | None]:
    """The drawings' pictures: those that the marks name, else the shot's of that name; the sheet does without."""
    from pegbar.io.frames import read_picture

    if not drawing.images:
        return [None] * len(places)
    known = _shot_pictures(shot)
    found: list[NDArray[np.uint8] | None] = []
    problems = []
    for place in places:
        named = drawing.images[place]
        try:
            found.append(read_picture(named if named.is_file() else known.get(named.name, named)))
        except (OSError, ValueError) as error:
            found.append(None)
            problems.append(describe(error))
    if problems:
        more = f" (and so {len(problems) - 1} more)" if problems[1:] else ""
        print(f"pegbar: warning: {problems[0]}{more}: the sheet shows these marks without pictures", file=sys.stderr)
    return found


def _shot_pictures(shot: Path | None) -> dict[str, Path]:
    """The shot's drawings by their files' names, for marks that came from another folder."""
    if shot is None:
        return {}
    from pegbar.io.sequence import FrameSequence
    from pegbar.shot.load import load_shot

    drawings = FrameSequence.parse(shot.parent / load_shot(shot).drawing.frames)
    return {path.name: path for path in map(drawings.path, drawings.numbers)}


def _write_choice(shot: Path | None, clips: Path, found: Matches, timing: Timing) -> None:
    """Put the best match, and the frame rate it was found with, into the shot file, or print what to put there."""
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
    # The clip's frames belong to this rate: another one would make aligning look for other frames.
    rate = timing.rate or best.drawing_rate
    if shot is None:
        open_rate = f"[shot]\nframe_rate = {rate:g}\n\n" if timing.rate is None else ""
        print(f"\nFor the shot file:\n\n{open_rate}{clip_text(section)}", end="")
        return
    write_clip(shot, section, frame_rate=None if rate == timing.said else rate)
    print(f"match: wrote [clip]{'' if rate == timing.said else f' and frame_rate = {rate:g}'} to {shot}")
