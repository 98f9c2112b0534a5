"""`pegbar check`: every problem of a shot, before work starts."""

from __future__ import annotations

import re
import sys
from contextlib import closing
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pegbar.cli.batch import BatchOptions, progress
from pegbar.errors import ShotError
from pegbar.io.numbers import format_frames


def check(
    shot: Path,
    *,
    frames: Annotated[str | None, Parameter(help="Frames to check, like 1-48 (default: the shot's).")] = None,
    jobs: Annotated[int | None, Parameter(help="Worker processes (default: one a core).")] = None,
) -> int:
    """Report every problem of a shot; see `pegbar check --help`.

    Parameters
    ----------
    shot
        The shot file.
    """
    from pegbar.shot.batch import run_frames
    from pegbar.shot.check import CheckStage
    from pegbar.shot.check_sections import section_problems
    from pegbar.shot.plan import open_shot

    try:
        plan = open_shot(shot)
    except ShotError as error:
        print(error, file=sys.stderr)
        return 1
    chosen = BatchOptions(frames=frames, jobs=jobs).select(plan.frames)
    problems: dict[int, list[str]] = {}
    with closing(run_frames(CheckStage(plan), chosen, jobs=jobs)) as results, progress("check", len(chosen)) as advance:
        for result in results:
            advance()
            problems[result.frame] = [result.error] if result.error else list(result.value)
    lines = section_problems(plan) + grouped([line for frame in sorted(problems) for line in problems[frame]])
    for line in lines:
        print(line, file=sys.stderr)
    print(f"check: {len(chosen)} frames read, {len(lines) or 'no'} problem{'' if len(lines) == 1 else 's'}")
    return 1 if lines else 0


def grouped(lines: list[str]) -> list[str]:
    """Return ``lines`` with those that differ in numbers only as one, which says how many frames it stands for."""
    groups: dict[str, list[str]] = {}
    for line in lines:
        groups.setdefault(re.sub(r"\d+", "#", line), []).append(line)
    merged = []
    for same in groups.values():
        if len(same) < 4:
            merged += same
        else:
            frames = [int(number[1]) for line in same if (number := re.match(r"frame (-?\d+):", line))]
            merged.append(f"{same[0]} (and so in {len(same)} frames: {format_frames(frames)})")
    return merged
