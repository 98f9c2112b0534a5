"""Preflight of an exposure sheet's camera: keys that no frame shows, views that leave the paper, words for numbers."""

from __future__ import annotations

from collections.abc import Iterator

from pegbar.io.exposure_sheet import read_exposure_sheet
from pegbar.io.frames import read_picture
from pegbar.io.numbers import format_frames
from pegbar.scene.film_view import FilmView
from pegbar.shot.plan import Shot
from pegbar.shot.problem import Problem

# A frame's edge may lie so far beyond the paper's, in pixels, by rounding.
_ROUNDING = 1e-6


def camera_problems(shot: Shot) -> list[Problem]:
    """Return what is wrong with the moves of the sheet's camera over the drawings of ``shot``."""
    return [*_keys(shot), *_views(shot)]


def _keys(shot: Shot) -> Iterator[Problem]:
    drawing = shot.settings.drawing
    if drawing.exposure is None or drawing.camera == "drawn":
        return
    place = shot.place("drawing.exposure")
    instructions = read_exposure_sheet(shot.folder / drawing.exposure).instructions
    if instructions:
        what = f"camera work in words is not used: {', '.join(instructions)}"
        yield Problem(
            what, "write numbers, like zoom 1.5 (docs: exposure-sheets)", "drawing.exposure", place, note=True
        )
    first, last = min(shot.frames), max(shot.frames)
    outside = [] if shot.moves is None else [frame for frame in shot.moves.frames if not first <= frame <= last]
    if outside:
        what = f"the camera has keys at frames {format_frames(outside)}: the shot has {first}-{last}"
        yield Problem(what, "correct the rows or shot.frames", "drawing.exposure", place, note=True)


def _views(shot: Shot) -> Iterator[Problem]:
    """Frames that show nothing of the paper, and frames that show what is beside it."""
    if shot.moves is None and shot.settings.output.size is None:
        return
    paper = _paper(shot)
    if paper is None:
        return
    key = "drawing.exposure" if shot.moves is not None else "output.size"
    views = {frame: shot.view(frame, paper) for frame in shot.frames}
    there = {frame: view for frame, view in views.items() if view is not None}
    if blind := tuple(frame for frame, view in there.items() if not view.sees_paper):
        what = f"the camera sees nothing of the paper ({_words(there[blind[0]])})"
        yield Problem(what, "correct the sheet's pan, or zoom less", key, shot.place(key), blind)
    beyond = tuple(frame for frame, view in there.items() if view.beyond > _ROUNDING and frame not in blind)
    if beyond:
        worst = max(beyond, key=lambda frame: there[frame].beyond)
        far = there[worst].beyond
        what = f"the camera's view leaves the paper, by {far:.3g} px in frame {worst}: it is transparent there"
        yield Problem(what, "larger drawings, more zoom or less pan", key, shot.place(key), beyond, note=True)


def _paper(shot: Shot) -> tuple[int, int] | None:
    """Width and height of the drawings; None where none can be read, which is told elsewhere."""
    if shot.settings.shot.size is not None:
        return shot.settings.shot.size
    try:
        height, width = read_picture(shot.drawings.path(shot.drawings.numbers[0])).shape[:2]
    except (ValueError, OSError):
        return None
    return width, height


def _words(view: FilmView) -> str:
    return f"pan {view.pan_x:g}, {view.pan_y:g}, zoom {view.zoom:g}, rotate {view.rotate:g}"
