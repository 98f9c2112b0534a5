import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from pegbar import time_warp
from pegbar.align.times import smooth_curve, smooth_times


@st.composite
def tubes(draw):
    """A target in a tube as a time warp leaves it, and the durations between its entries."""
    count = draw(st.integers(2, 8))
    steps = st.lists(st.integers(0, 4), min_size=count, max_size=count)
    first = np.cumsum(draw(steps)).astype(float)
    last = np.maximum.accumulate(first + draw(steps))
    target = first + np.round((last - first) * draw(st.floats(0, 1)))
    spacing = np.array(draw(st.lists(st.integers(1, 3), min_size=count - 1, max_size=count - 1)), float)
    return np.maximum.accumulate(target), first - 0.5, last + 0.5, spacing


def energy(times, target, spacing, stiffness):
    steps = spacing / spacing.mean()
    changes = np.diff(np.diff(times) / steps)
    return ((times - target) ** 2).sum() + stiffness * (changes**2 / ((steps[:-1] + steps[1:]) / 2)).sum()


@given(tubes(), st.sampled_from([0.1, 10.0, 1e4]))
@settings(max_examples=40)
def test_no_other_times_in_the_tube_are_better(case, stiffness):
    target, low, high, spacing = case
    got = smooth_times(target, low, high, spacing, stiffness)
    assert ((got >= low) & (got <= high)).all()
    assert (np.diff(got) >= 0).all()
    order = {"type": "ineq", "fun": np.diff, "jac": lambda t: np.diff(np.eye(len(t)), axis=0)}
    start = (low + high) / 2
    arguments = (target, spacing, stiffness)
    other = minimize(energy, start, arguments, "SLSQP", bounds=list(zip(low, high, strict=True)), constraints=[order])
    assert energy(got, *arguments) <= energy(other.x, *arguments) + 1e-4 * (1 + abs(other.fun))


def test_long_plateaus_and_jumps_are_settled_too():
    rng = np.random.default_rng(0)
    curves = [np.cumsum(rng.normal(size=count)) for count in (60, 90)]
    warp = time_warp(abs(curves[0][:, None] - curves[1]), stiffness=0)
    low, high = warp.partners[:, 0] - 0.5, warp.partners[:, 1] + 0.5
    arguments = (warp.frames.astype(float), np.ones(59), 100.0)
    got = smooth_times(arguments[0], low, high, arguments[1], arguments[2])
    best = energy(got, *arguments)
    for _ in range(2000):
        other = np.clip(np.maximum.accumulate(got + rng.normal(0, 10 ** rng.uniform(-4, 0), 60)), low, high)
        assert energy(other, *arguments) > best - 1e-3
    order = {"type": "ineq", "fun": np.diff, "jac": lambda t: np.diff(np.eye(60), axis=0)}
    bounds = list(zip(low, high, strict=True))
    other = minimize(energy, got, arguments, "SLSQP", bounds=bounds, constraints=[order], options={"maxiter": 300})
    assert best <= other.fun * (1 + 1e-4) + 1e-3


def test_drawings_held_unevenly_run_evenly_in_film_time():
    holds = np.array([2, 2, 1, 1, 1, 3, 2, 2, 1, 1])
    film = np.concatenate([[0], np.cumsum(holds)[:-1]])
    frames = np.round(film * 0.7)
    even = smooth_times(frames, frames - 0.5, frames + 0.5, holds[:-1].astype(float), 1e5)
    np.testing.assert_allclose(np.diff(even) / holds[:-1], 0.7, atol=0.05)
    blind = smooth_times(frames, frames - 0.5, frames + 0.5, np.ones(9), 1e5)
    assert np.ptp(np.diff(blind) / holds[:-1]) > 0.3


def test_time_warp_hands_the_holds_on():
    cost = abs(np.array([0.0, 1, 2, 4, 6, 8])[:, None] - np.arange(9.0))
    held = time_warp(cost, holds=[1, 1, 2, 2, 2, 2], stiffness=1e4)
    np.testing.assert_allclose(held.times, [0, 1, 2, 4, 6, 8], atol=1e-3)
    assert abs(time_warp(cost, stiffness=1e4).times - held.times).max() > 0.1


def test_without_stiffness_the_times_are_the_frames():
    cost = np.random.default_rng(3).random((30, 40))
    warp = time_warp(cost, stiffness=0)
    np.testing.assert_array_equal(warp.times, warp.frames)


def test_a_curve_keeps_lines_and_halves_swings_of_the_period():
    frames = np.arange(600.0)
    line = np.stack([2 * frames, -frames], axis=1)
    np.testing.assert_allclose(smooth_curve(line, 40), line, atol=1e-6)
    for swing, share in ((40, 0.5), (80, 16 / 17), (20, 1 / 17)):
        wave = np.sin(2 * np.pi * frames / swing)
        middle = slice(200, 400)
        assert np.abs(smooth_curve(wave, 40)[middle]).max() == pytest.approx(share, abs=0.02)
    assert np.array_equal(smooth_curve(line[:2], 40), line[:2])
