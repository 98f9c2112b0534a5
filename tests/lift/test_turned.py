"""Limbs turned by hand where the depth is the clip's."""

import numpy as np
import pytest

from pegbar import DegenerateError, PerspectiveCamera
from pegbar.lift.turned import turn_limbs

BONES = ((0, 1), (1, 2), (0, 3))


def scene():
    random = np.random.default_rng(0)
    cameras = [PerspectiveCamera.look_at((0.3 * f, 1.4, 4), (0, 1, 0), (640, 360), 0.7) for f in range(5)]
    markers = random.uniform((-0.5, 0.5, -0.5), (0.5, 1.5, 0.5), (5, 4, 3))
    return markers, np.stack([camera.matrix for camera in cameras]), cameras


def test_a_turned_limb_keeps_its_picture_and_what_hangs_on_it_moves_along():
    markers, matrices, cameras = scene()
    turned = turn_limbs(markers, matrices, BONES, [(0, 1, 3)])
    for frame, camera in enumerate(cameras):
        np.testing.assert_allclose(camera.project(turned[frame]), camera.project(markers[frame]), atol=1e-8)
        before, after = camera.depth(markers[frame]), camera.depth(turned[frame])
        if 1 <= frame < 3:
            assert after[1] - after[0] == pytest.approx(before[0] - before[1])
            assert after[2] - after[1] == pytest.approx(before[2] - before[1])
            np.testing.assert_allclose(after[[0, 3]], before[[0, 3]])
        else:
            np.testing.assert_allclose(turned[frame], markers[frame], atol=1e-12)


def test_turns_of_a_chain_do_not_depend_on_their_order_and_undo_each_other():
    markers, matrices, _ = scene()
    flips = [(0, 0, 5), (1, 2, 4)]
    once = turn_limbs(markers, matrices, BONES, flips)
    np.testing.assert_allclose(turn_limbs(markers, matrices, BONES, flips[::-1]), once, atol=1e-12)
    np.testing.assert_allclose(turn_limbs(once, matrices, BONES, flips), markers, atol=1e-9)
    assert turn_limbs(markers, matrices, BONES, []) is markers


def test_a_marker_behind_the_camera_is_named():
    markers, matrices, cameras = scene()
    markers[2, 1] = cameras[2].unproject(np.array([320.0, 180.0]), np.array(9.0))
    with pytest.raises(DegenerateError, match="hand"):
        turn_limbs(markers, matrices, BONES, [(0, 2, 3)], ("root", "hand", "tip", "other"))
