"""The search for a drawn sequence in a clip, slowly: every end, every path, angles by atan2."""

import numpy as np


def mean_angles(angles, weights, vectors, right, down):
    """Weighted sum over limbs of the internal angles (F, G): drawn ``angles`` (F, K), clip ``vectors`` (G, K, 3)."""
    seen = np.arctan2(vectors @ down, vectors @ right)
    out = np.zeros((len(angles), len(vectors)))
    for frame in range(len(angles)):
        for limb in range(angles.shape[1]):
            apart = np.abs(angles[frame, limb] - seen[:, limb]) % (2 * np.pi)
            out[frame] += weights[frame, limb] * np.minimum(apart, 2 * np.pi - apart)
    return out


def cheapest_path(costs, steps):
    """The lowest sum of costs over all paths, by the end frame (G,): each drawn frame some steps on."""
    frames, length = costs.shape
    best = np.full(length, np.inf)

    def walk(frame, at, total):
        if at >= length:
            return
        total += costs[frame, at]
        if frame == frames - 1:
            best[at] = min(best[at], total)
            return
        for step in range(steps[frame + 1][0], steps[frame + 1][1] + 1):
            walk(frame + 1, at + step, total)

    for start in range(length):
        walk(0, start, 0.0)
    return best
