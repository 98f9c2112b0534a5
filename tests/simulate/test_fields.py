"""Height fields: snow keeps its volume under feet and takes up flakes, a puddle's waves go as shallow water's do."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pegbar.scene.volumes import TaperedCylinders
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.engine import simulate_scene
from pegbar.simulate.field_meshes import cast_on_fields
from pegbar.simulate.fields import Puddle, SnowField
from pegbar.simulate.materials import Look
from pegbar.simulate.meshes import Models, volume_meshes
from pegbar.simulate.particles import ParticleEngine
from pegbar.simulate.presets import preset_elements
from pegbar.simulate.scene import Character, SimulationScene
from pegbar.simulate.wading import undersides
from pegbar.simulate.waves import PuddleRun
from pegbar.simulate.weather import ParticleMaterial, Particles
from tests.oracles import cloth as oracle
from tests.walkers import walker

SNOW = SnowField("snow", (-0.6, -0.45), 0.02, np.full((46, 61), 0.1))
POOL = Puddle("pool", (-1.0, -0.5), 0.02, np.ones((51, 101), bool), depth=0.04, damping=0.0)


def foot(frames: int, heights: np.ndarray) -> Character:
    """A level limb along x whose axis is at ``heights`` (F,), of radius 0.06."""
    start = np.stack([np.full(frames, -0.1), heights, np.zeros(frames)], axis=1)[:, None]
    radii = np.full((frames, 1), 0.06)
    volumes = TaperedCylinders(start, start + np.array([0.2, 0, 0]), radii, radii)
    return Character("foot", ("toe",), start, ("foot",), volumes)


def run(scene: SimulationScene) -> MemoryCache:
    cache = MemoryCache()
    simulate_scene(scene, cache, [ParticleEngine()])
    return cache


def volume(values: np.ndarray, element: SnowField | Puddle) -> float:
    return float(values.sum()) * element.spacing**2


def test_undersides_and_tops_are_those_of_the_exact_limb():
    row = np.array([-0.2, 0.3, -0.1, 0.08, 0.25, 0.22, 0.15, 0.12])
    x, z = np.linspace(-0.5, 0.5, 41), np.linspace(-0.4, 0.4, 33)
    ((part, under, over),) = undersides(row[None], x, z, 1.0)
    assert np.isfinite(under).sum() > 150
    # Spheres tell it apart from the limb only where it is nearly upright, at its outline.
    for i, j in np.argwhere(over - under > 0.1)[::7]:
        place = np.array([x[part[1]][j], 0.0, z[part[0]][i]])
        for height, out in ((under[i, j], -1), (over[i, j], 1)):
            place[1] = height
            assert oracle.capsule_distance(place, row) == pytest.approx(0.0, abs=2e-3)
            place[1] = height + 0.02 * out
            assert oracle.capsule_distance(place, row) > 0.005
    assert undersides(row[None], x, z, 0.05) == []
    assert undersides(row[None], x + 5, z, 1.0) == []


def test_a_foot_presses_the_snow_when_it_comes_and_all_snow_is_kept():
    heights = np.array([0.5, 0.3, 0.2, 0.09, 0.09, 0.3, 0.5])
    scene = SimulationScene(24, 7, (SNOW,), (foot(7, heights),), ground=0.0)
    cache = run(scene)
    states = [cache.read("snow", frame) for frame in range(7)]
    untouched = volume(SNOW.heights, SNOW)
    for state in states:
        assert volume(state["heights"] + state["pressed"], SNOW) == pytest.approx(untouched, rel=1e-12)
    # The underside comes to 0.03 over the ground in frame 3, and under the snow's 0.1 before frame 2's 0.14.
    np.testing.assert_array_equal(states[2]["heights"], SNOW.heights)
    middle = states[3]["heights"][22, 25:36]
    np.testing.assert_allclose(middle, 0.03, atol=2e-3)
    np.testing.assert_allclose(states[6]["heights"][22, 25:36], 0.03, atol=2e-3)
    rim = states[4]["heights"].max()
    assert 0.105 < rim < 0.16
    loose = states[4]["heights"].sum() - SNOW.heights.sum()
    assert loose == pytest.approx(-states[4]["pressed"].sum(), rel=1e-9)
    assert states[4]["pressed"].sum() > 0


def test_no_snow_is_left_in_a_foot_and_slopes_slide_to_the_angle_of_repose():
    scene = SimulationScene(24, 3, (replace(SNOW, repose=35.0),), (foot(3, np.full(3, 0.08)),), ground=0.0)
    state = run(scene).read("snow", 2)
    x, z = (SNOW.origin[axis] + 0.02 * np.arange(n) for axis, n in ((0, 61), (1, 46)))
    row = np.array([-0.1, 0.08, 0, 0.06, 0.1, 0.08, 0, 0.06])
    for i in range(15, 30):
        for j in range(20, 40):
            place = np.array([x[j], state["heights"][i, j] - 1e-3, z[i]])
            assert oracle.capsule_distance(place, row) > -4e-3, (i, j)
    free = state["heights"].copy()
    free[15:30, 20:41] = np.nan
    assert np.nanmax(np.abs(np.diff(free, axis=0))) < math.tan(math.radians(35)) * 0.02 * 1.3


def test_flakes_that_fall_on_snow_become_part_of_it():
    flakes = Particles("flakes", (-0.5, 0, -0.4), (0.5, 1, 0.4), 400, ParticleMaterial(0.01, stick=1.0, run_off=0.0))
    scene = SimulationScene(24, 12, (SNOW, flakes), ground=0.0)
    cache = run(scene)
    volumes = [volume(cache.read("snow", frame)["heights"], SNOW) for frame in range(12)]
    assert (np.diff(volumes) > 0).all()
    # What came down: the column that falls through the level of the snow in a frame, of its part over the field.
    fallen = 400 / 0.8 * 1.0 * 11 / 24 * 0.8
    each = 0.1 * 4 / 3 * math.pi * 0.01**3 * (1 + 0.4**2)
    assert volumes[-1] - volumes[0] == pytest.approx(fallen * each, rel=0.25)
    places = cache.read("flakes", 11)["positions"]
    phases = cache.read("flakes", 11)["codes"][:, 2]
    assert (places[phases == 1, 1] > 0.1).all(), "none is under the snow"


def test_a_wave_goes_at_the_root_of_g_times_depth():
    pool = replace(POOL, water=np.ones((5, 301), bool), origin=(0.0, 0.0))
    run_ = PuddleRun(pool, 0.0, 9.81)
    x = pool.spacing * np.arange(301)
    run_.heights = np.tile(1e-3 * np.exp(-(((x - 1.0) / 0.15) ** 2)), (5, 1))
    run_.rates = np.tile(math.sqrt(9.81 * 0.04) * 2 * (x - 1.0) / 0.15**2, (5, 1)) * run_.heights
    none = np.zeros((5, 0, 8))
    for _ in range(48):
        run_.advance(none, 1 / 96)
    # Two seconds: rows of four substeps at 24 frames a second.
    assert x[run_.heights[2].argmax()] == pytest.approx(1.0 + 2 * math.sqrt(9.81 * 0.04), abs=0.04)
    assert run_.heights.max() == pytest.approx(1e-3, rel=0.15)


def test_waves_keep_their_volume_reflect_and_never_grow():
    water = np.hypot(*np.meshgrid(np.linspace(-1, 1, 101), np.linspace(-1, 1, 51))) < 0.9
    run_ = PuddleRun(replace(POOL, water=water, spacing=0.004), 0.0, 9.81)
    run_.heights[25, 50] = 0.01
    none, most = np.zeros((5, 0, 8)), []
    for _ in range(200):
        run_.advance(none, 1 / 24)
        most.append(np.abs(run_.heights).max())
    assert run_.heights.sum() == pytest.approx(0.01, rel=1e-9)
    assert not run_.heights[~water].any()
    assert max(most) < 0.011
    assert np.abs(run_.heights[5:45, 5:15]).max() > 1e-5, "they have come to the border"


def test_a_foot_displaces_its_volume_and_splashes():
    frames = 10
    heights = np.array([0.4, 0.3, 0.2, 0.06, 0.06, 0.06, 0.06, 0.2, 0.3, 0.4])
    pool = replace(POOL, drops="drops")
    drops = Particles("drops", (-2, -1, -2), (2, 3, 2), 0, ParticleMaterial(0.006, terminal_velocity=9.0))
    scene = SimulationScene(24, frames, (pool, drops), (foot(frames, heights),), ground=0.0)
    cache = run(scene)
    for frame in range(frames):
        state = cache.read("pool", frame)
        assert volume(state["heights"], pool) == pytest.approx(volume(state["taken"], pool), abs=1e-12)
    # A cylinder of radius 0.06 lying 0.04 deep, 0.2 long, and its two round ends (a cap of the sphere together).
    cap, segment = (
        math.pi * 0.04**2 * (0.06 - 0.04 / 3),
        0.06**2 * math.acos(1 / 3) - 0.02 * math.sqrt(0.06**2 - 0.02**2),
    )
    assert volume(cache.read("pool", 4)["taken"], pool) == pytest.approx(0.2 * segment + cap, rel=0.03)
    assert volume(cache.read("pool", 8)["taken"], pool) == 0
    flying = [int((cache.read("drops", frame)["codes"][:, 2] != 0).sum()) for frame in range(frames)]
    assert flying[2] == 0
    assert flying[3] > 5
    state = cache.read("drops", 3)
    there = state["codes"][:, 2] != 0
    assert (state["positions"][there, 1] > 0.03).all()
    assert cache.read("pool", 3)["heights"].std() > 1e-3


def test_rain_makes_ripples_and_no_water():
    drops = ParticleMaterial(0.003, terminal_velocity=7.0, run_off=0.0)
    rain = Particles("rain", (-0.5, 0, -0.3), (0.5, 2, 0.3), 200, drops)
    cache = run(SimulationScene(24, 6, (POOL, rain), ground=0.0))
    heights = cache.read("pool", 5)["heights"]
    assert heights.std() > 1e-5
    assert abs(heights.sum()) < 1e-9


def test_a_run_that_is_taken_up_ends_in_the_same_bits():
    figure = walker(8)
    elements = [e for kind in ("snow", "puddle") for e in preset_elements(kind, figure, ground=0.0)]
    scene = SimulationScene(24, 8, tuple(elements), (figure,), ground=0.0)
    whole, cut = run(scene), run(scene)
    for element in elements:
        cut.clear(element.name, 3)
    simulate_scene(scene, cut, [ParticleEngine()])
    for element in elements:
        for key, values in whole.read(element.name, 7).items():
            np.testing.assert_array_equal(values, cut.read(element.name, 7)[key], f"{element.name} {key}")


def test_the_mesh_is_the_surface_with_its_normals_and_the_colour_of_what_is_pressed():
    heights = np.array([0.5, 0.07, 0.07])
    scene = SimulationScene(24, 3, (SNOW,), (foot(3, heights),), ground=1.0)
    cache = run(replace(scene, characters=(foot(3, heights + 1),)))
    (mesh,) = Models(scene).meshes(cache, 2)
    state = cache.read("snow", 2)
    np.testing.assert_allclose(mesh.vertices[:, 1], 1 + state["heights"].ravel())
    x, z = mesh.vertices[:, 0].reshape(46, 61), mesh.vertices[:, 2].reshape(46, 61)
    assert (x[0, 0], z[0, 0]) == tuple(SNOW.origin)
    assert (x[0, 1] - x[0, 0], z[1, 0] - z[0, 0]) == pytest.approx((0.02, 0.02))
    grid = mesh.normals.reshape(46, 61, 3)
    np.testing.assert_allclose(grid[2, 2], (0, 1, 0), atol=1e-9)
    assert grid[15:22, 30, 2].max() > 0.1, "the print's far side looks to +z"
    assert grid[23:30, 30, 2].min() < -0.1
    colors = mesh.colors.reshape(46, 61, 4)
    np.testing.assert_allclose(colors[2, 2], SNOW.look.color, atol=1e-6)
    assert np.abs(colors[22, 30] - np.array(SNOW.look.second)).max() < 0.1


def test_shadows_fall_on_the_field_where_the_light_does_not_come():
    scene = SimulationScene(24, 1, (replace(SNOW, look=Look((1, 1, 1, 1))),), (foot(1, np.array([0.4])),), ground=0.0)
    meshes = Models(scene).meshes(run(scene), 0)
    (lit,) = cast_on_fields(scene, meshes, volume_meshes(scene, 0), light=(0, 1, 0), darkness=0.5)
    dark = (lit.colors[:, 0] == 0.5).reshape(46, 61)
    # A node that the shadow's edge touches is dark: half a node more all around.
    outline = 0.4 + 2 * math.pi * 0.06
    assert dark.sum() * 0.02**2 == pytest.approx(0.2 * 0.12 + math.pi * 0.06**2 + 0.01 * outline, rel=0.1)
    assert dark[22, 30]
    assert (meshes[0].colors[:, 0] == 1).all()
    (other,) = cast_on_fields(scene, meshes, volume_meshes(scene, 0), light=(1, 1, 0), darkness=0.5)
    assert (other.colors[:, 0] == 0.5).reshape(46, 61)[22, 15], "0.3 m to the side that is away from the light"


@pytest.mark.parametrize(
    ("kind", "settings", "told"),
    [
        ("snow", {"depth": -1.0}, "depth: want a finite number of zero or more"),
        ("snow_field", {"depth": 0.0}, "depth: want a number above zero"),
        ("snow_field", {"softness": 1.5}, "softness 0 to 1"),
        ("snow_field", {"repose": 95.0}, "repose: want less than 90"),
        ("puddle", {"depth": "deep"}, "depth: want a number, got .deep."),
        ("puddle", {"size": 0.0}, "size: want a number above zero"),
        ("puddle", {"splash": -1}, "splash: want a finite number of zero or more"),
    ],
)
def test_wrong_settings_are_named(kind, settings, told):
    with pytest.raises(ValueError, match=told):
        preset_elements(kind, walker(2), ground=0.0, **settings)


def test_fields_want_a_ground_and_grids_of_sense():
    for kind in ("snow_field", "puddle"):
        with pytest.raises(ValueError, match="want a ground for it to lie on"):
            preset_elements(kind, walker(2), ground=None)
    with pytest.raises(ValueError, match="ground: snow wants a ground to lie on"):
        SimulationScene(24, 1, (SNOW,))
    with pytest.raises(ValueError, match="snow: want a grid of 3 x 3"):
        replace(SNOW, heights=np.zeros((2, 9)))
    with pytest.raises(ValueError, match="heights: want depths of zero or more"):
        replace(SNOW, heights=np.full((9, 9), -1.0))
    with pytest.raises(ValueError, match="water: want water somewhere"):
        replace(POOL, water=np.zeros((9, 9), bool))
    with pytest.raises(ValueError, match="water: want .rows, columns. bool"):
        replace(POOL, water=np.zeros((9, 9)))
    assert len(preset_elements("snow", walker(2), ground=None)) == 1
    assert [e.name for e in preset_elements("snow", walker(2), ground=0.0)] == ["snow_field", "snow"]
