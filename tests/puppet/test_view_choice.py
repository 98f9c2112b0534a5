import numpy as np
import pytest

from pegbar.align.pose_fit import PoseFit
from pegbar.puppet.view import _choice, near_side
from pegbar.scene.camera import PerspectiveCamera
from tests.figures import figure


def choose(errors, towards, wanted=None, near=0, beside=None):
    """The frame that is chosen of poses seen ``beside`` their front, in degrees, by a camera that turns with them."""
    size, count = (100, 100), len(errors)
    points = np.tile([[0, 1, 0], [0, 0, 0.0]], (count, 1, 1))
    matrices = []
    for azimuth in np.radians(np.add(towards, 0 if beside is None else beside)):
        place = 4 * np.array([np.sin(azimuth), 0, np.cos(azimuth)]) + [0, 0.5, 0]
        matrices.append(PerspectiveCamera.look_at(place, (0, 0.5, 0), size, 0.5).matrix)
    errors = np.array(errors, float)
    fit = PoseFit(errors, errors[:, None], errors, np.argsort(errors, kind="stable"), np.array(matrices), size)
    return _choice(fit, points, np.array(towards, float), wanted, near)


def test_of_poses_about_as_alike_one_faces_as_the_clip_mostly_does():
    frame, azimuth, view = choose([10, 12, 11.5, 30, 30], [100, 0, 5, 0, 0])
    assert frame == 2
    assert (azimuth, view) == (pytest.approx(0, abs=1e-6), "front")


def test_a_pose_that_is_clearly_most_alike_is_taken():
    assert choose([10, 14, 14, 30, 30], [100, 0, 5, 0, 0])[0] == 0
    assert choose([10, 11, 11, 11, 11], [10, 0, 5, 0, 0])[0] == 0
    assert choose([10, 11], [0, 0], wanted="side")[2] == "side"


def test_a_pose_that_shows_the_near_side_is_taken_before_a_likelier_one():
    poses = {"errors": [10, 12, 40, 41], "towards": [0, 0, 0, 0], "beside": [-80, -60, 50, 85]}
    assert choose(**poses)[0] == 0
    frame, azimuth, view = choose(**poses, near=1)
    assert (frame, azimuth, view) == (2, pytest.approx(50), "half profile")
    assert choose(**poses, near=1, wanted="side")[0] == 3
    assert choose(**poses, near=-1, wanted="half profile")[0] == 1
    # Where no pose shows it the likeliest is taken.
    assert choose(errors=[12, 10], towards=[0, 0], beside=[-80, -70], near=1)[0] == 1


@pytest.mark.parametrize(
    ("hidden", "near"),
    [
        ((), 0),
        (("chest",), 0),
        (("right_elbow",), 1),
        (("left_hip", "left_knee"), -1),
        (("left_hand", "right_hand", "right_elbow"), 1),
        (("left_hand", "right_hand"), 0),
    ],
)
def test_the_side_with_hidden_joints_is_the_far_one(hidden, near):
    assert near_side(figure(hidden=hidden)) == near
