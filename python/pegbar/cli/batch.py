"""What the frame commands share: options, progress on a terminal, the report and the exit code."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import Annotated

from cyclopts import Parameter

from pegbar.io.numbers import format_frames, parse_frames
from pegbar.shot.batch import FrameResult, run_frames
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
    made, failed, notes = 0, [], 0
    with closing(run_frames(stage, frames, jobs=options.jobs)) as results, progress(name, len(frames)) as advance:
        for result in results:
            advance()
            if result.error is not None:
                failed.append(result)
                _complain(result)
                if not options.keep_going:
                    break
                continue
            made += result.value.made
            notes += len(result.value.notes)
            for note in result.value.notes:
                print(f"pegbar: {note}", file=sys.stderr)
    where = stage.outputs(frames[0])[0].parent
    rest = len(frames) - made - len(failed)
    state = "not done" if failed and not options.keep_going else "up to date"
    print(f"{name}: {made} frames made, {rest} {state}, {len(failed)} failed, in {os.path.relpath(where)}")
    return 1 if failed else 0


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
        task = bar.add_task(name, total=total)
        yield lambda: bar.advance(task)
