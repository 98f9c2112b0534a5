import numpy as np
import pytest

from pegbar.puppet.pose_blend import blend_poses, closed_loop, ease
from tests.puppets import arm_puppet, turned_poses

BONES = np.array([[0, 1], [1, 2]])


def test_bones_keep_their_lengths_between_poses():
    puppet = arm_puppet()
    first, second = turned_poses(puppet, [0.0, 150.0])
    found = blend_poses(BONES, first, second, np.linspace(0, 1, 9))
    assert np.allclose(found[0], first)
    assert np.allclose(found[-1], second)
    assert np.allclose(np.linalg.norm(np.diff(found, axis=1), axis=2), 0.5)
    way = np.diff(found, axis=1)[:, 0]
    angles = np.degrees(np.arctan2(way[:, 2], way[:, 0]))
    assert np.allclose(angles, np.linspace(0, 150, 9))


def test_opposite_bones_stay_finite():
    puppet = arm_puppet()
    first, second = turned_poses(puppet, [0.0, 180.0])
    assert np.isfinite(blend_poses(BONES, first, second, np.linspace(0, 1, 5))).all()


def test_shares_begin_and_end_slowly():
    shares = ease(9)
    assert shares[4] == pytest.approx(0.5)
    assert (np.diff(shares) > 0).all()
    assert shares[0] < 0.02
    assert shares[-1] > 0.98
    assert len(ease(0)) == 0


def test_a_movement_repeats_without_a_jump():
    puppet = arm_puppet()
    time = np.arange(100)
    degrees = 40 * np.sin(2 * np.pi * time / 40) + 0.02 * time
    poses = turned_poses(puppet, degrees)
    loop, length = closed_loop(BONES, poses, 30)
    assert length == len(loop)
    assert length in range(78, 83)
    steps = np.abs(np.diff(np.concatenate([loop, loop[:1]]), axis=0)).max(axis=(1, 2))
    assert steps[-1] < 1.3 * steps[:-1].max()
    assert np.allclose(np.linalg.norm(np.diff(loop, axis=1), axis=2), 0.5)
    assert np.array_equal(loop[:50], poses[:50])


def test_a_moment_is_not_looped():
    poses = turned_poses(arm_puppet(), [0.0, 1.0, 2.0])
    assert closed_loop(BONES, poses, 30) == (pytest.approx(poses), 3)
