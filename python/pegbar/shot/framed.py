"""What the camera of the exposure sheet sees of a drawn frame and of rendered passes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.layer.reframe import reframe_coverage, reframe_nearest, reframe_picture
from pegbar.scene.film_view import FilmView
from pegbar.shot.drawn import Drawn
from pegbar.shot.plan import Shot


def reframed(shot: Shot, frame: int, drawn: Drawn) -> Drawn:
    """Return ``drawn`` as film ``frame`` shows it: colour and alpha filtered, depth and labels of nearest pixels."""
    view = shot.view(frame, drawn.size)
    if view is None:
        return drawn
    alpha = drawn.alpha.astype(np.float32)[..., None]
    colors = drawn.color[..., :3].astype(np.float32) / np.float32(255) * alpha
    seen = reframe_picture(np.concatenate([colors, alpha], axis=2), view)
    covered = seen[..., 3:]
    straight = np.divide(seen[..., :3], covered, out=np.zeros_like(seen[..., :3]), where=covered > 0)
    return replace(
        drawn,
        color=np.rint(straight.clip(0, 1) * 255).astype(np.uint8),
        alpha=np.ascontiguousarray(seen[..., 3].clip(0, 1)),
        depth=reframe_nearest(drawn.depth, view, np.inf),
        labels=None if drawn.labels is None else reframe_nearest(drawn.labels, view, 0),
    )


def reframed_channels(channels: dict[str, NDArray[Any]], view: FilmView) -> dict[str, NDArray[Any]]:
    """Return the channels of rendered passes as ``view`` shows them: depth and object numbers are never mixed."""
    seen: dict[str, NDArray[Any]] = {}
    for name, plane in channels.items():
        kind = name.rpartition(".")[2]
        if plane.ndim == 3:
            seen[name] = reframe_picture(plane, view)
        elif kind in ("Z", "ID"):
            seen[name] = reframe_nearest(plane, view, np.inf if kind == "Z" else 0)
        else:
            seen[name] = reframe_coverage(plane, view)
    return seen
