"""As-similar-as-possible shapes (Hornung, Dekkers and Kobbelt 2007, section 7, figures 5 and 6).

Every vertex is unprojected onto the planes of the bones it hangs on, inflated, moved with their frames, averaged in 3D
and projected again. Frames are as PAPERS' table has them: l_x = v x b and l_z = l_x x l_y of unit length, l_y = b, l_z
towards the camera.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.errors import DegenerateError
from pegbar.puppet.bone_weights import bone_weights
from pegbar.puppet.drawn_pose import focal_lengths
from pegbar.puppet.inflation import inflation_heights
from pegbar.puppet.trunk import Trunk
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.puppet import Puppet

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
# A bone's plane is seen at no flatter an angle than this (cosine between its normal and the ray): a bone that points
# into the camera when drawn would throw its vertices to infinity.
_STEEPEST = 0.35
# Frames worked on at a time: bounds the memory.
_BLOCK = 64


@dataclass(frozen=True, eq=False)
class BoneCoordinates:
    """One bone's share of the mesh: ``vertices`` (m,), ``weights`` (m,) and their places ``local`` (m, 3).

    Local coordinates are metres along l_x, bone lengths along the bone and metres along l_z.
    """

    bone: int
    vertices: Ints
    weights: Floats
    local: Floats


@dataclass(frozen=True, eq=False)
class AsapShapes:
    """The mesh of a figure in the coordinates of its bones, ready to be seen in other poses.

    ``bones`` (B, 2) index the joints of poses, ``parts`` has an entry for each bone that moves vertices, ``count`` is
    the number of vertices, ``trunk`` tells how broad the trunk is.
    """

    bones: Ints
    parts: tuple[BoneCoordinates, ...]
    count: int
    camera: PerspectiveCamera
    trunk: Trunk

    @classmethod
    def of_puppet(cls, puppet: Puppet, pose: ArrayLike, *, inflation: float = 1.0) -> AsapShapes:
        """Unproject a puppet's mesh.

        Parameters
        ----------
        puppet : Puppet
            Its vertices lie as the camera sees ``pose``.
        pose : (J, 3) float
            World metres.
        inflation : float
            How round the figure is: 0 is flat cardboard; 1 makes every limb as deep as it is wide (inflation 0 at the
            outline, most at the bone).

        Raises
        ------
        DegenerateError
            For a joint at or behind the camera; it names the joint.
        """
        joints = arrays.floats("pose", pose, (len(puppet.names), 3))
        behind = ~(puppet.camera.depth(joints) > 0)
        if behind.any():
            raise DegenerateError(f"pose: joint {puppet.names[int(behind.argmax())]}: it is behind the camera")
        weights = bone_weights(puppet)
        heights = inflation * inflation_heights(puppet)
        origins, frames = bone_frames(joints[None], puppet.bones, puppet.camera.position)
        parts = []
        for bone in range(len(puppet.bones)):
            chosen = np.flatnonzero(weights[:, bone])
            if len(chosen):
                origin, frame = origins[0, bone], frames[0, bone]
                metres = puppet.camera.depth(origin) / focal_lengths(puppet.camera).mean()
                points = _onto_plane(puppet.camera, puppet.vertices[chosen], origin, frame[:, 2])
                points += (heights[chosen] * metres)[:, None] * frame[:, 2]
                local = np.linalg.solve(frame, (points - origin).T).T
                parts.append(BoneCoordinates(bone, chosen, weights[chosen, bone], local))
        return cls(puppet.bones, tuple(parts), len(puppet.vertices), puppet.camera, Trunk.of_puppet(puppet, joints))

    def points(self, poses: ArrayLike) -> Floats:
        """Return the mesh (F, n, 3) in world metres, moved with the bones of ``poses`` (F, J, 3)."""
        joints = arrays.floats("poses", poses, ("F", "J", 3))
        origins, frames = bone_frames(joints, self.bones, self.camera.position)
        result = np.zeros((len(joints), self.count, 3))
        broad = self.trunk.breadths(self.camera, joints)
        for part in self.parts:
            if part.bone in self.trunk.spine:
                frames[:, part.bone, :, 0] *= broad[:, None]
            moved = part.local @ frames[:, part.bone].transpose(0, 2, 1) + origins[:, part.bone, None]
            result[:, part.vertices] += part.weights[:, None] * moved
        return result

    def shapes(self, poses: ArrayLike) -> Floats:
        """Return the mesh (F, n, 2) in pixels as the camera sees it in ``poses`` (F, J, 3).

        ``shapes(poses)[:, triangles]`` is what `Deformer.deform` takes as ``shapes``.

        Raises
        ------
        DegenerateError
            Where a part of the figure comes to or behind the camera; it names the frame.
        """
        joints = arrays.floats("poses", poses, ("F", "J", 3))
        result = np.empty((len(joints), self.count, 2))
        for start in range(0, len(joints), _BLOCK):
            points = self.points(joints[start : start + _BLOCK])
            near = (self.camera.depth(points) <= 0).any(axis=1)
            if near.any():
                raise DegenerateError(f"poses: frame {start + int(near.argmax())}: the figure comes to the camera")
            result[start : start + _BLOCK] = self.camera.project(points)
        return result


def bone_frames(poses: Floats, bones: Ints, position: Floats) -> tuple[Floats, Floats]:
    """Return each bone's origin (F, B, 3) and frame (F, B, 3, 3), whose columns are l_x, l_y and l_z.

    ``poses`` (F, J, 3), ``bones`` (B, 2) parent and child joints, ``position`` (3,) the camera's. l_y is the bone with
    its length. A bone that points into the camera has no l_x of its own: any that is square to it is taken, and the
    shapes, which are only used up to a rotation in the picture, go through smoothly.
    """
    origins = poses[:, bones[:, 0]]
    along = poses[:, bones[:, 1]] - origins
    view = position - origins
    lengths = np.linalg.norm(along, axis=2, keepdims=True)
    # A bone of no length is taken as one that stands upright, so that what hangs on it stays.
    bone = np.where(lengths > 0, along, [0.0, 1.0, 0.0])
    across = np.cross(view, bone)
    size = np.linalg.norm(across, axis=2, keepdims=True)
    small = 1e-9 * np.linalg.norm(view, axis=2, keepdims=True) * np.linalg.norm(bone, axis=2, keepdims=True)
    spare = np.cross(bone, np.where(np.abs(bone[..., :1]) > np.abs(bone[..., 1:2]), [0.0, 1, 0], [1.0, 0, 0]))
    across = np.where(size > small, across, spare)
    across /= np.linalg.norm(across, axis=2, keepdims=True)
    toward = np.cross(across, bone)
    toward /= np.linalg.norm(toward, axis=2, keepdims=True)
    # With l_x = v x b the product l_x x b looks away from the camera: the printed sign inflates backwards.
    toward *= np.where((toward * view).sum(axis=2, keepdims=True) < 0, -1.0, 1.0)
    return origins, np.stack([across, bone, toward], axis=3)


def _onto_plane(camera: PerspectiveCamera, pixels: Floats, origin: Floats, normal: Floats) -> Floats:
    """Where the rays of ``pixels`` (m, 2) meet the plane through ``origin`` (3,) with unit ``normal`` (3,): (m, 3)."""
    view = camera.position - origin
    view = view / np.linalg.norm(view)
    normal = normal + max(0.0, _STEEPEST - float(normal @ view)) * view
    rays = camera.unproject(pixels, np.ones(len(pixels))) - camera.position
    falls = rays @ normal
    # A ray may still run along the plane far from the bone: it is stopped at four times the bone's depth.
    distance = (origin - camera.position) @ normal
    steepest = distance / (4 * camera.depth(origin))
    falls = np.minimum(falls, steepest) if distance < 0 else np.maximum(falls, steepest)
    points: Floats = camera.position + rays * (distance / falls)[:, None]
    return points
