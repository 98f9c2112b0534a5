"""Performances on one canvas: where each figure stands, what is behind them, and the finished pictures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.puppet.drawn_pose import focal_lengths
from pegbar.puppet.figure_picture import FigurePicture
from pegbar.puppet.performance import Performance

Floats = NDArray[np.float64]
Pixels = NDArray[np.uint8]
#: What is behind the figures.
BACKGROUNDS = ("plain", "transparent", "completed", "picture")
# Part of the canvas that stays free on each side where figures are fitted into it.
_MARGIN = 0.04
# Part of a figure's width between two figures side by side.
_GAP = 0.1


@dataclass(frozen=True, kw_only=True)
class Setting:
    """How pictures look.

    Attributes
    ----------
    size : (width, height), optional
        Pixels; None: the first figure's picture's.
    background : {"plain", "transparent", "completed", "picture"}
        "completed" is the first picture with the figure taken out, "picture" as it is.
    color : (red, green, blue)
        Of a plain background.
    fit : bool, optional
        Zoom so that the figures fill the canvas and never leave it; None: unless a picture is the background.
    """

    size: tuple[int, int] | None = None
    background: str = "plain"
    color: tuple[int, int, int] = (255, 255, 255)
    fit: bool | None = None

    def __post_init__(self) -> None:
        if self.background not in BACKGROUNDS:
            raise ValueError(f"background: want one of {', '.join(BACKGROUNDS)}, got {self.background!r}")
        if self.size is not None and not all(1 <= side <= 16384 for side in self.size):
            raise ValueError(f"size: want a width and height of 1 to 16384 pixels, got {self.size}")


@dataclass(frozen=True, eq=False)
class Stage:
    """Figures placed on a canvas of ``size`` (width, height), ready to be drawn frame by frame.

    A point p of figure i's picture is on the canvas at ``scales[i] * p + offsets[i]``. ``behind`` (h, w, 3) is the
    first figure's picture, or the canvas's one colour where it is None, or nothing where the setting is transparent.
    """

    performances: tuple[Performance, ...]
    setting: Setting
    size: tuple[int, int]
    scales: tuple[float, ...]
    offsets: Floats
    behind: Pixels | None

    @classmethod
    def of_performances(
        cls, performances: Sequence[Performance], setting: Setting, picture: Pixels | None = None
    ) -> Stage:
        """Place figures: one as it is drawn, several side by side on one floor and in one scale.

        ``picture`` (H, W, 3) is wanted for the background "picture"; for "completed" the first puppet has it.

        Raises
        ------
        ValueError
            For no performance, frame rates that differ, or a background that is not there.
        """
        if not performances:
            raise ValueError("performances: want at least one")
        rates = {round(performance.frame_rate, 6) for performance in performances}
        if len(rates) > 1:
            raise ValueError(f"performances: want one frame rate, got {', '.join(map(str, sorted(rates)))}")
        behind = _behind(performances[0], setting, picture)
        size = setting.size or performances[0].puppet.image_size
        fit = setting.background in ("plain", "transparent") if setting.fit is None else setting.fit
        boxes = np.stack([[made.meshes.min(axis=(0, 1)), made.meshes.max(axis=(0, 1))] for made in performances])
        scales, offsets = _side_by_side(performances, boxes)
        if fit:
            placed = boxes * np.array(scales)[:, None, None] + offsets[:, None]
            zoom, move = _fitted(placed[:, 0].min(axis=0), placed[:, 1].max(axis=0), size)
        else:
            zoom, move = _filling(performances[0].puppet.image_size, size)
        return cls(
            tuple(performances), setting, size, tuple(zoom * scale for scale in scales), zoom * offsets + move, behind
        )

    def __len__(self) -> int:
        return max(len(performance) for performance in self.performances)

    def pictures(self, start: int = 0, stop: int | None = None) -> Iterator[Pixels]:
        """Give the pictures (H, W, 3|4) uint8: RGB, or straight RGBA where nothing is behind the figures.

        A figure whose clip is shorter than another's begins again.
        """
        for frame in range(start, len(self) if stop is None else stop):
            yield self.picture(frame)

    def picture(self, frame: int) -> Pixels:
        """Return one of the ``pictures``; threads may draw several at a time."""
        canvas = self._ground(frame)
        for index, performance in enumerate(self.performances):
            own = frame % len(performance)
            mesh = performance.meshes[own] * self.scales[index] + self.offsets[index]
            # Only the part of the canvas that the figure is on: a whole number of pixels from the corner.
            low = np.clip(np.floor(mesh.min(axis=0)).astype(int) - 1, 0, self.size)
            high = np.clip(np.ceil(mesh.max(axis=0)).astype(int) + 2, 0, self.size)
            width, height = (high - low).tolist()
            if width < 1 or height < 1:
                continue
            drawn = self._figures[index].draw(mesh - low, performance.triangle_depths(own), (width, height))
            part = canvas[low[1] : high[1], low[0] : high[0]]
            part[...] = put_over(drawn, part) if self.setting.background == "transparent" else over(drawn, part)
        return canvas

    @cached_property
    def _figures(self) -> tuple[FigurePicture, ...]:
        """The figures' textures and meshes, made ready at the size that they have on the canvas."""
        return tuple(
            FigurePicture.of_puppet(performance.puppet, scale * _growth(performance))
            for performance, scale in zip(self.performances, self.scales, strict=True)
        )

    def _ground(self, frame: int) -> Pixels:
        """What is behind the figures: (H, W, 3), or (H, W, 4) and empty."""
        first = self.performances[0]
        shift = first.shift[frame % len(first)]
        if self.setting.background == "transparent":
            return np.zeros((self.size[1], self.size[0], 4), np.uint8)
        if self.behind is None or not shift.any():
            return self._still.copy()
        # A camera that follows leaves the picture: its rim goes on.
        return self._seen(self.behind, shift, cv2.BORDER_REPLICATE)

    @cached_property
    def _still(self) -> Pixels:
        """What is behind the figures where the camera stands still."""
        if self.behind is None:
            return np.asarray(np.full((self.size[1], self.size[0], 3), self.setting.color, np.uint8))
        whole = np.array(self.behind.shape[1::-1]) * self.scales[0]
        if self.scales[0] < 1 and np.allclose(whole, self.size, atol=1):
            return np.asarray(cv2.resize(self.behind, self.size, interpolation=cv2.INTER_AREA), np.uint8)
        return self._seen(self.behind, np.zeros(2), cv2.BORDER_CONSTANT)

    def _seen(self, picture: Pixels, shift: Floats, rim: int) -> Pixels:
        scale = self.scales[0]
        move = np.array([[scale, 0, 0], [0, scale, 0]])
        move[:, 2] = self.offsets[0] + scale * shift
        color = self.setting.color
        warped = cv2.warpAffine(picture, move, self.size, flags=cv2.INTER_LINEAR, borderMode=rim, borderValue=color)
        return np.asarray(warped, np.uint8)


