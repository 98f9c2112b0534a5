"""A made-up figure in motion: rigid limbs that swing smoothly."""

import numpy as np

#: A root, a torso with two arms of two limbs, and two legs of two limbs.
LIMBS = np.array([(0, 1), (1, 2), (1, 3), (3, 4), (1, 5), (5, 6), (0, 7), (7, 8), (0, 9), (9, 10)])
LENGTHS = np.array([0.5, 0.25, 0.3, 0.27, 0.31, 0.26, 0.42, 0.4, 0.43, 0.41])
_ARM, _LEG = [[0.4, -1, 0], [0.1, -1, 0]], [[0.25, -1, 0], [0, -1, 0]]
_MIRRORED = np.array([-1, 1, 1])
_REST = np.concatenate([[[0, 1, 0], [0, 1, 0]], _ARM, _ARM * _MIRRORED, _LEG, _LEG * _MIRRORED])


def swinging(seed, frames, swing=0.7):
    """Markers (F, 11, 3) in metres whose root stands still and whose limbs swing with periods of 30 to 50 frames."""
    random = np.random.default_rng(seed)
    time = np.arange(frames)[:, None]
    directions = np.broadcast_to(_REST, (frames, *_REST.shape)).copy()
    for axis in range(3):
        period, phase = random.uniform(30, 50, len(LIMBS)), random.uniform(0, 2 * np.pi, len(LIMBS))
        directions[:, :, axis] += swing * random.uniform(0.3, 1, len(LIMBS)) * np.sin(2 * np.pi * time / period + phase)
    directions *= (LENGTHS / np.linalg.norm(directions, axis=-1))[..., None]
    points = np.zeros((frames, 11, 3))
    points[:, 0] = [0.2, 0.9, -0.1]
    for limb, (first, second) in enumerate(LIMBS):
        points[:, second] = points[:, first] + directions[:, limb]
    return points


def spans(points, limbs=LIMBS):
    """Lengths (F, V) of the limbs."""
    return np.linalg.norm(points[:, limbs[:, 1]] - points[:, limbs[:, 0]], axis=-1)
