import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from pegbar import Motion, film_times, retime, root_speeds, sample_markers, time_warp

PARENTS = (-1, 0, 1, 1, -1)
OFFSETS = np.array([[0, 0, 0], [0, 1, 0], [0.5, 0, 0], [0, 0, 0], [0, 0, 0]], float)


def clip(frames=9, rest_frame=None, seed=0):
    """A skeleton of two roots and four bones (one of no length) in random turns and places."""
    rng = np.random.default_rng(seed)
    local = Rotation.random(frames * 5, rng=rng).as_matrix().reshape(frames, 5, 3, 3)
    rotations, positions = local.copy(), rng.normal(size=(frames, 5, 3))
    for joint in (1, 2, 3):
        parent = PARENTS[joint]
        rotations[:, joint] = rotations[:, parent] @ local[:, joint]
        positions[:, joint] = positions[:, parent] + rotations[:, parent] @ OFFSETS[joint]
    return Motion(("a", "b", "c", "d", "e"), PARENTS, positions, rotations, 120.0, rest_frame), local


times = st.lists(st.floats(0, 8), max_size=5)


@given(times)
def test_bones_keep_their_lengths_and_joints_turn_by_slerp(wanted):
    motion, local = clip()
    got = retime(motion, wanted, frame_rate=24)
    assert got.positions.shape == (len(wanted), 5, 3)
    assert got.frame_rate == 24
    for joint in (1, 2, 3):
        bones = got.positions[:, joint] - got.positions[:, PARENTS[joint]]
        np.testing.assert_allclose(np.linalg.norm(bones, axis=1), np.linalg.norm(OFFSETS[joint]), atol=1e-9)
    for joint, parent in enumerate(PARENTS):
        above = got.rotations[:, parent] if parent >= 0 else np.eye(3)
        turns = np.swapaxes(above, -1, -2) @ got.rotations[:, joint]
        want = Slerp(np.arange(9), Rotation.from_matrix(local[:, joint]))(wanted).as_matrix() if wanted else turns
        np.testing.assert_allclose(turns, want, atol=1e-9)
    for root in (0, 4):
        want = [[np.interp(t, np.arange(9), motion.positions[:, root, k]) for k in range(3)] for t in wanted]
        np.testing.assert_allclose(got.positions[:, root], np.reshape(want, (-1, 3)), atol=1e-12)


def test_whole_frames_are_the_clips():
    motion = clip()[0]
    got = retime(motion, [0, 3, 8], frame_rate=24)
    np.testing.assert_allclose(got.positions, motion.positions[[0, 3, 8]], atol=1e-12)
    np.testing.assert_allclose(got.rotations, motion.rotations[[0, 3, 8]], atol=1e-12)


@pytest.mark.parametrize("rest", [0, 4, 8])
def test_the_rest_frame_is_never_blended_in(rest):
    motion, _ = clip(rest_frame=rest)
    spoilt = Motion(motion.names, PARENTS, motion.positions.copy(), motion.rotations.copy(), 120.0, rest)
    spoilt.positions[rest] += 1e6
    spoilt.rotations[rest] = np.eye(3)
    wanted = np.linspace(0, 8, 33)
    got, want = retime(spoilt, wanted, frame_rate=24), retime(motion, wanted, frame_rate=24)
    assert got.rest_frame is None
    np.testing.assert_array_equal(got.positions, want.positions)
    np.testing.assert_array_equal(got.rotations, want.rotations)
    neighbour = {0: 1, 8: 7}.get(rest)
    if neighbour is not None:
        np.testing.assert_allclose(got.positions[wanted == rest][0], motion.positions[neighbour], atol=1e-12)
    else:
        middle = (motion.positions[3, 0] + motion.positions[5, 0]) / 2
        np.testing.assert_allclose(got.positions[wanted == 4][0, 0], middle, atol=1e-12)


