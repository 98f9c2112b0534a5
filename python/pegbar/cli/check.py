"""`pegbar check`: every problem of a shot, before work starts."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from pegbar.cli.batch import BatchOptions, progress

if TYPE_CHECKING:
    from pegbar.shot.problem import Problem


def check(
    shot: Path,
    /,
    *,
    frames: Annotated[str | None, Parameter(help="Frames to check, like 1-48 (default: the shot's).")] = None,
    jobs: Annotated[int | None, Parameter(help="Worker processes (default: one a core).")] = None,
    as_json: Annotated[
        bool, Parameter(name="--json", negative="", help="Print the problems as JSON, with places.")
    ] = False,
) -> int:
    """Report every problem of a shot; see `pegbar check --help`.

    Parameters
    ----------
    shot
        The shot file.
    """
    from pegbar.shot.preflight import preflight

    problems, read = preflight(shot, BatchOptions(frames=frames, jobs=jobs).select, jobs, progress)
    wrong = sum(not problem.note for problem in problems)
    if as_json:
        print(json.dumps({"frames_read": read, "problems": [problem.record() for problem in problems]}, indent=1))
    else:
        _print(problems)
        print(f"check: {read} frame{'' if read == 1 else 's'} read, {wrong or 'no'} problem{'' if wrong == 1 else 's'}")
    return 1 if wrong else 0


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
