"""How broad a trunk is seen: a spine's bone does not tell how far the body is turned (for Hornung et al. 2007, s7).

Bones have no breadth, and turned about its own length one looks as before. So a trunk would stay as broad as drawn
while the shoulders and hips come nearer to each other in a turn, and bulge between them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.puppet import Puppet

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
_SPINE = ("chest", "neck")
# The part of the distance between shoulders (or hips) that counts as seen where they are drawn one before the other.
_DEEP = 0.3
# A trunk is seen no narrower and no broader than these parts of its drawn breadth.
_NARROW, _BROAD = 0.7, 1.15


@dataclass(frozen=True, eq=False)
class Trunk:
    """A puppet's ``spine``, bones of its trunk, and the ``pairs`` (P, 2) of joints that are on both its sides.

    ``drawn`` (P,) are the pairs' distances in the picture as drawn, ``spare`` (P,) what is added to all of them, in
    pixels.
    """

    spine: frozenset[int]
    pairs: Ints
    drawn: Floats
    spare: Floats

    @classmethod
    def of_puppet(cls, puppet: Puppet, rest: Floats) -> Trunk:
        """Find the trunk of a puppet that is drawn in the pose ``rest`` (J, 3); none where it has no person's."""
        driven = {puppet.drives.get(name): joint for joint, name in enumerate(puppet.names)}
        sides = [[f"{side}_{joint}" for side in ("left", "right")] for joint in ("shoulder", "hip")]
        found = [[driven[name] for name in pair] for pair in sides if puppet.fitted and all(n in driven for n in pair)]
        pairs = np.array(found, np.int64).reshape(-1, 2)
        spine = [bone for bone, end in enumerate(puppet.bones[:, 1]) if puppet.drives.get(puppet.names[end]) in _SPINE]
        middles = np.maximum(puppet.camera.depth(rest[pairs].mean(axis=1)), 1e-9)
        focal = float(np.linalg.norm(puppet.camera.matrix[0, :3]))
        across = np.linalg.norm(rest[pairs[:, 0]] - rest[pairs[:, 1]], axis=1) / middles * focal
        return cls(
            frozenset(spine if found else ()), pairs, _apart(puppet.camera, rest[None], pairs)[0], _DEEP * across
        )

    def breadths(self, camera: PerspectiveCamera, poses: Floats) -> Floats:
        """Return how broad the trunk is seen (F,) in ``poses`` (F, J, 3), as part of its drawn breadth."""
        if not self.spine:
            return np.ones(len(poses))
        shares = (_apart(camera, poses, self.pairs) + self.spare) / np.maximum(self.drawn + self.spare, 1e-9)
        breadths: Floats = np.clip(shares.mean(axis=1), _NARROW, _BROAD)
        return breadths


def _apart(camera: PerspectiveCamera, poses: Floats, pairs: Ints) -> Floats:
    """How far apart pairs of joints are seen (F, P), in pixels."""
    seen = camera.project(poses)
    apart: Floats = np.linalg.norm(seen[:, pairs[:, 0]] - seen[:, pairs[:, 1]], axis=2)
    return apart
