"""The part of a picture in which elements are seen: only that is rendered, and it is put back into the whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.mesh import Mesh
from pegbar.simulate.layers import exr_channels
from pegbar.simulate.passes import Passes

Floats = NDArray[np.float64]
Window = tuple[int, int, int, int]
#: Where the light comes from, as in `pegbar.simulate.passes.render_passes`.
LIGHT = (0.4, 0.8, 0.45)
# Vertices nearer than this (metres) may be seen anywhere.
_NEAR = 0.05
_NAMES = ("beauty", "depth", "coverage", "object_id")


@dataclass(frozen=True, eq=False)
class View:
    """Passes of ``window`` (first and last column and row) of a picture of ``size``, with the shadow in them.

    ``shadow`` is the shadow alone, None where there is none.
    """

    size: tuple[int, int]
    window: Window
    passes: Passes
    shadow: Passes | None

    def strip(
        self, first: int, stop: int, depth: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return beauty and depth of the picture's rows from ``first`` to before ``stop``, at their samples.

        ``depth`` is the window's, with what is filled in.
        """
        (left, top, right, bottom), samples = self.window, self.passes.samples
        shape = (stop - first) * samples, self.size[0] * samples
        beauty, depths = np.zeros((*shape, 4), np.float32), np.full(shape, np.inf, np.float32)
        low, high = max(first, top), min(stop, bottom + 1)
        if low < high:
            onto = np.s_[(low - first) * samples : (high - first) * samples, left * samples : (right + 1) * samples]
            taken = np.s_[(low - top) * samples : (high - top) * samples]
            beauty[onto], depths[onto] = self.passes.beauty[taken], depth[taken]
        return beauty, depths

    def channels(self) -> dict[str, NDArray[Any]]:
        """Return the channels of an EXR file of the whole picture, at the final size."""
        channels = exr_channels(_placed(self.passes.resolved(), self.window, self.size))
        if self.shadow is not None:
            samples, (left, top, right, bottom) = self.shadow.samples, self.window
            alpha, depth = np.zeros(self.size[::-1], np.float32), np.full(self.size[::-1], np.inf, np.float32)
            dark, part = self.shadow.beauty[..., 3], np.s_[top : bottom + 1, left : right + 1]
            alpha[part] = cv2.resize(dark, (right - left + 1, bottom - top + 1), interpolation=cv2.INTER_AREA)
            depth[part] = self.shadow.depth[::samples, ::samples]
            channels |= {"shadow.A": alpha, "shadow.Z": depth}
        return channels


def part_of(camera: PerspectiveCamera, window: Window) -> PerspectiveCamera:
    """Return the camera that sees ``window`` alone, in the same pixels."""
    left, top, right, bottom = window
    shift = np.array([[1.0, 0, -left], [0, 1, -top], [0, 0, 1]])
    return PerspectiveCamera(shift @ camera.matrix, (right - left + 1, bottom - top + 1))


def seen_window(
    camera: PerspectiveCamera, meshes: Sequence[Mesh], casting: Sequence[Mesh], ground: float, margin: float
) -> Window:
    """Return first and last column and row in which ``meshes`` and the shadows of ``casting`` may be seen.

    ``margin`` in pixels is added around them; one pixel where nothing is seen.
    """
    slope = np.array(LIGHT) / LIGHT[1]
    places = [mesh.vertices for mesh in meshes]
    places += [mesh.vertices - (mesh.vertices[:, 1:2] - ground).clip(0) * slope for mesh in casting]
    points = np.concatenate([np.empty((0, 3)), *places])
    width, height = camera.image_size
    if not len(points):
        return 0, 0, 0, 0
    if camera.depth(points).min() < _NEAR:
        return 0, 0, width - 1, height - 1
    pixels, most = camera.project(points), (width - 1, height - 1)
    low = np.clip(np.floor(pixels.min(axis=0) - margin - 1), 0, most).astype(int)
    high = np.clip(np.ceil(pixels.max(axis=0) + margin + 1), 0, most).astype(int)
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])


def lay_under(passes: Passes, shadow: Passes) -> None:
    """Put ``shadow`` into ``passes`` where no element is, in place."""
    shown = (passes.coverage == 0) & (shadow.coverage > 0)
    for name in _NAMES:
        onto = getattr(passes, name)
        np.copyto(onto, getattr(shadow, name), where=shown[..., None] if onto.ndim == 3 else shown)


def _placed(passes: Passes, window: Window, size: tuple[int, int]) -> Passes:
    """The passes of ``window`` in a picture of ``size`` in which there is nothing else."""
    (left, top, right, bottom), samples = window, passes.samples
    shape = size[1] * samples, size[0] * samples
    whole = Passes(
        np.zeros((*shape, 4), np.float32),
        np.full(shape, np.inf, np.float32),
        np.zeros(shape, np.float32),
        np.zeros(shape, np.uint16),
        samples,
    )
    part = np.s_[top * samples : (bottom + 1) * samples, left * samples : (right + 1) * samples]
    for name in _NAMES:
        getattr(whole, name)[part] = getattr(passes, name)
    return whole
