"""Loops: the seam is as smooth as the rest."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pegbar import Motion, close_loop, read_motion
from tests.motions import swaying


def jolts(motion, travel):
    """Largest second difference of any joint at the seam, and the usual one, in two turns of the loop."""
    places = np.concatenate([motion.positions, motion.positions + travel])
    sizes = np.linalg.norm(np.diff(places, 2, axis=0), axis=2).max(axis=1)
    count = len(motion.positions)
    return sizes[count - 2 : count].max(), np.quantile(sizes[: count - 3], 0.9)


@pytest.mark.parametrize("frames", [20, 24, 27, 45])
def test_a_cut_of_a_real_walk_runs_on(frames, test_data):
    walk = read_motion(test_data / "mocap/bvh/cmu_35_01.bvh").slice(1, None, 5).slice(5, 5 + frames)
    loop = close_loop(walk)
    assert loop.travel[1] == 0
    assert 0.04 < np.linalg.norm(loop.travel) / frames < 0.06  # metres a frame: it walks on at its pace
    seam, usual = jolts(loop.motion, loop.travel)
    assert seam < 1.5 * usual
    assert frames == 27 or jolts(walk, loop.travel)[0] > 2 * seam
    reach = min(round(0.3 * frames), 8)
    np.testing.assert_allclose(loop.motion.positions[reach + 1 : -reach - 1], walk.positions[reach + 1 : -reach - 1])
    for joint, parent in enumerate(walk.parents):
        if parent >= 0:
            lengths = np.linalg.norm(loop.motion.positions[:, joint] - loop.motion.positions[:, parent], axis=1)
            np.testing.assert_allclose(lengths, lengths[0], atol=1e-9)


def test_a_smooth_loop_hardly_changes():
    turn = 2 * np.pi * np.arange(24) / 24
    vectors = np.stack([0.5 * np.sin(turn), 0.3 * np.cos(turn), 0.2 * np.sin(2 * turn)], axis=1)
    turns = Rotation.from_rotvec(vectors).as_matrix()[:, None]
    spin = Motion(("a",), (-1,), 0.1 * vectors[:, None], turns, 24.0)
    closed = close_loop(spin)
    np.testing.assert_array_equal(closed.travel, 0)
    change = Rotation.from_matrix(np.swapaxes(closed.motion.rotations[:, 0], -1, -2) @ turns[:, 0]).magnitude()
    assert np.degrees(change).max() < 1
    assert np.abs(closed.motion.positions - spin.positions).max() < 2e-3


def test_speed_is_blended_as_well_as_place():
    # At its end it turns fast one way, at its beginning the other: equal poses alone would leave a kink.
    angle = np.concatenate([np.linspace(0, 1, 10), np.linspace(0.9, 0, 10)])
    turns = Rotation.from_rotvec(np.outer(angle, [0, 0, 1])).as_matrix()[:, None]
    spin = Motion(("a",), (-1,), np.zeros((20, 1, 3)), turns, 24.0)
    closed = close_loop(spin, blend=6).motion.rotations[:, 0]
    found = np.concatenate([Rotation.from_matrix(closed).as_rotvec()[:, 2]] * 2)
    assert np.abs(np.diff(found, 2))[17:21].max() < 0.75 * np.abs(np.diff(np.concatenate([angle] * 2), 2))[17:21].max()


def test_a_figure_on_the_spot_comes_back():
    motion = swaying(20)
    motion = motion.changed(positions=motion.positions - motion.positions[:, :1] * [1, 0, 1])
    closed = close_loop(motion)
    np.testing.assert_array_equal(closed.travel, 0)
    assert np.abs(closed.motion.positions[:, 0, [0, 2]]).max() < 1e-9


def test_wrong_arguments_are_named():
    with pytest.raises(ValueError, match="3 frames"):
        close_loop(swaying(2))
    assert len(close_loop(swaying(3)).motion.positions) == 3
    with pytest.raises(ValueError, match="blend"):
        close_loop(swaying(10), blend=6)
    points = Motion(("a", "b"), (-1, -1), np.zeros((5, 2, 3)), np.tile(np.eye(3), (5, 2, 1, 1)), 24.0)
    with pytest.raises(ValueError, match="skeleton"):
        close_loop(points)
