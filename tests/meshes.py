"""Meshes that tests render."""

import numpy as np

from pegbar import Mesh, PerspectiveCamera


def flat_camera(width, height, focal=64.0):
    """A camera at the origin that looks along +z; a power of two as focal length keeps pixels exact."""
    matrix = [[focal, 0, width / 2, 0], [0, focal, height / 2, 0], [0, 0, 1, 0]]
    return PerspectiveCamera(matrix, (width, height))


def pixel_mesh(camera, pixels, depths, triangles, color=(1, 1, 1, 1), object_id=1):
    """A mesh whose vertices are seen at ``pixels`` (n, 2) with ``depths`` (n,) or one depth."""
    pixels = np.asarray(pixels, float)
    depths = np.broadcast_to(np.asarray(depths, float), len(pixels))
    return Mesh(camera.unproject(pixels, depths), triangles, color, object_id)


def rectangle(camera, left, top, right, bottom, depth, color=(1, 1, 1, 1), object_id=1):
    """A rectangle that faces the camera, by the pixels of its corners."""
    corners = [[left, top], [right, top], [right, bottom], [left, bottom]]
    return pixel_mesh(camera, corners, depth, [[0, 1, 2], [0, 2, 3]], color, object_id)


def sheet(surface, columns, rows, color=(1, 1, 1, 1), object_id=1, closed=(False, False)):
    """A grid over ``surface(u, v) -> (..., 3)`` with u and v in 0..1, closed where the ends meet."""
    counts = columns + (not closed[0]), rows + (not closed[1])
    u, v = np.meshgrid(np.arange(counts[0]) / columns, np.arange(counts[1]) / rows, indexing="ij")
    i, j = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    corner = [
        ((i + a) % counts[0] * counts[1] + (j + b) % counts[1]).ravel() for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))
    ]
    triangles = np.concatenate([np.stack([corner[k] for k in order], axis=1) for order in ((0, 1, 2), (0, 2, 3))])
    # Rounded, so that no platform's sine moves a sample over an edge.
    return Mesh(np.round(surface(u, v).reshape(-1, 3) * 4096) / 4096, triangles, color, object_id)


def torus(radius, thickness, color=(0.9, 0.4, 0.2, 1), object_id=1, detail=(48, 24)):
    """A torus around the y axis."""

    def surface(u, v):
        a, b = 2 * np.pi * u, 2 * np.pi * v
        reach = radius + thickness * np.cos(b)
        return np.stack([reach * np.cos(a), thickness * np.sin(b), reach * np.sin(a)], axis=-1)

    return sheet(surface, *detail, color, object_id, (True, True))


def ribbon(color=(0.2, 0.5, 0.9, 1), object_id=2, detail=(120, 4)):
    """A ribbon that winds and twists along the x axis."""

    def surface(u, v):
        t, across = 6 * np.pi * u, (v - 0.5) * 0.25
        y, z = np.sin(t) * 0.35 + across * np.cos(1.3 * t), np.cos(t) * 0.35 + across * np.sin(1.3 * t)
        return np.stack([2.5 * (u - 0.5), y, z], axis=-1)

    return sheet(surface, *detail, color, object_id)


def box(center, side, color=(0.3, 0.8, 0.3, 1), object_id=3):
    """A cube along the axes."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * side / 2
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = [triangle for a, b, c, d in faces for triangle in ([a, b, c], [a, c, d])]
    return Mesh(corners + np.asarray(center), triangles, color, object_id)
