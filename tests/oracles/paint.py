"""Slow numpy polygons: winding numbers at points, coverage by many samples a pixel."""

import numpy as np


def winding(points, x, y):
    """Winding number of the closed polygon around every (x, y)."""
    number = np.zeros(np.shape(x), int)
    for (ax, ay), (bx, by) in zip(points, np.roll(points, -1, axis=0), strict=True):
        side = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
        number += np.where((ay <= y) & (by > y) & (side > 0), 1, 0)
        number -= np.where((ay > y) & (by <= y) & (side < 0), 1, 0)
    return number


def coverage(points, width, height, samples=16):
    """Part of every pixel inside the polygon."""
    step = (np.arange(samples) + 0.5) / samples - 0.5
    x = (np.arange(width)[:, None] + step).ravel()
    y = (np.arange(height)[:, None] + step).ravel()
    inside = winding(points, *np.meshgrid(x, y)) != 0
    return inside.reshape(height, samples, width, samples).mean(axis=(1, 3))


def inside(points, width, height, margin):
    """Whether each pixel's centre is inside, and whether it is at least ``margin`` from every edge."""
    x, y = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    clear = np.full(x.shape, True)
    for a, b in zip(points, np.roll(points, -1, axis=0), strict=True):
        along = b - a
        place = ((x - a[0]) * along[0] + (y - a[1]) * along[1]) / max(along @ along, 1e-12)
        place = np.clip(place, 0, 1)
        clear &= np.hypot(x - a[0] - place * along[0], y - a[1] - place * along[1]) >= margin
    return clear, winding(points, x, y) != 0
