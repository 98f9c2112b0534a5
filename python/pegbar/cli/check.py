"""`pegbar check`: every problem of a shot, before work starts."""

from __future__ import annotations

import sys
from contextlib import closing
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pegbar.cli.batch import BatchOptions, progress
from pegbar.errors import ShotError
from pegbar.shot.batch import run_frames
from pegbar.shot.check import CheckStage
from pegbar.shot.plan import open_shot


def check(
    shot: Path,
    *,
    frames: Annotated[str | None, Parameter(help="Frames to check, like 1-48 (default: the shot's).")] = None,
    jobs: Annotated[int | None, Parameter(help="Worker processes (default: one a core).")] = None,
) -> int:
    """Read all that a shot names and report every problem at once; nothing is written.

    Example: pegbar check shot.toml

    Parameters
    ----------
    shot
        The shot file.
    """
    try:
        plan = open_shot(shot)
    except ShotError as error:
        print(error, file=sys.stderr)
        return 1
    chosen, problems = BatchOptions(frames, jobs).select(plan.frames), 0
    with closing(run_frames(CheckStage(plan), chosen, jobs=jobs)) as results, progress("check", len(chosen)) as advance:
        for result in results:
            advance()
            for line in [result.error] if result.error else result.value:
                problems += 1
                print(line, file=sys.stderr)
    print(f"check: {len(chosen)} frames read, {problems or 'no'} problem{'' if problems == 1 else 's'}")
    return 1 if problems else 0
