"""Slow numpy transcription of the 2010 paper's equations 16-17, in float64, with nearer over farther."""

import numpy as np


def encode(linear):
    """Linear light to sRGB (IEC 61966-2-1), odd about zero and continued beyond one."""
    size = np.abs(np.asarray(linear, float))
    curve = np.where(size <= 0.0031308, 12.92 * size, 1.055 * np.maximum(size, 1e-9) ** (1 / 2.4) - 0.055)
    return np.copysign(curve, linear)


def decode(display):
    """Linear light of sRGB values."""
    size = np.abs(np.asarray(display, float))
    return np.copysign(np.where(size <= 0.04045, size / 12.92, ((size + 0.055) / 1.055) ** 2.4), display)


def printed(drawing, alpha, drawing_depth, rendered, rendered_depth):
    """Equations 16 and 17 as printed, for opaque plates: straight colours of any range."""
    alpha = np.where(drawing_depth < rendered_depth, alpha, 0)[..., None]
    return alpha * drawing[..., :3] + (1 - alpha) * rendered[..., :3]


def converted(premultiplied, curve):
    """Unpremultiplied, sent through a curve, premultiplied again; colour without coverage goes through as it is."""
    coverage = np.clip(premultiplied[..., 3:], 0, 1)
    scale = np.where(coverage > 0, coverage, 1)
    return np.concatenate([curve(premultiplied[..., :3] / scale) * scale, coverage], axis=-1)


def depth_composite(
    drawing, alpha, drawing_depth, rendered, rendered_depth, rendered_space="display", space="display", dtype=None
):
    """The whole contract of the product, vectorised over samples."""
    kind = np.dtype(rendered.dtype if dtype is None else dtype)
    scale = rendered.shape[0] // drawing.shape[0]
    enlarge = lambda values: np.repeat(np.repeat(np.asarray(values, float), scale, axis=0), scale, axis=1)  # noqa: E731
    plate = premultiplied(rendered)
    if rendered_space != space:
        plate = converted(plate, encode if space == "display" else decode)
    color, covered = plate[..., :3], np.clip(plate[..., 3:], 0, 1)
    if kind == np.uint8:
        color = np.clip(color, 0, 1)
    hue = enlarge(drawing[..., :3]) / 255
    hue = decode(hue) if space == "linear" else hue
    a, z = enlarge(alpha)[..., None], enlarge(drawing_depth)
    front = (np.isinf(z) | (z < rendered_depth))[..., None]
    light = np.where(front, a * hue + (1 - a) * color, color + (1 - covered) * a * hue)
    total = np.where(front, a + (1 - a) * covered, covered + (1 - covered) * a)
    result = average(np.concatenate([light, total], axis=-1), scale)
    return straight_bytes(result) if kind == np.uint8 else result


def premultiplied(rendered):
    """Straight bytes or premultiplied floats as premultiplied floats."""
    if rendered.dtype != np.uint8:
        return np.asarray(rendered, float)
    plate = rendered / 255
    plate[..., :3] *= plate[..., 3:]
    return plate


def average(samples, scale):
    """The mean of every scale x scale block."""
    height, width, channels = samples.shape
    return samples.reshape(height // scale, scale, width // scale, scale, channels).mean(axis=(1, 3))


def straight_bytes(premultiplied):
    """Quantised to the nearest of 0..255 with straight colours, 0 where nothing is covered."""
    coverage = premultiplied[..., 3:]
    straight = np.divide(
        premultiplied[..., :3], coverage, out=np.zeros_like(premultiplied[..., :3]), where=coverage > 0
    )
    return np.rint(255 * np.clip(np.concatenate([straight, coverage], axis=-1), 0, 1)).astype(np.uint8)


def matte(alpha, drawing_depth, rendered_alpha, rendered_depth):
    """Mean over samples of alpha where the drawing is in front; what shows through a given coverage counts too."""
    scale = rendered_depth.shape[0] // alpha.shape[0]
    a, z = (
        np.kron(np.asarray(values, float), np.ones((scale, scale)))
        for values in (alpha, np.minimum(drawing_depth, 1e9))
    )
    front = (z >= 1e9) | (z < rendered_depth)
    through = 0 if rendered_alpha is None else 1 - np.clip(rendered_alpha, 0, 1)
    return average(np.where(front, a, a * through)[..., None], scale)[..., 0]
