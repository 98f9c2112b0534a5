"""Slow numpy transcription of painting a textured mesh, pixel by pixel and triangle by triangle."""

import numpy as np


def covers(corners, x, y):
    """Whether a triangle holds a pixel centre by the top-left rule; corners are in whole 1/256 pixels."""
    (ax, ay), (bx, by), (cx, cy) = corners
    turn = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if turn == 0:
        return False
    ring = [(ax, ay), (bx, by), (cx, cy)] if turn > 0 else [(ax, ay), (cx, cy), (bx, by)]
    for (px, py), (qx, qy) in zip(ring, ring[1:] + ring[:1], strict=True):
        side = (qx - px) * (256 * y - py) - (qy - py) * (256 * x - px)
        top_left = qy < py or (qy == py and qx > px)
        if side < 0 or (side == 0 and not top_left):
            return False
    return True


def read(texture, u, v):
    """Premultiplied RGBA in 0..1, bilinear, with the rim repeated."""
    colors = texture.astype(float) / 255
    colors[..., :3] *= colors[..., 3:]
    u, v = np.clip(u, 0, texture.shape[1] - 1), np.clip(v, 0, texture.shape[0] - 1)
    i, j = int(u), int(v)
    i1, j1 = min(i + 1, texture.shape[1] - 1), min(j + 1, texture.shape[0] - 1)
    upper = colors[j, i] * (1 - u + i) + colors[j, i1] * (u - i)
    lower = colors[j1, i] * (1 - u + i) + colors[j1, i1] * (u - i)
    return upper * (1 - v + j) + lower * (v - j)


def render_mesh(vertices, triangles, coordinates, texture, size, depth=None, samples=1):
    """Premultiplied RGBA (H, W, 4) in 0..1."""
    width, height = size
    order = range(len(triangles)) if depth is None else sorted(range(len(triangles)), key=lambda t: -depth[t])
    big = np.zeros((height * samples, width * samples, 4))
    scaled = np.asarray(vertices, float) * samples + (samples - 1) / 2
    for t in order:
        corners = [tuple(int(v) for v in np.round(scaled[v] * 256)) for v in triangles[t]]
        a, b, c = scaled[triangles[t]]
        p, q, r = np.asarray(coordinates, float)[triangles[t]]
        for y in range(big.shape[0]):
            for x in range(big.shape[1]):
                if covers(corners, x, y):
                    shares = np.linalg.solve(np.stack([b - a, c - a], axis=1), np.array([x, y]) - a)
                    place = np.clip(
                        p + (q - p) * shares[0] + (r - p) * shares[1], np.min([p, q, r], 0), np.max([p, q, r], 0)
                    )
                    color = read(texture, *place)
                    big[y, x] = color + big[y, x] * (1 - color[3])
    return big.reshape(height, samples, width, samples, 4).mean(axis=(1, 3))
