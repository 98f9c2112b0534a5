"""`pegbar check`: every problem of a shot, before work starts."""

from __future__ import annotations

import json
import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from pegbar.cli.batch import BatchOptions, progress
from pegbar.errors import ShotError

if TYPE_CHECKING:
    from pegbar.shot.plan import Shot
    from pegbar.shot.problem import Problem


def check(
    shot: Path,
    *,
    frames: Annotated[str | None, Parameter(help="Frames to check, like 1-48 (default: the shot's).")] = None,
    jobs: Annotated[int | None, Parameter(help="Worker processes (default: one a core).")] = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="", help="Print the problems as JSON.")] = False,
) -> int:
    """Report every problem of a shot; see `pegbar check --help`.

    Parameters
    ----------
    shot
        The shot file.
    """
    from pegbar.shot.check_output import output_problems
    from pegbar.shot.check_sections import section_problems
    from pegbar.shot.plan import open_shot

    problems, plan = _opened(shot)
    read = 0
    if plan is not None:
        chosen = BatchOptions(frames=frames, jobs=jobs).select(plan.frames)
        read = len(chosen)
        found, seen = _frames(plan, chosen, jobs)
        whole = seen if chosen == list(plan.frames) else None
        # Marks as annotated, not as an older alignment left them.
        bare = open_shot(shot, aligned=False)
        problems += [*section_problems(bare, seen=whole), *output_problems(plan), *found]
    if as_json:
        _print_json(problems, read)
    else:
        _print(problems)
        print(f"check: {read} frames read, {len(problems) or 'no'} problem{'' if len(problems) == 1 else 's'}")
    return 1 if problems else 0


def _opened(path: Path) -> tuple[list[Problem], Shot | None]:
    """The shot, without what was aligned where that does not fit any more; None where it cannot be opened at all."""
    from pegbar.shot.plan import open_shot
    from pegbar.shot.problem import of_message

    problems: list[Problem] = []
    for aligned in (True, False):
        try:
            return problems, open_shot(path, aligned=aligned)
        except ShotError as error:
            known = {problem.line for problem in problems}
            new = [of_message(line, str(path)) for line in error.problems]
            problems += [problem for problem in new if problem.line not in known]
    return problems, None


def _frames(plan: Shot, chosen: list[int], jobs: int | None) -> tuple[list[Problem], frozenset[int]]:
    """What is wrong with the frames, in their order, and which labels they show."""
    from pegbar.shot.batch import run_frames
    from pegbar.shot.check import CheckStage, FrameCheck
    from pegbar.shot.problem import Problem, merged

    problems: dict[int, tuple[Problem, ...]] = {}
    seen: set[int] = set()
    with closing(run_frames(CheckStage(plan), chosen, jobs=jobs)) as results, progress("check", len(chosen)) as advance:
        for result in results:
            advance()
            if isinstance(result.value, FrameCheck):
                problems[result.frame] = result.value.problems
                seen |= result.value.limbs
            else:
                problems[result.frame] = (Problem(result.error or "", frames=(result.frame,)),)
    return merged(problem for frame in sorted(problems) for problem in problems[frame]), frozenset(seen)


def _print(problems: list[Problem]) -> None:
    """A table on a terminal, a line a problem elsewhere."""
    if not sys.stderr.isatty():
        for problem in problems:
            print(problem.line, file=sys.stderr)
        return
    if problems:
        from rich.console import Console
        from rich.table import Column, Table
        from rich.text import Text

        columns = [Column(name, overflow="fold") for name in ("where", "what", "how to mend")]
        table = Table(*columns, show_lines=True)
        for problem in problems:
            table.add_row(*(Text(text) for text in (problem.where, problem.what, problem.mend)))
        Console(stderr=True).print(table)


def _print_json(problems: list[Problem], read: int) -> None:
    print(json.dumps({"frames_read": read, "problems": [problem.record() for problem in problems]}, indent=1))
