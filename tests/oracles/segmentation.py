"""Slow transcriptions of the labels of section 3.3.1 of the 2010 paper, in whole numbers and fractions."""

from fractions import Fraction

import numpy as np


def segment_stick_figure(gray, ends, half_widths, threshold):
    """Dark pixels in the windows of limbs whose ends are whole pixels; exact, so that ties are ties."""
    out = np.zeros(np.shape(gray), np.uint8)
    for (row, column), value in np.ndenumerate(gray):
        nearest = None
        for limb, ((a, b), half) in enumerate(zip(ends, half_widths, strict=True)):
            (dx, dy), (px, py) = (b[0] - a[0], b[1] - a[1]), (column - a[0], row - a[1])
            whole, along, across = dx * dx + dy * dy, dx * px + dy * py, dx * py - dy * px
            squared = Fraction(across * across, whole) if whole else Fraction(px * px + py * py)
            inside = squared <= Fraction(half) ** 2 and 0 <= along <= whole
            if value < threshold and inside and (nearest is None or squared < nearest):
                nearest, out[row, column] = squared, limb + 1
    return out


def palette_labels(segmentation, colors, labels, background):
    """Exact colours: the labels, and the places of what matches none."""
    meaning = {tuple(color): label for color, label in zip(colors, labels, strict=True)} | {
        tuple(color): 0 for color in background
    }
    out, strangers = np.zeros(np.shape(segmentation)[:2], np.uint8), []
    for row, column in np.ndindex(out.shape):
        red, green, blue, *alpha = (int(value) for value in segmentation[row, column])
        if alpha and alpha[0] < 128:
            continue
        if (red, green, blue) in meaning:
            out[row, column] = meaning[red, green, blue]
        else:
            strangers.append((row, column))
    return out, strangers


def grow_labels(labels, figure, reach):
    """The nearest labelled pixel's label: by distance, then column, then row."""
    out = np.array(labels)
    known = [(row, column) for row, column in np.ndindex(out.shape) if labels[row, column]]
    for row, column in np.ndindex(out.shape):
        if labels[row, column] or not figure[row, column] or not known:
            continue
        squared, x, y = min(((y - row) ** 2 + (x - column) ** 2, x, y) for y, x in known)
        if reach is None or squared**0.5 <= reach:
            out[row, column] = labels[y, x]
    return out
