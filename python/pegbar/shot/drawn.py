"""One drawn frame read from its files and made ready: colour, alpha and depth of every pixel."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.errors import DegenerateError, ShotError
from pegbar.io.exr import read_passes
from pegbar.io.frames import png_size, read_picture
from pegbar.layer.depth import limb_depth
from pegbar.layer.matte import ink_alpha, matte
from pegbar.layer.segmentation import grow_labels, palette_labels, segment_stick_figure
from pegbar.shot.plan import Shot

# Coverage below which ink is taken for the grain of the paper: 25 levels of 255, where scans and JPEG stay within 15.
FAINT = 0.1

# How much lighter than the ink on both sides paper is that shows between them, in 8-bit levels.
SLIT = 96


@dataclass(frozen=True, eq=False)
class Drawn:
    """A drawn frame: ``color`` (H, W, 3|4) uint8 straight, ``alpha`` and ``depth`` (H, W) float32, and what to note.

    ``marked`` (H, W) are the labels as they are painted, ``labels`` (H, W) the limbs of all that is drawn; None where
    there are no labels.
    """

    color: NDArray[np.uint8]
    alpha: NDArray[np.float32]
    depth: NDArray[np.float32]
    notes: tuple[str, ...] = ()
    marked: NDArray[np.uint8] | None = None
    labels: NDArray[np.uint8] | None = None

    @property
    def limbs(self) -> frozenset[int] | None:
        """The labels that are painted somewhere; None where there are none. Takes longer than compositing."""
        return None if self.marked is None else frozenset(np.flatnonzero(np.bincount(self.marked.ravel())).tolist())

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.alpha.shape[1], self.alpha.shape[0]


def drawn_inputs(shot: Shot, frame: int) -> list[Path]:
    """Return the picture files that `read_drawn` reads for ``frame``."""
    number = shot.exposure.drawing(frame)
    sequences = (shot.drawings, shot.labels, shot.drawing_depth)
    return [sequence.path(number) for sequence in sequences if sequence is not None]


def read_drawn(shot: Shot, frame: int) -> Drawn:
    """Read the drawing of ``frame`` and find every pixel's alpha and depth (2010 paper, section 3.3.1).

    Raises ValueError or OSError, naming file and frame, for what cannot be read or does not fit together.
    """
    number, settings = shot.exposure.drawing(frame), shot.settings.drawing
    path = shot.drawings.path(number)
    picture = read_picture(path)
    check_size(frame, path, picture, shot.settings.shot.size)
    labels, notes = read_labels(shot, frame, picture)
    try:
        layer = matte(picture, shot.matte, labels=labels, white_point=settings.white_point)
    except ValueError as error:
        raise ValueError(f"frame {frame}: {path}: {error}") from None
    if shot.drawing_depth is not None:
        depth_path = shot.drawing_depth.path(number)
        depth = read_passes(depth_path, want=("depth",)).depth
        assert depth is not None
        check_size(frame, depth_path, depth, _size(picture))
        return Drawn(layer.color, layer.alpha, depth, notes)
    if labels is None:
        raise ValueError(
            f"frame {frame}: no depth: the shot needs drawing.labels (limb colours), drawing.half_width (a stick "
            "figure) or drawing.depth"
        )
    if layer.mode == "fill":
        # Lines belong to the limbs that they bound before those are made opaque; faint ink and slits are paper.
        ink = matte(picture, "unmix", white_point=settings.white_point).alpha
        labels = grow_labels(labels, (ink > FAINT) & ~_slits(ink), reach=settings.reach)
        layer = matte(picture, "fill", labels=labels, white_point=settings.white_point)
    if not labels.any() and layer.alpha.any():
        raise ValueError(f"frame {frame}: {path}: something is drawn, but no limb is marked in the label picture")
    grown = grow_labels(labels, layer.alpha > 0, reach=settings.reach)
    ends, end_depths = limb_ends(shot, frame, grown)
    depth = limb_depth(grown, ends, end_depths, interpolation=settings.interpolation)
    return Drawn(layer.color, layer.alpha, depth, notes, labels, grown)


def limb_ends(shot: Shot, frame: int, labels: NDArray[np.uint8]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the (V, 2, 2) pixels and (V, 2) depths of the limbs' markers in ``frame``.

    Raises DegenerateError where a limb that ``labels`` shows lacks a marker or its depth.
    """
    marks = shot.annotations
    if marks is None or not marks.limbs:
        raise ValueError(f"frame {frame}: no limbs: the shot needs drawing.annotations with limbs")
    if marks.depths is None:
        raise ValueError(f"frame {frame}: the annotations give no depths of the markers")
    index, pairs = shot.annotation_index(frame), marks.limb_markers
    ends, depths = marks.markers[index][pairs], marks.depths[index][pairs]
    missing = ~(np.isfinite(ends).all(axis=2) & np.isfinite(depths))
    for limb in np.flatnonzero(missing.any(axis=1)):
        if (labels == limb + 1).any():
            marker = marks.names[pairs[limb][int(np.argmax(missing[limb]))]]
            name = marks.limbs[limb].name
            raise DegenerateError(f"frame {frame}: limb {name}: marker {marker} has no place or no depth")
    return np.where(missing[..., None], 0.0, ends), np.where(missing, 1.0, depths)


