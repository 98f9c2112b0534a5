"""Preflight: reads everything that a shot names, so that all problems are known before work starts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import describe
from pegbar.shot.drawn import read_drawn
from pegbar.shot.plan import Shot
from pegbar.shot.stages import CompositeStage, check_passes


@dataclass(frozen=True, eq=False)
class CheckStage:
    """Reads one frame as the stages would, writes nothing, and returns what is wrong with it, a line each."""

    shot: Shot

    def __call__(self, frame: int, /) -> tuple[str, ...]:
        """Return the problems of ``frame``."""
        problems, drawn = self._marks(frame), None
        try:
            drawn = read_drawn(self.shot, frame)
            problems += drawn.notes
        except (ValueError, OSError) as error:
            problems.append(_in_frame(frame, error))
        if self.shot.beauty is not None:
            try:
                stage = CompositeStage(self.shot)
                beauty, depth, _ = stage.read_rendered(frame)
                if drawn is not None:
                    check_passes(frame, self.shot.beauty.path(frame), drawn, beauty, depth)
                    problems += _units(frame, drawn.depth, depth)
            except (ValueError, OSError) as error:
                problems.append(_in_frame(frame, error))
        return tuple(problems)

    def _marks(self, frame: int) -> list[str]:
        """Marks outside the picture."""
        marks = self.shot.annotations
        if marks is None:
            return []
        try:
            index = self.shot.annotation_index(frame)
        except (ValueError, OSError):
            return []
        place, size = marks.markers[index], np.array(marks.image_size)
        outside = marks.visible[index] & ((place < -0.5) | (place > size - 0.5)).any(axis=1)
        return [
            f"frame {frame}: marker {marks.names[i]} at {place[i].tolist()} lies outside the "
            f"{size[0]} x {size[1]} picture"
            for i in np.flatnonzero(outside)
        ]


def _units(frame: int, drawn: NDArray[np.float32], rendered: NDArray[np.float32]) -> list[str]:
    """Depths that are so far apart that one of them must be in another unit."""
    places = [depth[np.isfinite(depth)] for depth in (drawn, rendered)]
    if not all(place.size for place in places):
        return []
    ours, theirs = (float(np.median(place)) for place in places)
    if ours > 0 and theirs > 0 and 1 / 20 < theirs / ours < 20:
        return []
    return [
        f"frame {frame}: the render is about {theirs:.3g} m from the camera and the drawing {ours:.3g} m: "
        "is passes.unit right?"
    ]


def _in_frame(frame: int, error: Exception) -> str:
    text = describe(error)
    return text if text.startswith(f"frame {frame}:") else f"frame {frame}: {text}"
