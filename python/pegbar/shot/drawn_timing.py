"""How fast a drawing runs, for the search: what its marks say, what the shot file says, or neither."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.drawing import Drawing


@dataclass(frozen=True, eq=False)
class Timing:
    """Film frames a second, None where nobody says it; for how many film frames each drawing is held; who says so.

    ``said`` is the rate in the shot file, None where there is none.
    """

    rate: float | None
    holds: NDArray[np.float64]
    source: str
    said: float | None = None

    def words(self, found: float) -> str:
        """The rate that the search worked with, in a sentence; ``found`` is the best of those tried."""
        held = sorted({int(hold) for hold in self.holds if hold > 1})
        drawn = f", drawings held for {' or '.join(map(str, held))} frames" if held else ""
        if self.rate is None:
            tried = f"8, 12 and 24 frames a second were tried{drawn}"
            return (
                f"No frame rate is given: {tried}; {found:g} is nearest to the clip's own pace (or say --frame-rate)."
            )
        return f"{self.rate:g} frames a second ({self.source}){drawn}."


def drawn_timing(drawing: Drawing, shot: Path | None, given: float | None) -> Timing:
    """Return the timing of ``drawing``: what is ``given``, else what its marks say, else what the ``shot`` file says.

    Raises ShotError, FormatError or OSError for a shot file that cannot be read.
    """
    count = len(drawing.markers)
    holds, said = np.array(drawing.holds or [1] * count, float), None
    if shot is not None:
        # The models of the shot file take long to import; without one they are not needed.
        from pegbar.shot.load import load_shot

        settings = load_shot(shot)
        if "frame_rate" in settings.shot.model_fields_set:
            said = settings.shot.frame_rate
        if not drawing.holds:
            holds = _holds(settings.drawing.hold, count)
    for rate, source in ((given, "--frame-rate"), (drawing.frame_rate, "as marked"), (said, str(shot))):
        if rate is not None:
            return Timing(rate, holds, source, said)
    return Timing(None, holds, "", said)


def _holds(hold: int | Sequence[int] | str, count: int) -> NDArray[np.float64]:
    """For how many frames each of ``count`` drawings is held; sparse drawings are not known here: one each."""
    if isinstance(hold, int):
        return np.full(count, float(hold))
    if not isinstance(hold, str) and len(hold) == count:
        return np.array(hold, float)
    return np.ones(count)
