"""Motions of known shape for the exporters' tests."""

import numpy as np
from scipy.spatial.transform import Rotation

from pegbar import Motion

NAMES = ("pelvis", "spine", "head", "left_hip", "left_knee", "left_foot", "right_hip")
PARENTS = (-1, 0, 1, 0, 3, 4, 0)
OFFSETS = np.array(
    [[0, 0.9, 0], [0, 0.3, 0], [0, 0.3, 0.05], [0.1, -0.05, 0], [0, -0.4, 0], [0, -0.4, 0.02], [-0.1, -0.05, 0]]
)


def swaying(frames=7, stretch=0.0, seed=0):
    """A skeleton with random smooth joint angles that walks along x; `stretch` lengthens every bone in turn."""
    random = np.random.default_rng(seed)
    phase, size = random.uniform(0, 6, (len(NAMES), 3)), random.uniform(0.2, 1.2, (len(NAMES), 3))
    time = np.linspace(0, 3, frames)
    local = [Rotation.from_rotvec(size[j] * np.sin(time[:, None] + phase[j])).as_matrix() for j in range(len(NAMES))]
    positions, rotations = np.zeros((frames, len(NAMES), 3)), np.zeros((frames, len(NAMES), 3, 3))
    for joint, parent in enumerate(PARENTS):
        length = 1 + stretch * np.sin(time + joint)[:, None]
        if parent < 0:
            positions[:, joint] = OFFSETS[joint] + time[:, None] * (1, 0, 0)
            rotations[:, joint] = local[joint]
            continue
        offset = OFFSETS[joint] * length
        positions[:, joint] = positions[:, parent] + np.einsum("fij,fj->fi", rotations[:, parent], offset)
        rotations[:, joint] = rotations[:, parent] @ local[joint]
    return Motion(NAMES, PARENTS, positions, rotations, 24.0)
