"""Slow numpy rasteriser: every triangle at every sample by whole-number edge functions and the ray's meeting point."""

import numpy as np

SUBPIXELS = 256


def covered(corners, size):
    """Samples (H, W) of a triangle with snapped corners (3, 2) in 1/256 pixel, y down, by the top-left rule."""
    width, height = size
    a, b, c = ([int(v) for v in corner] for corner in corners)
    if cross(a, b, c) < 0:
        b, c = c, b
    inside = np.full((height, width), cross(a, b, c) != 0)
    for start, end in ((a, b), (b, c), (c, a)):
        left_or_top = end[1] < start[1] or (end[1] == start[1] and end[0] > start[0])
        for row, column in np.ndindex(height, width):
            value = cross(start, end, (column * SUBPIXELS, row * SUBPIXELS))
            inside[row, column] &= value > 0 or (value == 0 and left_or_top)
    return inside


def cross(a, b, c):
    """Twice the signed area of three points, in whole numbers of any size."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def snapped(camera, points):
    """Pixels of world points, in 1/256 pixel."""
    return np.floor(camera.project(points) * SUBPIXELS + 0.5).astype(np.int64)


def barycentric(camera, corners, pixel):
    """Barycentric coordinates of the point where a pixel's ray meets the triangle's plane."""
    a, b, c = corners
    eye = camera.position
    ray = camera.unproject(pixel, 1.0) - eye
    # a + u (b - a) + v (c - a) = eye + t ray
    u, v, _ = np.linalg.solve(np.column_stack([b - a, c - a, -ray]), eye - a)
    return np.array([1 - u - v, u, v])


def render(meshes, camera):
    """Depth, coverage, the objects that are nearest within rounding (a set a sample), and colours.

    Everything is in front of the camera. A sample that only snapping gives to a triangle has a depth and a colour
    between those of the corners.
    """
    width, height = camera.image_size
    depth = np.full((height, width), np.inf)
    color = np.zeros((height, width, 4))
    hits = [[[] for _ in range(width)] for _ in range(height)]
    for mesh in meshes:
        for triangle in mesh.triangles:
            corners, colors = mesh.vertices[triangle], mesh.colors[triangle].astype(float)
            depths = camera.depth(corners)
            for row, column in np.argwhere(covered(snapped(camera, corners), camera.image_size)):
                weights = barycentric(camera, corners, [column, row])
                z = np.clip(weights @ depths, depths.min(), depths.max())
                rgba = np.clip(weights @ colors, colors.min(axis=0), colors.max(axis=0))
                hits[row][column].append((z, mesh.object_id, rgba))
    objects = np.empty((height, width), object)
    for row, column in np.ndindex(height, width):
        found = sorted(hits[row][column], key=lambda hit: hit[0])
        objects[row, column] = {0}
        if found:
            z, _, rgba = found[0]
            depth[row, column] = z
            color[row, column] = [*(rgba[:3] * rgba[3]), rgba[3]]
            objects[row, column] = {hit[1] for hit in found if hit[0] <= z * (1 + 1e-5)}
    return depth, np.isfinite(depth).astype(float), objects, color


def resolve(beauty, depth, coverage, object_id, factor):
    """Means of beauty and coverage, depth and object of the nearest sample, pixel by pixel."""
    height, width = np.array(depth.shape) // factor
    out = np.zeros((height, width, 4)), np.zeros((height, width)), np.zeros((height, width)), np.zeros((height, width))
    for row, column in np.ndindex(height, width):
        block = np.s_[row * factor : (row + 1) * factor, column * factor : (column + 1) * factor]
        first = np.argmin(depth[block])
        out[0][row, column] = beauty[block].mean(axis=(0, 1))
        out[1][row, column] = depth[block].flat[first]
        out[2][row, column] = coverage[block].mean()
        out[3][row, column] = object_id[block].flat[first]
    return out
