"""The joint marks that a shot works with: as annotated, or with the cameras and depths that `pegbar align` found."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pegbar.io.annotations import read_annotations
from pegbar.io.numbers import format_frames
from pegbar.scene.drawing import Drawing
from pegbar.shot.model import ShotFile

#: What `pegbar align` writes the marks to, in its output folder.
ALIGNED = "aligned.json"


def read_marks(settings: ShotFile, folder: Path, *, aligned: bool = True) -> Drawing | None:
    """Return the annotations that ``settings`` names, or the aligned ones in their place; None where it names none.

    ``[align] use`` decides: "auto" takes aligned marks, where there are any, for annotations without depths.
    ``aligned`` False takes the annotations as they are.

    Raises
    ------
    ValueError
        For aligned marks that are not of these annotations any more, or that are wanted and not there.
    FormatError, OSError
        For files that cannot be read.
    """
    name, use = settings.drawing.annotations, settings.align.use
    if not name:
        return None
    marks = read_annotations(folder / name)
    path = folder / settings.align.output / ALIGNED
    if not aligned or use == "never" or (use == "auto" and (marks.depths is not None or not path.is_file())):
        return marks
    if not path.is_file():
        raise ValueError(f'align.use is "always", and there is no {path}: run pegbar align first')
    found = read_annotations(path)
    if not _are_the_same(marks, found):
        raise ValueError(f"{path} is not of these marks any more: run pegbar align again")
    return found


def outside_marks(marks: Drawing, index: int) -> list[str]:
    """Return the visible markers of frame ``index`` of ``marks`` that lie outside the picture, a line each."""
    place, size = marks.markers[index], marks.image_size
    return [
        f"marker {marks.names[i]} at {np.round(place[i], 1).tolist()} lies outside the {size[0]} x {size[1]} picture"
        for i in np.flatnonzero(_outside(marks)[index])
    ]


def outside_warnings(marks: Drawing, drawings: Mapping[int, int]) -> list[str]:
    """Return a line for every marker that is marked outside the picture; ``drawings`` are numbers to frames."""
    outside, (width, height) = _outside(marks), marks.image_size
    found = []
    for i in np.flatnonzero(outside.any(axis=0)):
        numbers = sorted(number for number, index in drawings.items() if outside[index, i])
        if numbers:
            where = f"outside the {width} x {height} picture in drawings {format_frames(numbers)}"
            found.append(f"{marks.names[i]} is marked {where}: its limbs may be misplaced")
    return found


def _outside(marks: Drawing) -> NDArray[np.bool_]:
    """Which markers (F, N) are said to be visible and lie outside the picture."""
    beyond = (marks.markers < -0.5) | (marks.markers > np.array(marks.image_size) - 0.5)
    return np.asarray(marks.visible & beyond.any(axis=2))


def _are_the_same(marks: Drawing, found: Drawing) -> bool:
    """Whether the marks that are seen stand where they were when they were aligned."""
    if marks.names != found.names or len(found.markers) > len(marks.markers):
        return False
    rows = _rows(marks, found)
    if rows is None or not np.array_equal(marks.visible[rows], found.visible):
        return False
    seen = found.visible
    return bool(np.abs(marks.markers[rows][seen] - found.markers[seen]).max(initial=0.0) < 1e-6)


def _rows(marks: Drawing, found: Drawing) -> list[int] | None:
    """For each aligned frame that of the annotations: by picture where those are named, else in order."""
    if not marks.images:
        return list(range(len(found.markers))) if len(found.markers) == len(marks.markers) else None
    order = {path.name: index for index, path in enumerate(marks.images)}
    names = [path.name for path in found.images]
    return [order[name] for name in names] if set(names) <= set(order) else None
