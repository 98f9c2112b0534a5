"""The umbrella: in the hand, over the head in every frame, and dry under it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.elements import Pin, Prop
from pegbar.simulate.engine import simulate_scene
from pegbar.simulate.figure import body_height, marker
from pegbar.simulate.meshes import Models
from pegbar.simulate.particles import FALLING, PHASE, ParticleEngine
from pegbar.simulate.presets import preset_elements
from pegbar.simulate.rapier import RapierEngine
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.tracks import pin_track
from tests.walkers import walker

FRAMES = 16


def rained_on(**settings):
    """A walker with an umbrella in the rain, and what was simulated."""
    figure = walker(FRAMES)
    (umbrella,) = preset_elements("umbrella", figure, **settings)
    (rain,) = preset_elements("rain", figure, ground=0.0, count=6000, reach=0.6)
    scene = SimulationScene(24, FRAMES, (umbrella, rain), (figure,), ground=0.0)
    cache = MemoryCache()
    simulate_scene(scene, cache, [RapierEngine(), ParticleEngine()])
    return scene, cache


def test_no_drop_is_close_under_the_canopy():
    scene, cache = rained_on()
    tall = body_height(scene.characters[0])
    canopy = slice(0, 8 * 40)
    for frame in range(FRAMES):
        edge = cache.read("umbrella", frame)["positions"][canopy]
        middle, low = edge.mean(axis=0), edge[:, 1].min()
        state = cache.read("rain", frame)
        # What has run off the canopy falls slowly from its edge, and the umbrella may swing over it.
        there = state["codes"][:, PHASE] == FALLING
        places = state["positions"][there]
        near = np.hypot(*(places - middle)[:, [0, 2]].T) < 0.25 * tall
        assert (near & (places[:, 1] > edge[:, 1].max())).sum() > 3, "it rains on it"
        under = near & (places[:, 1] < low) & (places[:, 1] > low - 0.15 * tall)
        assert not under.any(), (frame, places[under])


def test_it_is_in_the_hand_and_over_the_head():
    figure = walker(FRAMES)
    for side in ("left", "right"):
        _, cache = rained_on(hand=side)
        hand, head = marker(figure, f"{side}_hand"), marker(figure, "head")
        for frame in range(FRAMES):
            places = cache.read("umbrella", frame)["positions"]
            low, axis, length = shaft(places)
            grip = hand[frame] - low
            assert np.linalg.norm(np.cross(grip, axis)) < 1e-6
            assert 0 < grip @ axis < length
            assert places[: 8 * 40, 1].min() > head[frame, 1]
            # The shaft goes past the head, whose radius is 0.11, and the canopy is over it.
            assert np.linalg.norm(np.cross(head[frame] - low, axis)) > 0.11
            middle = places[: 8 * 40].mean(axis=0)
            assert np.hypot(*(middle - head[frame])[[0, 2]]) < 0.25 * body_height(figure)


def shaft(places: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """The shaft's lower end, its direction and length."""
    rings = places[8 * 40 :].reshape(2, 8, 3).mean(axis=1)
    length = float(np.linalg.norm(rings[1] - rings[0]))
    return rings[0], (rings[1] - rings[0]) / length, length


@pytest.mark.parametrize("tilt", [0.0, 12.0, 35.0])
def test_a_hand_that_flings_about_tilts_it_no_more_than_asked_and_the_canopy_stays_calm(tilt):
    frames = 48
    figure = walker(frames, speed=0.0)
    markers, turn = figure.markers.copy(), 2 * np.pi * np.arange(frames) / 12
    hand = figure.marker_names.index("right_hand")
    middle = markers[:, figure.marker_names.index("right_shoulder")].mean(axis=0)
    markers[:, hand] = middle + 0.5 * np.stack([np.cos(turn), np.sin(turn), np.cos(2 * turn)], axis=1)
    figure = replace(figure, markers=markers)
    (umbrella,) = preset_elements("umbrella", figure, hand="right", tilt=tilt)
    scene = SimulationScene(24, frames, (umbrella,), (figure,))
    places = pin_track(scene, umbrella.pin, umbrella.vertices)
    shapes = [shaft(each) for each in places]
    leans = np.degrees([np.arccos(min(1.0, axis[1])) for _, axis, _ in shapes])
    assert leans.max() <= tilt + 1e-6
    assert leans.max() >= 0.9 * tilt
    assert np.ptp([length for _, _, length in shapes]) < 1e-9, "it is rigid"
    for (low, axis, length), grip in zip(shapes, markers[:, hand], strict=True):
        assert np.linalg.norm(np.cross(grip - low, axis)) < 1e-9
        assert 0 < (grip - low) @ axis < length
    # Nothing moves it up and down as fast as the hand goes.
    canopy = places[:, : 8 * 40].mean(axis=1)
    assert np.abs(np.diff(canopy[:, 1])).max() < 0.25 * np.abs(np.diff(markers[:, hand, 1])).max()
    assert (places[:, : 8 * 40, 1].min(axis=1) > marker(figure, "head")[:, 1]).all()


def test_what_is_led_along_a_path_turns_and_goes_with_it():
    path = np.tile(np.eye(3, 4), (3, 1, 1))
    path[1] = [[0, 0, 1, 5], [0, 1, 0, 6], [-1, 0, 0, 7]]
    prop = Prop("rod", np.array([[1.0, 2, 3]]), np.empty((0, 3)), Pin("path", path=path))
    scene = SimulationScene(24, 3, (prop,))
    np.testing.assert_array_equal(
        pin_track(scene, prop.pin, prop.vertices)[:, 0], [(1, 2, 3), (3 + 5, 2 + 6, -1 + 7), (1, 2, 3)]
    )
    with pytest.raises(ValueError, match="pins: rod: path: want 4 frames, got 3"):
        SimulationScene(24, 4, (prop,))


def test_the_steadier_hand_holds_it_and_gores_have_two_colours():
    figure = walker(FRAMES)
    markers = figure.markers.copy()
    index = figure.marker_names.index("left_hand")
    markers[:, index, 1] += 0.3 * np.sin(np.arange(FRAMES))
    figure = replace(figure, markers=markers)
    (umbrella,) = preset_elements("umbrella", figure, color="#0000ff", second="#ffffff")
    low, axis, _ = shaft(umbrella.vertices)
    apart = [np.linalg.norm(np.cross(marker(figure, f"{s}_hand")[0] - low, axis)) for s in ("right", "left")]
    assert apart[0] < 1e-9 < apart[1]
    scene = SimulationScene(24, FRAMES, (umbrella,), (figure,))
    cache = MemoryCache()
    simulate_scene(scene, cache, [RapierEngine()])
    (mesh,) = Models(scene).meshes(cache, 0)
    gores = mesh.colors[: 8 * 40].reshape(8, 40, 4)
    np.testing.assert_array_equal(gores[::2, :, :3], np.tile(np.float32([0, 0, 1]), (4, 40, 1)))
    np.testing.assert_array_equal(gores[1::2, :, :3], np.ones((4, 40, 3)))


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"hand": "both"}, "hand: want left, right or auto"),
        ({"size": -1.0}, "size: want a finite number of zero or more"),
        ({"clearance": -0.1}, "clearance: want a finite number of zero or more"),
        ({"tilt": 80.0}, "tilt: want 0 to 60 degrees, got 80"),
        ({"length": 1}, "no setting 'length': there are size, clearance, hand, tilt"),
    ],
)
def test_wrong_settings_are_named(settings, told):
    with pytest.raises(ValueError, match=told):
        preset_elements("umbrella", walker(2), **settings)
