"""Slow numpy transcription of the rule for a render's soft edges: one look at the neighbours after the other."""

import numpy as np


def rim_depth(rendered, rendered_depth):
    """Depths with samples covered in part at +inf at the smallest finite depth one sample away, else two."""
    depth = np.asarray(rendered_depth, np.float32)
    result, whole = depth.copy(), 255 if rendered.dtype == np.uint8 else 1
    for row, column in np.argwhere((rendered[..., 3] > 0) & (rendered[..., 3] < whole) & np.isposinf(depth)):
        for reach in (1, 2):
            around = depth[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1]
            if np.isfinite(around).any():
                result[row, column] = around[np.isfinite(around)].min()
                break
    return result
