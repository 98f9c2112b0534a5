"""`pegbar demo`: the sample shot, from nothing to finished frames."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from numpy.typing import NDArray

from pegbar.cli.batch import BatchOptions, progress, run_stage
from pegbar.io.animation import write_animation
from pegbar.io.frames import read_picture, write_image
from pegbar.report.contact_sheet import contact_sheet, over_paper
from pegbar.sample.shot import write_sample
from pegbar.shot.plan import Shot, open_shot
from pegbar.shot.stages import CompositeStage, DepthStage

SHEET = 12


def demo(
    folder: Path,
    *,
    length: Annotated[int, Parameter(help="Number of frames that the dance is spread over.")] = 48,
    jobs: Annotated[int | None, Parameter(help="Worker processes (default: one a core).")] = None,
) -> int:
    """Make the sample shot and finish it; see `pegbar demo --help`.

    Parameters
    ----------
    folder
        Where to put it; made if it is not there.
    """
    start = time.perf_counter()
    with progress("sample", length) as advance:
        path = write_sample(folder, frames=length, workers=jobs, progress=lambda *_: advance())
    shot, options = open_shot(path), BatchOptions(jobs=jobs)
    for name, stage in (("depth", DepthStage(shot)), ("composite", CompositeStage(shot))):
        if code := run_stage(name, stage, options):
            return code
    sheet, animation = folder / "contact_sheet.png", folder / "animation.png"
    chosen = options.select(shot.frames)
    finals = [picture for frame in spread(chosen, SHEET) for picture in _rows(shot, frame)]
    write_image(sheet, contact_sheet(finals, columns=6))
    write_animation(animation, _finals(shot, chosen), shot.settings.shot.frame_rate)
    print(f"\nMade in {time.perf_counter() - start:.1f} s:")
    for made, what in (
        (animation, "the animation: open it in a browser"),
        (sheet, "drawing, depth and finished frame side by side"),
        (folder / "final", "the finished frames"),
        (path, "the shot file: check, depth and composite take it"),
        (folder / "clip.bvh", "the dance as a motion-capture clip; truth.npz holds its markers and cameras"),
    ):
        print(f"  {made}  {what}")
    return 0


def spread(frames: list[int], count: int) -> list[int]:
    """Return at most ``count`` of ``frames``, evenly spread, in order."""
    return [frames[i * len(frames) // min(count, len(frames))] for i in range(min(count, len(frames)))]


def final_path(shot: Shot, frame: int) -> Path:
    """Return where the finished ``frame`` is."""
    return CompositeStage(shot).outputs(frame)[0]


def _rows(shot: Shot, frame: int) -> Iterator[NDArray[np.uint8]]:
    """The drawing, its depth and the finished frame."""
    yield read_picture(shot.drawings.path(shot.exposure.drawing(frame)))
    yield read_picture(DepthStage(shot).outputs(frame)[1])
    yield read_picture(final_path(shot, frame))


def _finals(shot: Shot, frames: list[int]) -> Iterator[NDArray[np.uint8]]:
    for frame in frames:
        yield over_paper(read_picture(final_path(shot, frame)))
