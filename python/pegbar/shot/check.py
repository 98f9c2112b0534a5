"""Preflight: reads everything that a shot names, so that all problems are known before work starts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import describe
from pegbar.io.frames import read_picture
from pegbar.shot.drawn import check_size, read_drawn, read_labels
from pegbar.shot.marks import outside_marks
from pegbar.shot.plan import Shot
from pegbar.shot.problem import Problem, mend
from pegbar.shot.stages import CompositeStage, check_passes


@dataclass(frozen=True)
class FrameCheck:
    """The problems of a frame, and which limbs (their numbers + 1) its label picture shows."""

    problems: tuple[Problem, ...]
    limbs: frozenset[int] = frozenset()


@dataclass(frozen=True, eq=False)
class CheckStage:
    """Reads one frame as the stages would, writes nothing, and returns what is wrong with it."""

    shot: Shot

    def __call__(self, frame: int, /) -> FrameCheck:
        """Return what is found in ``frame``."""
        problems = self._marks(frame)
        depth = limbs = None
        try:
            size, depth, limbs, notes = self._drawn(frame)
            problems += [_problem(frame, "drawing.labels", note) for note in notes]
        except (ValueError, OSError) as error:
            size = None
            problems.append(_problem(frame, self._key(frame, describe(error)), describe(error)))
        if self.shot.beauty is not None:
            problems += self._passes(frame, size, depth)
        return FrameCheck(tuple(problems), limbs or frozenset())

    def _marks(self, frame: int) -> list[Problem]:
        """Marks outside the picture, and depths behind the camera."""
        marks = self.shot.annotations
        try:
            index = self.shot.annotation_index(frame)
        except ValueError:
            return []
        if marks is None:
            return []
        found = [
            _problem(frame, "drawing.annotations", what, "move the mark, or say that the joint is not visible")
            for what in outside_marks(marks, index)
        ]
        if marks.depths is not None:
            found += [
                _problem(
                    frame,
                    "drawing.annotations",
                    f"marker {marks.names[i]} lies behind the camera: depth {marks.depths[index, i]:.3g} m",
                    "correct the depths (metres in front of the camera) or the camera",
                )
                for i in np.flatnonzero(marks.visible[index] & (marks.depths[index] <= 0))
            ]
        return found

    def _drawn(
        self, frame: int
    ) -> tuple[tuple[int, ...], NDArray[np.float32] | None, frozenset[int] | None, tuple[str, ...]]:
        """Size, depth, limbs and notes of a drawing; no depth where `pegbar align` is yet to find it."""
        shot = self.shot
        path = shot.drawings.path(shot.exposure.drawing(frame))
        awaits = shot.settings.clip is not None and shot.annotations is not None and shot.annotations.depths is None
        if not awaits or shot.drawing_depth is not None:
            drawn = read_drawn(shot, frame)
            return drawn.alpha.shape, drawn.depth, drawn.limbs, drawn.notes
        picture = read_picture(path)
        check_size(frame, path, picture, shot.settings.shot.size)
        labels, notes = read_labels(shot, frame, picture)
        limbs = None if labels is None else frozenset(np.unique(labels).tolist())
        return picture.shape[:2], None, limbs, notes

    def _passes(self, frame: int, size: tuple[int, ...] | None, drawn: NDArray[np.float32] | None) -> list[Problem]:
        assert self.shot.beauty is not None
        path = self.shot.beauty.path(frame)
        try:
            stage = CompositeStage(self.shot)
            beauty, depth, _ = stage.read_rendered(frame)
            if size is not None:
                check_passes(frame, path, stage.rendered_shape(size), beauty, depth)
        except (ValueError, OSError) as error:
            return [_problem(frame, "passes.beauty", describe(error))]
        return [] if drawn is None else _units(frame, drawn, depth)

    def _key(self, frame: int, text: str) -> str:
        """The key of the sequence whose file a message names."""
        shot = self.shot
        sequences = {"frames": shot.drawings, "labels": shot.labels, "depth": shot.drawing_depth}
        try:
            number = shot.exposure.drawing(frame)
        except ValueError:
            return "shot.frames"
        named = [key for key, sequence in sequences.items() if sequence and str(sequence.path(number)) in text]
        return f"drawing.{named[0]}" if named else "drawing.annotations" if "mark" in text else "drawing"


def _units(frame: int, drawn: NDArray[np.float32], rendered: NDArray[np.float32]) -> list[Problem]:
    """Depths that are so far apart that one of them must be in another unit."""
    places = [depth[np.isfinite(depth)] for depth in (drawn, rendered)]
    if not all(place.size for place in places):
        return []
    ours, theirs = (float(np.median(place)) for place in places)
    if ours > 0 and theirs > 0 and 1 / 20 < theirs / ours < 20:
        return []
    what = f"the render is about {theirs:.3g} m from the camera and the drawing {ours:.3g} m: is passes.unit right?"
    return [_problem(frame, "passes.unit", what, 'set passes.unit to the unit of the depth pass, like "cm"')]


def _problem(frame: int, key: str, text: str, how: str = "") -> Problem:
    return Problem(text.removeprefix(f"frame {frame}: "), how or mend(text), key, frames=(frame,))
