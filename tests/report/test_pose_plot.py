import numpy as np
import pytest

from pegbar import Motion, read_motion
from pegbar.report.pose_plot import plot_poses
from tests.clips import bvh

LEFT, RIGHT, FLOOR = (31, 111, 208), (208, 58, 43), (138, 109, 59)


@pytest.fixture
def motion(tmp_path):
    (tmp_path / "a.bvh").write_text(bvh())
    return read_motion(tmp_path / "a.bvh")


def panel(picture, number):
    third = picture.shape[1] // 3
    return picture[:, number * third : (number + 1) * third, :3].astype(int)


def places(pixels, color):
    """Rows and columns of nearly ``color``."""
    return np.argwhere(np.abs(pixels - color).max(axis=2) < 12)


def test_views_show_sides_floor_and_front(motion):
    picture = plot_poses(motion, [0], title="walk")
    assert picture.dtype == np.uint8
    assert picture.shape[2] == 4
    front, side, above = (panel(picture, number) for number in range(3))
    # Seen from the front the person's left is at the right; from above too, with the front at the bottom.
    for view in (front, above):
        assert places(view, LEFT)[:, 1].mean() > places(view, RIGHT)[:, 1].mean() + 50
    # The floor is below the feet, and not drawn from above.
    for view in (front, side):
        assert places(view, FLOOR)[:, 0].mean() > places(view, LEFT)[:, 0].max() - 5
    assert len(places(above, FLOOR)) < 5
    # From the left the toes point to the left of the picture: the lowest blue is there.
    blue = places(side, LEFT)
    assert blue[blue[:, 0] > blue[:, 0].max() - 4, 1].min() < np.median(blue[:, 1]) - 10


def test_later_poses_are_darker(motion):
    _, side, _ = (panel(plot_poses(motion, [0, 29]), number) for number in range(3))
    # It walks to the left of the picture: there stands the last pose in full colour, the first at the right is pale.
    full, colored = places(side, LEFT), np.argwhere(np.ptp(side, axis=2) > 20)
    assert len(full) > 100
    assert full[:, 1].max() < side.shape[1] * 0.5
    assert (colored[:, 1] > side.shape[1] * 0.6).sum() > 100


def test_eight_poses_without_the_t_pose_by_default(motion):
    np.testing.assert_array_equal(plot_poses(motion), plot_poses(motion, [0, 4, 8, 12, 17, 21, 25, 29]))
    marked = motion.changed(rest_frame=0)
    np.testing.assert_array_equal(plot_poses(marked), plot_poses(motion, [1, 5, 9, 13, 17, 21, 25, 29]))


def test_missing_points_leave_gaps(motion):
    gone = motion.positions.copy()
    gone[:, motion.names.index("left_knee")] = np.nan
    assert len(places(panel(plot_poses(motion.changed(positions=gone), [3]), 0), LEFT)) > 0


@pytest.mark.parametrize("count", [1, 3, 4, 7])
def test_any_number_of_poses(motion, count):
    picture = plot_poses(motion, range(count))
    assert len(places(panel(picture, 1), LEFT)) > 100


@pytest.mark.parametrize("frame", [-1, 30])
def test_frames_that_are_not_there_are_named(motion, frame):
    with pytest.raises(ValueError, match=f"^frames: the motion has no frame {frame}"):
        plot_poses(motion, [3, frame])


def test_nothing_to_draw_is_an_error(motion):
    for empty in (motion.slice(0, 0), Motion(("a",), (-1,), np.zeros((2, 1, 3)), np.zeros((2, 1, 3, 3)), 24)):
        with pytest.raises(ValueError, match="^motion: want frames and canonical markers"):
            plot_poses(empty)
