"""Frames of elements that Blender rendered, as the passes that the stages work with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import FormatError
from pegbar.io.exr import read_exr
from pegbar.shot.view import Window
from pegbar.simulate.blender.render import passes_of
from pegbar.simulate.passes import Passes


def read_rendered(path: Path, samples: int, size: tuple[int, int], pen: float) -> Passes:
    """Read a frame that Blender rendered ``samples`` times larger than ``size``, with ink lines ``pen`` wide.

    Raises FormatError for a file that is missing, damaged or not what it should be.
    """
    if not path.is_file():
        raise FormatError(path, "Blender said that this frame is finished, and there is no file")
    try:
        passes = passes_of(read_exr(path).channels, samples, pen)
    except FormatError:
        raise
    except ValueError as error:
        raise FormatError(path, str(error)) from None
    (height, width), wanted = passes.depth.shape, (size[0] * samples, size[1] * samples)
    if (width, height) != wanted:
        raise FormatError(path, f"want {wanted[0]} x {wanted[1]} pixels, got {width} x {height}")
    return passes


def part_seen(passes: Passes, window: Window) -> Passes:
    """Return what is in ``window`` (first and last column and row at the final size)."""
    left, top, right, bottom = (passes.samples * edge for edge in (window[0], window[1], window[2] + 1, window[3] + 1))

    def cut(picture: NDArray[Any]) -> NDArray[Any]:
        return np.ascontiguousarray(picture[top:bottom, left:right])

    return Passes(
        beauty=cut(passes.beauty),
        depth=cut(passes.depth),
        coverage=cut(passes.coverage),
        object_id=cut(passes.object_id),
        samples=passes.samples,
    )
