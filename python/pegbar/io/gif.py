"""GIF animations, written as their frames come: a palette for each scene, only what changes in each frame.

Colours are the weighted means of boxes that median cut finds, then two rounds of k-means; the packing is in
``kernels/gif.rs``.
"""

from __future__ import annotations

import itertools
import os
import struct
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from pegbar import _kernels, arrays
from pegbar.io import atomic

Pixels = NDArray[np.uint8]
# Frames packed at a time, and frames of these that a palette is made from.
_BLOCK, _LOOKED_AT = 24, 8
_COLOURS = 255
_CLEAR = 255
# Share of a block's pixels whose colours its palette does not know that asks for a new one.
_NEW_SCENE = 0.02


def write_gif(path: str | os.PathLike[str], frames: Iterable[ArrayLike], durations: Iterable[int]) -> None:
    """Write pictures as a GIF that repeats for ever, complete or not at all.

    Parameters
    ----------
    path : path
    frames : iterable of (H, W, 3|4) uint8
        RGB or straight RGBA of one size; taken as they come, a block of them held in memory. Alpha below a half is
        transparent. RGB packs better: only what changes is kept.
    durations : iterable of int
        Hundredths of a second, as many as frames.

    Raises
    ------
    ValueError
        For no frames or frames that differ in size or channels.
    """
    with atomic.complete_file(path) as part, open(part, "wb") as file:
        file.writelines(_encoded(arrays.images("frames", frames), iter(durations)))


def _encoded(frames: Iterator[Pixels], durations: Iterator[int]) -> Iterator[bytes]:
    """The file's bytes, piece by piece."""
    known: Scene | None = None
    previous: Pixels | None = None
    while block := list(itertools.islice(frames, _BLOCK)):
        pixels = np.stack(block)
        # A frame that shows nothing where the one before did must not be laid over it.
        transparent = pixels.shape[3] == 4
        if known is None:
            height, width = pixels.shape[1:3]
            yield b"GIF89a" + struct.pack("<HHBBB", width, height, 0x70, 0, 0)
            yield b"\x21\xff\x0bNETSCAPE2.0\x03\x01\0\0\0"
        if known is None or known.unknown(pixels) > _NEW_SCENE:
            known, previous = Scene(pixels), None
        if previous is None and not transparent:
            previous = np.full(pixels.shape[1:3], _CLEAR, np.uint8)
        for place, data in _kernels.pack_gif_frames(pixels, known.table, previous):
            yield _frame(place, data, known.palette, next(durations), disposal=2 if transparent else 1)
    if known is None:
        raise ValueError("frames: want at least one")
    yield b";"


def _frame(place: Sequence[int], data: bytes, palette: bytes, duration: int, *, disposal: int) -> bytes:
    control = b"\x21\xf9\x04" + struct.pack("<BHBB", disposal << 2 | 1, duration, _CLEAR, 0)
    return control + b"\x2c" + struct.pack("<HHHHB", *place, 0x87) + palette + b"\x08" + data


