"""Drawings on film: steps, runs, other rates, loops."""

import numpy as np

from pegbar.shot.film import film_moments, on_film
from tests.motions import swaying

HOLDS = [2, 1, 2, 1]


def test_film_frames_hold_drawings_or_run_on():
    motion = swaying(4)
    stepped = on_film(motion, HOLDS, 24.0, stepped=True, rate=24.0, loop=False)
    np.testing.assert_allclose(stepped.positions[:, 0], motion.positions[[0, 0, 1, 2, 2, 3], 0], atol=1e-9)
    smooth = on_film(motion, HOLDS, 24.0, stepped=False, rate=24.0, loop=False)
    middle = (motion.positions[0, 0] + motion.positions[1, 0]) / 2
    np.testing.assert_allclose(smooth.positions[1, 0], middle, atol=1e-9)
    np.testing.assert_allclose(smooth.positions[-1], motion.positions[-1], atol=1e-9)


def test_one_frame_a_drawing_is_seen_when_the_drawing_is():
    seconds, places = film_moments(HOLDS, 24.0, stepped=True, rate="drawings", loop=False)
    np.testing.assert_allclose(seconds * 24, [0, 2, 3, 5])
    np.testing.assert_array_equal(places, [0, 1, 2, 3])
    seconds, places = film_moments(HOLDS, 24.0, stepped=True, rate="drawings", loop=True)
    np.testing.assert_allclose(seconds * 24, [0, 2, 3, 5, 6])
    assert on_film(swaying(4), HOLDS, 24.0, stepped=True, rate="drawings", loop=False).frame_rate == 16


def test_another_rate_shows_the_drawing_of_its_moment():
    seconds, places = film_moments(HOLDS, 24.0, stepped=True, rate=60.0, loop=False)
    assert len(seconds) == 15
    starts = np.array([0, 2, 3, 5]) / 24
    want = [np.flatnonzero(starts <= moment + 1e-9)[-1] for moment in seconds]
    np.testing.assert_array_equal(places, want)
    _, running = film_moments(HOLDS, 24.0, stepped=False, rate=60.0, loop=False)
    np.testing.assert_allclose(running, np.minimum(np.interp(seconds, starts, range(4)), 3))


def test_a_loop_ends_where_its_next_turn_begins():
    motion, travel = swaying(4), np.array([1.5, 0, 0.2])
    for stepped in (True, False):
        looped = on_film(motion, HOLDS, 24.0, stepped=stepped, rate=48.0, loop=True, travel=travel)
        assert looped.frame_rate == 48
        assert len(looped.positions) == 13
        np.testing.assert_allclose(looped.positions[-1], looped.positions[0] + travel, atol=1e-9)
        np.testing.assert_allclose(looped.rotations[-1], looped.rotations[0], atol=1e-9)
    np.testing.assert_allclose(
        on_film(motion, HOLDS, 24.0, stepped=False, rate=24.0, loop=True, travel=travel).positions[-2, 0],
        motion.positions[3, 0],
        atol=1e-9,
    )
