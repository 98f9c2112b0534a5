"""All of a shot's preflight: what it names is read, nothing is written, and every problem is told."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, closing
from pathlib import Path

from pegbar.errors import ShotError
from pegbar.shot.batch import run_frames
from pegbar.shot.check import CheckStage, FrameCheck
from pegbar.shot.check_camera import camera_problems
from pegbar.shot.check_output import output_problems
from pegbar.shot.check_sections import section_problems
from pegbar.shot.plan import Shot, open_shot
from pegbar.shot.problem import Problem, merged, of_message

Progress = Callable[[str, int], AbstractContextManager[Callable[[], None]]]


def preflight(
    path: Path, select: Callable[[tuple[int, ...]], list[int]], jobs: int | None, progress: Progress
) -> tuple[list[Problem], int]:
    """Return the problems of the shot file at ``path``, and how many frames were read.

    ``select`` chooses of the shot's frames, ``jobs`` is the number of worker processes, and ``progress`` is opened
    with a name and the number of frames, and told of each. Raises FormatError or FileNotFoundError for a shot file
    that cannot be read, and what ``select`` raises.
    """
    problems, shot = _opened(path)
    if shot is None:
        return problems, 0
    frames = select(shot.frames)
    found, seen = _frames(shot, frames, jobs, progress)
    # Marks as annotated, not as an older alignment left them; a part of the frames does not tell what none shows.
    bare, whole = open_shot(path, aligned=False), frames == list(shot.frames)
    problems += section_problems(bare, seen=seen if whole else None)
    return [*problems, *output_problems(shot), *camera_problems(shot), *found], len(frames)


def _opened(path: Path) -> tuple[list[Problem], Shot | None]:
    """The shot, without what was aligned where that does not fit any more; None where it cannot be opened at all."""
    problems: list[Problem] = []
    for aligned in (True, False):
        try:
            return problems, open_shot(path, aligned=aligned)
        except ShotError as error:
            known = {problem.line for problem in problems}
            new = [of_message(line, str(path)) for line in error.problems]
            problems += [problem for problem in new if problem.line not in known]
    return problems, None


def _frames(
    shot: Shot, frames: list[int], jobs: int | None, progress: Progress
) -> tuple[list[Problem], frozenset[int]]:
    """What is wrong with the frames, in their order, and which labels they show."""
    problems: dict[int, tuple[Problem, ...]] = {}
    seen: set[int] = set()
    with closing(run_frames(CheckStage(shot), frames, jobs=jobs)) as results, progress("check", len(frames)) as advance:
        for result in results:
            advance()
            if isinstance(result.value, FrameCheck):
                problems[result.frame] = result.value.problems
                seen |= result.value.limbs
            else:
                problems[result.frame] = (Problem(result.error or "", frames=(result.frame,)),)
    return merged(problem for frame in sorted(problems) for problem in problems[frame]), frozenset(seen)
