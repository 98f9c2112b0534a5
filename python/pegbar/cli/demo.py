"""`pegbar demo`: the sample shot, and all that pegbar makes of it, from nothing to a page to look at."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from pegbar.cli.batch import BatchOptions, progress, run_stage
from pegbar.cli.lift import lift
from pegbar.cli.secondary import secondary

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pegbar.report.page import Section
    from pegbar.shot.plan import Shot

SHEET = 12


def demo(
    folder: Path,
    /,
    *,
    length: Annotated[int, Parameter(help="Number of frames that the dance is spread over.")] = 48,
    jobs: Annotated[int | None, Parameter(help="Worker processes (default: one a core).")] = None,
) -> int:
    """Make the sample shot and all that can be made of it; see `pegbar demo --help`.

    Parameters
    ----------
    folder
        Where to put it; made if it is not there.
    """
    from pegbar.io.hold import hold

    with hold(folder):
        return _make(folder, length, jobs)


def _make(folder: Path, length: int, jobs: int | None) -> int:
    from pegbar.io import atomic
    from pegbar.report.page import html_page
    from pegbar.sample.shot import write_sample

    start = time.perf_counter()
    with progress("sample", length) as advance:
        path = write_sample(folder, frames=length, workers=jobs, progress=lambda *_: advance())
    options = BatchOptions(jobs=jobs)
    # The dance is two seconds long: spread over fewer frames it is too fast for cloth to follow.
    jobs_done = [_composite(path, options)]
    if length >= SHEET:
        jobs_done += [secondary(path, options), lift(path)]
    if code := max(jobs_done):
        return code
    _animate(folder)
    page = folder / "index.html"
    atomic.write_bytes(page, html_page("pegbar: the sample shot", _LEAD, _sections(folder)).encode())
    print(f"\nMade in {time.perf_counter() - start:.1f} s. Open {page} in a browser, or:")
    for name, what in _MADE.items():
        if (folder / name).exists():
            print(f"  {folder / name}  {what}")
    return 0


_LEAD = (
    "A dancer, drawn frame by frame with her joints marked, and a clip of the dance. This page shows what pegbar makes "
    "of the two; every command that made it works on your own shot. A click on a picture opens it in full size."
)
_MADE = {
    "secondary/animation.png": "scarves, a skirt and balls that collide with the drawn dancer",
    "lift/animation.glb": "the drawings as a 3D animation, for any 3D package",
    "animated.gif": "one drawing that performs the clip",
    "animation.png": "rendered elements in front of and behind the drawing",
    "final": "the finished frames",
    "shot.toml": "the shot file: check, align, lift, secondary, depth, composite and report take it",
    "clip.bvh": "the dance as a motion-capture clip; truth.npz holds its markers and cameras",
}


def spread(frames: list[int], count: int) -> list[int]:
    """Return at most ``count`` of ``frames``, evenly spread, in order."""
    return [frames[i * len(frames) // min(count, len(frames))] for i in range(min(count, len(frames)))]


def final_path(shot: Shot, frame: int) -> Path:
    """Return where the finished ``frame`` is."""
    from pegbar.shot.stages import CompositeStage

    return CompositeStage(shot).outputs(frame)[0]


def _composite(path: Path, options: BatchOptions) -> int:
    """Depth of the drawings, and the composite with the rendered hoop and ribbon."""
    from pegbar.io.animation import write_animation
    from pegbar.io.frames import write_image
    from pegbar.report.contact_sheet import contact_sheet
    from pegbar.shot.plan import open_shot
    from pegbar.shot.stages import CompositeStage, DepthStage

    shot = open_shot(path)
    for name, stage in (("depth", DepthStage(shot)), ("composite", CompositeStage(shot))):
        if code := run_stage(name, stage, options):
            return code
    chosen = options.select(shot.frames)
    finals = [picture for frame in spread(chosen, SHEET) for picture in _rows(shot, frame)]
    write_image(shot.folder / "contact_sheet.png", contact_sheet(finals, columns=6))
    write_animation(shot.folder / "animation.png", _finals(shot, chosen), shot.settings.shot.frame_rate)
    return 0


def _animate(folder: Path) -> None:
    """The first drawing performs the clip."""
    from pegbar.shot.animating import Casting, Part, animate_parts

    first = Part(folder / "drawings/dancer.0001.png", (folder / "clip.bvh",))
    casting = Casting(joints=folder / "annotation.json", keep=folder / ".pegbar/puppets")
    animate_parts([first], folder / "animated.gif", casting=casting)


def _sections(folder: Path) -> list[Section]:
    """The three jobs, what they begin with, and how to go on; those that have run."""
    from pegbar.cli.demo_page import demo_sections, next_step

    return [*(part for section in demo_sections() if (part := _there(section, folder)).pictures), next_step()]


def _there(section: Section, folder: Path) -> Section:
    """The section without what was not made."""
    pictures = tuple(picture for picture in section.pictures if (folder / picture.source).is_file())
    files = tuple(entry for entry in section.files if (folder / entry[0]).is_file())
    return replace(section, files=files, pictures=pictures)


def _rows(shot: Shot, frame: int) -> Iterator[NDArray[np.uint8]]:
    """The drawing, its depth and the finished frame."""
    from pegbar.io.frames import read_picture
    from pegbar.shot.stages import DepthStage

    yield read_picture(shot.drawings.path(shot.exposure.drawing(frame)))
    yield read_picture(DepthStage(shot).outputs(frame)[1])
    yield read_picture(final_path(shot, frame))


def _finals(shot: Shot, frames: list[int]) -> Iterator[NDArray[np.uint8]]:
    from pegbar.io.frames import read_picture
    from pegbar.report.contact_sheet import over_paper

    for frame in frames:
        yield over_paper(read_picture(final_path(shot, frame)))
