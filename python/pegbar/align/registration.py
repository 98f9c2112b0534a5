"""A camera for every drawn frame, from which the clip looks as it was drawn (Jain et al. 2010, section 3.1.2).

Equation 1 for the whole shot at once, with squared residuals in pixels (docs/papers.md).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.align.camera_choice import MODES, SLOWNESS
from pegbar.align.camera_fit import RAYLEIGH_MEDIAN, Settings
from pegbar.align.camera_terms import Cameras, Shot
from pegbar.align.camera_track import CameraTrack
from pegbar.align.registration_input import check_solvable, read_cameras, read_settings, read_shot
from pegbar.align.root_choice import Root, choose_mode, choose_root, with_share
from pegbar.align.root_motion import travelling
from pegbar.errors import DegenerateError
from pegbar.scene.camera import PerspectiveCamera

Floats = NDArray[np.float64]
Mode = Literal["static", "pan", "free", "auto", "given"]
#: Named shares of the clip's travel.
ROOTS = {"travel": 1.0, "in_place": 0.0}


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
    root: Literal["travel", "in_place", "auto"] | float = "travel",
    cameras: PerspectiveCamera | Sequence[PerspectiveCamera] | ArrayLike | None = None,
    robust: bool = True,
    bridge: bool = False,
) -> CameraTrack:
    """Find the cameras from which a clip looks as it was drawn (Jain et al. 2010, equation 1, the whole shot at once).

    Minimised is the sum over frames of squared pixels: the mean distance of projected and drawn joints; second
    differences of the camera's orientation and place, as they turn and shift a mark at the figure's edge, times
    (window / 2.78)^2 ("smooth"); the sines of roll and of elevation times the figure's spread ("roll", "level"); how
    deep below the floor the camera is, as seen at the figure ("ground"); and, once a shot, the logarithm of the focal
    length over the usual one, times the marks' noise over a spread of 0.35 and the root of the window
    ("field_of_view").

    Parameters
    ----------
    markers : (F, N, 2) float
        The drawn joints, (x, y) in pixels, pixel centres at integers, anywhere; NaN is allowed where not visible.
    points : (F, N, 3) float
        The same joints of the clip, warped to the drawings, world metres, y up; NaN is allowed where not visible.
    image_size : (width, height)
        Of the drawings in pixels. The principal point is the middle, pixels are square.
    field_of_view : float, optional
        Horizontal, radians. None solves one for the shot, near 40 degrees unless the drawings say otherwise.
    visible : (F, N) bool, optional
        Which marks count; None is all.
    mode : {"free", "pan", "static", "auto", "given"}
        A camera that moves, turns in its place, or stands still; the simplest of these that explains the drawings
        within their noise (judged by frames held out); or ``cameras``, of which the errors are computed.
    window : int
        A moving camera is smoothed about as much as an average over so many frames would.
    weights : mapping, optional
        What multiplies the squared terms "smooth", "roll", "ground" and "field_of_view", 1 each by default, and
        "level", 0 by default: 0.3 keeps a figure with short legs from being taken for one seen from above.
    ground : float, optional
        Height of the floor in metres, above which the camera stands; None lets it stand anywhere.
    root : {"travel", "in_place", "auto"} or float
        Whether the figure moves on as in the clip, is drawn on the spot (the clip's smooth horizontal travel taken
        out), or how large a share of the travel it keeps; "auto" looks for the share with which a still camera explains
        the drawings, when the whole travel needs one that moves.
    cameras : camera, cameras or (3, 4) or (F, 3, 4) float, optional
        For ``mode="given"``.
    robust : bool
        Whether marks far off, beyond 2.5 times the usual noise, count linearly rather than squared.
    bridge : bool
        Whether the camera may go smoothly through frames with fewer than four visible marks.

    Returns
    -------
    CameraTrack
        ``matrices`` (F, 3, 4), ``errors`` (F,) RMS px, ``cameras``, and what was chosen.

    Raises
    ------
    ValueError
        For a wrong shape or option, or NaN in a visible mark (frame and joint are named).
    DegenerateError
        For a frame with fewer than four visible marks, or whose marks lie on one line; a camera that stands still needs
        that of the shot only.

    Examples
    --------
    >>> points = np.random.default_rng(0).uniform(-1, 1, (5, 12, 3)) + [0, 1, 0]
    >>> seen = points @ [[1, 0, 0], [0, -1, 0], [0, 0, -1]] + [0, 1.2, 6]
    >>> drawn = 1000 * seen[..., :2] / seen[..., 2:] + [319.5, 179.5]
    >>> track = register_cameras(drawn, points, (640, 360), mode="auto")
    >>> track.mode, bool(np.abs(track.cameras[0].position - [0, 1.2, 6]).max() < 0.01)
    ('static', True)
    """
    if mode not in (*MODES, "auto", "given"):
        raise ValueError(f"mode: want {', '.join(MODES)}, auto or given, got {mode!r}")
    if (cameras is None) == (mode == "given"):
        raise ValueError(f'cameras: wanted for mode "given" and only there, got mode {mode!r}')
    share = _share(root)
    shot = read_shot(markers, points, image_size, visible)
    size = arrays.integers("image_size", image_size, (2,)).tolist()
    settings = read_settings(field_of_view, size[0], window, weights, ground, robust)
    world = arrays.floats("points", points, shot.points.shape, allow="nan")
    if cameras is not None:
        return _given(shot, world, read_cameras(cameras, len(world)), size, settings, share)
    check_solvable(shot, mode != "static" and not bridge)
    if share is None:
        found = choose_root(shot, world, settings, mode)
    else:
        found = Root(choose_mode(with_share(shot, world, settings, share), settings, mode), share, ())
    best = found.choice.fit
    if not np.isfinite(best.distances).all():
        raise DegenerateError("markers: no camera has all visible joints in front of it")
    world = travelling(world, SLOWNESS * settings.window, found.share)
    trials = {mode: errors.distance for mode, errors in found.choice.held_out.items()}
    matrices = _matrices(best.cameras, shot.middle)
    return _track(shot, world, matrices, best.distances, size, best.mode, found.share, trials, found.notes)


def _share(root: str | float) -> float | None:
    """Return the share of the travel that is kept, None to look for it."""
    if isinstance(root, str):
        if root not in (*ROOTS, "auto"):
            raise ValueError(f"root: want travel, in_place, auto or a number, got {root!r}")
        return ROOTS.get(root)
    return float(arrays.floats("root", root, ()))


def _given(
    shot: Shot, world: Floats, matrices: Floats, size: list[int], settings: Settings, share: float | None
) -> CameraTrack:
    if share is None:
        tracks = [_given(shot, world, matrices, size, settings, one) for one in ROOTS.values()]
        return min(tracks, key=lambda track: track.error)
    world = travelling(world, SLOWNESS * settings.window, share)
    views = [PerspectiveCamera(matrix, size) for matrix in matrices]
    seen_at = np.stack([view.project(points) for view, points in zip(views, world, strict=True)])
    distances = np.where(shot.seen, np.linalg.norm(seen_at - shot.marks, axis=-1), 0.0)
    return _track(shot, world, np.stack([view.matrix for view in views]), distances, size, "given", share, {}, ())


def _track(
    shot: Shot,
    world: Floats,
    matrices: Floats,
    distances: Floats,
    size: list[int],
    mode: str,
    share: float,
    trials: dict[str, float],
    notes: tuple[str, ...],
) -> CameraTrack:
    with np.errstate(invalid="ignore"):
        errors = np.sqrt(np.sum(distances**2, axis=1) / shot.seen.sum(axis=1))
    noise = float(np.median(distances[shot.seen])) / RAYLEIGH_MEDIAN if shot.seen.any() else math.nan
    bad = np.flatnonzero(errors > 3 * max(float(np.nanmedian(errors)), 1e-9)).tolist() if shot.seen.any() else []
    if bad:
        notes = (*notes, f"frames that fit badly: {', '.join(map(str, bad))}")
    root = next((name for name, value in ROOTS.items() if value == share), "scaled")
    return CameraTrack(matrices, errors, (size[0], size[1]), mode, root, share, world, noise, trials, notes)


def _matrices(cameras: Cameras, middle: Floats) -> Floats:
    focal = math.exp(cameras.log_focal)
    intrinsic = np.array([[focal, 0, middle[0]], [0, focal, middle[1]], [0, 0, 1]])
    shift = -cameras.rotations @ cameras.centers[..., None]
    matrices: Floats = intrinsic @ np.concatenate([cameras.rotations, shift], axis=-1)
    return matrices
