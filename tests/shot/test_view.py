"""Rendering a part of a picture gives the whole's pixels."""

import numpy as np

from pegbar import Ink, Mesh, PerspectiveCamera, render_passes, render_shadow
from pegbar.shot.view import LIGHT, View, lay_under, part_of, seen_window
from pegbar.simulate.layers import under

CAMERA = PerspectiveCamera.look_at((0.4, 1.2, 4), (0, 0.6, 0), (160, 90), 0.9)
BALL = Mesh(
    [[0.3, 0.5, 0.1], [0.7, 0.5, 0.1], [0.5, 0.9, 0.0], [0.5, 0.6, 0.4]],
    [[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]],
    (1, 0.2, 0.1, 1),
    3,
)


def rendered(camera):
    passes = render_passes([BALL], camera, samples=2, light=LIGHT, ink=Ink(1.5))
    return passes, render_shadow([BALL], camera, 0.0, samples=2, light=LIGHT)


def test_a_part_is_what_the_whole_has_there():
    passes, shadow = rendered(CAMERA)
    want = under(passes, shadow)
    window = seen_window(CAMERA, [BALL], [BALL], 0.0, 1.5)
    assert (window[2] - window[0]) * (window[3] - window[1]) < 0.5 * 160 * 90
    part, dark = rendered(part_of(CAMERA, window))
    lay_under(part, dark)
    view = View(CAMERA.image_size, window, part, dark)
    for rows in (slice(0, 90), slice(40, 41), slice(0, 60), slice(60, 90)):
        for got, wanted in zip(view.strip(rows.start, rows.stop, part.depth), (want.beauty, want.depth), strict=True):
            wanted = wanted[2 * rows.start : 2 * rows.stop]
            assert got.shape == wanted.shape
            assert np.isclose(got, wanted, atol=1e-5).mean() > 0.9995
    channels = view.channels()
    small = want.resolved()
    np.testing.assert_allclose(
        channels["Z"][np.isfinite(small.depth)].mean(), small.depth[np.isfinite(small.depth)].mean(), rtol=1e-3
    )
    assert abs(channels["shadow.A"].sum() - shadow.resolved().beauty[..., 3].sum()) < 1


def test_nothing_seen_is_one_pixel_and_what_is_too_near_is_everywhere():
    assert seen_window(CAMERA, [], [], 0.0, 1.0) == (0, 0, 0, 0)
    near = Mesh(BALL.vertices + np.array([0.0, 0.6, 3.8]), BALL.triangles, BALL.colors)
    assert seen_window(CAMERA, [near], [], 0.0, 1.0) == (0, 0, 159, 89)
