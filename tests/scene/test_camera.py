import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import DegenerateError, PerspectiveCamera

angle = st.floats(-1.2, 1.2)


@st.composite
def cameras(draw):
    azimuth, elevation, fov = draw(angle), draw(angle), draw(st.floats(0.2, 2.0))
    place = 4 * np.array(
        [
            math.sin(azimuth) * math.cos(elevation),
            math.sin(elevation),
            math.cos(azimuth) * math.cos(elevation),
        ]
    )
    return PerspectiveCamera.look_at(place, (0, 0, 0), (640, 360), fov), place, fov


@given(cameras(), st.floats(-50, 50).filter(lambda s: abs(s) > 1e-3))
def test_parts_are_recovered_from_a_matrix_of_any_scale(case, scale):
    camera, place, fov = case
    again = PerspectiveCamera(camera.matrix * scale, camera.image_size)
    np.testing.assert_allclose(again.position, place, atol=1e-9)
    assert again.field_of_view == pytest.approx(fov)
    np.testing.assert_allclose(again.rotation @ again.rotation.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(again.rotation) == pytest.approx(1)
    np.testing.assert_allclose(again.depth([0, 0, 0]), 4, atol=1e-9)


@given(cameras(), st.floats(-100, 800), st.floats(-100, 500), st.floats(0.1, 30))
def test_project_undoes_unproject(case, x, y, depth):
    camera = case[0]
    point = camera.unproject([x, y], depth)
    np.testing.assert_allclose(camera.project(point), [x, y], atol=1e-6)
    assert camera.depth(point) == pytest.approx(depth)


def test_axes_are_opencv_and_y_is_up_in_the_world():
    camera = PerspectiveCamera.look_at((0, 1, 5), (0, 1, 0), (101, 51), math.radians(90))
    np.testing.assert_allclose(camera.project([0, 1, 0]), [50, 25])
    assert camera.project([0, 2, 0])[1] < 25 < camera.project([0, 0, 0])[1]
    assert camera.project([1, 1, 0])[0] > 50
    assert camera.focal_length == pytest.approx(50.5)


def test_a_larger_picture_keeps_pixel_centres_at_integers():
    camera = PerspectiveCamera.look_at((0, 1, 5), (0, 1, 0), (100, 50), 1.0)
    point = [0.3, 1.2, -0.4]
    np.testing.assert_allclose(camera.scaled(3).project(point), 3 * camera.project(point) + 1)
    assert camera.scaled(3).image_size == (300, 150)


def test_wrong_cameras_are_refused():
    with pytest.raises(DegenerateError, match="singular"):
        PerspectiveCamera(np.zeros((3, 4)), (10, 10))
    with pytest.raises(ValueError, match="^image_size: "):
        PerspectiveCamera(np.eye(3, 4), (0, 10))
    with pytest.raises(ValueError, match="^matrix: "):
        PerspectiveCamera(np.eye(3), (10, 10))
    with pytest.raises(DegenerateError, match="target"):
        PerspectiveCamera.look_at((0, 0, 0), (0, 1, 0), (10, 10), 1.0)
