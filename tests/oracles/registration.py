"""Slow numpy transcription of the 2010 paper's equation 1 as docs/papers.md reads it."""

import numpy as np
from scipy.spatial.transform import Rotation


def cost(marks, seen, points, middle, rotations, centers, focal, terms):
    """Sum over frames, mark by mark and frame by frame."""
    total = 0.0
    frames, count = seen.shape
    for i in range(frames):
        for j in range(count):
            if seen[i, j]:
                x, y, z = rotations[i] @ (points[i, j] - centers[i])
                squared = (focal * x / z + middle[0] - marks[i, j, 0]) ** 2
                squared += (focal * y / z + middle[1] - marks[i, j, 1]) ** 2
                if squared > terms.knee**2:
                    squared = terms.knee * (2 * np.sqrt(squared) - terms.knee)
                total += squared / count
        roll = rotations[i][0] @ [0, 1, 0]
        total += terms.roll**2 * roll**2
        total += terms.level**2 * (rotations[i][2] @ [0, 1, 0]) ** 2
        total += terms.ground**2 * max(0, terms.floor - centers[i, 1]) ** 2
    for i in range(1, frames - 1):
        later = Rotation.from_matrix(rotations[i + 1] @ rotations[i].T).as_rotvec()
        earlier = Rotation.from_matrix(rotations[i] @ rotations[i - 1].T).as_rotvec()
        total += terms.turn**2 * np.sum((later - earlier) ** 2)
        total += terms.place**2 * np.sum((centers[i + 1] - 2 * centers[i] + centers[i - 1]) ** 2)
    return total + terms.focal**2 * (np.log(focal) - terms.usual_focal) ** 2
