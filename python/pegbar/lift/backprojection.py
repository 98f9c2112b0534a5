"""The drawing's joints in 3D: exactly behind the drawn marks, at the clip's depths (Jain et al. 2010, section 3.1.3).

A mark x under the camera M = [Q | q] lies on the ray X(z) = C + z d with C = -Q^-1 q and d = Q^-1 (x, y, 1); where the
third row of Q has length 1, z is the planar depth in metres. Equations 2-5 say no more than this. Everything is
measured in metres of the world: the pixels, and with them K, have left the equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solveh_banded

from pegbar import arrays
from pegbar.errors import DegenerateError

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Form = Literal["ray", "printed"]


def back_project(
    markers: ArrayLike,
    matrices: ArrayLike,
    depths: ArrayLike,
    *,
    smoothing: float = 0.0,
    visible: ArrayLike | None = None,
    form: Form = "ray",
    names: Sequence[str] | None = None,
) -> Floats:
    """Place drawn markers in the world at known depths (Jain et al. 2010, equations 2-8).

    Parameters
    ----------
    markers : (F, N, 2) float
        Drawn markers in pixels; NaN is allowed where not visible.
    matrices : (F, 3, 4) float
        A camera matrix per frame, of any scale, as `PerspectiveCamera` takes it.
    depths : (F, N) float
        Planar depths in metres, positive: what the registered cameras say of the clip's points (equation 4).
    smoothing : float
        Weight of a marker's squared second differences over time, along its ray (metres a frame, a frame), against
        its squared change of depth (metres). To and fro motion in depth with a period of
        ``2 * pi * smoothing ** 0.25`` frames is halved, faster motion is taken away and slower motion is left:
        1 halves 6 frames, 16 halves 13 frames, 200 halves 24 frames.
    visible : (F, N) bool, optional
        False where the drawing hides a marker: there the result is NaN and smoothing does not look.
        `fill_hidden` gives such markers a place first.
    form : {"ray", "printed"}
        "ray": smoothing moves a marker only along its own ray, so that the drawing is always met exactly.
        "printed": equations 7-8, where first differences of position are weighted against both the drawing and the
        depth, all in metres at the marker; a marker leaves its ray.
    names : sequence of N str, optional
        The markers' names, for messages.

    Returns
    -------
    (F, N, 3) float
        World positions in metres.

    Raises
    ------
    ValueError
        For a wrong shape, a number that is not finite, a negative smoothing or an unknown form.
    DegenerateError
        For a depth that is not positive, before or after smoothing, and for a singular camera, naming the frame.

    Examples
    --------
    >>> camera = [[100, 0, 50, 0], [0, 100, 50, 0], [0, 0, 1, 0]]
    >>> back_project([[[150, 50]]], [camera], [[4.0]]).tolist()
    [[[4.0, 0.0, 4.0]]]
    """
    markers = arrays.floats("markers", markers, ("F", "N", 2), allow="any")
    frames, count = markers.shape[:2]
    matrices = arrays.floats("matrices", matrices, (frames, 3, 4))
    depths = arrays.floats("depths", depths, (frames, count), allow="any")
    seen = np.ones((frames, count), bool) if visible is None else arrays.flags("visible", visible, (frames, count))
    if not (np.isfinite(smoothing) and smoothing >= 0):
        raise ValueError(f"smoothing: want zero or more, got {smoothing}")
    if form not in ("ray", "printed"):
        raise ValueError(f'form: want "ray" or "printed", got {form!r}')
    places = _Places(names, count)
    places.check("markers", np.isfinite(markers).all(axis=2) | ~seen, "has no position", ValueError)
    places.check("depths", np.isfinite(depths) | ~seen, "has no finite depth", ValueError)
    places.check("depths", (np.where(seen, depths, 1) > 0), "is not in front of the camera", DegenerateError)
    centres, rays = camera_rays(np.where(seen[..., None], markers, 0), matrices)
    depths = np.where(seen, depths, 1)
    if form == "printed" and smoothing > 0:
        points = _printed(centres, rays, depths, _depth_rows(matrices), seen, smoothing)
    else:
        if smoothing > 0:
            depths = _smooth_depths(centres, rays, depths, seen, smoothing)
            places.check("smoothing", depths > 0, "is moved behind the camera", DegenerateError)
        points = centres[:, None] + depths[..., None] * rays
    points[~seen] = np.nan
    return points


def camera_rays(markers: ArrayLike, matrices: ArrayLike) -> tuple[Floats, Floats]:
    """Return camera centres (F, 3) and the rays (F, N, 3) through ``markers`` (F, N, 2), one metre deep.

    A point at planar depth z (metres) behind a marker is ``centre + z * ray``. ``matrices`` (F, 3, 4) may have any
    scale; a singular one is a DegenerateError that names the frame.
    """
    markers = arrays.floats("markers", markers, ("F", "N", 2), allow="nan")
    matrices = arrays.floats("matrices", matrices, (len(markers), 3, 4))
    left, last = matrices[:, :, :3], matrices[:, :, 3]
    determinants = np.linalg.det(left)
    sizes = np.prod(np.linalg.norm(left, axis=2), axis=1)
    singular = ~(np.abs(determinants) > 1e-12 * sizes)
    if singular.any():
        raise DegenerateError(f"matrices: frame {int(np.argmax(singular))} is singular, so it is no finite camera")
    scales = np.sign(determinants) * np.linalg.norm(left[:, 2], axis=1)
    inverses = np.linalg.inv(left)
    centres = -np.einsum("fij,fj->fi", inverses, last)
    pixels = np.concatenate([markers, np.ones((*markers.shape[:2], 1))], axis=2)
    rays = np.einsum("fij,fnj->fni", inverses * scales[:, None, None], pixels)
    return centres, rays


def _depth_rows(matrices: Floats) -> Floats:
    """The unit view axes (F, 3): the third rows of the matrices, m_3, pointing forward."""
    rows = matrices[:, 2, :3] * np.sign(np.linalg.det(matrices[:, :, :3]))[:, None]
    axes: Floats = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    return axes


def _smooth_depths(centres: Floats, rays: Floats, depths: Floats, seen: Flags, smoothing: float) -> Floats:
    """The depths z (F, N) that minimise sum (z - depths)^2 + smoothing * sum (second differences along the ray)^2.

    Linear in z, and each marker for itself: a positive definite matrix with five diagonals, F unknowns. What is
    solved for is the change, so that what is smooth already keeps its digits.
    """
    frames, count = depths.shape
    if frames < 3:
        return depths
    whole = seen[:-2] & seen[1:-1] & seen[2:]
    middle = rays[1:-1] / np.einsum("fni,fni->fn", rays[1:-1], rays[1:-1])[..., None]
    windows = [slice(first, frames - 2 + first) for first in range(3)]
    taps = [
        np.where(whole, weight * np.einsum("fni,fni->fn", middle, rays[window]), 0)
        for window, weight in zip(windows, (1, -2, 1), strict=True)
    ]
    points = centres[:, None] + depths[..., None] * rays
    bends = np.einsum("fni,fni->fn", middle, points[:-2] - 2 * points[1:-1] + points[2:])
    bands, pull = np.zeros((3, frames, count)), np.zeros((frames, count))
    for first, window in enumerate(windows):
        pull[window] -= smoothing * taps[first] * bends
        for second in range(first, 3):
            bands[second - first, window] += smoothing * taps[first] * taps[second]
    bands[0] += 1
    changes = [solveh_banded(bands[:, :, n], pull[:, n], lower=True) for n in range(count)]
    return depths + np.reshape(changes, (count, frames)).T


def _printed(centres: Floats, rays: Floats, depths: Floats, axes: Floats, seen: Flags, smoothing: float) -> Floats:
    """Equations 7-8 with W on both sides and the fourth coordinate 1: the points (F, N, 3).

    In camera axes the cross product with the ray r = (x, y, 1) has the normal matrix r.r I - r r^T, the depth row
    adds that of the view axis; first differences of position couple a frame to the next. Each marker for itself: a
    positive definite matrix with seven diagonals, 3 F unknowns.
    """
    frames, count = depths.shape
    start = centres[:, None] + depths[..., None] * rays
    whole = np.where(seen[:-1] & seen[1:], smoothing, 0.0)
    gaps = whole[..., None] * np.diff(start, axis=0)
    coupled = np.zeros((frames, count))
    pull = np.zeros((frames, count, 3))
    coupled[:-1] += whole
    coupled[1:] += whole
    pull[:-1] += gaps
    pull[1:] -= gaps
    blocks = np.einsum("fni,fni->fn", rays, rays)[..., None, None] * np.eye(3) - np.einsum("fni,fnj->fnij", rays, rays)
    blocks += np.einsum("fi,fj->fij", axes, axes)[:, None] + coupled[..., None, None] * np.eye(3)
    bands = np.zeros((4, count, frames, 3))
    for lower in range(3):
        for row in range(lower, 3):
            bands[row - lower, :, :, lower] = blocks[..., row, lower].T
    bands[3, :, :-1] = -whole.T[..., None]
    for n in range(count):
        change = solveh_banded(bands[:, n].reshape(4, -1), pull[:, n].reshape(-1), lower=True)
        start[:, n] += change.reshape(frames, 3)
    return start


class _Places:
    """Says where a value is wrong: frame and marker, by name where names are known."""

    def __init__(self, names: Sequence[str] | None, count: int) -> None:
        if names is not None and len(names) != count:
            raise ValueError(f"names: want {count}, got {len(names)}")
        self.names = names

    def check(self, argument: str, good: Flags, problem: str, error: type[ValueError]) -> None:
        """Raise ``error`` for the first place (frame, marker) where ``good`` is false."""
        if not good.all():
            frame, marker = (int(i) for i in np.argwhere(~good)[0])
            name = self.names[marker] if self.names is not None else f"marker {marker}"
            raise error(f"{argument}: frame {frame}, {name} {problem}")
