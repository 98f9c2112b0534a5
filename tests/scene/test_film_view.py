"""The camera over the paper: where its pixels lie, what leaves the paper, and the 3D camera that sees the same."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import PerspectiveCamera
from pegbar.scene.film_view import FilmView
from tests.oracles import reframe as oracle

places = st.floats(-500, 500)
views = st.builds(
    FilmView,
    st.tuples(st.integers(1, 400), st.integers(1, 400)),
    st.tuples(st.integers(1, 300), st.integers(1, 300)),
    places,
    places,
    st.floats(0.05, 20),
    st.floats(-720, 720),
)


@given(view=views, column=st.integers(0, 299), row=st.integers(0, 299))
def test_film_pixels_lie_where_the_definition_says(view, column, row):
    found = view.to_paper @ (column, row, 1)
    np.testing.assert_allclose(found[:2], oracle.place(view, column, row), atol=1e-8)
    np.testing.assert_allclose(view.to_film @ found, (column, row, 1), atol=1e-7)


def test_the_camera_s_moves_are_what_they_are_called():
    """Right and down by its pan, nearer by its zoom, and its right side goes down when it turns clockwise."""
    size = (100, 60)
    middle = np.array([49.5, 29.5, 1])
    assert (FilmView(size, size, 7, -3).to_paper @ middle)[:2].tolist() == [56.5, 26.5]
    assert np.ptp(FilmView(size, size, zoom=4).corners, axis=0).tolist() == [25, 15]
    right = FilmView(size, size, rotate=90).to_paper @ (59.5, 29.5, 1)
    assert right[:2].tolist() == [49.5, 39.5]


def test_at_rest_the_frame_is_in_the_middle_on_whole_pixels():
    assert FilmView((100, 60), (40, 31)).corners[0].tolist() == [29.5, 13.5]
    assert FilmView((40, 31), (100, 60)).corners[0].tolist() == [-30.5, -15.5]


@pytest.mark.parametrize(
    ("moved", "beyond", "sees"),
    [
        ({}, 0, True),
        ({"pan_x": 30}, 0, True),
        ({"pan_x": -31.5}, 1.5, True),
        ({"pan_y": 54}, 39, True),
        ({"pan_y": 55}, 40, False),
        ({"pan_x": 1000}, 970, False),
        ({"zoom": 0.5}, 5, True),
        ({"rotate": 45, "pan_x": -60, "pan_y": -60}, None, False),
        ({"rotate": 45, "pan_x": -50, "pan_y": -50}, None, True),
    ],
)
def test_what_leaves_the_paper_is_known(moved, beyond, sees):
    view = FilmView((100, 70), (40, 40), **moved)
    if beyond is not None:
        assert view.beyond == pytest.approx(beyond)
    assert view.sees_paper is sees


@given(view=views)
def test_a_frame_on_the_paper_sees_it_and_one_off_it_is_beyond(view):
    corners = view.corners
    if view.beyond == 0:
        assert view.sees_paper
        assert (corners > -0.5 - 1e-9).all()
        assert (corners < np.array(view.paper) - 0.5 + 1e-9).all()
    if not view.sees_paper:
        assert view.beyond > 0


@given(view=views, point=st.tuples(st.floats(-1, 1), st.floats(0, 2), st.floats(-1, 1)))
def test_the_3d_camera_sees_points_where_the_view_shows_them(view, point):
    camera = PerspectiveCamera.look_at((1.5, 1.4, 4), (0, 1, 0), view.paper, 0.8)
    moved = view.camera(camera)
    shown = view.to_film @ np.append(camera.project(point), 1)
    np.testing.assert_allclose(moved.project(point), shown[:2], rtol=1e-9, atol=1e-6)
    assert moved.depth(point) == pytest.approx(camera.depth(point))
    assert moved.image_size == view.size
    np.testing.assert_allclose(moved.position, camera.position, atol=1e-9)
    assert abs(moved.intrinsic[0, 1]) < 1e-7 * moved.focal_length
    assert moved.focal_length == pytest.approx(camera.focal_length * view.zoom)
