"""Slow numpy transcription of the 2007 paper's section 7 (equation 4, averaging), and what stitches and precedes it."""

import numpy as np


def fit_triangles(shapes, intermediate, triangles):
    """Equation 4, triangle by triangle, with the perpendicular that minimises the squared distance."""
    out = []
    for shape, corners in zip(np.asarray(shapes, float), triangles, strict=True):
        q = np.asarray(intermediate, float)[np.asarray(corners)]
        p, middle = shape - shape.mean(axis=0), q.mean(axis=0)
        q = q - middle
        perpendicular = np.stack([-p[:, 1], p[:, 0]], axis=1)
        r = np.array([(p * q).sum(), (perpendicular * q).sum()])
        c, s = r / np.linalg.norm(r) if r.any() else (1.0, 0.0)
        out.append(p @ np.array([[c, s], [-s, c]]) + middle)
    return np.array(out)


def average_triangles(fitted, triangles, n):
    """The mean of each vertex's corners."""
    return np.array([np.mean([fitted[t][k] for t, k in np.argwhere(np.asarray(triangles) == v)], 0) for v in range(n)])


def _solve(energy, held, positions):
    """Complex vertices that minimise the Hermitian ``energy`` (plus a linear term) with some of them held."""
    matrix, load = energy
    n = len(matrix)
    free = np.setdiff1d(np.arange(n), held)
    out = np.empty(n, complex)
    out[held] = positions
    out[free] = np.linalg.solve(matrix[np.ix_(free, free)], load[free] - matrix[np.ix_(free, held)] @ out[held])
    return out


def deform(vertices, triangles, handles, positions, shapes=None, iterations=1, stitch="poisson"):
    """Dense systems: similarity of triangles, then fitting and joining."""
    z, moved = (np.asarray(v, float) @ [1, 1j] for v in (vertices, positions))
    triangles, n = np.asarray(triangles), len(z)
    edges = np.roll(z[triangles], -1, 1) - np.roll(z[triangles], -2, 1)
    unit = (np.abs(edges) ** 2).mean()
    squared = np.maximum(np.abs(edges) ** 2 / unit, 4e-4)
    area = np.abs((edges[:, 0].conj() * edges[:, 1]).imag) / unit
    stitching = np.sqrt(np.maximum(area / squared.sum(1), 0.01))[:, None] * squared**-1.25
    similar = np.zeros((n, n), complex)
    for corners, c, w in zip(triangles, edges / np.sqrt(unit), (1 / squared).sum(1), strict=True):
        similar[np.ix_(corners, corners)] += w * np.outer(c.conj(), c)
    out = _solve((similar, np.zeros(n)), handles, moved)
    shapes = np.asarray(vertices, float)[triangles] if shapes is None else shapes
    for _ in range(iterations):
        fitted = fit_triangles(shapes, np.stack([out.real, out.imag], 1), triangles)
        if stitch == "average":
            out = average_triangles(fitted, triangles, n) @ [1, 1j]
            out[handles] = moved
            continue
        laplacian, load, f = np.zeros((n, n), complex), np.zeros(n, complex), fitted @ [1, 1j]
        for corners, q, w in zip(triangles, f, stitching, strict=True):
            for k in range(3):
                i, j = (k + 1) % 3, (k + 2) % 3
                d = np.zeros(n)
                d[corners[i]], d[corners[j]] = 1, -1
                laplacian += w[k] * np.outer(d, d)
                load += w[k] * d * (q[i] - q[j])
        out = _solve((laplacian, load), handles, moved)
    return np.stack([out.real, out.imag], axis=1)
