"""Dots drawn with soft rims over line art, and marks carried between key drawings."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import carry_marks, find_dots, moving_average, read_annotations
from pegbar.io.frames import read_picture
from pegbar.layer.matte import ink_alpha
from pegbar.report.canvas import Canvas

COLORS = [(255, 0, 0), (0, 160, 0), (0, 0, 255), (255, 0, 255), (255, 160, 0)]


def layer(places, radius=3.0, background=(255, 255, 255, 255)):
    canvas = Canvas(120, 90, background)
    if background[3]:
        canvas.polyline([(5, 5), (110, 80)], 2, (0, 0, 0))
        canvas.polyline([(5, 80), (110, 8)], 2, (90, 90, 90))
    for place, color in zip(places, COLORS, strict=False):
        canvas.circle(place, radius, color)
    return canvas.image()


@given(
    st.lists(st.tuples(st.floats(8, 20), st.floats(8, 80)), min_size=5, max_size=5),
    st.floats(2.0, 6.0),
    st.sampled_from([(255, 255, 255, 255), (0, 0, 0, 0)]),
)
def test_dots_are_found_to_a_third_of_a_pixel(places, radius, background):
    places = [(x + 22 * index, y) for index, (x, y) in enumerate(places)]
    found = find_dots(layer(places, radius, background), COLORS)
    np.testing.assert_allclose(found.places, places, atol=0.34)
    assert all(len(rivals) == 0 for rivals in found.rivals)


def test_missing_dots_and_second_spots_are_told():
    picture = layer([(20, 20), (50, 50)])
    picture[60:66, 90:96, :3] = COLORS[1]
    picture[70:72, 20:21, :3] = COLORS[0]
    found = find_dots(picture, COLORS)
    assert np.isnan(found.places[2:]).all()
    assert [len(rivals) for rivals in found.rivals] == [0, 1, 0, 0, 0]


def test_colours_too_near_to_tell_apart_are_refused():
    with pytest.raises(ValueError, match=r"colors: \[255, 0, 0\] and \[250, 10, 0\] are 11 apart"):
        find_dots(layer([]), [(255, 0, 0), (250, 10, 0)])
    with pytest.raises(ValueError, match="tolerance"):
        find_dots(layer([]), COLORS, tolerance=-1)


def test_marks_go_straight_between_keys_and_meet_them():
    marks = np.full((7, 2, 2), np.nan)
    marks[[1, 4], 0] = [[0, 0], [9, 3]]
    marks[2, 1] = [5, 5]
    there = np.isfinite(marks).all(axis=2)
    carried, flags = carry_marks(marks, there)
    np.testing.assert_allclose(carried[:, 0], [[0, 0], [0, 0], [3, 1], [6, 2], [9, 3], [9, 3], [9, 3]])
    np.testing.assert_allclose(carried[:, 1], 5)
    np.testing.assert_array_equal(flags, ~there)


def test_a_marker_without_any_mark_stays_unknown():
    carried, flags = carry_marks(np.zeros((3, 2, 2)), [[True, False]] * 3)
    assert np.isnan(carried[:, 1]).all()
    assert flags[:, 1].all()


def blob(place):
    canvas = Canvas(160, 120, (255, 255, 255, 255))
    chance = np.random.default_rng(4)
    for _ in range(30):
        canvas.circle(np.array(place) + chance.uniform(-22, 22, 2), chance.uniform(2, 5), chance.integers(0, 200, 3))
    return np.ascontiguousarray(canvas.image()[..., 0])


def test_flow_follows_what_moves_in_a_curve():
    turn = np.linspace(0, np.pi, 9)
    way = np.stack([80 - 40 * np.cos(turn), 75 - 30 * np.sin(turn)], axis=1)
    there = np.zeros((9, 1), bool)
    there[[0, 8]] = True
    straight, _ = carry_marks(way[:, None], there)
    flowing, _ = carry_marks(way[:, None], there, lambda frame: blob(way[frame]))
    assert np.linalg.norm(straight[4, 0] - way[4]) > 25
    assert np.linalg.norm(flowing[:, 0] - way, axis=1).max() < 2
    np.testing.assert_array_equal(flowing[[0, 8], 0], way[[0, 8]])


def test_the_average_keeps_lines_and_ends_and_evens_out_noise():
    line = np.stack([np.arange(9.0), 2 * np.arange(9.0)], axis=1)[:, None]
    np.testing.assert_allclose(moving_average(line, 5), line)
    noisy = line + np.random.default_rng(0).normal(0, 1, line.shape)
    assert np.abs(moving_average(noisy, 5) - line)[2:-2].std() < 0.7 * np.abs(noisy - line)[2:-2].std()
    np.testing.assert_allclose(moving_average(noisy, 5)[4], noisy[2:7].mean(axis=0))
    with pytest.raises(ValueError, match="odd"):
        carry_marks(line, np.ones((9, 1), bool), average=4)


def test_on_the_drawn_walk_flow_is_better_than_straight_lines(test_data):
    drawing = read_annotations(test_data / "annotated/morevna_side_walk/annotation.json")

    def gray(frame):
        return np.rint(255 - 255 * ink_alpha(read_picture(drawing.images[frame])))[::2, ::2].astype(np.uint8)

    marks, there = drawing.markers[:9] / 2, np.zeros((9, 16), bool)
    there[[0, 4, 8]] = True
    shown = drawing.visible[:9] & ~there
    errors = [
        np.linalg.norm(carry_marks(marks, there, pictures)[0] - marks, axis=2)[shown].mean()
        for pictures in (None, gray)
    ]
    assert errors[1] < 0.7 * errors[0]


def test_a_joint_that_is_hidden_from_a_drawing_on_goes_along_with_the_figure():
    walk = np.arange(6)[:, None] * np.array([10.0, 0])
    marks = walk[:, None] + np.array([(0.0, 0), (0, 20), (5, 10)])
    there = np.ones((6, 3), bool)
    there[1] = there[3] = False
    there[2:, 2] = False
    carried, flags = carry_marks(marks, there)
    np.testing.assert_allclose(carried, marks)
    assert flags[2:, 2].all()
