"""The joint marks that a shot works with: as annotated, or with the cameras and depths that `pegbar align` found."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pegbar.io.annotations import read_annotations
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
