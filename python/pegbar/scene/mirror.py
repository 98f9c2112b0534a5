"""Left and right of a clip change places: in a mirror, or by name alone."""

from __future__ import annotations

import dataclasses

import numpy as np

from pegbar.scene.motion import Motion

_FLIP = np.array([-1.0, 1.0, 1.0])


def mirrored(motion: Motion) -> Motion:
    """Return ``motion`` reflected at the plane x = 0, with the canonical markers of the two sides exchanged.

    What was the left hand's joint is now the canonical right hand; joints keep their names, but for those that have a
    canonical marker's. Reflected twice it is the motion again.
    """
    motion = _without_labels(motion)
    joints = {_other(marker): _other(joint) for marker, joint in motion.joint_map.items()}
    changed = dataclasses.replace(
        motion,
        names=tuple(map(_other, motion.names)),
        positions=motion.positions * _FLIP,
        rotations=_FLIP[:, None] * motion.rotations * _FLIP,
        joints=joints,
        rest=None if motion.rest is None else motion.rest * _FLIP,
        ends={_other(joint): end * _FLIP for joint, end in motion.ends.items()},
    )
    return changed.knowing(joints)


def exchanged(motion: Motion) -> Motion:
    """Return ``motion`` with the canonical markers of its two sides exchanged, for drawings that mix them up."""
    motion = _without_labels(motion)
    joints = {_other(marker): _other(joint) for marker, joint in motion.joint_map.items()}
    ends = {_other(joint): end for joint, end in motion.ends.items()}
    changed = dataclasses.replace(motion, names=tuple(map(_other, motion.names)), joints=joints, ends=ends)
    return changed.knowing(joints)


def _without_labels(motion: Motion) -> Motion:
    """Optical points as canonical markers, which can change sides; a skeleton as it is."""
    if not motion.derived:
        return motion
    names = motion.known_markers
    turns = np.broadcast_to(np.eye(3), (len(motion.positions), len(names), 3, 3))
    places = motion.markers(names)
    kept = {name: name for name in names}
    points = dataclasses.replace(
        motion, names=names, parents=(-1,) * len(names), positions=places, rotations=turns, joints=kept, rest=None
    )
    return points.knowing(kept)


def _other(marker: str) -> str:
    for side, opposite in (("left_", "right_"), ("right_", "left_")):
        if marker.startswith(side):
            return opposite + marker.removeprefix(side)
    return marker
