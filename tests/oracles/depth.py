"""Slow numpy transcription of the 2010 paper's section 3.3.1."""

import numpy as np


def limb_depth(labels, ends, end_depths, interpolation="linear"):
    """Depth of the closest point of the limb's axis, pixel by pixel."""
    out = np.full(np.shape(labels), np.inf)
    for (row, column), label in np.ndenumerate(labels):
        if label == 0:
            continue
        (a, b), (za, zb) = np.array(ends[label - 1], float), end_depths[label - 1]
        along = b - a
        if not along.any():
            out[row, column] = min(za, zb)
            continue
        t = np.clip((np.array([column, row]) - a) @ along / (along @ along), 0, 1)
        out[row, column] = 1 / ((1 - t) / za + t / zb) if interpolation == "perspective" else (1 - t) * za + t * zb
    return out