class Scene:
    """The palette of some frames and the table that finds its entries.

    ``palette`` are 256 colours, the last unused; ``table`` (32768,) uint8 has the nearest entry of a colour of fifteen
    bits; ``seen`` (32768,) bool tells the colours that the frames hold.
    """

    def __init__(self, frames: Pixels) -> None:
        looked_at: Pixels = frames[np.unique(np.linspace(0, len(frames) - 1, _LOOKED_AT).astype(int))]
        # Every pixel of small pictures, every second or third of large ones.
        stride = max(1, round((looked_at.shape[1] * looked_at.shape[2] / 1e5) ** 0.5))
        shown = _shown(looked_at[:, ::stride, ::stride])
        if not len(shown):
            shown = np.zeros((1, 3), np.uint8)
        bins = _bins(shown)
        counts = np.bincount(bins, minlength=1 << 15)
        used = np.flatnonzero(counts)
        weights = counts[used].astype(np.float64)
        sums = [np.bincount(bins, shown[:, channel], minlength=1 << 15)[used] for channel in range(3)]
        means = np.stack(sums, axis=1) / weights[:, None]
        colours = _refined(_median_cut(means, weights), means, weights)
        self.palette = np.rint(np.vstack([colours, np.zeros((256 - len(colours), 3))])).astype(np.uint8).tobytes()
        grid = np.indices((32, 32, 32)).reshape(3, -1).T * 8 + 4.0
        # A colour that occurs is found by what it is, not by the middle of its bin.
        grid[used] = means
        self.table: Pixels = np.asarray(cKDTree(colours).query(grid)[1], np.uint8)
        self.seen = np.zeros(1 << 15, bool)
        self.seen[used] = True

    def unknown(self, frames: Pixels) -> float:
        """The share of the pixels of ``frames`` (F, H, W, 4) whose colours are not near any that were seen."""
        sample = _shown(frames[::8, ::4, ::4])
        if not len(sample):
            return 0.0
        cells = np.asarray(self.seen.reshape(8, 4, 8, 4, 8, 4).any(axis=(1, 3, 5)))
        red, green, blue = (sample >> 5).T
        return float(1 - cells[red, green, blue].mean())


def _shown(frames: Pixels) -> Pixels:
    """The colours (N, 3) of what is not transparent."""
    pixels = frames.reshape(-1, frames.shape[-1])
    return pixels if pixels.shape[1] == 3 else pixels[pixels[:, 3] >= 128][:, :3]


def _bins(colours: Pixels) -> NDArray[np.intp]:
    red, green, blue = (colours.astype(np.intp) >> 3).T
    bins: NDArray[np.intp] = red << 10 | green << 5 | blue
    return bins


def _median_cut(colours: NDArray[Any], weights: NDArray[Any]) -> NDArray[Any]:
    """At most 255 colours: the box with the largest weighted spread is cut at its mean until there are enough."""
    boxes = [np.arange(len(colours))]
    spreads = [_spread(colours, weights, boxes[0])]
    while len(boxes) < min(_COLOURS, len(colours)):
        worst = int(np.argmax([spread for spread, _, _ in spreads]))
        spread, axis, cut = spreads[worst]
        if not spread > 0:
            break
        box = boxes[worst]
        below = colours[box, axis] <= cut
        boxes[worst : worst + 1] = [box[below], box[~below]]
        spreads[worst : worst + 1] = [_spread(colours, weights, box[below]), _spread(colours, weights, box[~below])]
    return np.stack([np.average(colours[box], axis=0, weights=weights[box]) for box in boxes])


def _spread(colours: NDArray[Any], weights: NDArray[Any], box: NDArray[np.intp]) -> tuple[float, int, float]:
    """How far a box's colours lie apart, along which axis most, and where to cut."""
    # Square roots keep a large plain ground from taking all entries.
    own, share = colours[box], np.sqrt(weights[box])
    mean = share @ own / share.sum()
    variances = share @ (own - mean) ** 2
    axis = int(variances.argmax())
    # The mean may round up to the largest colour, which must not take the whole box.
    cut = min(float(mean[axis]), float(own[:, axis].max()) - 1e-9)
    return float(variances[axis]) if len(box) > 1 else 0.0, axis, cut


def _refined(palette: NDArray[Any], colours: NDArray[Any], weights: NDArray[Any]) -> NDArray[Any]:
    """Two rounds of k-means."""
    for _ in range(2):
        nearest = cKDTree(palette).query(colours)[1]
        total = np.bincount(nearest, weights, minlength=len(palette))
        sums = np.stack([np.bincount(nearest, weights * channel, minlength=len(palette)) for channel in colours.T], 1)
        palette = np.where(total[:, None] > 0, sums / np.maximum(total, 1e-300)[:, None], palette)
    return palette
