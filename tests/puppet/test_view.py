import numpy as np
import pytest

from pegbar.puppet.view import drawn_view, seen_pose, view_of
from pegbar.scene.body import MARKERS
from tests.figures import animal, clip, figure, marks


@pytest.mark.parametrize(
    ("azimuth", "view"),
    [
        (0, "front"),
        (-20, "front"),
        (45, "half profile"),
        (90, "side"),
        (-100, "side"),
        (140, "half back"),
        (180, "back"),
    ],
)
def test_views_stand_every_45_degrees(azimuth, view):
    assert view_of(azimuth) == view
    assert view_of(azimuth + 360) == view


@pytest.mark.parametrize("azimuth", [0, 45, 90, -90, 180])
def test_camera_pose_and_view_are_found_again(azimuth):
    motion = clip()
    found = seen_pose(figure(azimuth), motion)
    assert found.fitted
    assert found.frame == 3
    assert found.error < 1
    assert found.view == view_of(azimuth)
    assert abs((found.azimuth - azimuth + 180) % 360 - 180) < 8
    np.testing.assert_allclose(found.camera.project(found.pose), marks(azimuth), atol=3)


def test_a_wanted_view_is_taken_where_the_clip_has_it():
    found = seen_pose(figure(0), clip(), view="side")
    assert found.view == "side"
    with pytest.raises(ValueError, match="view: want one of front"):
        seen_pose(figure(), clip(), view="top")


def test_the_drawing_tells_its_view():
    assert [drawn_view(figure(azimuth)) for azimuth in (0, 90, 180)] == ["front", "side", "back"]


def test_an_animal_starts_as_drawn_seen_from_its_side():
    source = animal()
    found = seen_pose(source, clip())
    assert not found.fitted
    assert found.view == "side"
    assert found.azimuth == -90
    np.testing.assert_allclose(found.camera.project(found.pose), source.marks, atol=1e-6)
    depths = dict(zip(source.names, found.camera.depth(found.pose), strict=True))
    # It goes to the right of the picture: its right legs are nearer.
    assert depths["right_foot_f"] < depths["tail"] < depths["left_foot_f"]
    assert found.notes


def test_joints_that_nothing_moves_stay_where_they_are_drawn():
    source = figure(drives={name: name for name in MARKERS if name != "left_hand"})
    found = seen_pose(source, clip())
    hand = source.names.index("left_hand")
    np.testing.assert_allclose(found.camera.project(found.pose)[hand], source.marks[hand], atol=1e-6)


def test_a_clip_that_moves_too_little_is_refused():
    with pytest.raises(ValueError, match="moves four of the figure's joints or more, got 3"):
        seen_pose(figure(drives={name: name for name in ("head", "left_hand", "left_foot")}), clip())
    broken = clip()
    broken.positions[:, 5] = np.nan
    with pytest.raises(ValueError, match="want a frame in which all joints are known"):
        seen_pose(figure(), broken)
