"""What users pass to `register_cameras`, checked: marks, points, cameras and options."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.align.camera_fit import Settings
from pegbar.align.camera_terms import Shot
from pegbar.errors import DegenerateError
from pegbar.scene.camera import PerspectiveCamera

Floats = NDArray[np.float64]
#: Multiply the squared terms; 1 is as `register_cameras` describes them, 0 leaves a term out.
WEIGHTS = {"smooth": 1.0, "roll": 1.0, "level": 0.0, "ground": 1.0, "field_of_view": 1.0}
#: The usual lens of a shot.
USUAL_FIELD_OF_VIEW = math.radians(40)
#: Marks that a frame's own camera needs.
FEWEST = 4
#: Points whose spread across is below this share of their spread along lie on a line.
_THIN_POINTS, _THIN_MARKS = 1e-3, 1e-5


def read_shot(markers: ArrayLike, points: ArrayLike, image_size: ArrayLike, visible: ArrayLike | None) -> Shot:
    """Return the checked arrays; marks that are not seen become zeros."""
    width, height = arrays.integers("image_size", image_size, (2,), low=1).tolist()
    marks = arrays.floats("markers", markers, ("F", "N", 2), allow="nan")
    seen = np.ones(marks.shape[:2], bool) if visible is None else arrays.flags("visible", visible, marks.shape[:2])
    world = arrays.floats("points", points, (*marks.shape[:2], 3), allow="nan")
    if not len(marks):
        raise ValueError("markers: want one frame or more, got none")
    for name, values in (("markers", marks), ("points", world)):
        missing = np.argwhere(seen & np.isnan(values).any(axis=-1))
        if len(missing):
            frame, joint = missing[0]
            raise ValueError(f"{name}: want finite numbers where visible, got NaN in frame {frame}, joint {joint}")
    shown = seen[..., None]
    middle = np.array([(width - 1) / 2, (height - 1) / 2])
    return Shot(np.where(shown, marks, 0.0), seen, np.where(shown, world, 0.0), middle)


def check_solvable(shot: Shot, every_frame: bool) -> None:
    """Refuse what cannot tell a camera: every frame for itself, or only the shot as a whole."""
    counts = shot.seen.sum(axis=1)
    if not every_frame:
        if counts.sum() < FEWEST:
            raise DegenerateError(f"markers: {counts.sum()} visible joints in all frames, want {FEWEST} or more")
        _refuse_lines("the shot", shot.points[shot.seen], shot.marks[shot.seen])
        return
    few = np.flatnonzero(counts < FEWEST)
    if len(few):
        frame = int(few[0])
        joints = np.flatnonzero(shot.seen[frame]).tolist()
        raise DegenerateError(f"markers: frame {frame} has only {joints} as visible joints, want {FEWEST} or more")
    for frame, seen in enumerate(shot.seen):
        _refuse_lines(f"frame {frame}", shot.points[frame, seen], shot.marks[frame, seen])


def read_settings(
    field_of_view: float | None,
    width: int,
    window: int,
    weights: Mapping[str, float] | None,
    ground: float | None,
    robust: bool,
) -> Settings:
    """Return the checked options."""
    angle = USUAL_FIELD_OF_VIEW if field_of_view is None else field_of_view
    if not 0 < angle < math.pi:
        raise ValueError(f"field_of_view: want radians between 0 and pi, got {field_of_view}")
    frames = int(arrays.integers("window", window, (), low=1))
    for name, weight in (weights or {}).items():
        if name not in WEIGHTS:
            raise ValueError(f"weights: want {', '.join(WEIGHTS)}, got {name!r}")
        if not (math.isfinite(weight) and weight >= 0):
            raise ValueError(f"weights: want {name} zero or more, got {weight}")
    floor = None if ground is None else float(arrays.floats("ground", ground, ()))
    log_focal = math.log(width / 2 / math.tan(angle / 2))
    return Settings(log_focal, field_of_view is None, frames, {**WEIGHTS, **(weights or {})}, floor, robust)


def read_cameras(cameras: PerspectiveCamera | Sequence[PerspectiveCamera] | ArrayLike, frames: int) -> Floats:
    """Return the matrices (F, 3, 4) of one camera for all ``frames`` or of one each."""
    given: Any = cameras
    if isinstance(cameras, PerspectiveCamera):
        given = cameras.matrix
    elif isinstance(cameras, (list, tuple)) and all(isinstance(camera, PerspectiveCamera) for camera in cameras):
        given = [camera.matrix for camera in cameras]
    matrices = arrays.floats("cameras", given, (..., 3, 4))
    if matrices.shape not in ((3, 4), (frames, 3, 4)):
        raise ValueError(f"cameras: want one or {frames} matrices (3, 4), got shape {matrices.shape}")
    return np.array(np.broadcast_to(matrices, (frames, 3, 4)))


def _refuse_lines(where: str, points: Floats, marks: Floats) -> None:
    for name, values, thin in (("points", points, _THIN_POINTS), ("markers", marks, _THIN_MARKS)):
        spread = np.linalg.svd(values - values.mean(axis=0), compute_uv=False)
        if not spread[1] > thin * spread[0]:
            raise DegenerateError(f"{name}: the visible joints of {where} lie on one line")
