"""The umbrella: in the hand, over the head in every frame, and dry under it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.engine import simulate_scene
from pegbar.simulate.figure import body_height, marker
from pegbar.simulate.meshes import Models
from pegbar.simulate.particles import FALLING, PHASE, ParticleEngine
from pegbar.simulate.presets import preset_elements
from pegbar.simulate.rapier import RapierEngine
from pegbar.simulate.scene import SimulationScene
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
        near = np.hypot(*(places - middle)[:, [0, 2]].T) < 0.3 * tall
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
            shaft = places[8 * 40 :]
            axis = shaft[8:].mean(axis=0) - shaft[:8].mean(axis=0)
            gap = np.cross(hand[frame] - shaft[:8].mean(axis=0), axis / np.linalg.norm(axis))
            assert np.linalg.norm(gap) < 1e-6
            assert places[: 8 * 40, 1].min() > head[frame, 1]


def test_the_steadier_hand_holds_it_and_gores_have_two_colours():
    figure = walker(FRAMES)
    markers = figure.markers.copy()
    index = figure.marker_names.index("left_hand")
    markers[:, index, 1] += 0.3 * np.sin(np.arange(FRAMES))
    (umbrella,) = preset_elements("umbrella", replace(figure, markers=markers), color="#0000ff", second="#ffffff")
    assert umbrella.pin.target == "right_hand"
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
        ({"length": 1}, "no setting 'length': there are size, clearance, hand"),
    ],
)
def test_wrong_settings_are_named(settings, told):
    with pytest.raises(ValueError, match=told):
        preset_elements("umbrella", walker(2), **settings)
