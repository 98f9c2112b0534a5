"""What a picture can show of a moving figure: limits to how its parts turn (beside Hornung et al. 2007, s7).

A part that points into the camera is a scrap in the picture, and what is drawn between two that pass over one another
is squeezed into a stalk. A body is about as round as it is broad: what comes up is its side, that is not drawn. So
parts turn less than the clip's where the picture would give out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
# Frames over which a direction is smoothed that the picture hardly tells, and the seen share up to which it does so.
_LAG, _STEADY = 3.0, 0.7
# Parts of its drawn length in the picture by which the end of a bone across the trunk moves freely, and at most.
_FREE, _MOST = 0.1, 0.22
# A bone that is drawn towards the viewer is taken to be so long in the picture, in parts of its length.
_LEAST = 0.5
# The part of its length up to which a bone hardly points out of the picture.
_SHALLOW = 0.2
# The cosine of the turn up to which the figure shows its drawn side; beyond, it turns over.
_TURNED = 0.5
# Degrees by which an animal's limb swings as the clip's, and at most; a clip's limb that points the other way, from
# where on it counts less and less, says nothing about how far.
_SWING, _MOST_SWING, _BACK = 20.0, 50.0, 110.0


def towards_picture(along: Floats, axes: Floats, least: float, drawn: float = 1.0) -> Floats:
    """Vectors (F, 3) turned back towards the picture, so that ``least`` of what is drawn of them is seen at least.

    ``axes`` (3, 3) are the camera's: right, down and forward. ``drawn`` is the part of their length that is drawn; one
    of which as much or more is seen stays.
    """
    right, down, deep = (along @ axes.T).T
    length = np.linalg.norm(along, axis=1)
    seen = np.hypot(right, down) / length
    # The outline of an ellipsoid of half axes 1 and r that is seen from an angle.
    wanted = np.sqrt(seen**2 + least**2 * np.maximum(drawn**2 - seen**2, 0))
    angles = _steady(np.arctan2(down, right), seen)
    towards = np.sign(deep) * np.sqrt(np.maximum(1 - wanted**2, 0))
    shown = np.stack([wanted * np.cos(angles), wanted * np.sin(angles), towards], axis=1)
    result: Floats = length[:, None] * (shown @ axes)
    return result


def _steady(angles: Floats, seen: Floats) -> Floats:
    """Angles (F,) in radians, smoothed where what they are the direction of is hardly seen: ``seen`` (F,), 0 to 1."""
    turned = np.unwrap(angles)
    weights = seen + 1e-3
    smooth = gaussian_filter1d(weights * turned, _LAG, mode="nearest") / gaussian_filter1d(
        weights, _LAG, mode="nearest"
    )
    share = np.clip(seen / _STEADY, 0, 1)
    share = share * share * (3 - 2 * share)
    steady: Floats = share * turned + (1 - share) * smooth
    return steady


def shown_across(along: Floats, drawn: Floats, axes: Floats, turned: Floats, tilt: Rotation) -> Floats:
    """Return bones (F, 3) across the trunk, ``along`` (F, 3), turned so that they are seen about as drawn.

    Parameters
    ----------
    along : (F, 3) float
        From the spine to the shoulder or hip, metres.
    drawn : (3,) float
        The same as drawn.
    axes : (3, 3) float
        The camera's right, down and forward.
    turned : (F,) float
        By how many degrees the figure has turned about the upright from its drawn view.
    tilt : Rotation
        By what the trunk has turned in the picture (F,): about the camera's forward axis.
    """
    side = np.clip(np.cos(np.radians(turned)) / _TURNED, -1, 1)
    right, down, _ = axes @ drawn
    flat = side[:, None] * right * axes[0] + down * axes[1]
    expected = tilt.apply(flat) @ axes[:2].T
    seen = along @ axes.T
    moved = seen[:, :2] - expected
    length = float(np.linalg.norm(drawn))
    reach = max(float(np.hypot(right, down)), _LEAST * length)
    if not reach > 0:
        return along
    size = np.linalg.norm(moved, axis=1) / reach
    beyond = np.maximum(size - _FREE, 0) / (_MOST - _FREE)
    limited = np.minimum(size, _FREE) + (_MOST - _FREE) * np.tanh(beyond)
    place = expected + moved * (limited / np.maximum(size, 1e-12))[:, None]
    depth = np.sqrt(np.maximum(length**2 - (place**2).sum(axis=1), 0))
    # As deep as its length asks for, on the side where it is; there is no jump where it comes through the picture.
    share = np.minimum(np.abs(seen[:, 2]) / max(_SHALLOW * length, 1e-12), 1)
    deep = (1 - share) * seen[:, 2] + share * np.sign(seen[:, 2]) * depth
    result: Floats = np.column_stack([place, deep]) @ axes
    return result


def limited_swing(directions: Floats, drawn: Floats, axes: Floats) -> Floats:
    """Vectors (F, 3) turned in the picture so that they are never far from ``drawn`` (F, 3).

    An arm goes up beside the head; a leg that is drawn under a trunk does not. ``axes`` (3, 3) are the camera's.
    """
    angles, own = (np.arctan2(*(vectors @ axes[[1, 0]].T).T) for vectors in (directions, drawn))
    away = np.degrees((angles - own + np.pi) % (2 * np.pi) - np.pi)
    size, room = np.abs(away), _MOST_SWING - _SWING
    limited = np.minimum(size, _SWING) + room * np.tanh(np.maximum(size - _SWING, 0) / room)
    back = np.clip((180 - size) / (180 - _BACK), 0, 1)
    limited = np.sign(away) * limited * back * back * (3 - 2 * back)
    turned: Floats = Rotation.from_rotvec(np.radians(limited - away)[:, None] * axes[2]).apply(directions)
    return turned
