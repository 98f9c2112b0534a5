import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pegbar.puppet.limits import limited_swing, shown_across, towards_picture

#: A camera's right, down and forward that looks along -z, turned a little.
AXES = Rotation.from_euler("xyz", [4, 11, -3], degrees=True).apply(np.diag([1.0, -1.0, -1.0]))
RNG = np.random.default_rng(8)


def placed(right, down, deep):
    """World vectors with these coordinates in the camera's axes."""
    return np.stack(np.broadcast_arrays(right, down, deep), axis=-1).astype(float) @ AXES


def turned(degrees, vector):
    """A vector turned about the picture's down axis by each angle (F,)."""
    return Rotation.from_rotvec(np.radians(np.atleast_1d(degrees))[:, None] * AXES[1]).apply(vector)


def test_what_is_seen_as_long_as_drawn_stays():
    vectors = placed(0.5, -0.2, 0.3)[None].repeat(4, axis=0)
    shown = float(np.hypot(0.5, 0.2) / np.linalg.norm([0.5, 0.2, 0.3]))
    np.testing.assert_allclose(towards_picture(vectors, AXES, 0.85, shown), vectors)
    longer = placed(0.6, -0.2, 0.1)[None].repeat(4, axis=0)
    np.testing.assert_allclose(towards_picture(longer, AXES, 0.85, shown), longer)


def test_what_points_into_the_camera_is_seen_at_the_least_of_its_drawn_length():
    vectors = placed(np.full(9, 1e-9), 0.0, 2.0)
    for drawn in (1.0, 0.6):
        seen = towards_picture(vectors, AXES, 0.85, drawn) @ AXES.T
        np.testing.assert_allclose(np.hypot(seen[:, 0], seen[:, 1]), 2 * 0.85 * drawn, rtol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(seen, axis=1), 2)


def test_shoulders_that_are_as_drawn_stay():
    drawn = placed(0.2, 0.03, -0.1)
    tilt = Rotation.from_rotvec(np.radians([0, 10, -40])[:, None] * AXES[2])
    along = tilt.apply(drawn)
    np.testing.assert_allclose(shown_across(along, drawn, AXES, np.zeros(3), tilt), along, atol=1e-12)


def test_shoulders_move_freely_a_little_and_never_far():
    drawn = placed(0.2, 0.0, 0.0)
    angles = np.linspace(-55, 55, 221)
    along = turned(angles, drawn)
    seen = shown_across(along, drawn, AXES, angles, Rotation.identity(len(angles))) @ AXES.T
    free = np.abs(angles) < 5
    np.testing.assert_allclose(seen[free], (along @ AXES.T)[free], atol=1e-9)
    assert seen[:, 0].min() > 0.77 * 0.2
    assert np.ptp(seen[:, 2]) > 0.2
    assert np.linalg.norm(np.diff(seen, axis=0), axis=1).max() < 0.005


@pytest.mark.parametrize("turn", [180.0, -180.0, 540.0])
def test_a_figure_that_is_turned_over_has_its_shoulders_on_the_other_sides(turn):
    drawn = placed(0.2, 0.05, 0.0)
    along = turned(turn, drawn)
    seen = shown_across(along, drawn, AXES, np.full(1, turn), Rotation.identity(1)) @ AXES.T
    np.testing.assert_allclose(seen[0], [-0.2, 0.05, 0], atol=1e-9)


def test_a_bone_of_no_length_stays_none():
    nothing = np.zeros((3, 3))
    np.testing.assert_array_equal(shown_across(nothing, nothing[0], AXES, np.zeros(3), Rotation.identity(3)), nothing)


def test_depth_does_not_jump_where_a_shoulder_comes_through_the_picture():
    drawn = placed(0.2, 0.0, 0.0)
    # Raised by 40 degrees, and swung from before the picture to behind it.
    raised = Rotation.from_rotvec(np.radians(-40) * AXES[2]).apply(drawn)
    along = turned(np.linspace(-20, 20, 401), raised)
    seen = shown_across(along, drawn, AXES, np.zeros(401), Rotation.identity(401)) @ AXES.T
    assert np.abs(np.diff(seen[:, 2])).max() < 0.003
    assert seen[0, 2] * seen[-1, 2] < 0


def swung(degrees, drawn):
    """The angles by which `limited_swing` swings what a clip swings by ``degrees``."""
    clip = Rotation.from_rotvec(np.radians(degrees)[:, None] * AXES[2]).apply(drawn)
    made = limited_swing(clip, np.broadcast_to(drawn, clip.shape), AXES)
    np.testing.assert_allclose(np.linalg.norm(made, axis=1), 1)
    np.testing.assert_allclose(made @ AXES[2], clip @ AXES[2], atol=1e-12)
    own, seen = (np.arctan2(*(vectors @ AXES[[1, 0]].T).T) for vectors in (drawn[None], made))
    return np.degrees((seen - own + np.pi) % (2 * np.pi) - np.pi)


def test_an_animals_leg_swings_as_the_clips_and_never_up_through_the_trunk():
    drawn = placed(0.3, 0.9, 0.3) / np.linalg.norm([0.3, 0.9, 0.3])
    angles = np.arange(-179.5, 180, 0.5)
    made = swung(angles, drawn)
    near = np.abs(angles) <= 20
    np.testing.assert_allclose(made[near], angles[near], atol=1e-9)
    assert 45 < made.max() < 50
    np.testing.assert_allclose(made, -made[::-1], atol=1e-6)
    # Straight up is neither forwards nor backwards: it swings through there without a jump.
    assert np.abs(made[[0, -1]]).max() < 1
    assert np.abs(np.diff(made)).max() < 1
