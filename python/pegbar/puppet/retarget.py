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
from pegbar.puppet.limits import limited_swing, shown_across, towards_picture
from pegbar.scene.gait import facing
from pegbar.scene.puppet import Puppet

Floats = NDArray[np.float64]


# Degrees by which a limb may be drawn otherwise than in the clip as the figure's build, that shows in all poses; by
# which it may be and still be the same pose, and from which on it is another one: a drawing with stretched-out arms
# does not walk with them; and how far the clip's limb may be from that pose for the difference to count, or is where it
# does not: legs that are drawn closer than the clip's must not cross when it closes them.
_BUILD, _SAME, _NEAR = (10.0, 20.0), (30.0, 75.0), (5.0, 40.0)
# A figure that is like no pose of the clip (an animal) is as deep as is guessed: of its limbs so much is seen at least.
_FLAT = 0.8
# Heads are about round: of what is drawn between neck and crown so much is seen at least.
_HEAD = 0.85
#: The joints that lie beside the spine: bones that lead to them lie across the trunk.
ACROSS_ENDS = ("_shoulder", "_hip")
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
        it up to 10 degrees; while the clip's limb is near its reference up to 30, and less of it from there to 75.
        "always" keeps it, "never" follows the clip. The body (spine, head, shoulders, hips) always keeps it.
        Differences turn with the way the person faces.

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
    turned = facing_turn(puppet, clip, before)
    turns = Rotation.from_euler("y", turned[:, None], degrees=True)
    body, trunk = turns, np.zeros(len(moved), bool)
    across = np.unique(puppet.bones[moved & _ending(puppet, ACROSS_ENDS)])
    tilt = _tilt(_trunk_turns(clip, before, across) * turns.inv(), puppet.camera.rotation[2])
    if not puppet.fitted:
        # It is always seen from the drawn side, with its trunk all of a piece.
        clip, turns = _turned(clip, turns.inv()), Rotation.identity()
        trunk = moved & ~_ending(puppet, (*LIMB_ENDS, "head"))
        body = tilt = _tilt(_trunk_turns(clip, before, np.unique(puppet.bones[trunk])), puppet.camera.rotation[2])
    result = np.zeros(clip.shape)
    root = int(np.flatnonzero(puppet.parents < 0)[0])
    result[:, root] = rest[root]
    rotations: dict[int, Rotation] = {root: body}
    for (parent, child), is_moved, is_trunk in zip(puppet.bones.tolist(), moved, trunk, strict=True):
        own = rest[child] - rest[parent]
        if is_trunk:
            rotations[child] = body
            along = body.apply(own)
        elif is_moved:
            pointing = _unit(clip[:, child] - clip[:, parent]), _unit(before[child] - before[parent])
            directions = _pointed(own, *pointing, turns, keep, puppet.drives[puppet.names[child]])
            along = _shown(puppet, child, directions * np.linalg.norm(own), own, turned, tilt)
            rotations[child] = rotations_between(_unit(own), _unit(along))
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


def _pointed(own: Floats, clip: Floats, before: Floats, turns: Rotation, keep: str, marker: str) -> Floats:
    """Where a bone drawn as ``own`` (3,) points (F, 3) when the clip's, ``before`` (3,), points as ``clip`` (F, 3)."""
    offset = rotations_between(before, _unit(own)[None])[0]
    directions = turns.inv().apply(clip)
    shares = _kept(offset, directions @ before, keep, marker)
    pointed: Floats = (turns * Rotation.from_rotvec(shares[:, None] * offset.as_rotvec())).apply(directions)
    return pointed


def _shown(puppet: Puppet, child: int, along: Floats, own: Floats, turned: Floats, tilt: Rotation) -> Floats:
    """A bone to ``child`` (F, 3), turned back where the picture would give out; ``tilt`` is the trunk's in the picture.

    Of a person only the head's and the trunk's bones are.
    """
    axes, marker = puppet.camera.rotation, puppet.drives[puppet.names[child]]
    if not puppet.fitted:
        return limited_swing(towards_picture(along, axes, _FLAT), tilt.apply(own), axes)
    if marker.endswith(ACROSS_ENDS):
        return shown_across(along, own, axes, turned, tilt)
    if marker == "head":
        return towards_picture(along, axes, _HEAD, float(np.linalg.norm((axes @ _unit(own))[:2])))
    return along


def _ending(puppet: Puppet, ends: tuple[str, ...]) -> NDArray[np.bool_]:
    """Which bones (B,) lead to joints that such markers drive."""
    markers = [puppet.drives.get(puppet.names[child]) or "" for child in puppet.bones[:, 1].tolist()]
    return np.array([marker.endswith(ends) for marker in markers], bool)


def _turned(points: Floats, turns: Rotation) -> Floats:
    """Points (F, J, 3), each frame's turned by its rotation; NaN stays."""
    turned: Floats = np.einsum("fij,fnj->fni", turns.as_matrix(), points)
    return turned


def _tilt(turns: Rotation, axis: Floats) -> Rotation:
    """The part of rotations (F,) that goes round a unit ``axis`` (3,): their twist."""
    quaternions = turns.as_quat()
    return Rotation.from_rotvec(2 * np.arctan2(quaternions[:, :3] @ axis, quaternions[:, 3])[:, None] * axis)


def _trunk_turns(clip: Floats, before: Floats, joints: NDArray[np.int64]) -> Rotation:
    """How the markers ``joints`` have turned as one body (F,) from ``before`` (J, 3) to ``clip`` (F, J, 3)."""
    then, now = before[joints], clip[:, joints]
    if not len(joints):
        return Rotation.identity(len(clip))
    spread = np.einsum("fki,kj->fij", now - now.mean(axis=1, keepdims=True), then - then.mean(axis=0))
    left, _, right = np.linalg.svd(spread)
    # The nearest rotation to the spread; not a mirror image.
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    return Rotation.from_matrix(left @ right)


def _kept(offset: Rotation, alike: Floats, keep: str, marker: str) -> Floats:
    """The part (F,) of ``offset`` that stays where a bone's direction has the cosines ``alike`` (F,) to the drawn."""
    if keep == "always" or not marker.endswith(LIMB_ENDS):
        return np.ones(len(alike))
    if keep == "never":
        return np.zeros(len(alike))
    away = np.degrees(np.arccos(np.clip(alike, -1, 1)))
    angle = math.degrees(offset.magnitude())
    build = _fading(angle, *_BUILD)
    return build + (_fading(angle, *_SAME) - build) * _fading(away, *_NEAR)


def _fading(angle: Floats | float, start: float, end: float) -> Floats:
    """1 up to ``start``, 0 from ``end`` on, smoothly."""
    share = np.clip((end - np.asarray(angle)) / (end - start), 0, 1)
    smooth: Floats = share * share * (3 - 2 * share)
    return smooth


def rotations_between(first: Floats, second: Floats) -> Rotation:
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
