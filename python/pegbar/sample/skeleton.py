"""The dancer's skeleton: rest pose, forward kinematics, and a leg that reaches for its foot.

Metres, Y up, facing +Z in a T-pose, so the left side is +X. A joint's rotation takes its rest axes to world axes and
carries the bones that leave it; the bone lengths can be scaled per frame for squash and stretch.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

THIGH, SHIN = 0.405, 0.405
UPPER_ARM, FOREARM, HAND = 0.28, 0.245, 0.155
FOOT = np.array([0.0, -0.055, 0.15])
HEAD_RADIUS = 0.12

_MIDDLE = {
    "pelvis": ("", (0.0, 0.0, 0.0)),
    "chest": ("pelvis", (0.0, 0.22, -0.005)),
    "neck": ("chest", (0.0, 0.235, 0.0)),
    "head": ("neck", (0.0, 0.172, 0.02)),
}
_LEFT = {
    "shoulder": ("chest", (0.148, 0.19, 0.0)),
    "elbow": ("shoulder", (UPPER_ARM, 0.0, 0.0)),
    "hand": ("elbow", (FOREARM, 0.0, 0.0)),
    "finger": ("hand", (HAND, 0.0, 0.0)),
    "hip": ("pelvis", (0.09, -0.04, 0.0)),
    "knee": ("hip", (0.0, -THIGH, 0.0)),
    "foot": ("knee", (0.0, -SHIN, 0.0)),
    "toe": ("foot", tuple(FOOT.tolist())),
}


def _joints() -> dict[str, tuple[str, tuple[float, ...]]]:
    joints: dict[str, tuple[str, tuple[float, ...]]] = dict(_MIDDLE)
    for side, mirror in (("left_", 1.0), ("right_", -1.0)):
        for name, (parent, (x, y, z)) in _LEFT.items():
            joints[side + name] = (parent if parent in _MIDDLE else side + parent, (mirror * x, y, z))
    return joints


_JOINTS = _joints()
NAMES = tuple(_JOINTS)
PARENTS = tuple(NAMES.index(parent) if parent else -1 for parent, _ in _JOINTS.values())
OFFSETS: Floats = np.array([offset for _, offset in _JOINTS.values()])


def forward(root: Floats, rotations: dict[str, Floats], scales: dict[str, Floats]) -> tuple[Floats, Floats]:
    """Return joint positions (F, J, 3) and world rotations (F, J, 3, 3).

    ``root`` (F, 3) is the pelvis; ``rotations`` (F, 3, 3) are world rotations by joint, a joint without one has its
    parent's; ``scales`` (F,) multiply the bone that ends in the joint of that name.
    """
    positions = np.empty((len(root), len(NAMES), 3))
    frames = np.empty((len(root), len(NAMES), 3, 3))
    for index, (name, parent) in enumerate(zip(NAMES, PARENTS, strict=True)):
        frames[:, index] = rotations[name] if name in rotations else frames[:, parent]
        if parent < 0:
            positions[:, index] = root
        else:
            bone = np.multiply.outer(scales.get(name, np.ones(len(root))), OFFSETS[index])
            positions[:, index] = positions[:, parent] + (frames[:, parent] @ bone[..., None])[..., 0]
    return positions, frames


def euler(yaw: Floats, pitch: Floats, roll: Floats) -> Floats:
    """Return rotations (F, 3, 3): roll about Z (to the dancer's right), then pitch about X (forward), then yaw about Y.

    Angles (F,) in degrees; positive yaw turns to the dancer's left.
    """
    return _turn(1, yaw) @ _turn(0, pitch) @ _turn(2, roll)


def _turn(axis: int, degrees: Floats) -> Floats:
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    first, second = (axis + 1) % 3, (axis + 2) % 3
    out = np.zeros((len(degrees), 3, 3))
    out[:, axis, axis] = 1
    out[:, first, first] = out[:, second, second] = cosine
    out[:, first, second], out[:, second, first] = -sine, sine
    return out


def unit(vectors: Floats) -> Floats:
    """Return ``vectors`` (..., 3) with length 1."""
    scaled: Floats = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return scaled


def swing(rest: Floats, directions: Floats) -> Floats:
    """Return the smallest rotations (F, 3, 3) that take the unit vector ``rest`` (3,) onto ``directions`` (F, 3)."""
    axis, cosine = np.cross(rest, directions), directions @ rest
    cross = np.zeros((len(directions), 3, 3))
    cross[:, [2, 0, 1], [1, 2, 0]] = axis
    cross[:, [1, 2, 0], [2, 0, 1]] = -axis
    rotations: Floats = np.eye(3) + cross + cross @ cross / (1 + cosine)[:, None, None]
    return rotations


def reach_leg(hip: Floats, ankle: Floats, pole: Floats, thigh: Floats, shin: Floats) -> tuple[Floats, Floats]:
    """Return the thigh's and the shin's world rotations (F, 3, 3) that bring the ankle from the hip to its place.

    ``hip``, ``ankle`` (F, 3); ``pole`` (F, 3) is where the knee points; ``thigh``, ``shin`` (F,) are lengths. A place
    out of reach is approached with the leg straight.
    """
    line = ankle - hip
    limit = thigh + shin
    distance = np.minimum(np.linalg.norm(line, axis=1), limit * (1 - 1e-9))
    along = unit(line)
    hinge = unit(np.cross(along, pole))
    outward = np.cross(hinge, along)
    cosine = (thigh**2 + distance**2 - shin**2) / (2 * thigh * distance)
    knee = cosine[:, None] * along + np.sqrt(1 - cosine**2)[:, None] * outward
    lower = unit(distance[:, None] * along - thigh[:, None] * knee)
    return _frame(knee, -hinge), _frame(lower, -hinge)


def _frame(down: Floats, side: Floats) -> Floats:
    """Rotation whose -Y is ``down`` and whose X is ``side``, both unit and perpendicular."""
    return np.stack([side, -down, np.cross(side, -down)], axis=-1)
