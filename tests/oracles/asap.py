"""Section 7 of the 2007 paper, one vertex of one bone at a time, with the frames of PAPERS' table."""

import numpy as np


def frame(start, end, eye):
    """The local frame of a bone: l_x, l_y, l_z as columns."""
    bone = end - start
    l_x = np.cross(eye - start, bone)
    l_x /= np.linalg.norm(l_x)
    l_z = np.cross(l_x, bone)
    l_z /= np.linalg.norm(l_z)
    if l_z @ (eye - start) < 0:
        l_z = -l_z
    return np.stack([l_x, bone, l_z], axis=1)


def unproject(pixel, height, start, end, matrix):
    """The local coordinates of a pixel: where its ray meets the bone's plane, and `height` metres out of it."""
    eye = -np.linalg.solve(matrix[:, :3], matrix[:, 3])
    axes = frame(start, end, eye)
    ray = np.linalg.solve(matrix[:, :3], [*pixel, 1.0])
    distance = ((start - eye) @ axes[:, 2]) / (ray @ axes[:, 2])
    return np.linalg.solve(axes, eye + distance * ray + height * axes[:, 2] - start)


def place(local, start, end, eye):
    """The point with local coordinates in a bone's new frame."""
    return frame(start, end, eye) @ local + start


def project(point, matrix):
    image = matrix @ [*point, 1.0]
    return image[:2] / image[2]


def shape(pixel, height, weights, bones, first, then, matrix):
    """A vertex (2,) in another pose: weighted over its bones in 3D, then projected."""
    eye = -np.linalg.solve(matrix[:, :3], matrix[:, 3])
    total = np.zeros(3)
    for (parent, child), weight in zip(bones, weights, strict=True):
        if weight:
            local = unproject(pixel, height, first[parent], first[child], matrix)
            total += weight * place(local, then[parent], then[child], eye)
    return project(total, matrix)
