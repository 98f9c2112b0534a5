"""The drawn figure in 3D: the pose whose joints project onto the drawing's marks (before Hornung et al. 2007, s7).

The paper takes the clip's pose itself and pulls the drawing onto it, which gives the drawing the actor's proportions.
Here every bone keeps its drawn length instead. How far it points away from the camera is the clip's where the drawing
shows the clip's pose; where it does not, limbs are as long as their partner on the other side is drawn.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import DegenerateError
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.puppet import Puppet

Floats = NDArray[np.float64]
#: The outer joints of arms and legs; bones that end elsewhere are the body's, whose build is the drawing's.
LIMB_ENDS = ("elbow", "hand", "wrist", "knee", "foot", "toe")
# Share of a bone's length by which the ratio of drawn to projected length is kept from noise: a bone that points at
# the camera takes its depth from the clip alone.
_SOFTENING = 0.3
# RMS distances between marks and projected joints, as parts of the figure's extent, up to which the picture shows the
# clip's pose and from which on it shows another.
_SAME, _OTHER = 0.04, 0.1


def moved_bones(puppet: Puppet) -> NDArray[np.bool_]:
    """Which bones (B,) a clip turns: both ends are driven, by different markers. The others move with their parent."""
    return np.array([None not in pair and pair[0] != pair[1] for pair in _bone_markers(puppet)], bool)


def drawn_pose(puppet: Puppet) -> Floats:
    """Return the joints (J, 3) in world metres that ``puppet.camera`` projects onto ``puppet.marks``.

    The root has the depth of the clip's pose. A bone's depth, from its parent to its child joint, is the clip's times
    ``(p + e) / (q + e)``: p its drawn length, q the projected length of the clip's bone, both in metres at the root's
    distance, e 0.3 of the clip's bone. The less the drawing is like the clip's pose, the more a limb has, instead, the
    depth that makes it as long as its partner on the other side is drawn, if that is less. No limb is longer than its
    partner unless it is drawn so. Bones that no clip moves lie parallel to the picture.

    Raises
    ------
    DegenerateError
        For a root at or behind the camera, naming the joint.
    """
    camera, pose = puppet.camera, puppet.pose
    depths = camera.depth(pose)
    root = int(np.flatnonzero(puppet.parents < 0)[0])
    if not depths[root] > 0:
        raise DegenerateError(f"pose: joint {puppet.names[root]}: it is not in front of the camera")
    metres = depths[root] / focal_lengths(camera)
    flat = _lengths(puppet, camera.project(pose) * metres)
    wanted = _lengths(puppet, puppet.marks * metres)
    lengths = _lengths(puppet, pose)
    share = (wanted + _SOFTENING * lengths) / np.maximum(np.minimum(flat, lengths) + _SOFTENING * lengths, 1e-12)
    away = np.diff(depths[puppet.bones], axis=1)[:, 0] * np.where(moved_bones(puppet) & (lengths > 0), share, 0.0)
    away = np.where(_limb_bones(puppet), _limb_depths(puppet, wanted, away), away)
    drawn = np.full(len(pose), depths[root])
    for (parent, child), step in zip(puppet.bones.tolist(), away, strict=True):
        drawn[child] = drawn[parent] + step
    # A joint that a steep bone would take through the lens stays in front of it.
    return camera.unproject(puppet.marks, np.maximum(drawn, 0.05 * depths[root]))


def focal_lengths(camera: PerspectiveCamera) -> Floats:
    """The camera's focal lengths (2,) in pixels, along x and y."""
    lengths: Floats = np.linalg.norm(np.cross(camera.matrix[:2, :3], camera.matrix[2, :3]), axis=1)
    return lengths


def _bone_markers(puppet: Puppet) -> list[tuple[str | None, str | None]]:
    drives = [puppet.drives.get(name) for name in puppet.names]
    return [(drives[parent], drives[child]) for parent, child in puppet.bones.tolist()]


def _limb_bones(puppet: Puppet) -> NDArray[np.bool_]:
    return np.array([(child or "").endswith(LIMB_ENDS) for _, child in _bone_markers(puppet)], bool)


def _limb_depths(puppet: Puppet, wanted: Floats, away: Floats) -> Floats:
    """The depths (B,) of limbs' bones whose drawn lengths are ``wanted`` and whose depths by the clip ``away``."""
    partners = _partners(puppet)
    trust, other = _likeness(puppet), wanted[partners]
    likely = np.minimum(np.abs(away), np.sqrt(np.maximum(other**2 - wanted**2, 0)))
    deep = trust * np.abs(away) + (1 - trust) * likely
    # The clip's actor may hold one arm to the camera that is drawn aside: it would be longer than the other.
    lengths = np.hypot(wanted, deep)
    most = np.maximum(np.minimum(lengths, lengths[partners]), np.maximum(wanted, other))
    depths: Floats = np.sign(away) * np.sqrt(np.maximum(np.minimum(lengths, most) ** 2 - wanted**2, 0))
    return depths


def _partners(puppet: Puppet) -> NDArray[np.intp]:
    """The same bone of the other side (B,), or the bone itself."""
    markers = _bone_markers(puppet)
    found = []
    for index, pair in enumerate(markers):
        other = tuple(marker and _other_side(marker) for marker in pair)
        found.append(markers.index(other) if other in markers else index)
    return np.array(found, np.intp)


def _other_side(marker: str) -> str:
    side, _, rest = marker.partition("_")
    return {"left": f"right_{rest}", "right": f"left_{rest}"}.get(side, marker)


def _lengths(puppet: Puppet, joints: Floats) -> Floats:
    lengths: Floats = np.linalg.norm(joints[puppet.bones[:, 1]] - joints[puppet.bones[:, 0]], axis=1)
    return lengths


def _likeness(puppet: Puppet) -> float:
    """How surely the picture shows the clip's pose, 0 to 1."""
    if not puppet.fitted:
        return 1.0
    extent = float(np.linalg.norm(np.ptp(puppet.marks, axis=0)))
    error = math.sqrt(float(((puppet.camera.project(puppet.pose) - puppet.marks) ** 2).sum(axis=1).mean()))
    share = min(max((_OTHER - error / max(extent, 1e-12)) / (_OTHER - _SAME), 0.0), 1.0)
    return share * share * (3 - 2 * share)
