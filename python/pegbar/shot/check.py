"""Preflight: reads everything that a shot names, so that all problems are known before work starts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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


def _in_frame(frame: int, error: Exception) -> str:
    text = " ".join(str(error).split())
    return text if text.startswith(f"frame {frame}:") else f"frame {frame}: {text}"
