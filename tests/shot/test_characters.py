"""Drawn characters over film frames."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar.shot.characters import film_cameras

SIZE = (64, 48)


@given(st.lists(st.booleans(), min_size=1, max_size=12).filter(any))
def test_a_frame_without_a_drawing_has_the_camera_of_the_nearest_the_earlier_of_two(shown):
    """Against a comparison of all frames with all others."""
    rows = np.where(shown, np.cumsum(shown) - 1, -1)
    matrices = np.tile(np.eye(3, 4), (sum(shown), 1, 1))
    matrices[:, 0, 3] = np.arange(sum(shown))
    cameras = film_cameras(SimpleNamespace(matrices=matrices, image_size=SIZE), rows)
    known = [frame for frame, there in enumerate(shown) if there]
    nearest = [min(known, key=lambda other: (abs(other - frame), other)) for frame in range(len(shown))]
    assert [camera.matrix[0, 3] for camera in cameras] == [rows[frame] for frame in nearest]


def test_a_shot_without_marked_drawings_is_refused():
    with pytest.raises(ValueError, match="no frame of the shot shows a drawing"):
        film_cameras(SimpleNamespace(matrices=np.empty((0, 3, 4)), image_size=SIZE), np.array([-1, -1]))
