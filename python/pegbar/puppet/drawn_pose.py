"""The drawn figure in 3D: the pose whose joints project onto the drawing's marks (before Hornung et al. 2007, s7).

The paper takes the clip's pose itself and pulls the drawing onto it, which gives the drawing the actor's proportions.
Here every bone keeps its drawn length instead: its marks say how long it is in the picture, the clip's pose how far it
points away from the camera.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import DegenerateError
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.puppet import Puppet

Floats = NDArray[np.float64]
# Share of a bone's length by which the ratio of drawn to projected length is kept from noise: a bone that points at
# the camera takes its depth from the clip alone.
_SOFTENING = 0.3


def moved_bones(puppet: Puppet) -> NDArray[np.bool_]:
    """Which bones (B,) a clip turns: both ends are driven, by different markers. The others move with their parent."""
    drives = [puppet.drives.get(name) for name in puppet.names]
    ends = [(drives[parent], drives[child]) for parent, child in puppet.bones.tolist()]
    return np.array([None not in pair and pair[0] != pair[1] for pair in ends], bool)


def drawn_pose(puppet: Puppet) -> Floats:
    """Return the joints (J, 3) in world metres that ``puppet.camera`` projects onto ``puppet.marks``.

    The root has the depth of the clip's pose. A bone's depth, from its parent to its child joint, is the clip's times
    ``(p + e) / (q + e)``: p its drawn length, q the projected length of the clip's bone, both in metres at the root's
    distance, e 0.3 of the clip's bone. Bones that no clip moves lie parallel to the picture.

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
    projected = camera.project(pose)
    drawn = np.zeros(len(pose))
    drawn[root] = depths[root]
    for (parent, child), moved in zip(puppet.bones.tolist(), moved_bones(puppet), strict=True):
        drawn[child] = drawn[parent]
        length = float(np.linalg.norm(pose[child] - pose[parent]))
        if moved and length > 0:
            flat = float(np.linalg.norm((projected[child] - projected[parent]) * metres))
            wanted = float(np.linalg.norm((puppet.marks[child] - puppet.marks[parent]) * metres))
            share = (wanted + _SOFTENING * length) / (min(flat, length) + _SOFTENING * length)
            drawn[child] += (depths[child] - depths[parent]) * share
    # A joint that a steep bone would take through the lens stays in front of it.
    return camera.unproject(puppet.marks, np.maximum(drawn, 0.05 * depths[root]))


def focal_lengths(camera: PerspectiveCamera) -> Floats:
    """The camera's focal lengths (2,) in pixels, along x and y."""
    lengths: Floats = np.linalg.norm(np.cross(camera.matrix[:2, :3], camera.matrix[2, :3]), axis=1)
    return lengths
