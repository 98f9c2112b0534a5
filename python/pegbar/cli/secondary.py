"""`pegbar secondary`: cloth and balls around a drawn character, from drawings to finished frames."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from pegbar.cli.batch import BatchOptions, progress, run_stage
from pegbar.errors import BlenderError, SimulationError
from pegbar.io.hold import hold

if TYPE_CHECKING:
    from pegbar.shot.passes_stage import ElementsStage
    from pegbar.shot.secondary_stage import SecondaryStage

_Program = Literal["pegbar", "blender"]


def secondary(
    shot: Path,
    /,
    options: BatchOptions | None = None,
    *,
    engine: Annotated[_Program | None, Parameter(help="What simulates (default: the shot file's).")] = None,
    renderer: Annotated[_Program | None, Parameter(help="What renders (default: the shot file's).")] = None,
) -> int:
    """Add simulated secondary motion to a shot; see `pegbar secondary --help`.

    Parameters
    ----------
    shot
        The shot file.
    """
    from pegbar.shot.secondary_stage import SecondaryStage

    options = options or BatchOptions()
    stage = SecondaryStage(shot, options.overwrite, engine=engine, renderer=renderer)
    options.select(stage.secondary.stages[0].bare.frames)
    # Wrong settings are told before anything is made, also the folder.
    stage.secondary.check()
    with hold(stage.secondary.folder):
        return _run(stage, options)


def _run(stage: SecondaryStage, options: BatchOptions) -> int:
    with bars() as tell:
        stage.progress = tell
        drivings = stage.drive()
        for line in stage.remarks.lines(stage.path):
            print(f"pegbar: {line}", file=sys.stderr)
        print(f"volumes: {_made(stage, 'volumes')}, in {os.path.relpath(stage.secondary.folder)}")
        try:
            scene = stage.simulate(drivings)
        except (SimulationError, BlenderError) as error:
            print(f"pegbar: {error}; what was made before is kept", file=sys.stderr)
            return 1
    for note in stage.own_work(scene) if stage.made["simulation"] else ():
        print(f"pegbar: note: {note}", file=sys.stderr)
    print(f"simulation: {scene.frames} frame{'' if scene.frames == 1 else 's'} {_made(stage, 'simulation')}")
    frames = stage.frames(drivings, scene)
    if code := _render(stage, frames, options):
        return code
    start = time.perf_counter()
    if code := run_stage("composite", frames, options):
        return code
    stage.times["render and composite"] = time.perf_counter() - start
    finals = [frames.outputs(frame)[0] for frame in options.select(frames.shot.frames)]
    report = stage.finish(scene, drivings, finals)
    _summarise(stage, report)
    return 0


def _render(stage: SecondaryStage, frames: ElementsStage, options: BatchOptions) -> int:
    """Have Blender render, where it is to; return the exit code."""
    try:
        with bars() as tell:
            stage.progress = tell
            stage.render(frames, options.select(frames.shot.frames))
    except BlenderError as error:
        print(f"pegbar: {error}; what was made before is kept", file=sys.stderr)
        return 1
    if "Blender" in stage.made:
        print(f"Blender: elements {_made(stage, 'Blender')}, in {os.path.relpath(stage.secondary.folder / 'blender')}")
    return 0


def _made(stage: SecondaryStage, name: str) -> str:
    return "made" if stage.made.get(name) else "up to date"


def _deep(report: dict[str, Any]) -> list[str]:
    """What lies too deep in a limb."""
    from pegbar.report.figures import DEEP

    said = []
    for kind in ("cloth", "strands", "particles"):
        for name, part in report.get(kind, {}).items():
            if (depth := part["deepest_penetration_m"]) > DEEP * report["height_m"]:
                said.append(f"{name} lies {1000 * depth:.0f} mm deep in {part['in_limb']} in frame {part['in_frame']}")
    return said


def _summarise(stage: SecondaryStage, report: dict[str, Any]) -> None:
    for deep in _deep(report):
        print(f"pegbar: warning: {deep}: look at it there, and whether the limb jumps", file=sys.stderr)
    parts = [f"drawn marks and volumes {report['reprojection_px']:.1g} px apart"]
    if report.get("deepest_penetration_m") is not None:
        parts.append(f"deepest penetration {1000 * report['deepest_penetration_m']:.1f} mm")
    if report.get("stretch_p99") is not None:
        parts.append(f"cloth stretched by {report['stretch_p99']:.1%} (99 in 100 threads by less)")
    print(f"secondary: {', '.join(parts)}")
    seconds = ", ".join(f"{name} {value:.1f}" for name, value in report["seconds"].items())
    print(f"secondary: seconds: {seconds}")
    print(f"secondary: animation, sheet.png and report.json in {os.path.relpath(stage.secondary.folder)}")


@contextmanager
def bars() -> Iterator[Callable[[str, int, int], None]]:
    """Give a function that shows a stage's progress: a bar a stage, one after the other."""
    with ExitStack() as stack:
        shown: dict[str, tuple[ExitStack, Callable[[], None]]] = {}

        def tell(name: str, done: int, total: int) -> None:
            if name not in shown:
                for other, _ in shown.values():
                    other.close()
                inner = stack.enter_context(ExitStack())
                shown[name] = (inner, inner.enter_context(progress(name, total)))
            shown[name][1]()

        yield tell
