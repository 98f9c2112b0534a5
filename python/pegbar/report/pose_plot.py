"""Poses of a clip as stick figures, from the front, from the side and from above."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.gait import facing
from pegbar.scene.motion import Motion

Floats = NDArray[np.float64]

_LEFT, _RIGHT, _MIDDLE, _FLOOR = "#1f6fd0", "#d03a2b", "#333333", "#8a6d3b"
#: Stick figure: chains of markers; a chain with a side is drawn once for each.
_TRUNK = ("pelvis", "chest", "neck", "head")
_CHAINS = (("neck", "{}_shoulder", "{}_elbow", "{}_hand"), ("pelvis", "{}_hip", "{}_knee", "{}_foot", "{}_toe"))
#: Views: title, the axes shown (0 to the person's left, 1 up, 2 ahead) and their signs.
_VIEWS = (("front", (0, 1), (1, 1)), ("left side", (2, 1), (-1, 1)), ("above", (0, 2), (1, -1)))


def plot_poses(motion: Motion, frames: Sequence[int] | None = None, *, title: str = "") -> NDArray[np.uint8]:
    """Return a picture (H, W, 4) uint8 of poses of ``motion``; later ones are darker, left is blue, right is red.

    The views are the person's own at the middle one of the poses: from the front, from its left side, and from above
    with the front at the bottom. Grids are in metres; the brown line is the floor.

    Parameters
    ----------
    motion : Motion
        The clip.
    frames : sequence of int, optional
        Frames to draw, from 0; eight spread over the clip, without an inserted T-pose, where None.
    title : str
        Stands over the picture with the frames drawn.

    Raises
    ------
    ValueError
        For a clip without frames or canonical markers, and a frame that it does not have.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    chosen = _spread(motion) if frames is None else list(frames)
    if not chosen or not motion.known_markers:
        raise ValueError("motion: want frames and canonical markers to draw")
    if strange := [frame for frame in chosen if not 0 <= frame < len(motion.positions)]:
        raise ValueError(f"frames: the motion has no frame {strange[0]} (it has 0-{len(motion.positions) - 1})")
    names = motion.known_markers
    places = motion.markers(names)
    floor = motion.report.floor if motion.report is not None else None
    seen = _own_axes(dict(zip(names, places.transpose(1, 0, 2), strict=True)), chosen[len(chosen) // 2])
    figure = Figure(figsize=(15, 6), dpi=100, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    figure.suptitle(f"{title}  frames {', '.join(map(str, chosen))}".strip(), fontsize=10)
    for panel, (name, axes, signs) in zip(figure.subplots(1, 3), _VIEWS, strict=True):
        _draw(panel, {key: points[:, axes] * signs for key, points in seen.items()}, chosen)
        if 1 in axes and floor is not None:
            panel.axhline(floor, color=_FLOOR, linewidth=1.5, zorder=0)
        panel.set_title(name)
        panel.set_aspect("equal", adjustable="datalim")
        panel.grid(True, linewidth=0.4, alpha=0.6)
        panel.set_xlabel("metres")
    canvas.draw()  # type: ignore[no-untyped-call]
    pixels: NDArray[np.uint8] = np.asarray(canvas.buffer_rgba()).copy()  # type: ignore[no-untyped-call]
    return pixels


def _spread(motion: Motion) -> list[int]:
    kept = [frame for frame in range(len(motion.positions)) if frame != motion.rest_frame]
    return [kept[place] for place in np.unique(np.linspace(0, len(kept) - 1, 8).round().astype(int))] if kept else []


def _own_axes(markers: dict[str, Floats], frame: int) -> dict[str, Floats]:
    """The points with axes to the person's left, up, and ahead, as the person faces at ``frame``."""
    azimuth = facing(markers)
    turn = np.radians(azimuth[frame]) if azimuth is not None and np.isfinite(azimuth[frame]) else 0.0
    left, ahead = [np.cos(turn), 0, -np.sin(turn)], [np.sin(turn), 0, np.cos(turn)]
    return {name: points @ np.array([left, [0, 1, 0], ahead]).T for name, points in markers.items()}


def _draw(panel: Any, points: dict[str, Floats], frames: Sequence[int]) -> None:
    if "pelvis" in points:
        panel.plot(*points["pelvis"].T, color=_MIDDLE, linewidth=0.6, linestyle=":", zorder=1)
    for order, frame in enumerate(frames):
        fade = 1.0 - 0.8 * (len(frames) - 1 - order) / max(1, len(frames) - 1)
        style = {"alpha": fade, "linewidth": 1.8, "solid_capstyle": "round", "zorder": 2 + order}
        _chain(panel, points, frame, _TRUNK, _MIDDLE, style)
        # The left, which is nearer in the view from the left, over the right.
        for side, color in (("right", _RIGHT), ("left", _LEFT)):
            for chain in _CHAINS:
                _chain(panel, points, frame, [word.format(side) for word in chain], color, style)
        if "head" in points:
            panel.plot(*points["head"][frame], marker="o", markersize=7, color=_MIDDLE, alpha=fade, zorder=2 + order)


def _chain(
    panel: Any, points: dict[str, Floats], frame: int, names: Sequence[str], color: str, style: dict[str, Any]
) -> None:
    known = [points[name][frame] for name in names if name in points]
    if len(known) > 1:
        panel.plot(*np.array(known).T, color=color, **style)
