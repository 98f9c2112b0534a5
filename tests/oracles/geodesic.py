"""Labels that grow inside a figure, as a fixed point: every pixel asks its neighbours until nothing changes."""

import numpy as np

STEPS = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if (dy, dx) != (0, 0)]


def distances_of(seeds, costs, pace):
    """Distances (H, W) from true ``seeds``, after Bellman and Ford."""
    far = np.where(seeds, 0.0, np.inf)
    while True:
        new = far.copy()
        for y, x in np.ndindex(*costs.shape):
            if not np.isfinite(costs[y, x]):
                continue
            for dy, dx in STEPS:
                v, u = y + dy, x + dx
                if 0 <= v < costs.shape[0] and 0 <= u < costs.shape[1] and np.isfinite(far[v, u]):
                    own = costs[v, u] if np.isfinite(costs[v, u]) else costs[y, x]
                    step = np.hypot(dy, dx) * (own + costs[y, x]) / 2 * pace
                    new[y, x] = min(new[y, x], far[v, u] + step)
        if np.array_equal(new, far):
            return far
        far = new
