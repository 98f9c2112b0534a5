"""Equations 9 to 13 of the 2010 paper for one corner at a time, as linear systems."""

import numpy as np


def corner(pixel, matrix, depth):
    """Equations 9-12: the homogeneous point that is seen at `pixel` and has the planar `depth`."""
    x, y = pixel
    cross = np.array([[0, -1, y], [1, 0, -x], [-y, x, 0]])
    system = np.vstack([cross @ matrix, matrix[2], [0, 0, 0, 1]])
    point = np.linalg.lstsq(system, np.array([0, 0, 0, depth, 1]), rcond=None)[0]
    return point[:3]


def cylinder(box, matrix, start, end):
    """One limb's axis and radii; `start` and `end` are its markers (3,)."""
    depths = [matrix[2] @ [*point, 1] for point in (start, end, end, start)]
    p1, p2, p3, p4 = (corner(pixel, matrix, depth) for pixel, depth in zip(box, depths, strict=True))
    return (p1 + p4) / 2, (p2 + p3) / 2, np.linalg.norm(p1 - p4) / 2, np.linalg.norm(p2 - p3) / 2
