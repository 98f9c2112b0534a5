"""The pose descriptor and the distance between two poses (Jain et al. 2009, sections 3.2-3.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import _kernels, arrays

Floats = NDArray[np.float64]


def pose_descriptor(markers: ArrayLike, limbs: ArrayLike, *, parents: ArrayLike | None = None) -> Floats:
    """Angles of the limbs of 2D poses (Jain et al. 2009, equation 2), free of place and size.

    Parameters
    ----------
    markers : (..., N, 2) float
        Marker positions (x, y), y downwards, any unit. A marker that is not known may hold NaN.
    limbs : (K, 2) int
        Each limb's first and second marker, as indices into the N.
    parents : (K,) int, optional
        For each limb the limb of the list that its angle is measured against, or -1 for the x axis (the default for
        all): the paper's relative and absolute reference orientation.

    Returns
    -------
    (..., K) float
        atan2(dy, dx) from the first to the second marker in radians, in (-pi, pi]. A limb of no length has angle 0,
        whatever its parent; a limb of which a marker (or a marker of its parent) is NaN has NaN.

    Raises
    ------
    ValueError
        For a wrong shape or dtype, an infinite number, or an index without a marker or limb.

    Examples
    --------
    >>> thigh_and_shin = [[0, 1], [1, 2]]
    >>> knee_bent = [[0.0, 0.0], [0.0, 1.0], [-1.0, 1.0]]
    >>> np.degrees(pose_descriptor(knee_bent, thigh_and_shin)).tolist()
    [90.0, 180.0]
    >>> np.degrees(pose_descriptor(knee_bent, thigh_and_shin, parents=[-1, 0])).tolist()
    [90.0, 90.0]
    """
    markers = arrays.floats("markers", markers, (..., "N", 2), allow="nan")
    limbs = arrays.integers("limbs", limbs, ("K", 2), low=0, high=markers.shape[-2] - 1)
    along = _along(markers, limbs)
    angles = _half_open(np.arctan2(along[..., 1], along[..., 0]))
    angles[(along == 0).all(axis=-1)] = 0
    if parents is None:
        return angles
    reference = arrays.integers("parents", parents, (len(limbs),), low=-1, high=len(limbs) - 1)
    if (reference == np.arange(len(limbs))).any():
        raise ValueError(f"parents: limb {int(np.argmax(reference == np.arange(len(limbs))))} is its own parent")
    against = np.where(reference < 0, 0, angles[..., reference])
    relative = _half_open(np.remainder(angles - against + np.pi, 2 * np.pi) - np.pi)
    relative[(along == 0).all(axis=-1)] = 0
    return np.where(reference < 0, angles, relative)


def limb_trust(markers: ArrayLike, limbs: ArrayLike, *, lengths: ArrayLike | None = None) -> Floats:
    """How far each limb's angle is to be trusted: its projected length over its full length.

    A limb that points at the camera is short in the picture, and its angle is mostly the noise of its two marks.

    Parameters
    ----------
    markers : (..., N, 2) float
        Marker positions; NaN for a marker that is not known.
    limbs : (K, 2) int
        Each limb's two markers, as indices into the N.
    lengths : (K,) float, optional
        The limbs' full lengths in the markers' unit, positive. None: the longest that each is seen in ``markers``.

    Returns
    -------
    (..., K) float
        0 to 1; 0 where a marker is NaN or the limb has no length.

    Raises
    ------
    ValueError
        For a wrong shape or dtype, an infinite number, an index without a marker, or a length that is not positive.

    Examples
    --------
    >>> limb_trust([[[0.0, 0.0], [2.0, 0.0]], [[0.0, 0.0], [0.5, 0.0]]], [[0, 1]]).tolist()
    [[1.0], [0.25]]
    """
    markers = arrays.floats("markers", markers, (..., "N", 2), allow="nan")
    limbs = arrays.integers("limbs", limbs, ("K", 2), low=0, high=markers.shape[-2] - 1)
    seen = _seen_lengths(markers, limbs)
    if lengths is None:
        full = longest_seen(markers, limbs)
    else:
        full = arrays.floats("lengths", lengths, (len(limbs),))
        if not (full > 0).all():
            raise ValueError(f"lengths: want positive lengths, got {full.min()} for limb {int(np.argmin(full))}")
    trust: Floats = np.minimum(seen / np.where(full > 0, full, 1), 1)
    return trust


def longest_seen(markers: ArrayLike, limbs: ArrayLike) -> Floats:
    """The longest that each of ``limbs`` (K, 2) is seen in ``markers`` (..., N, 2); 0 for one that never is.

    Raises ValueError as `limb_trust` does.

    Examples
    --------
    >>> longest_seen([[[0.0, 0.0], [2.0, 0.0]], [[0.0, 0.0], [0.5, 0.0]]], [[0, 1]]).tolist()
    [2.0]
    """
    markers = arrays.floats("markers", markers, (..., "N", 2), allow="nan")
    limbs = arrays.integers("limbs", limbs, ("K", 2), low=0, high=markers.shape[-2] - 1)
    longest: Floats = _seen_lengths(markers, limbs).reshape(-1, len(limbs)).max(axis=0, initial=0)
    return longest


def pose_distance(
    a: ArrayLike,
    b: ArrayLike,
    *,
    weights: ArrayLike | None = None,
    a_trust: ArrayLike | None = None,
    b_trust: ArrayLike | None = None,
) -> Floats:
    """Distances between all poses of two sequences (Jain et al. 2009, equation 4).

    The sum over limbs of the internal angle difference, 0 to pi. A NaN angle (a limb that is not seen) is left out
    and the sum over the others rescaled, so that frames with hidden limbs are neither cheaper nor dearer; a pair that
    has no limb in common gets what unrelated poses have on average, pi / 2 a limb.

    Parameters
    ----------
    a : (F, K) float
        Descriptors in radians, of the drawing say.
    b : (G, K) float
        Descriptors of the same limbs, of the clip say.
    weights : (K,) float, optional
        How much each limb counts, zero or more; 1 for all where None.
    a_trust, b_trust : (F, K) and (G, K) float, optional
        How far each angle is to be trusted, zero or more, as `limb_trust` gives it. In a pair a limb then counts
        weight * trust * trust, and the sum is rescaled to the sum of the weights.

    Returns
    -------
    (F, G) float
        Radians.

    Raises
    ------
    ValueError
        For a wrong shape or dtype, an infinite number, or a weight or trust that is negative or not finite.

    Examples
    --------
    >>> pose_distance([[3.0, 0.5]], [[3.0, 0.0], [-3.0, 0.5]]).round(3).tolist()
    [[0.5, 0.283]]
    """
    a = arrays.floats("a", a, ("F", "K"), allow="nan")
    limbs = a.shape[1]
    b = arrays.floats("b", b, ("G", limbs), allow="nan")
    factors = np.ones(limbs) if weights is None else _not_negative("weights", weights, (limbs,))
    trusted = not (a_trust is None and b_trust is None) or np.isnan(a).any() or np.isnan(b).any()
    none = np.empty((0, 0))
    first = _trust("a_trust", a_trust, a) if trusted else none
    second = _trust("b_trust", b_trust, b) if trusted else none
    return _kernels.pose_distance(_one_turn(a), _one_turn(b), factors, first, second)


def _seen_lengths(markers: Floats, limbs: NDArray[np.int64]) -> Floats:
    lengths: Floats = np.nan_to_num(np.linalg.norm(_along(markers, limbs), axis=-1))
    return lengths


def _along(markers: Floats, limbs: NDArray[np.int64]) -> Floats:
    along: Floats = markers[..., limbs[:, 1], :] - markers[..., limbs[:, 0], :]
    return along


def _half_open(angles: Floats) -> Floats:
    """Put -pi, which atan2 gives for a negative zero, to pi."""
    return np.where(angles <= -np.pi, np.pi, angles)


def _trust(name: str, value: ArrayLike | None, angles: Floats) -> Floats:
    trust = np.ones(angles.shape) if value is None else _not_negative(name, value, angles.shape)
    return np.where(np.isnan(angles), 0, trust)


def _not_negative(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Floats:
    values: Floats = arrays.floats(name, value, shape)
    if (values < 0).any():
        raise ValueError(f"{name}: want zero or more, got {values.min()}")
    return values


def _one_turn(angles: Floats) -> Floats:
    """The same angles so that no two differ by a turn or more, NaN as 0."""
    known = np.nan_to_num(angles)
    if np.abs(known).max(initial=0) > np.pi:
        known = np.remainder(known + np.pi, 2 * np.pi) - np.pi
    return known
