import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import fill_hidden


def clip(seed, frames, count):
    random = np.random.default_rng(seed)
    projected = random.uniform(0, 500, (frames, count, 2))
    return projected, projected + random.normal(0, 9, projected.shape), random.random((frames, count)) > 0.4


@given(st.integers(0, 10**6), st.integers(0, 6), st.integers(0, 4))
def test_what_is_drawn_is_kept_and_what_is_hidden_is_flagged_and_placed(seed, frames, count):
    projected, markers, visible = clip(seed, frames, count)
    markers[~visible] = np.nan
    filled, guessed = fill_hidden(markers, visible, projected)
    np.testing.assert_array_equal(filled[visible], markers[visible])
    np.testing.assert_array_equal(guessed, ~visible)
    assert np.isfinite(filled).all()


@given(st.integers(0, 10**6), st.floats(-40, 40), st.floats(-40, 40))
def test_a_drawing_that_is_the_clip_beside_itself_is_found_again(seed, x, y):
    projected, _, visible = clip(seed, 7, 3)
    visible[2] |= not visible.any()
    markers = projected + np.array([x, y])
    filled, _ = fill_hidden(markers, visible, projected)
    np.testing.assert_allclose(filled, markers, atol=1e-9)


def test_differences_run_linearly_between_visible_frames_and_are_held_outside():
    projected = np.arange(12.0).reshape(6, 1, 2) ** 2
    visible = np.array([[False], [True], [False], [False], [True], [False]])
    markers = np.where(visible[..., None], projected, np.nan)
    markers[1] += [3, 0]
    markers[4] += [9, -6]
    filled, _ = fill_hidden(markers, visible, projected)
    want = [[3, 0], [3, 0], [5, -2], [7, -4], [9, -6], [9, -6]]
    np.testing.assert_allclose((filled - projected)[:, 0], want, atol=1e-12)


def test_a_marker_never_seen_takes_its_neighbours_difference_then_that_of_all():
    projected = np.zeros((1, 5, 2))
    markers = np.array([[[2.0, 0], [4, 0], [np.nan] * 2, [np.nan] * 2, [np.nan] * 2]])
    visible = [[True, True, False, False, False]]
    filled, _ = fill_hidden(markers, visible, projected, limbs=[(1, 2), (2, 3)])
    np.testing.assert_allclose(filled[0, :, 0], [2, 4, 4, 4, 3])


def test_a_drawing_that_shows_nothing_is_the_clip():
    projected = np.ones((2, 3, 2))
    filled, guessed = fill_hidden(np.full((2, 3, 2), np.nan), np.zeros((2, 3), bool), projected)
    np.testing.assert_array_equal(filled, projected)
    assert guessed.all()


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("markers", {"markers": [[[np.nan, 1]]]}),
        ("visible", {"visible": [[True, False]]}),
        ("visible", {"visible": [[1]]}),
        ("projected", {"projected": [[[np.nan, 1]]]}),
        ("limbs", {"limbs": [(0, 1)]}),
    ],
)
def test_wrong_arguments_are_named(name, change):
    good = {"markers": [[[0.0, 1]]], "visible": [[True]], "projected": [[[0.0, 1]]]}
    with pytest.raises(ValueError, match=f"^{name}: "):
        fill_hidden(**good | change)
