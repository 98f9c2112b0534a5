"""How far clip and drawing are apart, drawing by drawing, as a plot."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray


def error_plot(numbers: Sequence[int], errors: NDArray[np.float64], figure_height: float) -> NDArray[np.uint8]:
    """Return a plot (H, W, 4) uint8 of the errors (F,) in pixels of drawings ``numbers``.

    A second scale tells the errors as shares of the figure's height in pixels.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3), dpi=100, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    panel = figure.add_subplot()
    panel.bar(list(numbers), errors, width=0.8, color="#4878cf")
    panel.axhline(float(np.median(errors)), color="#d65f5f", linewidth=1, label="median")
    panel.set_xlabel("drawing")
    panel.set_ylabel("clip to marks, RMS (pixels)")
    share = panel.secondary_yaxis(
        "right", functions=(partial(np.multiply, 100 / figure_height), partial(np.multiply, figure_height / 100))
    )
    share.set_ylabel("% of the figure's height")
    panel.legend(loc="upper right")
    canvas.draw()  # type: ignore[no-untyped-call]
    return np.array(canvas.buffer_rgba(), np.uint8)  # type: ignore[no-untyped-call]
