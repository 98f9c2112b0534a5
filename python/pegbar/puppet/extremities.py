"""Hands, feet and the crowns of heads: what is drawn beyond the last joint of a limb (beside Hornung et al. 2007, s7).

No bone runs through them. On their limb's last bone they would be as foreshortened as it is, and a broad hand of which
a tenth of the length is left is a scrap. So each has a bone of its own: from the last joint to a vertex at its end. It
turns with the limb, and is as long in the picture as a round shape of its length and width would be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.puppet.limits import towards_picture
from pegbar.puppet.retarget import rotations_between
from pegbar.scene.puppet import Puppet

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
#: What is shorter, in parts of its limb's last bone, or has fewer triangles, has no bone of its own.
_LEAST_LENGTH, _LEAST_TRIANGLES = 0.15, 4
#: The part of its vertices, those farthest from the joint, whose middle its bone points at.
_FAR = 70.0
# Of its drawn length so much is seen at least, and at most, where it points into the camera.
_SHORTEST, _LONGEST = 0.7, 1.0


@dataclass(frozen=True, eq=False)
class Extremities:
    """A puppet with bones for what is beyond its last joints.

    ``puppet`` has a joint and a bone more for each of E ends, after its own. ``bones`` (E,) are the limbs' last bones,
    ``roundness`` (E,) is what part of an end's length is seen where it points into the camera.
    """

    puppet: Puppet
    bones: Ints
    roundness: Floats

    @classmethod
    def of_puppet(cls, puppet: Puppet) -> Extremities:
        """Find the ends of a puppet's limbs in its mesh."""
        leaves = np.flatnonzero(~np.isin(puppet.bones[:, 1], puppet.bones[:, 0]))
        centres = puppet.vertices[puppet.triangles].mean(axis=1)
        owner = puppet.triangle_bone.copy()
        bones: list[int] = []
        tips: list[int] = []
        roundness: list[float] = []
        for bone in leaves.tolist():
            start, joint = puppet.marks[puppet.bones[bone]]
            own = np.flatnonzero((puppet.triangle_bone == bone) & ((centres - joint) @ (joint - start) > 0))
            tip = _tip(puppet, own, joint)
            if tip is None or np.linalg.norm(tip[1]) < _LEAST_LENGTH * np.linalg.norm(joint - start):
                continue
            owner[own] = len(puppet.bones) + len(bones)
            bones.append(bone)
            tips.append(tip[0])
            roundness.append(_roundness(puppet.vertices[np.unique(puppet.triangles[own])] - joint, tip[1]))
        ends = np.array(bones, np.int64)
        return cls(_extended(puppet, ends, np.array(tips, np.int64), owner), ends, np.array(roundness, np.float64))

    def extended(self, rest: Floats, poses: Floats) -> tuple[Floats, Floats]:
        """Return ``rest`` (J + E, 3) and ``poses`` (F, J + E, 3) with the ends' joints.

        ``rest`` (J, 3) is the pose as drawn. An end lies parallel to the picture there. In ``poses`` (F, J, 3) it turns
        as its limb's last bone does, and then back towards the picture until enough of it is seen.
        """
        puppet, count = self.puppet, len(rest)
        camera = puppet.camera
        parents, joints = puppet.bones[self.bones].T
        tips = camera.unproject(puppet.marks[count:], camera.depth(rest[joints])).reshape(-1, 3)
        seen = np.empty((len(poses), len(tips), 3))
        for end, (parent, joint) in enumerate(zip(parents, joints, strict=True)):
            bone = rest[joint] - rest[parent]
            turns = rotations_between(_unit(bone), _unit(poses[:, joint] - poses[:, parent]))
            along = turns.apply(tips[end] - rest[joint])
            seen[:, end] = poses[:, joint] + towards_picture(along, camera.rotation, float(self.roundness[end]))
        return np.concatenate([rest, tips]), np.concatenate([poses, seen], axis=1)


def _tip(puppet: Puppet, triangles: Ints, joint: Floats) -> tuple[int, Floats] | None:
    """The vertex at the end of ``triangles``, and how it lies from the joint; None where there is none."""
    corners = np.setdiff1d(np.unique(puppet.triangles[triangles]), puppet.handles)
    if len(triangles) < _LEAST_TRIANGLES or not len(corners):
        return None
    away = np.linalg.norm(puppet.vertices[corners] - joint, axis=1)
    middle = puppet.vertices[corners[away >= np.percentile(away, _FAR)]].mean(axis=0)
    tip = int(corners[np.linalg.norm(puppet.vertices[corners] - middle, axis=1).argmin()])
    return tip, puppet.vertices[tip] - joint


def _roundness(places: Floats, along: Floats) -> float:
    """How broad ``places`` (n, 2) about the joint are beside their length in the direction ``along`` (2,)."""
    unit = along / np.linalg.norm(along)
    length = np.percentile(places @ unit, 95)
    width = np.ptp(np.percentile(places @ [-unit[1], unit[0]], (5, 95)))
    return float(np.clip(width / max(length, 1e-9), _SHORTEST, _LONGEST))


def _extended(puppet: Puppet, bones: Ints, tips: Ints, owner: Ints) -> Puppet:
    """The puppet with a joint, a bone and a handle at each of ``tips``."""
    if not len(bones):
        return puppet
    joints = puppet.bones[bones, 1]
    new = np.arange(len(bones))
    marks = puppet.vertices[tips]
    depths = puppet.camera.depth(puppet.pose[joints])
    return puppet.changed(
        names=(*puppet.names, *(f"{puppet.names[joint]} end" for joint in joints)),
        marks=np.concatenate([puppet.marks, marks]),
        bones=np.concatenate([puppet.bones, np.stack([joints, len(puppet.names) + new], axis=1)]),
        triangle_bone=owner,
        handles=np.concatenate([puppet.handles, tips]),
        handle_bone=np.concatenate([puppet.handle_bone, len(puppet.bones) + new]),
        handle_fraction=np.concatenate([puppet.handle_fraction, np.ones(len(bones))]),
        joint_handles=np.concatenate([puppet.joint_handles, len(puppet.handles) + new]),
        pose=np.concatenate([puppet.pose, puppet.camera.unproject(marks, depths)]),
        bone_layer=np.concatenate([puppet.bone_layer, puppet.bone_layer[bones]]),
    )


def _unit(vectors: Floats) -> Floats:
    """Vectors (..., 3) of length 1; one of no length points upwards."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit: Floats = np.where(lengths > 1e-12, vectors / np.maximum(lengths, 1e-300), [0.0, 1.0, 0.0])
    return unit
