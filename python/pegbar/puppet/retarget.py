"""The drawn figure in a clip's poses: the clip's movement, the drawing's proportions (for Hornung et al. 2007, s7).

A bone keeps its drawn length and points where the clip's bone points, turned by the difference between the drawn and
the clip's direction in the pose in which the picture was recognised: there the figure is as drawn.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from pegbar import arrays
from pegbar.errors import DegenerateError
from pegbar.puppet.drawn_pose import LIMB_ENDS, moved_bones
from pegbar.scene.gait import facing
from pegbar.scene.puppet import Puppet

Floats = NDArray[np.float64]


# Degrees by which a limb may be drawn otherwise than in the clip and still be the same pose, and from which on it is
# another one: a drawing with stretched-out arms does not walk with stretched-out arms.
_SAME, _OTHER = 30.0, 75.0
#: How the difference between the drawn limbs and the clip's is treated.
KEEPS = ("near", "always", "never")


def retarget(
    puppet: Puppet, drawn: ArrayLike, markers: ArrayLike, reference: ArrayLike, *, keep: str = "near"
) -> Floats:
    """Return the drawn figure's joints (F, J, 3) in a clip's poses, its root where it was drawn.

    Parameters
    ----------
    puppet : Puppet
    drawn : (J, 3) float
        The drawn figure in 3D, `pegbar.puppet.drawn_pose.drawn_pose`.
    markers : (F, J, 3) float
        For every joint the clip's marker that drives it, world metres; NaN for joints without one.
    reference : (J, 3) float
        The same in the clip's pose in which the figure was recognised.
    keep : {"near", "always", "never"}
        What happens to the difference between a drawn limb's direction and the clip's in ``reference``: "near" keeps
        it up to 30 degrees and lets it go from 75 degrees on, "always" keeps it, "never" follows the clip. The body
        (spine, head, shoulders, hips) always keeps it. Differences turn with the way the person faces.

    Raises
    ------
    DegenerateError
        For a driven joint without position; it names frame and joint.
    """
    if keep not in KEEPS:
        raise ValueError(f"keep: want one of {', '.join(KEEPS)}, got {keep!r}")
    joints = len(puppet.names)
    rest = arrays.floats("drawn", drawn, (joints, 3))
    clip = arrays.floats("markers", markers, ("F", joints, 3), allow="nan")
    moved = moved_bones(puppet)
    before = arrays.floats("reference", reference, (joints, 3), allow="nan")
    _refuse_missing(puppet, clip, moved)
    turns = Rotation.from_euler("y", facing_turn(puppet, clip, before)[:, None], degrees=True)
    result = np.zeros(clip.shape)
    root = int(np.flatnonzero(puppet.parents < 0)[0])
    result[:, root] = rest[root]
    rotations: dict[int, Rotation] = {root: turns}
    for (parent, child), is_moved in zip(puppet.bones.tolist(), moved, strict=True):
        own = rest[child] - rest[parent]
        if is_moved:
            seen = _unit(before[child] - before[parent])
            offset = _kept(_rotations_between(seen, _unit(own)[None])[0], keep, puppet.drives[puppet.names[child]])
            directions = (turns * offset * turns.inv()).apply(_unit(clip[:, child] - clip[:, parent]))
            rotations[child] = _rotations_between(_unit(own), directions)
            along = directions * np.linalg.norm(own)
        else:
            rotations[child] = rotations[parent]
            along = rotations[child].apply(own)
        result[:, child] = result[:, parent] + along
    return result


def body_scale(puppet: Puppet, drawn: Floats, reference: Floats) -> float:
    """How large the drawn figure is beside the clip's: its legs' length by theirs, or all bones' where it has none."""
    moved = moved_bones(puppet)
    ends = [puppet.drives.get(puppet.names[child], "") for child in puppet.bones[:, 1]]
    legs = moved & np.array([end.endswith(("knee", "foot")) for end in ends], bool)
    parents, children = puppet.bones[legs if legs.any() else moved].T
    drawn_length = np.linalg.norm(drawn[children] - drawn[parents], axis=1).sum()
    length = np.linalg.norm(reference[children] - reference[parents], axis=1).sum()
    return float(drawn_length / length) if length > 0 else 1.0


def facing_turn(puppet: Puppet, clip: Floats, reference: Floats) -> Floats:
    """Return the degrees (F,) by which the person has turned since ``reference`` (J, 3), unwrapped; 0 where unknown."""
    driven = {puppet.drives[name]: joint for joint, name in enumerate(puppet.names) if name in puppet.drives}
    poses = np.concatenate([reference[None], clip])
    azimuths = facing({name: poses[:, joint] for name, joint in driven.items()})
    if azimuths is None or not np.isfinite(azimuths[0]):
        return np.zeros(len(clip))
    turned: Floats = azimuths[1:] - azimuths[0]
    known = turned[np.isfinite(turned)]
    # From the reference to the first frame it is the shorter way round.
    return np.nan_to_num(turned - 360 * np.round(known[0] / 360)) if len(known) else np.zeros(len(clip))


def _kept(offset: Rotation, keep: str, marker: str) -> Rotation:
    """The part of ``offset`` that stays."""
    if keep == "always" or not marker.endswith(LIMB_ENDS):
        return offset
    if keep == "never":
        return Rotation.identity()
    angle = math.degrees(offset.magnitude())
    share = np.clip((_OTHER - angle) / (_OTHER - _SAME), 0, 1)
    return offset ** float(share * share * (3 - 2 * share))


def _rotations_between(first: Floats, second: Floats) -> Rotation:
    """The smallest rotations that take unit vector ``first`` (3,) to each of ``second`` (F, 3)."""
    axis = np.cross(first, second)
    cosine = second @ first
    size = np.linalg.norm(axis, axis=1)
    spare = np.cross(first, [1.0, 0, 0] if abs(first[0]) < 0.9 else [0.0, 1, 0])
    axis = np.where(size[:, None] > 1e-12, axis / np.maximum(size, 1e-300)[:, None], spare / np.linalg.norm(spare))
    return Rotation.from_rotvec(axis * np.arctan2(size, cosine)[:, None])


def _unit(vectors: Floats) -> Floats:
    """Vectors (..., 3) of length 1; one of no length points upwards."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit: Floats = np.where(lengths > 1e-12, vectors / np.maximum(lengths, 1e-300), [0.0, 1.0, 0.0])
    return unit


def _refuse_missing(puppet: Puppet, clip: Floats, moved: NDArray[np.bool_]) -> None:
    needed = np.unique(puppet.bones[moved])
    missing = np.argwhere(np.isnan(clip[:, needed]).any(axis=2))
    if len(missing):
        frame, place = missing[0]
        raise DegenerateError(f"markers: frame {frame}: the clip has no position for {puppet.names[needed[place]]}")