def _slits(ink: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Where paper shows through between two lines: darker on both sides, within two pixels along some direction."""
    dark = np.rint(255 * ink).astype(np.uint8)
    found = np.zeros(dark.shape, bool)
    for step in ((0, 1), (1, 0), (1, 1), (1, -1)):
        side = np.zeros((5, 5), np.uint8)
        for away in (1, 2):
            side[2 + away * step[0], 2 + away * step[1]] = 1
        walls = cv2.min(cv2.dilate(dark, side), cv2.dilate(dark, side[::-1, ::-1].copy()))
        found |= cv2.subtract(walls, dark) >= SLIT
    return found


def read_labels(shot: Shot, frame: int, picture: NDArray[np.uint8]) -> tuple[NDArray[np.uint8] | None, tuple[str, ...]]:
    """Return the limb labels (H, W) of ``frame``, whose drawing is ``picture``, and notes; None where there are none.

    They are painted ones, or a stick figure's; raises as `read_drawn` does.
    """
    settings = shot.settings.drawing
    if shot.labels is not None:
        return _painted_labels(shot, frame, picture)
    if settings.half_width is not None and shot.annotations is not None:
        marks = shot.annotations
        ends = marks.markers[shot.annotation_index(frame)][marks.limb_markers]
        gray = _gray_over_white(picture)
        return segment_stick_figure(gray, ends, settings.half_width, threshold=settings.threshold), ()
    return None, ()


def _painted_labels(shot: Shot, frame: int, picture: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], tuple[str, ...]]:
    assert shot.labels is not None
    path = shot.labels.path(shot.exposure.drawing(frame))
    painted = read_picture(path)
    check_size(frame, path, painted, _size(picture))
    palette, tolerance = shot.palette, shot.settings.drawing.tolerance
    if not len(palette.colors):
        raise ValueError(f"frame {frame}: no limb colours: the annotations' limbs have none and there is no palette")
    found = palette_labels(painted, palette.colors, palette.labels, tolerance=tolerance, background=palette.background)
    if found.first_unmatched is None or found.first_unmatched_color is None:
        return found.labels, ()
    (row, column), color = found.first_unmatched, "#" + bytes(found.first_unmatched_color[:3]).hex()
    note = f"frame {frame}: {path}: {found.unmatched} pixels match no limb, first {color} at row {row}, column {column}"
    if shot.settings.drawing.refuses_unknown_colors:
        raise ValueError(f"{note} (drawing.palette can name it, drawing.tolerance allow for it)")
    return found.labels, (note,)


def _gray_over_white(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.rint(255 - 255 * ink_alpha(picture)).astype(np.uint8)


def _size(picture: NDArray[np.uint8]) -> tuple[int, int]:
    return picture.shape[1], picture.shape[0]


def check_size(frame: int, path: Path, image: NDArray[np.generic], size: tuple[int, int] | None) -> None:
    """Raise ValueError, naming ``frame`` and ``path``, for an image that is not ``size`` (width, height) large."""
    height, width = image.shape[:2]
    if size is not None and (width, height) != tuple(size):
        raise ValueError(f"frame {frame}: {path}: want {size[0]} x {size[1]} pixels, got {width} x {height}")


def check_drawings(shot: Shot, numbers: Iterable[int]) -> None:
    """Raise ShotError, naming all of them, for drawings of another size than the shot or its marks have.

    Only headers of PNG files are read; other pictures are checked when they are read, by `check_drawing`.
    """
    problems = []
    for number in numbers:
        path = shot.drawings.path(number)
        size = png_size(path) if path.is_file() else None
        problems += [] if size is None else _odd_size(shot, path, size)
    if problems:
        raise ShotError(problems)


def check_drawing(shot: Shot, number: int, picture: NDArray[np.uint8]) -> None:
    """Raise ShotError where the ``picture`` of drawing ``number`` has another size than the shot or its marks have."""
    if problems := _odd_size(shot, shot.drawings.path(number), _size(picture)):
        raise ShotError(problems)


def _odd_size(shot: Shot, path: Path, size: tuple[int, int]) -> list[str]:
    marks, given = shot.annotations, shot.settings.shot.size
    wanted = given or (marks.image_size if marks is not None else size)
    if tuple(wanted) == size:
        return []
    source = "shot.size" if given else "as the joint marks say"
    return [f"{path}: want {wanted[0]} x {wanted[1]} pixels ({source}), got {size[0]} x {size[1]}"]
