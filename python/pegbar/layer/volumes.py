"""Collision volumes: a tapered cylinder for every limb (2010 paper, section 3.2, equations 9-13)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.errors import DegenerateError
from pegbar.scene.camera import metric
from pegbar.scene.volumes import TaperedCylinders

Floats = NDArray[np.float64]


def collision_volumes(boxes: ArrayLike, matrices: ArrayLike, points: ArrayLike, limbs: ArrayLike) -> TaperedCylinders:
    """Fill every limb's box in the picture with a tapered cylinder in 3D (2010, equations 9-13).

    The box's corners are put at the planar depth of the limb's markers; half the distance between the two corners at
    a marker is the radius there (the printed square root of the distance is no length), and the axis runs through
    the middles between them.

    Parameters
    ----------
    boxes : (F, V, 4, 2) float
        Corners p1 to p4 in pixels: p1 and p4 at the limb's first marker, p2 and p3 at its second, p1 and p2 on one
        side. NaN where a limb has no box.
    matrices : (F, 3, 4) float
        The cameras, of any scale.
    points : (F, N, 3) float
        The markers in world metres, NaN where unknown.
    limbs : (V, 2) int
        Each limb's first and second marker.

    Returns
    -------
    TaperedCylinders
        Axis and radii of every limb and frame.

    Raises
    ------
    ValueError
        For a wrong shape or a limb that names no marker.
    DegenerateError
        Naming frame and limb: for a box that is inside out (its sides cross), a box whose two corners at a marker
        coincide on both ends, or a marker behind the camera.

    Examples
    --------
    >>> import numpy as np
    >>> camera = [[100.0, 0, 0, 0], [0, 100.0, 0, 0], [0, 0, 1, 0]]
    >>> box = [[[[10, -20], [10, 20], [-10, 20], [-10, -20]]]]
    >>> volumes = collision_volumes(box, [camera], [[[0.0, -0.4, 2.0], [0.0, 0.4, 2.0]]], [[0, 1]])
    >>> volumes.start_radius.round(6).tolist(), volumes.start[0, 0].round(6).tolist()
    ([[0.2]], [0.0, -0.4, 2.0])
    """
    matrices = metric(arrays.floats("matrices", matrices, ("F", 3, 4)))
    frames = len(matrices)
    points = arrays.floats("points", points, (frames, "N", 3), allow="nan")
    limbs = arrays.integers("limbs", limbs, ("V", 2), low=0, high=points.shape[1] - 1)
    boxes = arrays.floats("boxes", boxes, (frames, len(limbs), 4, 2), allow="nan")
    depths = np.einsum("fi,fni->fn", matrices[:, 2, :3], points) + matrices[:, 2, 3:]
    _refuse(boxes, depths[:, limbs])
    corners = _unproject(boxes, depths[:, limbs[:, [0, 1, 1, 0]]], matrices)
    start_side, end_side = corners[:, :, 0] - corners[:, :, 3], corners[:, :, 1] - corners[:, :, 2]
    return TaperedCylinders(
        (corners[:, :, 0] + corners[:, :, 3]) / 2,
        (corners[:, :, 1] + corners[:, :, 2]) / 2,
        np.linalg.norm(start_side, axis=-1) / 2,
        np.linalg.norm(end_side, axis=-1) / 2,
    )


def _unproject(pixels: Floats, depths: Floats, matrices: Floats) -> Floats:
    """World points (F, V, 4, 3) that are seen at ``pixels`` at planar ``depths``: equations 9, 10-11 and 12."""
    image = np.concatenate([pixels * depths[..., None], depths[..., None]], axis=-1) - matrices[:, None, None, :, 3]
    world: Floats = np.einsum("fij,fvqj->fvqi", np.linalg.inv(matrices[:, :, :3]), image)
    return world


def _refuse(boxes: Floats, depths: Floats) -> None:
    """Raise for the first limb that no cylinder can fill; what is NaN is unknown and no fault."""
    start, end = boxes[:, :, 0] - boxes[:, :, 3], boxes[:, :, 1] - boxes[:, :, 2]
    crossed = np.einsum("fvi,fvi->fv", start, end) < 0
    empty = (start == 0).all(axis=2) & (end == 0).all(axis=2)
    for wrong, reason in (
        (crossed, "its box is inside out: p1 and p2 lie on different sides"),
        (empty, "its box has no width"),
        ((depths <= 0).any(axis=2), "a marker lies behind the camera"),
    ):
        if wrong.any():
            frame, limb = np.argwhere(wrong)[0].tolist()
            raise DegenerateError(f"boxes: frame {frame}, limb {limb}: {reason}")
