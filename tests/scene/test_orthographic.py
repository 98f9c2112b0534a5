import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import OrthographicCamera

azimuths, elevations = st.floats(-180, 180), st.floats(-89, 89)
points = st.tuples(*[st.floats(-5, 5)] * 3)


@given(azimuths, elevations, points)
def test_it_stands_where_the_angles_say_and_sees_as_a_far_observer_would(azimuth, elevation, point):
    camera = OrthographicCamera.from_angles(azimuth, elevation, 50, (3, 4))
    a, e = math.radians(azimuth), math.radians(elevation)
    place = np.array([math.sin(a) * math.cos(e), math.sin(e), math.cos(a) * math.cos(e)])
    assert camera.depth(point) == pytest.approx(-np.dot(place, point), abs=1e-9)
    np.testing.assert_allclose(camera.project(10 * place), [3, 4], atol=1e-9)
    np.testing.assert_allclose(camera.unproject(camera.project(point), camera.depth(point)), point, atol=1e-9)
    assert np.linalg.det(camera.rotation) == pytest.approx(1)
    assert camera.elevation == pytest.approx(elevation, abs=1e-5)


def test_x_is_right_and_up_is_up():
    front = OrthographicCamera.from_angles(0, 0)
    np.testing.assert_allclose(front.project([[1, 0, 0], [0, 1, 0], [0, 0, 1]]), [[1, 0], [0, -1], [0, 0]], atol=1e-12)
    assert front.depth([0, 0, 1]) == -1
    side = OrthographicCamera.from_angles(90, 0)
    np.testing.assert_allclose(side.project([0, 0, 1]), [-1, 0], atol=1e-12)
    assert OrthographicCamera.from_angles(0, 30).project([0, 0, 1])[1] > 0
    assert side.azimuth == pytest.approx(90)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [((0, 91), "elevation"), ((math.nan, 0), "azimuth"), ((0, 0, 0), "scale"), ((0, 0, math.inf), "scale")],
)
def test_wrong_values_are_named(arguments, name):
    with pytest.raises(ValueError, match=name):
        OrthographicCamera.from_angles(*arguments)


def test_a_mirror_is_no_rotation():
    with pytest.raises(ValueError, match="rotation"):
        OrthographicCamera(np.diag([1, 1, -1]))