def over(drawn: Pixels, ground: Pixels) -> Pixels:
    """Return ``drawn`` (H, W, 4), straight alpha, over ``ground`` (H, W, 3)."""
    return _kernels.over_ground(drawn, np.ascontiguousarray(ground))


def put_over(drawn: Pixels, ground: Pixels) -> Pixels:
    """Return ``drawn`` over ``ground``, both (H, W, 4) with straight alpha."""
    if not ground[..., 3].any():
        return drawn
    alpha = drawn[..., 3:].astype(np.uint16)
    under = ground[..., 3:].astype(np.uint16) * (255 - alpha) // 255
    total = alpha + under
    mixed = drawn[..., :3].astype(np.uint32) * alpha + ground[..., :3].astype(np.uint32) * under
    colors = (mixed + total // 2) // np.maximum(total, 1)
    return np.asarray(np.concatenate([colors, total], axis=2), np.uint8)


def _growth(performance: Performance) -> float:
    """How much larger than drawn a figure becomes that comes nearer, 1 or more."""
    heights = np.ptp(performance.meshes[..., 1], axis=1)
    return max(1.0, float(heights.max() / max(np.ptp(performance.puppet.vertices[:, 1]), 1e-9)))


def _behind(performance: Performance, setting: Setting, picture: Pixels | None) -> Pixels | None:
    found = {"completed": performance.puppet.background, "picture": picture}.get(setting.background)
    if found is None and setting.background in ("completed", "picture"):
        raise ValueError(f"background: there is no {setting.background} one")
    return found


def _side_by_side(performances: Sequence[Performance], boxes: Floats) -> tuple[list[float], Floats]:
    """Scales and offsets (n, 2) that put figures beside the first, a metre alike everywhere, on its floor."""
    densities = []
    for performance in performances:
        camera, pose = performance.puppet.camera, performance.puppet.pose
        densities.append(float(focal_lengths(camera).mean() / camera.depth(pose).mean()))
    scales = [densities[0] / density for density in densities]
    offsets = np.zeros((len(performances), 2))
    right = boxes[0, 1, 0]
    for index in range(1, len(performances)):
        box = boxes[index] * scales[index]
        offsets[index] = right + _GAP * np.ptp(box[:, 0]) - box[0, 0], boxes[0, 1, 1] - box[1, 1]
        right = offsets[index, 0] + box[1, 0]
    return scales, offsets


def _fitted(low: Floats, high: Floats, size: tuple[int, int]) -> tuple[float, Floats]:
    """The zoom and offset that put what is between ``low`` and ``high`` into the middle of a canvas."""
    sides = np.array(size, np.float64)
    zoom = float((sides * (1 - 2 * _MARGIN) / np.maximum(high - low, 1e-9)).min())
    return zoom, (sides - 1) / 2 - zoom * (low + high) / 2


def _filling(picture: tuple[int, int], size: tuple[int, int]) -> tuple[float, Floats]:
    """The zoom and offset that show a whole picture in the middle of a canvas."""
    zoom = min(size[0] / picture[0], size[1] / picture[1])
    middle = (np.array(size) - 1) / 2
    return zoom, middle - zoom * (np.array(picture) - 1) / 2
