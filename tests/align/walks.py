"""Real clips as a camera at the side of their travel sees them."""

import math

import numpy as np

import pegbar
from pegbar.scene.body import LIMBS, MARKERS

#: The eight limbs of the 2009 paper, as places in MARKERS.
ARMS_AND_LEGS = np.array(
    [[MARKERS.index(limb.start), MARKERS.index(limb.end)] for limb in LIMBS if limb.name not in ("torso", "head")]
)


def clip(folder, name, step=1):
    """Every ``step``-th frame of a CMU clip without its inserted T-pose."""
    return pegbar.read_motion(folder / "mocap" / "bvh" / f"cmu_{name}.bvh").slice(1, None, step)


def from_the_side(motion):
    """The canonical markers (F, N, 2) seen across the direction in which the pelvis travels."""
    markers = motion.markers(MARKERS)
    along = markers[-1, 0] - markers[0, 0]
    azimuth = math.degrees(math.atan2(-along[2], along[0]))
    return pegbar.OrthographicCamera.from_angles(azimuth, 0).project(markers)


def distances(drawn, seen):
    """Pose distances between drawn (F, N, 2) and seen (G, N, 2) markers."""
    return pegbar.pose_distance(*(pegbar.pose_descriptor(each, ARMS_AND_LEGS) for each in (drawn, seen)))
