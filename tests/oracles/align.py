"""Slow transcriptions of the 2009 paper's sections 3.2-3.3: descriptor, distance, and every path of a time warp."""

import cmath
import itertools
import math

import numpy as np


def pose_descriptor(markers, limbs, parents=None):
    """One pose (N, 2): the angle of each limb, against its parent's where it has one."""
    angles = []
    for first, second in limbs:
        dx, dy = np.subtract(markers[second], markers[first])
        angles.append(0.0 if dx == dy == 0 else cmath.phase(complex(dx, dy)))
    for limb, parent in enumerate(parents if parents is not None else []):
        first, second = limbs[limb]
        if parent >= 0 and np.any(np.subtract(markers[second], markers[first])):
            one, other = (cmath.rect(1, absolute(markers, limbs[k])) for k in (limb, parent))
            angles[limb] = cmath.phase(one * other.conjugate())
    return np.array([math.pi if angle <= -math.pi else angle for angle in angles])


def absolute(markers, limb):
    """The angle of one limb."""
    dx, dy = np.subtract(markers[limb[1]], markers[limb[0]])
    return math.atan2(dy, dx) if dx or dy else 0.0


def pose_distance(a, b, weights):
    """Equation 4 between two poses: the angle between two directions, by their cosine and sine."""
    turns = [abs(cmath.phase(cmath.rect(1, p) * cmath.rect(1, q).conjugate())) for p, q in zip(a, b, strict=True)]
    return sum(weight * turn for weight, turn in zip(weights, turns, strict=True))


def paths(rows, columns, open_begin=False, open_end=False, slope_limit=None):
    """Every allowed path, each a list of (row, column)."""
    ends = range(columns) if open_end else [columns - 1]
    stack = [[(0, j)] for j in (range(columns) if open_begin else [0])]
    while stack:
        path = stack.pop()
        row, column = path[-1]
        if row == rows - 1 and column in ends and _gentle(path, slope_limit):
            yield path
        following = [(row + 1, column + 1), (row + 1, column), (row, column + 1)]
        stack.extend([*path, (i, j)] for i, j in following if i < rows and j < columns)


def _gentle(path, slope_limit):
    if slope_limit is None:
        return True
    steps = [(b[0] - a[0], b[1] - a[1]) for a, b in itertools.pairwise(path)]
    run = []
    for step in steps:
        run = [] if step == (1, 1) else [*run, step]
        if len(run) >= slope_limit or len(set(run)) > 1:
            return False
    return True


def time_warp(cost, **rules):
    """The cheapest of all paths and its sum, summed in the order of the path."""
    sums = {tuple(path): sum((cost[cell] for cell in path), 0.0) for path in paths(*np.shape(cost), **rules)}
    if not sums:
        return None
    best = min(sums, key=sums.get)
    return list(best), sums[best]
