"""A camera for every drawn frame, from which the clip looks as it was drawn (Jain et al. 2010, section 3.1.2).

Equation 1 for the whole shot at once, with squared residuals in pixels (docs/papers.md).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.align.camera_fit import Settings, fit
from pegbar.align.camera_terms import Cameras, Shot
from pegbar.align.camera_track import CameraTrack
from pegbar.errors import DegenerateError

Floats = NDArray[np.float64]
Mode = Literal["static", "pan", "free"]
MODES = ("static", "pan", "free")
#: Multiply squared residuals; 1 means as described in `register_cameras`, 0 leaves a term out.
WEIGHTS = {"smooth": 1.0, "roll": 1.0, "ground": 1.0, "field_of_view": 1.0}
#: The usual lens of a shot, and how far its focal length strays (standard deviation of the logarithm).
USUAL_FIELD_OF_VIEW = math.radians(40)
FOCAL_SPREAD = 0.35
#: Frames looked at for a start.
_LOOKED_AT = 48


def register_cameras(
    markers: ArrayLike,
    points: ArrayLike,
    image_size: ArrayLike,
    *,
    field_of_view: float | None = None,
    visible: ArrayLike | None = None,
    mode: Mode = "free",
    window: int = 9,
    weights: Mapping[str, float] | None = None,
    ground: float | None = 0.0,
) -> CameraTrack:
    """Find the cameras from which a clip looks as it was drawn (Jain et al. 2010, equation 1, the whole shot at once).

    Parameters
    ----------
    markers : (F, N, 2) float
        The drawn joints, (x, y) in pixels, pixel centres at integers; NaN is allowed where not visible.
    points : (F, N, 3) float
        The same joints of the clip, warped to the drawings, world metres, y up; NaN is allowed where not visible.
    image_size : (width, height)
        Of the drawings in pixels. The principal point is the middle, pixels are square.
    field_of_view : float, optional
        Horizontal, radians. None solves one for the shot, near 40 degrees unless the drawings say otherwise.
    visible : (F, N) bool, optional
        Which marks count; None is all. Every frame needs four.
    mode : {"static", "pan", "free"}
        A camera that stands still, turns in its place, or moves.
    window : int
        A moving camera is smoothed about as much as an average over so many frames would.
    weights : mapping, optional
        What multiplies the squared terms "smooth", "roll", "ground" and "field_of_view"; 1 each by default.
    ground : float, optional
        Height of the floor in metres, above which the camera stands; None lets it stand anywhere.

    Returns
    -------
    CameraTrack

    Raises
    ------
    ValueError
        For a wrong shape, or NaN in a visible mark (frame and joint are named).
    DegenerateError
        For a frame with fewer than four visible marks.

    Examples
    --------
    >>> points = np.random.default_rng(0).uniform(-1, 1, (5, 12, 3)) + [0, 1, 0]
    >>> seen = points @ [[1, 0, 0], [0, -1, 0], [0, 0, -1]] + [0, 1.2, 6]
    >>> drawn = 1000 * seen[..., :2] / seen[..., 2:] + [319.5, 179.5]
    >>> track = register_cameras(drawn, points, (640, 360), mode="static")
    >>> np.abs(track.cameras[0].position - [0, 1.2, 6]).max() < 0.01
    np.True_
    """
    size = arrays.integers("image_size", image_size, (2,), low=1)
    shot = _shot(markers, points, visible, size)
    focal = size[0] / 2 / math.tan((field_of_view or USUAL_FIELD_OF_VIEW) / 2)
    scale = {**WEIGHTS, **(weights or {})}
    settings = Settings(math.log(focal), field_of_view is None, window, scale, ground, True)
    found = fit(shot, mode, settings)
    errors = np.sqrt(np.sum(found.distances**2, axis=1) / shot.seen.sum(axis=1))
    matrices = _matrices(found.cameras, shot.middle)
    return CameraTrack(matrices, errors, (int(size[0]), int(size[1])), mode, "travel", shot.points, found.noise)


def _shot(markers: ArrayLike, points: ArrayLike, visible: ArrayLike | None, size: NDArray[np.int64]) -> Shot:
    marks = arrays.floats("markers", markers, ("F", "N", 2), allow="nan")
    seen = np.ones(marks.shape[:2], bool) if visible is None else arrays.flags("visible", visible, marks.shape[:2])
    world = arrays.floats("points", points, (*marks.shape[:2], 3), allow="nan")
    for name, values in (("markers", marks), ("points", world)):
        missing = np.argwhere(seen & np.isnan(values).any(axis=-1))
        if len(missing):
            frame, joint = missing[0]
            raise ValueError(f"{name}: want finite numbers where visible, got NaN in frame {frame}, joint {joint}")
    few = np.flatnonzero(seen.sum(axis=1) < 4)
    if len(few):
        raise DegenerateError(f"markers: frame {few[0]} has {seen[few[0]].sum()} visible joints, want 4 or more")
    middle = (size - 1) / 2
    world = np.where(seen[..., None], world, 0.0)
    return Shot(np.where(seen[..., None], marks, 0.0), seen, world, middle)


def _matrices(cameras: Cameras, middle: Floats) -> Floats:
    focal = math.exp(cameras.log_focal)
    intrinsic = np.array([[focal, 0, middle[0]], [0, focal, middle[1]], [0, 0, 1]])
    shift = -cameras.rotations @ cameras.centers[..., None]
    matrices: Floats = intrinsic @ np.concatenate([cameras.rotations, shift], axis=-1)
    return matrices
