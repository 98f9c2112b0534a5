"""Marker positions in space from drawn points and a clip (Jain, Sheikh, Hodgins 2009, section 3.5)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import _kernels, arrays
from pegbar.errors import DegenerateError
from pegbar.lift.lengths import clip_lengths, given_lengths
from pegbar.lift.projection import frame_cameras, projection_rows
from pegbar.lift.refine import Refinement, refine_markers
from pegbar.lift.subspace import principal_components

Floats = NDArray[np.float64]
#: With fewer visible marks than this the rest of the figure is a guess from the clip alone.
FEWEST_MARKS = 4


def reconstruct_markers(
    aligned: ArrayLike,
    prior: ArrayLike,
    camera: Any,
    limbs: ArrayLike,
    lengths: ArrayLike | None,
    *,
    limb_weight: float = 1e-3,
    prior_weight: float = 0.1,
    components: int = 20,
    training: ArrayLike | None = None,
    refine: bool = False,
) -> Floats:
    """Find the markers in space whose picture is the drawn pose and which stay near the clip's.

    Jain, Sheikh, Hodgins 2009, eqs. 5-16: every frame minimises the squared projection error, ``limb_weight`` times
    the squared error of squared limb lengths (eq. 7, linearised around the clip's pose) and ``prior_weight`` times the
    squared distance to the clip, all in metres, in closed form.

    Parameters
    ----------
    aligned : (F, N, 2) float
        The aligned markers (see `align_limbs`) in the picture's units; NaN where a marker is not visible.
    prior : (F, N, 3) float
        The time-aligned clip's markers in metres.
    camera : OrthographicCamera, PerspectiveCamera, a sequence of F of them, or an object with ``cameras``
        Errors in pixels are divided by the orthographic scale, or multiplied by depth over focal length.
    limbs : (V, 2) int
        Pairs of markers that keep their distance.
    lengths : (V,) or (F, V) float, or None
        Their lengths in metres; None estimates them (see `limb_lengths`).
    limb_weight, prior_weight : float
        The paper's lambda 1 (dimension: 1 / metres squared) and lambda 2.
    components : int
        How many principal components of ``training`` poses are made of.
    training : (G, N, 3) float, optional
        Poses in the frame of reference of ``prior``; None leaves poses free (eq. 11).

    Returns
    -------
    (F, N, 3) float
        The markers in metres.

    Raises
    ------
    ValueError
        For a wrong shape, a number that is not finite, a weight below 0 or fewer than 2 training poses.
    DegenerateError
        For a frame with fewer than 4 visible markers, or training poses that are all equal.

    Examples
    --------
    >>> from pegbar import OrthographicCamera
    >>> clip = [[[0.0, 0.0, 1.0], [0.0, 0.3, 1.4]]]
    >>> front = OrthographicCamera.from_angles(0, 0)
    >>> reconstruct_markers([[[0, 0], [0.3, 0]]], clip, front, [(0, 1)], [0.5])[0, 1].round(2).tolist()
    [0.27, 0.03, 1.4]
    """
    prior = arrays.floats("prior", prior, ("F", "N", 3))
    frames, markers = prior.shape[:2]
    aligned = arrays.floats("aligned", aligned, (frames, markers, 2), allow="nan")
    limbs = arrays.integers("limbs", limbs, ("V", 2), low=0, high=markers - 1)
    cameras = frame_cameras(camera, frames)
    check_weights(limb_weight=limb_weight, prior_weight=prior_weight)
    check_marks(aligned)
    given = None if lengths is None else given_lengths(lengths, frames, len(limbs))
    if not frames:
        return prior
    if refine:
        return refine_markers(aligned, prior, cameras, limbs, given, Refinement())[0]
    if given is None:
        given = given_lengths(clip_lengths(prior, limbs), frames, len(limbs))
    mean, basis = np.empty((0, 3)), np.empty((0, 3 * markers))
    if training is not None:
        poses = arrays.floats("training", training, ("G", markers, 3))
        if components < 1:
            raise ValueError(f"components: want at least 1, got {components}")
        mean, basis = principal_components(poses, components)
    rows = projection_rows(aligned, cameras)
    # Where drawing and limbs leave a direction open the clip's stays: the limit of a weight that goes to 0.
    weights = (float(limb_weight), max(float(prior_weight), 1e-9))
    return _kernels.lift_markers(rows, limbs, given, prior, weights, (mean, basis))


def check_weights(**weights: float) -> None:
    """Refuse a weight that is negative or not finite, by its name."""
    for name, value in weights.items():
        if not (np.isfinite(value) and value >= 0):
            raise ValueError(f"{name}: want a finite number of at least 0, got {value}")


def check_marks(points: Floats) -> None:
    """Refuse a frame of (F, N, 2) ``points`` in which fewer than four are not NaN (or all, of fewer markers)."""
    visible = (~np.isnan(points).any(axis=-1)).sum(axis=1)
    wanted = min(FEWEST_MARKS, points.shape[1])
    if (visible < wanted).any():
        frame = int(np.argmax(visible < wanted))
        raise DegenerateError(
            f"frame {frame}: {visible[frame]} visible markers, want at least {wanted} to place the figure"
        )