def test_points_run_linearly_and_missing_ones_stay_missing():
    points = np.random.default_rng(1).normal(size=(4, 3, 3))
    points[2, 1] = np.nan
    motion = Motion(("p", "q", "r"), (-1,) * 3, points, np.tile(np.eye(3), (4, 3, 1, 1)), 100.0)
    wanted = [0.25, 1.0, 1.5, 2.0, 3.0]
    got = retime(motion, wanted, frame_rate=24).positions
    np.testing.assert_allclose(got[0], 0.75 * points[0] + 0.25 * points[1], atol=1e-12)
    assert np.isnan(got).any(axis=2).tolist() == [[False, k in (2, 3), False] for k in range(5)]
    np.testing.assert_array_equal(got, sample_markers(points, wanted))
    assert np.array_equal(got[1], points[1])
    assert np.array_equal(sample_markers(points, [0.0, 0.5], rest_frame=0), points[[1, 1]])


def test_root_smoothing_steadies_the_travel_and_moves_the_figure_along():
    motion, _ = clip(200, seed=5)
    motion.positions[:, :4] += (np.arange(200) // 20)[:, None, None] * [1.0, 0, 0] - motion.positions[:, :1]
    wanted = np.linspace(0, 199, 150)
    plain, steady = (retime(motion, wanted, frame_rate=24, root_smoothing=s) for s in (0, 2.0))
    speeds = [np.diff(m.positions[:, 0, 0]) for m in (plain, steady)]
    assert speeds[1].max() < speeds[0].max() / 4
    apart = [m.positions[:, 1:4] - m.positions[:, :1] for m in (plain, steady)]
    np.testing.assert_allclose(apart[0], apart[1], atol=1e-9)
    assert np.array_equal(plain.positions[..., 1], steady.positions[..., 1])
    assert np.array_equal(plain.rotations, steady.rotations)


@given(st.lists(st.tuples(st.floats(0, 3), st.integers(1, 4)), max_size=6))
def test_film_times_hold_or_run_on(steps):
    drawn, holds = np.cumsum([s for s, _ in steps]), np.array([h for _, h in steps], int)
    starts = np.cumsum(holds) - holds
    stepped, running = (film_times(drawn, holds, stepped=way) for way in (True, False))
    assert len(stepped) == len(running) == holds.sum()
    for k, (start, hold) in enumerate(zip(starts, holds, strict=True)):
        assert (stepped[start : start + hold] == drawn[k]).all()
        if k + 1 < len(drawn):
            np.testing.assert_allclose(
                np.diff(running[start : start + hold + 1]), (drawn[k + 1] - drawn[k]) / hold, atol=1e-12
            )
        else:
            assert (running[start:] == drawn[-1]).all()


def test_speeds_of_a_root_that_travels_evenly():
    root = np.outer(np.arange(50), [0.03, 0.5, 0.04])
    curve = np.cumsum(np.random.default_rng(0).normal(size=50))
    speeds = root_speeds(root, time_warp(abs(curve[::2, None] - curve)), clip_rate=24, drawn_rate=24, holds=[2] * 25)
    np.testing.assert_allclose(speeds.clip, 1.2)
    np.testing.assert_allclose(speeds.warped, 1.2)
    np.testing.assert_allclose(speeds.smoothed, 1.2, atol=1e-3)
    assert str(speeds).splitlines()[2].split() == ["warped", "1.20", "1.20", "1.20"]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: retime(m, [8.5], frame_rate=24), r"^times: want 0 to 8.*got 8\.5"),
        (lambda m: retime(m, [-0.1], frame_rate=24), "^times: want 0 to 8"),
        (lambda m: retime(m, [np.nan], frame_rate=24), "^times: "),
        (lambda m: retime(m, [[1.0]], frame_rate=24), "^times: want shape"),
        (lambda m: retime(m, [1.0], frame_rate=0), "^frame_rate"),
        (lambda m: retime(m, [1.0], frame_rate=24, root_smoothing=-1), "^frame_rate, root_smoothing"),
        (lambda m: sample_markers(m.positions[:1], [0], rest_frame=0), "^times: .*rest frame"),
        (lambda m: sample_markers(m.positions[..., :2], [0]), "^markers: "),
        (lambda m: film_times([1.0], [0]), "^holds: "),
        (lambda m: film_times([1.0], [1, 1]), "^holds: "),
        (lambda m: root_speeds(np.zeros((3, 3)), time_warp(np.eye(3)), clip_rate=0, drawn_rate=1), "^clip_rate"),
        (lambda m: root_speeds(np.zeros((2, 3)), time_warp(1 - np.eye(3)), clip_rate=1, drawn_rate=1), "^times: "),
    ],
)
def test_wrong_arguments_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call(clip()[0])
