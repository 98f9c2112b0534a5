"""Slow numpy cameras over drawings: one film pixel after the other, by its definition."""

import math

import numpy as np


def place(view, column, row):
    """Where the middle of a film pixel lies in the drawing: about the frame's middle, turned, reduced, and moved."""
    (width, height), (wide, tall) = view.size, view.paper
    x, y = (column - (width - 1) / 2) / view.zoom, (row - (height - 1) / 2) / view.zoom
    turn = math.radians(view.rotate)
    right = x * math.cos(turn) - y * math.sin(turn)
    down = x * math.sin(turn) + y * math.cos(turn)
    rest = (width - 1) / 2 + (wide - width) // 2, (height - 1) / 2 + (tall - height) // 2
    return rest[0] + view.pan_x + right, rest[1] + view.pan_y + down


def keys(distance):
    """Keys 1981, equation 15."""
    s = abs(distance)
    if s < 1:
        return 1.5 * s**3 - 2.5 * s**2 + 1
    return -0.5 * s**3 + 2.5 * s**2 - 4 * s + 2 if s < 2 else 0.0


def resample(picture, view):
    """A premultiplied picture (H, W, C) as ``view`` sees it."""
    tall, wide = picture.shape[:2]
    out = np.zeros((view.size[1], view.size[0], picture.shape[2]))
    reach = max(1.0, 1 / view.zoom)
    for row in range(view.size[1]):
        for column in range(view.size[0]):
            x, y = place(view, column, row)
            cover = np.prod(
                [np.clip(0.5 + (min(p + 0.5, n - 0.5 - p)) * view.zoom, 0, 1) for p, n in ((x, wide), (y, tall))]
            )
            total, weights, near = 0.0, 0.0, []
            for j in range(math.floor(y - 2 * reach), math.ceil(y + 2 * reach) + 1):
                for i in range(math.floor(x - 2 * reach), math.ceil(x + 2 * reach) + 1):
                    weight = keys((i - x) / reach) * keys((j - y) / reach)
                    color = picture[min(max(j, 0), tall - 1), min(max(i, 0), wide - 1)]
                    total, weights = total + weight * color, weights + weight
                    if abs(i - x) < reach and abs(j - y) < reach and weight != 0:
                        near.append(color)
            if cover > 0:
                out[row, column] = np.clip(total / weights, np.min(near, axis=0), np.max(near, axis=0)) * cover
    return out


def nearest(values, view, empty):
    """Values of the nearest pixels; where that is empty, of the nearest under the filter's middle that is not."""
    tall, wide = values.shape
    out = np.full(view.size[::-1], empty, values.dtype)
    reach = max(1.0, 1 / view.zoom)
    for row in range(view.size[1]):
        for column in range(view.size[0]):
            x, y = place(view, column, row)
            i, j = math.floor(x + 0.5), math.floor(y + 0.5)
            if 0 <= i < wide and 0 <= j < tall and values[j, i] != empty:
                out[row, column] = values[j, i]
                continue
            around = [
                (math.hypot(i - x, j - y), values[j, i])
                for j in range(max(0, math.floor(y - reach)), min(tall, math.ceil(y + reach) + 1))
                for i in range(max(0, math.floor(x - reach)), min(wide, math.ceil(x + reach) + 1))
                if values[j, i] != empty and max(abs(i - x), abs(j - y)) < reach
            ]
            if around:
                out[row, column] = min(around, key=lambda found: found[0])[1]
    return out
