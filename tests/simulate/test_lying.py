"""Snow as a preset lays it: over all that the cameras see, as deep as shoes allow, pressed where feet are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pegbar import _kernels
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.volumes import TaperedCylinders
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.engine import simulate_scene
from pegbar.simulate.field_meshes import cast_on_fields, lines_of
from pegbar.simulate.fields import SnowField, places_of
from pegbar.simulate.figure import body_height, marker
from pegbar.simulate.floor import ankle_height, seen_ground, soles
from pegbar.simulate.meshes import Models, volume_meshes
from pegbar.simulate.particles import FREE, PHASE, SETTLED, ParticleEngine
from pegbar.simulate.passes import render_passes
from pegbar.simulate.presets import preset_elements
from pegbar.simulate.scene import Character, SimulationScene
from tests.walkers import walker

FRAMES = 24
#: Level, rolled, and from above: the first two see the horizon.
CAMERAS = {
    "level": PerspectiveCamera.look_at((1, 1.0, 6), (0.5, 1.0, 0), (96, 54), 0.9),
    "turned": PerspectiveCamera.look_at((4, 1.3, 4), (0, 0.9, 0.5), (54, 96), 0.7, up=(0.1, 1, 0)),
    "above": PerspectiveCamera.look_at((0, 5, 3), (0, 0, 0.5), (96, 54), 0.8),
}


def grown(figure: Character, factor: float) -> Character:
    volumes = TaperedCylinders(*(factor * getattr(figure.volumes, name) for name in TaperedCylinders.__annotations__))
    return replace(figure, markers=factor * figure.markers, volumes=volumes)


@pytest.fixture(scope="module")
def walked():
    """Snow that a walker has gone through."""
    figure = walker(FRAMES)
    cameras = (CAMERAS["level"],) * FRAMES
    (snow,) = preset_elements("snow_field", figure, ground=0.0, cameras=cameras)
    scene = SimulationScene(24, FRAMES, (snow,), (figure,), cameras, ground=0.0)
    cache = MemoryCache()
    simulate_scene(scene, cache, [ParticleEngine()])
    return scene, snow, cache


@pytest.mark.parametrize("view", CAMERAS)
def test_it_covers_all_the_ground_that_the_camera_sees(view):
    camera, figure = CAMERAS[view], walker(2)
    (snow,) = preset_elements("snow_field", figure, ground=0.1, cameras=(camera,) * 2)
    scene = SimulationScene(24, 2, (snow,), (figure,), (camera,) * 2, ground=0.1)
    cache = MemoryCache()
    simulate_scene(scene, cache, [ParticleEngine()])
    seen = render_passes(Models(scene).meshes(cache, 0), camera).coverage > 0
    columns, rows = np.meshgrid(np.arange(camera.image_size[0]), np.arange(camera.image_size[1]))
    rays = camera.unproject(np.stack([columns.ravel(), rows.ravel()], axis=1) + 0.0, np.ones(columns.size))
    fall = (camera.position - rays)[:, 1].reshape(seen.shape) / np.linalg.norm(rays - camera.position, axis=1).max()
    # Half a degree under the horizon the ground is 100 m away and more.
    assert seen[fall > 0.012].all()
    assert not seen[fall < -0.002].any()
    assert (view == "above") == seen.all()


def test_a_patch_is_as_large_as_asked_for_and_thins_out():
    figure = walker(FRAMES)
    (snow,) = preset_elements("snow_field", figure, ground=0.0, margin=0.5, cameras=(CAMERAS["level"],) * FRAMES)
    assert snow.beyond is None
    assert not snow.heights[snow.border].any()
    feet = np.concatenate([marker(figure, f"{side}_foot") for side in ("left", "right")])[:, [0, 2]]
    assert feet.min(axis=0) - snow.origin == pytest.approx(0.5 * body_height(figure))


def test_prints_are_where_feet_are_and_only_there(walked):
    scene, snow, cache = walked
    figure, pressed = scene.characters[0], cache.read("snow_field", FRAMES - 1)["pressed"]
    x, z = places_of(snow, pressed.shape)
    shoes, depth = snow.soles, snow.heights.max()
    trodden = np.zeros(pressed.shape, bool)
    across, along = np.meshgrid(x, z)
    ground = np.stack([across, 0 * across + depth, along], axis=-1).reshape(-1, 3)
    for frame in range(0, FRAMES):
        low = shoes[frame][shoes[frame][:, 1] - shoes[frame][:, 3] < depth]
        if len(low):
            flat = np.ascontiguousarray(low * np.array([1, 0, 1, 1, 1, 0, 1, 1]) + np.array([0, depth, 0, 0] * 2))
            trodden |= (_kernels.capsule_distances(ground, flat)[0] < 0.05).reshape(pressed.shape)
    assert 0.01 < trodden.mean() < 0.2
    assert not pressed[~trodden].any()
    shoe = 0.1 * 0.15**2 * body_height(figure) ** 2
    assert (pressed > 0.5 * snow.compaction * depth).sum() * snow.spacing**2 > 2 * shoe
    # Under an ankle that stands it is pressed hard, beside it snow stands higher than it lay.
    lowest = np.array([marker(figure, f"{side}_foot")[:, 1].argmin() for side in ("left", "right")])
    for side, frame in zip(("left", "right"), lowest, strict=True):
        ankle = marker(figure, f"{side}_foot")[frame]
        i, j = np.searchsorted(z, ankle[2]), np.searchsorted(x, ankle[0])
        assert pressed[i, j] > 0.3 * snow.compaction * depth
    assert (cache.read("snow_field", FRAMES - 1)["heights"] - snow.heights).max() > 0.1 * depth


@pytest.mark.parametrize("factor", [0.4, 1.0, 3.0])
def test_it_is_as_deep_as_shoes_are_high(factor):
    figure = grown(walker(FRAMES), factor)
    tall = body_height(figure)
    lift = 0.05 * tall - ankle_height(figure, 0.0)
    (snow,) = preset_elements("snow_field", figure, ground=-lift, roughness=0.0)
    assert snow.heights.max() == pytest.approx(0.6 * 0.05 * tall)
    for ankle, depth in ((0.001, 0.012), (0.3, 0.05)):
        (snow,) = preset_elements("snow_field", figure, ground=-lift - (ankle - 0.05) * tall, roughness=0.0)
        assert snow.heights.max() == pytest.approx(depth * tall)
    flakes = preset_elements("snow", figure, ground=-lift)
    assert flakes[0].heights[0, 0] == pytest.approx(0.6 * 0.05 * tall)
    (snow,) = preset_elements("snow_field", figure, ground=0.0, depth=0.04, roughness=0.0)
    assert snow.heights.max() == pytest.approx(0.04 * tall)


def test_soles_lie_on_the_ground_along_the_way_and_are_as_long_as_feet():
    figure = walker(FRAMES, speed=1.2)
    tall = body_height(figure)
    rows = soles(figure, 0.0, tall)
    assert rows.shape == (FRAMES, 2, 8)
    heel, toe = rows[..., :3], rows[..., 4:7]
    np.testing.assert_allclose((toe - heel)[..., :2], 0, atol=1e-2)
    length = np.linalg.norm(toe - heel, axis=2) + rows[..., 3] + rows[..., 7]
    np.testing.assert_allclose(length, 0.154 * tall, rtol=0.01)
    assert (toe[..., 2] > heel[..., 2]).all(), "it walks along +Z"
    under = (heel[..., 1] - rows[..., 3]).min(axis=1)
    assert np.quantile(under, 0.1) == pytest.approx(0.0, abs=1e-9)
    ankles = np.stack([marker(figure, f"{side}_foot") for side in ("left", "right")], axis=1)
    share = ((ankles - heel) * (toe - heel)).sum(axis=2) / ((toe - heel) ** 2).sum(axis=2)
    np.testing.assert_allclose(share, 0.022 / 0.102, atol=1e-6)
    # Backwards the toes are behind.
    back = soles(walker(FRAMES, speed=-1.2), 0.0, tall)
    assert (back[..., 6] > back[..., 2]).all()
    # Who stands looks where the hips face, and feet that are limbs need none.
    stands = soles(walker(FRAMES, speed=0.0), 0.0, tall)
    np.testing.assert_allclose(stands[..., 4:7] - stands[..., :3], (toe - heel), atol=1e-6)
    limbs = (*figure.limb_markers[:-1], ("left_foot", "left_toe"))
    assert soles(replace(figure, limb_markers=limbs), 0.0, tall).shape == (FRAMES, 1, 8)


def test_the_ground_seen_goes_from_under_the_camera_to_the_farthest():
    low, high = seen_ground([CAMERAS["level"]], 0.0, 50.0)
    assert low[1] == pytest.approx(6 - 50 * np.cos(0.1), abs=5)
    assert high[1] >= 6
    near = seen_ground([CAMERAS["above"]] * 2, 0.0, 50.0)
    assert near[0][1] > -5


def test_flakes_beyond_the_field_become_snow_too_and_lie_under_none_of_it():
    figure = walker(6)
    field, flakes = preset_elements("snow", figure, ground=0.0, cameras=(CAMERAS["level"],) * 6)
    cache = MemoryCache()
    simulate_scene(SimulationScene(24, 6, (field, flakes), ground=0.0), cache, [ParticleEngine()])
    state = cache.read("snow", 5)
    phases, places = state["codes"][:, PHASE], state["positions"]
    assert not (phases == SETTLED).any(), "without a figure there is but snow to lie on"
    there = phases != FREE
    assert there.sum() > 1000
    assert places[there, 1].min() > field.heights[0, 0]
    # A patch of snow leaves the ground beside it bare.
    bare = replace(field, beyond=None)
    simulate_scene(SimulationScene(24, 6, (bare, flakes), ground=0.0), cache := MemoryCache(), [ParticleEngine()])
    assert (cache.read("snow", 5)["codes"][:, PHASE] == SETTLED).sum() > 100


def test_lines_grow_apart_to_the_corners_and_keep_the_nodes():
    field = SnowField("snow", (1.0, -2.0), 0.1, np.full((5, 7), 0.2), beyond=(-30.0, -2.0, 1.9, 40.0))
    x, z = lines_of(field)
    assert (x[0], x[-1], z[0], z[-1]) == pytest.approx((-30, 1.9, -2, 40))
    assert np.isclose(x[:, None], 1 + 0.1 * np.arange(7)).any(axis=0).all()
    assert (np.diff(x) > 0).all()
    steps = np.diff(z[z > -1.6 + 1e-9])
    np.testing.assert_allclose(steps[1:-1] / steps[:-2], 1.15)
    assert len(x) < 40
    assert lines_of(replace(field, beyond=None))[0].tolist() == places_of(field, (5, 7))[0].tolist()


def test_shadows_go_on_beyond_the_field(walked):
    scene, snow, cache = walked
    small = replace(snow, heights=np.full((5, 5), 0.1), origin=np.array([0.3, 0.3]), soles=None)
    scene = replace(scene, elements=(small,))
    cache = MemoryCache()
    simulate_scene(scene, cache, [ParticleEngine()])
    meshes = Models(scene).meshes(cache, 0)
    (mesh,) = cast_on_fields(scene, meshes, volume_meshes(scene, 0), light=(0, 1, 0), darkness=0.5)
    x, z = lines_of(small)
    dark = (mesh.colors[:, 0] < 0.6 * small.look.color[0]).reshape(len(z), len(x))
    places = np.stack(np.meshgrid(x, z), axis=-1)[dark]
    figure = scene.characters[0]
    ahead = np.array([marker(figure, name)[0, [0, 2]] for name in ("pelvis", "head")])
    assert len(places) > 20
    assert np.abs(places - ahead.mean(axis=0)).max() < 0.8
    assert mesh.vertices[:, 1] == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"depth": 0.0}, "depth: want a number above zero"),
        ({"depth": "deep"}, "depth: want a finite number"),
        ({"margin": -1.0}, "margin: want a finite number of zero or more"),
    ],
)
def test_wrong_settings_are_named(settings, told):
    with pytest.raises(ValueError, match=told):
        preset_elements("snow_field", walker(2), ground=0.0, **settings)
    with pytest.raises(ValueError, match="soles: want shape"):
        SnowField("snow", (0, 0), 0.1, np.ones((5, 5)), soles=np.zeros((2, 8)))
    with pytest.raises(ValueError, match="beyond: want shape"):
        SnowField("snow", (0, 0), 0.1, np.ones((5, 5)), beyond=(1, 2))
