"""A time warp to look at: the costs as a picture, the path through them, and the smoothed times."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.align.timewarp import TimeWarp

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def warp_picture(
    cost: ArrayLike,
    warp: TimeWarp,
    *,
    size: tuple[int, int] = (1100, 700),
    clip_offset: float = 0,
    clip_step: float = 1,
    title: str = "",
    thinned: tuple[int, int] = (1, 1),
) -> NDArray[np.uint8]:
    """Draw a time warp.

    Above: the cost of each pair, dark is cheap, drawn frames to the right and clip frames upwards, with the path, the
    chosen whole frames and the smoothed times. Below: how many clip frames pass from drawing to drawing. A good warp
    runs along a dark valley, and its smoothed speed has neither zeros nor peaks.

    Parameters
    ----------
    cost : (F, G) float
        What was warped, F and G ``thinned``.
    warp : TimeWarp
        The result.
    size : (width, height)
        Of the picture in pixels.
    clip_offset, clip_step : float
        The clip's own frame of column j is clip_offset + clip_step * j, where the warp was made on a part of it.
    title : str
        Stands on top.
    thinned : (rows, columns)
        ``cost`` has every so manieth drawn and clip frame only, as of a long shot: more than the picture has pixels
        would only take time and memory.

    Returns
    -------
    (height, width, 4) uint8
        Opaque.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows, columns = arrays.integers("thinned", thinned, (2,), low=1).tolist()
    table = arrays.floats("cost", cost, (-(-len(warp.times) // rows), "G"))
    width, height = arrays.integers("size", size, (2,), low=100, high=10000).tolist()
    figure = Figure(figsize=(width / 100, height / 100), dpi=100, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    _draw(figure, table, warp, (clip_offset, clip_step), (rows, columns), title)
    canvas.draw()  # type: ignore[no-untyped-call]
    return np.array(canvas.buffer_rgba(), np.uint8)  # type: ignore[no-untyped-call]


def _draw(
    figure: Figure,
    table: NDArray[np.float64],
    warp: TimeWarp,
    clip: tuple[float, float],
    thinned: tuple[int, int],
    title: str,
) -> None:
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    offset, step = clip
    drawn, (wide, high) = np.arange(len(warp.times)), thinned
    bottom, top = offset - step / 2, offset + step * (high * table.shape[1] - 0.5)
    extent = (-0.5, wide * len(table) - 0.5, bottom, top)
    shown = above.imshow(table.T, origin="lower", aspect="auto", cmap="gray", extent=extent)
    figure.colorbar(shown, ax=above, label="cost of a pair")
    above.plot(warp.path[:, 0], offset + step * warp.path[:, 1], color="tab:blue", label="path")
    above.plot(drawn, offset + step * warp.frames, ".", color="tab:orange", label="frames")
    above.plot(drawn, offset + step * warp.times, color="tab:red", label="times")
    above.set(ylabel="clip frame", title=title, xlim=(-0.5, len(drawn) - 0.5), ylim=(bottom, top))
    above.legend(loc="upper left")
    for times, color in ((warp.frames, "tab:orange"), (warp.times, "tab:red")):
        below.step(drawn[:-1], step * np.diff(times), where="post", color=color)
    below.set(xlabel="drawn frame", ylabel="clip frames\na drawn frame")
    below.grid(alpha=0.3)
