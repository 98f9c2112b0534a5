"""Marker positions in space from drawn points and a clip (Jain, Sheikh, Hodgins 2009, section 3.5)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import _kernels, arrays
from pegbar.lift.given import Given, Refinement, check_weights
from pegbar.lift.lengths import clip_lengths
from pegbar.lift.projection import projection_rows
from pegbar.lift.refine import refine_markers
from pegbar.lift.subspace import principal_components

Floats = NDArray[np.float64]


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
    planted: ArrayLike | None = None,
    held: ArrayLike | None = None,
    flips: ArrayLike = (),
    stretch: bool = False,
    noise: float | None = None,
    root: int = 0,
) -> Floats:
    """Find the markers in space whose picture is the drawn pose and which stay near the clip's.

    Jain, Sheikh, Hodgins 2009, eqs. 5-16: every frame minimises the squared projection error, ``limb_weight`` times
    the squared error of squared limb lengths (eq. 7, linearised around the clip's pose) and ``prior_weight`` times the
    squared distance to the clip, all in metres, in closed form.

    With ``refine`` limbs have exact lengths instead: length and drawn foreshortening give the size of a limb's depth,
    smooth motion and the clip its sign, over the whole sequence at once. The weights and components above are not used.

    Parameters
    ----------
    aligned : (F, N, 2) float
        The aligned markers (see `align_limbs`) in the picture's units; with ``refine`` the drawn markers themselves.
        NaN where a marker is not visible.
    prior : (F, N, 3) float
        The time-aligned clip's markers in metres.
    camera : OrthographicCamera, PerspectiveCamera, a sequence of F of them, or an object with ``cameras``
        Errors in pixels are divided by the orthographic scale, or multiplied by depth over focal length.
    limbs : (V, 2) int
        Pairs of markers that keep their distance.
    lengths : (V,) or (F, V) float, or None
        Their lengths in metres. None: the clip's medians; with ``refine`` what `drawn_lengths` finds.
    limb_weight, prior_weight : float
        The paper's lambda 1 (dimension: 1 / metres squared) and lambda 2.
    components : int
        How many principal components of ``training`` poses are made of.
    training : (G, N, 3) float, optional
        Poses in the frame of reference of ``prior``; None leaves poses free (eq. 11).
    refine : bool
        Rigid limbs, signs chosen over time; what follows is for it alone.
    planted : (F, N) bool, optional
        Where a marker stands: it stays at one place through every run of frames.
    held : (F, N, 3) float, optional
        Where a marker is put, in metres; NaN where it is free.
    flips : (K, 3) int
        (limb, first frame, one past the last): limbs whose depth is turned the other way by hand.
    stretch : bool
        Keep the drawing's squash and stretch: the drawn points are met exactly and limbs change their lengths.
    noise : float, optional
        Deviation of the marks in the picture's units; None measures it. 0 follows them wherever lengths allow it.
    root : int
        The marker whose depth is the clip's; the others' depths hang on it.

    Returns
    -------
    (F, N, 3) float
        The markers in metres.

    Raises
    ------
    ValueError
        For a wrong shape, a number that is not finite, a weight below 0, fewer than 2 training poses, or an option of
        ``refine`` without it.
    DegenerateError
        For a frame with fewer than 4 visible markers, or training poses that are all equal.

    Examples
    --------
    >>> from pegbar import OrthographicCamera
    >>> clip = [[[0.0, 0.0, 1.0], [0.0, 0.3, 1.4]]]
    >>> front = OrthographicCamera.from_angles(0, 0)
    >>> reconstruct_markers([[[0, 0], [0.3, 0]]], clip, front, [(0, 1)], [0.5])[0, 1].round(2).tolist()
    [0.27, 0.03, 1.4]
    >>> reconstruct_markers([[[0, 0], [0.3, 0]]], clip, front, [(0, 1)], [0.5], refine=True)[0, 1].round(2).tolist()
    [0.3, 0.0, 1.4]
    """
    given = Given.checked(aligned, prior, camera, limbs, lengths)
    check_weights(limb_weight=limb_weight, prior_weight=prior_weight)
    subspace = _subspace(training, given, components)
    options = Refinement.checked(given, planted, held, flips, stretch, noise, root)
    if refine:
        return refine_markers(given, options)[0]
    if planted is not None or held is not None or len(options.flips) or stretch or noise is not None:
        raise ValueError("refine: planted, held, flips, stretch and noise are options of refine=True")
    return _closed_form(given, float(limb_weight), float(prior_weight), subspace)


def drawn_lengths(drawn: ArrayLike, prior: ArrayLike, camera: Any, limbs: ArrayLike) -> Floats:
    """Find how long the limbs of a drawn figure are, from how they foreshorten over a sequence.

    A limb that comes through the picture plane shows its length; for one that never does, the clip's proportions and
    its turning decide. Every length is the one under which the depths, in the best choice of signs, are smoothest and
    nearest to the clip.

    Parameters
    ----------
    drawn : (F, N, 2) float
        The drawn markers in the picture's units, NaN where not visible.
    prior : (F, N, 3) float
        The time-aligned clip's markers in metres.
    camera, limbs
        As in `reconstruct_markers`.

    Returns
    -------
    (V,) float
        Metres.

    Raises
    ------
    ValueError, DegenerateError
        As in `reconstruct_markers`.

    Examples
    --------
    >>> from pegbar import OrthographicCamera
    >>> angles = np.linspace(-1, 1, 30)
    >>> turning = 0.4 * np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=1)
    >>> figure = np.stack([0 * turning, turning], axis=1)
    >>> front = OrthographicCamera.from_angles(0, 0)
    >>> drawn_lengths(front.project(figure), 1.1 * figure, front, [(0, 1)]).round(2).tolist()
    [0.4]
    """
    given = Given.checked(drawn, prior, camera, limbs, None)
    return refine_markers(given, Refinement())[1][0] if len(given.prior) else np.zeros(len(given.limbs))


def _subspace(training: ArrayLike | None, given: Given, components: int) -> tuple[Floats, Floats]:
    """Mean and components of ``training``; both empty without any."""
    markers = given.prior.shape[1]
    if training is None:
        return np.empty((0, 3)), np.empty((0, 3 * markers))
    if components < 1:
        raise ValueError(f"components: want at least 1, got {components}")
    return principal_components(arrays.floats("training", training, ("G", markers, 3)), components)


def _closed_form(given: Given, limb_weight: float, prior_weight: float, subspace: tuple[Floats, Floats]) -> Floats:
    if not len(given.prior):
        return given.prior
    lengths = given.lengths
    if lengths is None:
        lengths = np.tile(clip_lengths(given.prior, given.limbs), (len(given.prior), 1))
    rows = projection_rows(given.drawn, given.cameras)
    # Where drawing and limbs leave a direction open the clip's stays: the limit of a weight that goes to 0.
    weights = (limb_weight, max(prior_weight, 1e-9))
    return _kernels.lift_markers(rows, given.limbs, lengths, given.prior, weights, subspace)
