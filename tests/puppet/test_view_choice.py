import numpy as np
import pytest

from pegbar.align.pose_fit import PoseFit
from pegbar.puppet.view import _choice
from pegbar.scene.camera import PerspectiveCamera


def choose(errors, towards, wanted=None):
    """The frame that is chosen of poses seen from the front by a camera that turns with them."""
    size, count = (100, 100), len(errors)
    points = np.tile([[0, 1, 0], [0, 0, 0.0]], (count, 1, 1))
    matrices = []
    for azimuth in np.radians(towards):
        place = 4 * np.array([np.sin(azimuth), 0, np.cos(azimuth)]) + [0, 0.5, 0]
        matrices.append(PerspectiveCamera.look_at(place, (0, 0.5, 0), size, 0.5).matrix)
    errors = np.array(errors, float)
    fit = PoseFit(errors, errors[:, None], errors, np.argsort(errors, kind="stable"), np.array(matrices), size)
    return _choice(fit, points, np.array(towards, float), wanted)


def test_of_poses_about_as_alike_one_faces_as_the_clip_mostly_does():
    frame, azimuth, view = choose([10, 12, 11.5, 30, 30], [100, 0, 5, 0, 0])
    assert frame == 2
    assert (azimuth, view) == (pytest.approx(0, abs=1e-6), "front")


def test_a_pose_that_is_clearly_most_alike_is_taken():
    assert choose([10, 14, 14, 30, 30], [100, 0, 5, 0, 0])[0] == 0
    assert choose([10, 11, 11, 11, 11], [10, 0, 5, 0, 0])[0] == 0
    assert choose([10, 11], [0, 0], wanted="side")[2] == "side"
