"""`pegbar import-passes`: what another package rendered, checked and brought into pegbar's convention."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from pegbar.cli.batch import BatchOptions, progress
from pegbar.cli.secondary import bars

if TYPE_CHECKING:
    from pegbar.io.sequence import FrameSequence
    from pegbar.shot.import_stage import ImportStage
    from pegbar.shot.incoming import Finding
    from pegbar.shot.passes_check import ImportOptions, Judgement


def import_passes(
    shot: Path,
    *passes: str,
    output: Annotated[
        Path | None, Parameter(name=["--output", "-o"], help="Folder (default: imported, beside the shot file).")
    ] = None,
    frames: Annotated[str | None, Parameter(help="Frames to take, like 1-48 (default: the shot's).")] = None,
    shift: Annotated[int, Parameter(help="Film frame of a file less its number.")] = 0,
    layer: Annotated[str | None, Parameter(help="The layer to take where there are several.")] = None,
    depth: Annotated[
        Literal["planar", "radial", "inverse"] | None, Parameter(help="What the depth is (default: found out).")
    ] = None,
    unit: Annotated[str | None, Parameter(help="Its unit: m, cm, mm, inch, foot (default: found out).")] = None,
    alpha: Annotated[
        Literal["premultiplied", "straight"] | None, Parameter(help="What alpha is (default: found out).")
    ] = None,
    camera: Annotated[
        Literal["sheet", "drawn"] | None, Parameter(help="Which export it was rendered for (default: found out).")
    ] = None,
    check: Annotated[bool, Parameter(negative="", help="Only check; write nothing.")] = False,
) -> int:
    """Check and take passes that another package rendered; see `pegbar import-passes --help`.

    Parameters
    ----------
    shot
        The shot file.
    passes
        EXR sequences, like render/beauty.####.exr: colour and depth in one, or one of each.
    """
    from pegbar.layer.depth_convention import UNITS
    from pegbar.shot.passes_check import ImportOptions

    if not passes:
        raise ValueError("want the passes to import, like render/beauty.####.exr")
    if unit is not None and unit not in UNITS:
        raise ValueError(f"--unit: want one of {', '.join(UNITS)}, got {unit}")
    options = ImportOptions(depth, UNITS[unit] if unit else None, alpha)
    stages = _stages(shot, passes, (shift, layer), frames, output, options)
    if camera is not None:
        stages = [stage for stage in stages if stage.camera == camera] or stages
    target = stages[0].outputs
    stage, found, judgement = _judged(stages)
    print_table(found)
    if judgement is None:
        print("pegbar: the passes cannot be used as they are; nothing is written", file=sys.stderr)
        return 1
    return 0 if check else _take(shot, stage, judgement, target)


def _judged(stages: Sequence[ImportStage]) -> tuple[ImportStage, list[Finding], Judgement | None]:
    """The first of ``stages`` whose camera rendered the passes, as far as that is seen; what was found; how to read."""
    from pegbar.shot.incoming import Finding

    checked = []
    for stage in stages:
        found, judgement = stage.check()
        checked.append((stage, found, judgement))
        if judgement is not None and any(line.what == "camera" and line.kind == "ok" for line in found):
            return stage, found, judgement
    usable = [check for check in checked if check[2] is not None]
    stage, found, judgement = (usable or checked)[0]
    if len(usable) > 1:
        text = "taken for the exposure sheet's camera; the whole drawing's would fit as well"
        found = [*found, Finding("guess", "camera", "some frames", text, "--camera drawn, if it is that one's")]
    return stage, found, judgement


def _stages(
    shot: Path,
    passes: Sequence[str],
    found: tuple[int, str | None],
    frames: str | None,
    output: Path | None,
    options: ImportOptions,
) -> list[ImportStage]:
    """For the camera of the exposure sheet, where it moves, and for that of the drawings."""
    from pegbar.shot.import_stage import ImportStage
    from pegbar.shot.incoming import Incoming
    from pegbar.shot.plan import open_shot
    from pegbar.shot.shot_scene import Tracked, film_scene, shot_scene

    incoming = Incoming.find(passes, *found)
    wanted = BatchOptions(frames=frames).select(open_shot(shot, aligned=False).frames)
    beside = shot.absolute().parent
    tracked = Tracked(shot, False, beside / "export")
    with bars() as tell:
        scene, _ = shot_scene(tracked, tell)
    drawn = ImportStage(incoming, tuple(wanted), scene, output or beside / "imported", options)
    seen = film_scene(scene, tracked)
    return [replace(drawn, scene=seen, camera="sheet"), drawn] if seen.views else [drawn]


def _take(shot: Path, stage: ImportStage, judgement: Judgement, target: FrameSequence) -> int:
    from pegbar.shot.passes_section import write_passes

    with progress("import", len(stage.frames)) as advance:
        stage.run(judgement, advance)
    section = write_passes(shot, Path(target.pattern), stage.camera)
    count = len(stage.frames)
    print(f"import-passes: {count} frame{'' if count == 1 else 's'} written, {os.path.relpath(target.pattern)}")
    print(f"import-passes: {os.path.relpath(shot)} says now: {', '.join(section.splitlines()[1:])}")
    return 0


def print_table(found: Sequence[Finding]) -> None:
    """Print the findings as a table: state, what, where, what was found and how to mend it."""
    rows = [("", "what", "where", "found", "mended by"), *_rows(found)]
    widths = [max(len(row[column]) for row in rows) for column in range(4)]
    for row in rows:
        print("  ".join([*(cell.ljust(width) for cell, width in zip(row, widths, strict=False)), row[4]]).rstrip())


def _rows(found: Sequence[Finding]) -> list[tuple[str, str, str, str, str]]:
    return [(line.kind, line.what, line.where, line.found, line.remedy) for line in found]
