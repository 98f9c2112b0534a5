import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pegbar.puppet.make import make_puppet
from pegbar.puppet.performance import Direction, perform
from pegbar.puppet.turning import shown_turn, turned_markers
from pegbar.scene.motion import Motion
from tests.figures import clip, figure

RATE = 30.0


def test_small_turns_are_the_clips_own():
    turned = np.linspace(-25, 25, 40)
    np.testing.assert_allclose(shown_turn(turned, RATE), turned)
    np.testing.assert_allclose(shown_turn(360 + turned, RATE), 360 + turned)


def test_the_figure_never_comes_to_its_edge_and_goes_on_turning():
    turned = np.linspace(0, 110, 200)
    shown = shown_turn(turned, RATE)
    assert shown.max() < 50
    assert (np.diff(shown) > 0).all()
    np.testing.assert_allclose(shown_turn(-turned, RATE), -shown)


def test_a_clip_that_turns_round_turns_the_figure_over_quickly():
    turned = np.concatenate([np.linspace(0, 180, 120), np.full(30, 180.0)])
    shown = shown_turn(turned, RATE)
    assert shown[-1] == pytest.approx(180, abs=1)
    assert (np.diff(shown) > -1e-9).all()
    # Seen from the edge, between 60 and 120 degrees, for a fifth of a second at most; and no jump.
    assert 1 <= ((shown > 60) & (shown < 120)).sum() <= RATE / 5
    assert np.diff(shown).max() < 40


def test_a_clip_that_stays_side_on_does_not_turn_the_figure_to_and_fro():
    turned = np.concatenate([np.linspace(0, 90, 60), 90 + 20 * np.sin(np.arange(300) / 5)])
    assert np.abs(shown_turn(turned, RATE)).max() < 50


def test_no_frames_turn_by_nothing():
    assert shown_turn(np.zeros(0), RATE).shape == (0,)


def test_markers_turn_as_one_body_and_the_way_with_them():
    rng = np.random.default_rng(3)
    markers = rng.normal(size=(20, 5, 3)) + np.cumsum(rng.normal(size=(20, 1, 3)), axis=0)
    np.testing.assert_allclose(turned_markers(markers, np.zeros(20), 2, 7), markers)
    turn = turned_markers(markers, np.full(20, 40.0), 2, 7)
    about = Rotation.from_euler("y", 40, degrees=True)
    # About where the root is in the anchor's frame, heights unchanged.
    middle = markers[7, 2]
    np.testing.assert_allclose(turn.reshape(-1, 3), about.apply((markers - middle).reshape(-1, 3)) + middle)
    np.testing.assert_allclose(turn[..., 1], markers[..., 1])


def test_a_foot_that_stands_in_a_turn_stands_in_the_limited_one():
    # The root goes round a foot that stands; turned back by as much as it turns, it goes straight past it.
    angles = np.linspace(0, 90, 200)
    arm = Rotation.from_euler("y", angles[:, None], degrees=True).apply([0.3, 0.9, 0])
    markers = np.stack([arm, np.zeros((200, 3))], axis=1)
    held = turned_markers(markers, -angles, 0, 0)
    np.testing.assert_allclose(held[:, 1] - held[:, 0], np.tile([-0.3, -0.9, 0], (200, 1)), atol=1e-9)
    assert np.ptp(held[:, 0, 0]) < 0.01
    assert np.ptp(held[:, 0, 2]) == pytest.approx(0.3 * np.pi / 2, rel=0.01)


def spun(degrees, still=60, turning=30):
    """The standing person's clip, that in its last frames is turned by up to ``degrees``."""
    angles = np.concatenate([np.zeros(still), np.linspace(0, degrees, turning), np.full(15, float(degrees))])
    still = clip(sway=0.0, frames=len(angles))
    turns = Rotation.from_euler("y", angles[:, None], degrees=True).as_matrix()
    places = np.einsum("fij,fnj->fni", turns, still.positions)
    return Motion(still.names, still.parents, places, still.rotations, still.frame_rate)


def test_a_performed_turn_leaves_the_trunk_broad():
    motion = spun(90)
    puppet = make_puppet(figure(), motion, completion="flat")
    made = perform(puppet, motion, Direction(frame_rate=30))
    assert puppet.view == "front"
    left, right = (puppet.names.index(f"{side}_shoulder") for side in ("left", "right"))
    seen = puppet.camera.project(made.poses)
    broad = seen[:, left, 0] - seen[:, right, 0]
    assert broad.min() > 0.6 * broad[0]
    assert "the clip turns the figure 8" in made.notes[0]
    assert "turns less" in made.notes[0]
    # Shoulders do turn: the far one is farther.
    depths = puppet.camera.depth(made.poses[-1])
    assert abs(depths[left] - depths[right]) > 0.1


def test_a_figure_whose_clip_turns_round_is_seen_mirrored():
    motion = spun(180)
    puppet = make_puppet(figure(), motion, completion="flat")
    made = perform(puppet, motion, Direction(frame_rate=30))
    assert np.isfinite(made.meshes).all()
    left, right = (puppet.names.index(f"{side}_shoulder") for side in ("left", "right"))
    first, last = puppet.camera.project(made.poses[[0, -1]])
    assert first[left, 0] - first[right, 0] == pytest.approx(last[right, 0] - last[left, 0], rel=0.1)
