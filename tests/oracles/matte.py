"""Slow numpy transcriptions of the mattes (2010 paper, equations 14 and 15, and docs/papers.md)."""

from fractions import Fraction

import numpy as np


def over_white(image):
    """The picture over white paper, not rounded."""
    image = np.asarray(image, float)
    if image.shape[2] == 3:
        return image
    alpha = image[..., 3:] / 255
    return image[..., :3] * alpha + 255 * (1 - alpha)


def whiten(image, white_point):
    """Levels from the white point up are white, those below spread over the range; an alpha channel stays."""
    image = np.array(image)
    table = [min(255, int(255 * Fraction(v, white_point) + Fraction(1, 2))) for v in range(256)]
    image[..., :3] = np.array(table, np.uint8)[image[..., :3]]
    return image


def ink_alpha(image):
    """Equations 14 and 15 with 0.299."""
    return (255 - over_white(image) @ [0.299, 0.587, 0.114]) / 255


def unmix(image):
    """Colour to alpha: 1 - min(RGB), and the colour that over white gives the picture; white where alpha is 0."""
    drawn = np.rint(over_white(image))
    alpha = 1 - drawn.min(axis=2) / 255
    safe = np.where(alpha > 0, alpha, 1)[..., None]
    return np.where(alpha[..., None] > 0, (drawn - 255 * (1 - alpha[..., None])) / safe, 255), alpha


def depths(labels):
    """0 outside, 1 beside the outside, 2 at its corner, 3 inside; beyond the picture the figure goes on."""
    height, width = np.shape(labels)
    outside = np.pad(np.asarray(labels) == 0, 1, mode="edge" if height and width else "constant")
    near = {(y, x): outside[1 + y : 1 + y + height, 1 + x : 1 + x + width] for y in (-1, 0, 1) for x in (-1, 0, 1)}
    side = near[-1, 0] | near[1, 0] | near[0, -1] | near[0, 1]
    corner = near[-1, -1] | near[1, 1] | near[1, -1] | near[-1, 1]
    return np.where(near[0, 0], 0, np.where(side, 1, np.where(corner, 2, 3)))


def explain(dark, paint):
    """By how much paint over white misses a pixel at best, and with which alpha; both as distances from white."""
    if paint @ paint < 24**2:
        return None
    part = min(int(dark @ paint * 255 + paint @ paint // 2) // int(paint @ paint), 255)
    miss = dark - (paint * part + 127) // 255
    return (miss @ miss, part) if miss @ miss <= 24**2 else None


def border(drawn, deep, at):
    """The alpha of a border pixel in 255ths: the best paint farther in, or the darkest ink about as good."""
    dark, here = 255 - drawn.astype(int), np.array(at)
    steps = {place: np.array(place) - here for place in np.ndindex(deep.shape)}
    near = {place: step for place, step in steps.items() if 0 < abs(step).max() <= 5}
    on = [(np.clip(here + step, 0, np.array(deep.shape) - 1), step) for step in np.argwhere(np.ones((3, 3))) - 1]
    outward = sum((step for place, step in on if deep[tuple(place)] == 0), np.zeros(2))
    beside = [place for place, step in near.items() if abs(step).sum() == 1 and step @ outward > 0]
    if deep[at] == 2 and any(dark[place].max() > max(dark[at].max() - 16, 0) for place in beside):
        return 255
    every, ink = [], [255]
    for place, step in near.items():
        is_ink = dark[place].min() >= 128
        inward = deep[place] > deep[at] and abs(step).max() <= 2
        along = is_ink and deep[place] in (1, 2) and step @ outward <= 0
        found = explain(dark[at], dark[place]) if inward or along else None
        if found:
            every.append((found[0], step @ step, -found[1]))
            ink += [found[1]] if is_ink and found[0] <= 36 else []
    return max(min(-min(every)[2], min(ink)) if every else 255, dark[at].max())


def fill(image, labels):
    """Alpha 1 inside, unmixed outside, the border from the paint and the ink that explain it."""
    drawn = np.rint(over_white(image))
    color, alpha = unmix(image)
    deep = depths(labels)
    color[deep > 0], alpha[deep > 0] = drawn[deep > 0], 1
    for row, column in np.argwhere((deep == 1) | (deep == 2)):
        alpha[row, column] = border(drawn, deep, (row, column)) / 255
        color[row, column] = 255 - (255 - drawn[row, column]) / max(alpha[row, column], 1 / 255)
    return color, alpha
