"""What the frame commands share: options, progress on a terminal, the report and the exit code."""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from pegbar.io.hold import BusyError, hold
from pegbar.io.numbers import format_frames, parse_frames

if TYPE_CHECKING:
    from pegbar.shot.batch import FrameResult
    from pegbar.shot.stages import Stage


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class BatchOptions:
    """Options of every command that works through frames."""

    frames: Annotated[str | None, Parameter(help="Frames to do, like 1-48 or 1-10,20 (default: the shot's).")] = None
    jobs: Annotated[int | None, Parameter(help="Worker processes (default: one a core).")] = None
    overwrite: Annotated[bool, Parameter(negative="", help="Make frames again that are up to date.")] = False
    keep_going: Annotated[bool, Parameter(negative="", help="Go on after a frame that fails.")] = False

    def select(self, frames: tuple[int, ...]) -> list[int]:
        """Return the frames to do: those asked for, all of which the shot must have."""
        if self.jobs is not None and self.jobs < 1:
            raise ValueError(f"--jobs: want 1 or more, got {self.jobs}")
        if self.frames is None:
            return list(frames)
        wanted = parse_frames(self.frames)
        if strange := sorted(set(wanted) - set(frames)):
            raise ValueError(
                f"--frames: the shot has no frame {format_frames(strange)} (it has {format_frames(frames)})"
            )
        return wanted


def run_stage(name: str, stage: Stage, options: BatchOptions) -> int:
    """Run ``stage`` over the chosen frames, report, and return the exit code."""
    frames = options.select(stage.shot.frames)
    if not frames:
        raise ValueError("the shot has no frames")
    stage.prepare(frames)
    with _alongside(stage.outputs(frames[0])[0].parent):
        return _run(name, stage, frames, options)


@contextmanager
def _alongside(folder: Path) -> Iterator[None]:
    """Tell of another run in ``folder`` and go on: frames are complete or absent, so two runs only work twice."""
    with ExitStack() as stack:
        try:
            stack.enter_context(hold(folder))
        except BusyError as error:
            print(f"pegbar: note: {str(error).rpartition(':')[0]}: frames may be made twice", file=sys.stderr)
        except OSError:
            # Frames that are up to date need no right to write; others say what is wrong themselves.
            pass
        yield


def _run(name: str, stage: Stage, frames: list[int], options: BatchOptions) -> int:
    from pegbar.shot.batch import run_frames

    # Told here, so that no worker is started for frames that need none.
    todo = [frame for frame in frames if not stage.is_done(frame)]
    count = Counter({"up to date": len(frames) - len(todo)})
    results = run_frames(stage, todo, jobs=options.jobs, go_on=lambda: options.keep_going or not count["failed"])
    with closing(results), progress(name, len(todo)) as advance:
        for result in results:
            advance()
            if result.error is not None:
                count["failed"] += 1
                _complain(result)
                continue
            count["made" if result.value.made else "up to date"] += 1
            count["warnings"] += len(result.value.notes)
            for note in result.value.notes:
                print(f"pegbar: warning: {note}", file=sys.stderr)
    _summarise(name, stage, frames, count)
    return 1 if count["failed"] else 0


def _summarise(name: str, stage: Stage, frames: list[int], count: Counter[str]) -> None:
    left = len(frames) - count["made"] - count["up to date"] - count["failed"]
    parts = [f"{count['made']} frame{'' if count['made'] == 1 else 's'} made"]
    parts += [f"{count[state]} {state}" for state in ("up to date", "failed") if count[state]]
    parts += [f"{left} not begun"] if left else []
    parts += [f"{count['warnings']} warning{'' if count['warnings'] == 1 else 's'}"] if count["warnings"] else []
    print(f"{name}: {', '.join(parts)}, in {os.path.relpath(stage.outputs(frames[0])[0].parent)}")


def _complain(result: FrameResult) -> None:
    text = result.error or ""
    prefix = "" if text.startswith(f"frame {result.frame}:") else f"frame {result.frame}: "
    print(f"pegbar: {prefix}{text}", file=sys.stderr)


@contextmanager
def progress(name: str, total: int) -> Iterator[Callable[[], None]]:
    """Show a progress bar on a terminal, nothing elsewhere; the body calls what it is given once a step."""
    if not sys.stderr.isatty():
        yield lambda: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        # It moves to and fro until the first step: what is worked out for all of them may take long.
        task = bar.add_task(name, total=None)
        yield lambda: bar.update(task, total=total, advance=1)
