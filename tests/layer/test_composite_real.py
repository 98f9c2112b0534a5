"""A hoop around the waist of a drawn walk: linear render, 2 x 2 samples, soft rims of a real drawing."""

import cv2
import numpy as np
import pytest

from pegbar import depth_composite
from tests.oracles import composite as oracle

SCALE = 2


def hoop(size, center):
    """A tilted ring whose lower half is nearer than 5 m, its upper half farther: premultiplied linear, and depth."""
    rows, columns = np.indices((size[0] * SCALE, size[1] * SCALE), np.float32)
    x, y = ((values - (SCALE - 1) / 2) / SCALE for values in (columns, rows))
    across = (y - center[1] - 0.25 * (x - center[0])) / 34
    inside = np.abs(np.hypot((x - center[0]) / 140, across) - 1) < 0.13
    color = inside[..., None] * np.float32([0.8, 0.12, 0.02, 1])
    return color, np.where(inside, 5 - np.clip(across, -2, 2), np.float32(np.inf))


@pytest.mark.parametrize("number", [0, 10, 33])
def test_a_hoop_passes_before_and_behind_a_drawn_figure(test_data, number):
    picture = cv2.imread(
        str(test_data / "annotated/morevna_side_walk/frames" / f"{number:03}.png"), cv2.IMREAD_UNCHANGED
    )
    drawing = cv2.cvtColor(picture, cv2.COLOR_BGRA2RGBA)
    alpha = drawing[..., 3] / np.float32(255)
    depth = np.where(alpha > 0, np.float32(5), np.float32(np.inf))
    rows, columns = np.nonzero(alpha > 0.5)
    rendered, rendered_depth = hoop(alpha.shape, (columns.mean(), rows.mean()))
    case = (drawing, alpha, depth, rendered, rendered_depth)
    options = {"rendered_space": "linear", "dtype": np.uint8}
    got = depth_composite(*case, **options)
    assert np.abs(got.astype(int) - oracle.depth_composite(*case, **options)).max() <= 1

    samples = rendered[..., 3].reshape(alpha.shape[0], SCALE, alpha.shape[1], SCALE).swapaxes(1, 2)
    full, empty = samples.min(axis=(2, 3)) == 1, samples.max(axis=(2, 3)) == 0
    nearest = rendered_depth[::SCALE, ::SCALE]
    color = np.rint(255 * oracle.encode(rendered[rendered[..., 3] == 1][0, :3]))
    before, behind = full & (nearest < 4.99), full & (nearest > 5.01) & (alpha == 1)
    assert before.sum() > 500
    assert behind.sum() > 500
    assert (got[before][:, :3] == color).all()
    assert np.array_equal(got[behind][:, :3], drawing[behind][:, :3])
    # Away from the hoop the drawing's own bytes come back, soft rims included.
    kept = empty & (alpha > 0)
    assert np.array_equal(got[kept], drawing[kept])
