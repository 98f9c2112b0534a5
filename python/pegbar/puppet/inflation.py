"""How far a vertex stands out of its bone's plane (2007 paper, s7, figure 6a): the cross-section of a limb is round."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pegbar.puppet.bone_weights import bone_distances
from pegbar.scene.puppet import Puppet

Floats = NDArray[np.float64]


def inflation_heights(puppet: Puppet) -> Floats:
    """Return heights (n,) in pixels: 0 at the outline, most at the bone.

    A vertex at distance d from its layer's outline and x from its bone lies on a circle of radius d + x about the
    bone: its height is sqrt((d + x)^2 - x^2).
    """
    heights = np.zeros(len(puppet.vertices))
    for layer in range(len(puppet.layers)):
        mine = puppet.triangle_layer == layer
        corners = np.unique(puppet.triangles[mine])
        inside, rim = corners[~puppet.boundary[corners]], corners[puppet.boundary[corners]]
        if not len(inside) or not len(rim):
            continue
        outward, _ = cKDTree(puppet.vertices[rim]).query(puppet.vertices[inside])
        used = np.unique(puppet.triangle_bone[mine & (puppet.triangle_bone >= 0)])
        chosen = puppet.bones[used] if len(used) else puppet.bones
        inward = bone_distances(puppet.vertices[inside], puppet.marks, chosen)[0].min(axis=1)
        heights[inside] = np.sqrt(outward**2 + 2 * outward * inward)
    return heights
