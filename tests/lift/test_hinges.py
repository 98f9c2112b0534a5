"""Knees that bend to one side."""

import numpy as np

from pegbar.lift.hinges import breaks, hinge


def leg(frames, swing=0.5, bend=0.7, phase=0.0, heading=0.0):
    """Hip, knee and foot (F, 3, 3) of a leg that swings along ``heading`` and bends its knee backwards."""
    time = np.arange(frames) / 5 + phase
    thigh = swing * np.sin(time)
    shin = thigh - bend * (0.55 + 0.45 * np.cos(time))

    def down(angle):
        forward = np.outer(np.sin(angle), [np.sin(heading), 0, np.cos(heading)])
        return forward + np.outer(-np.cos(angle), [0, 1, 0])

    hip = np.tile([0.0, 1.0, 0.0], (frames, 1))
    knee = hip + 0.45 * down(thigh)
    return np.stack([hip, knee, knee + 0.42 * down(shin)], axis=1)


def limbs(points):
    return points[:, 1] - points[:, 0], points[:, 2] - points[:, 1]


def test_a_knee_is_a_hinge_about_its_own_axis_and_a_back_is_none():
    for heading in (0.0, 2.0):
        joint = hinge(*limbs(leg(80, heading=heading)))
        assert joint is not None
        assert joint.steady.all()
        want = [np.cos(heading), 0, -np.sin(heading)]
        np.testing.assert_allclose(np.abs(joint.axes @ want), 1, atol=1e-9)
    assert hinge(*limbs(leg(80, bend=0.1))) is None
    upper, lower = limbs(leg(80))
    along = upper / np.linalg.norm(upper, axis=1)[:, None]
    mirrored = 2 * np.sum(lower * along, axis=1)[:, None] * along - lower
    to_and_fro = hinge(upper, np.where(np.arange(80)[:, None] % 2, lower, mirrored))
    assert to_and_fro is not None
    assert to_and_fro.steady.mean() < 0.2
    assert hinge(np.zeros((0, 3)), np.zeros((0, 3))) is None


def test_a_shin_before_its_thigh_breaks_the_knee():
    upper, lower = limbs(leg(80))
    joint = hinge(upper, lower)
    along = upper / np.linalg.norm(upper, axis=1)[:, None]
    # Mirrored in the thigh's line, within the plane of the leg.
    other = 2 * np.sum(lower * along, axis=1)[:, None] * along - lower
    bent = np.abs(np.cross(upper, lower)).max(axis=1) > 0.06 * 0.45 * 0.42
    np.testing.assert_array_equal(breaks(joint, upper, other, lower)[bent], True)
    assert not breaks(joint, upper, lower, other).any()
