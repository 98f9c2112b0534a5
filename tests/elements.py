"""3D things that fly round a drawn figure in tests: a hoop and a ball, with known places."""

import numpy as np

from pegbar import Mesh


def hoop(center, radius, tube, *, axis=(0, 1, 0), object_id=1, color=(0.9, 0.1, 0.1, 1), around=96, across=12):
    """A torus about ``axis`` through ``center``."""
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    side = np.cross(axis, [0, 0, 1]) / np.linalg.norm(np.cross(axis, [0, 0, 1]))
    other = np.cross(side, axis)
    u, v = np.meshgrid(*(np.arange(n) * 2 * np.pi / n for n in (around, across)), indexing="ij")
    out = np.cos(u)[..., None] * side + np.sin(u)[..., None] * other
    points = np.asarray(center) + out * (radius + tube * np.cos(v))[..., None] + axis * (tube * np.sin(v))[..., None]
    return Mesh(points.reshape(-1, 3), _grid(around, across, True), np.array(color, np.float32), object_id)


def ball(center, radius, *, object_id=2, color=(0.1, 0.2, 0.9, 1), around=32, across=17):
    """A sphere."""
    u, v = np.meshgrid(np.arange(around) * 2 * np.pi / around, np.linspace(0, np.pi, across), indexing="ij")
    normal = np.stack([np.cos(u) * np.sin(v), np.cos(v), np.sin(u) * np.sin(v)], axis=-1)
    points = np.asarray(center) + radius * normal
    return Mesh(points.reshape(-1, 3), _grid(around, across, False), np.array(color, np.float32), object_id)


def _grid(rows, columns, closed):
    last = columns if closed else columns - 1
    i, j = np.meshgrid(np.arange(rows), np.arange(last), indexing="ij")
    a, b = i * columns + j, ((i + 1) % rows) * columns + j
    c, d = ((i + 1) % rows) * columns + (j + 1) % columns, i * columns + (j + 1) % columns
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
