"""Particles: how they fall, what they meet, that the air stays full, and the same bits every time."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from pegbar.errors import SimulationError
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.volumes import TaperedCylinders
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.elements import Pin, Prop
from pegbar.simulate.engine import simulate_scene
from pegbar.simulate.materials import Look, Wind
from pegbar.simulate.measures import measure_particles
from pegbar.simulate.meshes import Models
from pegbar.simulate.particles import DROPLET, FALLING, FREE, HOST, PHASE, SERIAL, SETTLED, SLIDING, ParticleEngine
from pegbar.simulate.presets import preset_elements
from pegbar.simulate.rapier import RapierEngine
from pegbar.simulate.scene import BARE, Character, SimulationScene
from pegbar.simulate.weather import ParticleMaterial, Particles
from tests.conftest import ROOT
from tests.walkers import walker

LOW, HIGH = (-1.0, 0.0, -1.0), (1.0, 3.0, 1.0)
SNOW = Particles("snow", LOW, HIGH, 300, ParticleMaterial(stick=1.0, run_off=0.0, settle=2.0))
RAIN = Particles(
    "rain", LOW, HIGH, 300, ParticleMaterial(0.003, terminal_velocity=7.0, run_off=0.2, splash=3), shape="streak"
)


def run(scene: SimulationScene) -> MemoryCache:
    cache = MemoryCache()
    simulate_scene(scene, cache, [ParticleEngine()])
    return cache


def post(frames: int, way: np.ndarray | None = None, radius: float = 0.1) -> Character:
    """A slanting limb that moves by ``way`` (F, 3)."""
    moved = np.zeros((frames, 1, 3)) if way is None else way[:, None]
    radii = np.full((frames, 1), radius)
    ends = (moved + np.array(end) for end in ((-0.5, 1.0, 0.1), (0.5, 1.3, -0.1)))
    volumes = TaperedCylinders(*ends, radii, 0.6 * radii)
    return Character("post", ("top",), moved + np.array([0, 1, 0]), ("arm",), volumes)


def roof(frames: int, slope: float = 0.3) -> Prop:
    """A square roof at 2 m that slopes along x, held by nothing."""
    places = [(x, 2.0 + slope * x, z) for x in (-0.6, 0.6) for z in (-0.6, 0.6)]
    return Prop("roof", np.array(places), np.array([[0, 1, 2], [1, 3, 2]]), Pin("world"))


def live(cache: MemoryCache, name: str, frame: int, *phases: int) -> tuple[np.ndarray, np.ndarray]:
    """Places and velocities of a frame's particles, of ``phases`` or all there are."""
    state = cache.read(name, frame)
    codes = state["codes"][:, PHASE]
    there = np.isin(codes, phases) if phases else codes != FREE
    return state["positions"][there], state["velocities"][there]


def test_they_reach_their_terminal_velocity_and_fall_freely_without_drag():
    slow = replace(SNOW, material=ParticleMaterial(terminal_velocity=1.5, spread=0.0))
    cache = run(SimulationScene(24, 3, (slow,)))
    speeds = live(cache, "snow", 2, FALLING)[1]
    np.testing.assert_allclose(speeds, np.tile([0, -1.5, 0], (len(speeds), 1)), atol=1e-6)
    # Half as heavy: the speed at which resistance holds the weight is smaller by the root of two.
    light = run(SimulationScene(24, 2, (slow,), gravity=(0, -9.81 / 2, 0)))
    np.testing.assert_allclose(live(light, "snow", 1, FALLING)[1][:, 1], -1.5 / np.sqrt(2), atol=1e-6)


def test_what_has_next_to_no_drag_falls_as_in_a_vacuum():
    stones = Particles("stones", (-1, -500, -1), (1, 100, 1), 40, ParticleMaterial(terminal_velocity=190.0))
    frames = 13
    thrown = replace(stones, count=0)
    cache = run(SimulationScene(24, 1, (thrown,)))
    state = {name: np.array(array) for name, array in cache.read("stones", 0).items()}
    state["codes"][0] = (7, -1, FALLING)
    state["positions"][0], state["sizes"][0] = (0, 90, 0), (0.01, 0)
    cache.write("stones", 0, state)
    simulate_scene(SimulationScene(24, frames, (thrown,)), cache, [ParticleEngine()], start=1)
    place, speed = live(cache, "stones", frames - 1)
    assert speed[0, 1] == pytest.approx(-9.81 * 0.5, rel=1e-3)
    # The step is of the first order: half a substep's speed ahead.
    assert place[0, 1] == pytest.approx(90 - 9.81 / 8 - 9.81 * 0.5 / 192, abs=2e-3)


@pytest.mark.parametrize("wind", [(0.0, 0.0, 0.0), (2.0, 0.0, -1.0)])
def test_the_air_is_as_full_in_every_frame_as_asked_for_and_evenly(wind):
    snow = replace(SNOW, count=2000)
    scene = SimulationScene(24, 30, (snow,), ground=0.0, wind=Wind(wind, gusts=0.0))
    cache = run(scene)
    for frame in (0, 15, 29):
        places, _ = live(cache, "snow", frame, FALLING)
        inside = ((places >= snow.low) & (places <= snow.high)).all(axis=1)
        assert inside.sum() == pytest.approx(2000, rel=0.06)
        share = (places[inside] - snow.low) / (snow.high - snow.low)
        counts = np.array([np.histogram(share[:, axis], 4, (0, 1))[0] for axis in range(3)])
        assert counts.min() > 400, counts
        assert counts.max() < 600, counts


def test_none_is_inside_a_limb_that_swings_through_them():
    frames = 24
    way = np.zeros((frames, 3))
    way[:, 1] = 0.5 * np.sin(np.arange(frames) * 1.1)
    scene = SimulationScene(24, frames, (SNOW, RAIN), (post(frames, way, 0.05),), ground=0.0)
    cache = run(scene)
    for name in ("snow", "rain"):
        measures = measure_particles(scene, cache, name)
        assert measures.penetration.max() < 1e-3, (name, measures.penetration)
        assert measures.falling.min() > 200
    assert measure_particles(scene, cache, "snow").settled.min() > 0
    assert measure_particles(scene, cache, "rain").droplets.min() > 10


def test_without_the_limb_they_would_be_where_it_is():
    empty = SimulationScene(24, 2, (replace(SNOW, count=20000),), ground=0.0)
    cache = run(empty)
    with_limb = replace(empty, characters=(post(2),))
    assert measure_particles(with_limb, cache, "snow").penetration.max() > 0.05
    assert measure_particles(with_limb, cache, "snow").limb[1] == "arm"


def test_flakes_that_lie_go_with_their_limb_and_melt():
    frames = 60
    way = np.zeros((frames, 3))
    way[:, 0] = np.minimum(np.arange(frames), 20) * 0.01
    cache = run(SimulationScene(24, frames, (SNOW,), (post(frames, way),)))
    before, after = cache.read("snow", 4), cache.read("snow", 16)
    stay = (before["codes"][:, PHASE] == SETTLED) & (after["codes"] == before["codes"]).all(axis=1)
    assert stay.sum() > 5
    assert (before["codes"][stay, HOST] == 0).all()
    np.testing.assert_allclose(
        (after["positions"] - before["positions"])[stay], np.tile([0.12, 0, 0], (stay.sum(), 1)), atol=1e-9
    )
    first = set(before["codes"][before["codes"][:, PHASE] == SETTLED, SERIAL])
    last = cache.read("snow", 59)["codes"]
    assert not first & set(last[last[:, PHASE] == SETTLED, SERIAL]), "settle is 2 s"


def test_flakes_fall_off_a_limb_that_turns_over():
    frames = 12
    turn = np.linspace(0, np.pi, frames)
    start = np.tile([0.0, 1.5, 0.0], (frames, 1, 1))
    along = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)[:, None]
    radii = np.full((frames, 1), 0.1)
    arm = Character("c", ("m",), start, ("arm",), TaperedCylinders(start, start + 0.6 * along, radii, radii))
    cache = run(SimulationScene(24, frames, (replace(SNOW, count=3000),), (arm,)))
    assert len(live(cache, "snow", 0, SETTLED)[0]) > 20
    assert len(live(cache, "snow", frames - 1, SLIDING)[0]) > 3


@pytest.mark.parametrize("slope", [0.0, 0.5])
def test_no_drop_is_under_a_roof(slope):
    scene = SimulationScene(24, 12, (roof(12, slope), replace(RAIN, count=3000)), ground=0.0)
    cache = MemoryCache()
    simulate_scene(scene, cache, [RapierEngine(), ParticleEngine()])
    for frame in range(12):
        places, _ = live(cache, "rain", frame, FALLING, SLIDING)
        under = (np.abs(places[:, [0, 2]]) < 0.55).all(axis=1) & (places[:, 1] < 2 + slope * places[:, 0] - 0.01)
        assert not under.any()
        assert (np.abs(places[:, [0, 2]]) < 0.55).all(axis=1).any(), "there is rain above"


def test_a_roof_that_is_carried_keeps_the_rain_off():
    frames = 16
    way = np.zeros((frames, 3))
    way[:, 0], way[:, 1] = 0.03 * np.arange(frames), 0.15 * np.sin(np.arange(frames) * 0.9)
    carrier = post(frames, way)
    held = replace(roof(frames), pin=Pin("marker", "top"))
    scene = SimulationScene(24, frames, (held, replace(RAIN, count=4000)), (carrier,), ground=0.0)
    cache = MemoryCache()
    simulate_scene(scene, cache, [RapierEngine(), ParticleEngine()])
    for frame in range(4, frames):
        places, _ = live(cache, "rain", frame, FALLING)
        local = places - way[frame]
        # It goes 0.23 m on while a drop that it has not met yet falls from its height to the ground.
        under = (np.abs(local[:, [0, 2]]) < 0.36).all(axis=1) & (local[:, 1] < 1.98 + 0.3 * local[:, 0])
        assert not under.any(), frame


def test_a_splash_is_of_droplets_that_fly_off_slower_than_the_drop():
    scene = SimulationScene(24, 6, (replace(RAIN, material=replace(RAIN.material, run_off=0.0)),), ground=0.0)
    cache = run(scene)
    places, speeds = live(cache, "rain", 5, DROPLET)
    assert len(places) > 20
    assert places[:, 1].min() >= 0
    assert places[:, 1].max() < 0.25
    assert np.linalg.norm(speeds, axis=1).max() < 0.6 * 7
    dry = replace(scene, elements=(replace(RAIN, material=replace(RAIN.material, run_off=0.0, splash=0)),))
    assert not len(live(run(dry), "rain", 5, DROPLET)[0])


SCRIPT = """
from tests.simulate.test_particles import digest
print(digest())
"""


def digest() -> str:
    """A hash of what snow and rain on a walker leave in the last frame."""
    figure = walker(6)
    elements = [*preset_elements("snow", figure, ground=0.0, seed=3), *preset_elements("rain", figure, ground=0.0)]
    scene = SimulationScene(24, 6, tuple(elements), (figure,), ground=0.0, wind=Wind((1, 0, 0.5), seed=2), seed=3)
    cache = run(scene)
    states = [cache.read(name, 5) for name in ("snow", "rain")]
    return hashlib.sha256(b"".join(state[name].tobytes() for state in states for name in sorted(state))).hexdigest()


def test_another_process_gives_the_same_bits():
    command = [sys.executable, "-c", SCRIPT]
    told = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=True)
    assert told.stdout.strip() == digest()


def test_a_run_that_is_taken_up_ends_in_the_same_bits():
    way = np.linspace(0, 0.3, 10)[:, None] * np.array([1.0, 0.5, 0])
    scene = SimulationScene(24, 10, (SNOW, RAIN), (post(10, way),), ground=0.0, wind=Wind((1, 0, 0)))
    whole, cut = run(scene), run(scene)
    for name in ("snow", "rain"):
        cut.clear(name, 4)
    simulate_scene(scene, cut, [ParticleEngine()])
    for name in ("snow", "rain"):
        for key, values in whole.read(name, 9).items():
            np.testing.assert_array_equal(values, cut.read(name, 9)[key], key)


def test_another_seed_is_other_snow():
    scene = SimulationScene(24, 1, (SNOW,))
    one, other = run(scene), run(replace(scene, seed=1))
    assert not np.array_equal(one.read("snow", 0)["positions"], other.read("snow", 0)["positions"])


def test_an_explosion_is_told():
    heavy = replace(SNOW, high=(1.0, 3000.0, 1.0))
    with pytest.raises(SimulationError, match="snow: frame 0: the simulation exploded"):
        run(SimulationScene(24, 1, (heavy,)))


def test_flakes_face_the_camera_and_streaks_lie_along_the_way():
    camera = PerspectiveCamera.look_at((0, 1.5, 6), (0, 1.5, 0), (320, 180), 0.7)
    scene = SimulationScene(24, 1, (SNOW, replace(RAIN, look=Look((0, 0, 1, 1)))), (), (camera,))
    cache = run(scene)
    flakes, drops = Models(scene).meshes(cache, 0)
    assert (flakes.object_id, drops.object_id) == (BARE + 1, BARE + 2)
    depths = camera.depth(flakes.vertices).reshape(-1, 6)
    assert np.ptp(depths, axis=1).max() < 1e-9
    corners = drops.vertices.reshape(-1, 4, 3)
    ways = corners[:, 3] - corners[:, 0]
    np.testing.assert_allclose(ways, np.tile([0, 7 / 48, 0], (len(ways), 1)), atol=1e-3)
    wide = np.linalg.norm(camera.project(corners[:, 1]) - camera.project(corners[:, 0]), axis=1)
    assert wide.min() > 1.19


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"count": -1}, "count: want 0 to 200000"),
        ({"count": 2.5}, "count: want 0 to 200000"),
        ({"size": 0.0}, "size: want a number above zero"),
        ({"fall_speed": float("nan")}, "fall_speed: want a finite number"),
        ({"stick": 1.5}, "stick: want 0 to 1"),
        ({"colour": "#ffffff"}, "no setting 'colour': there are count, size"),
    ],
)
def test_wrong_settings_are_named(settings, told):
    with pytest.raises(ValueError, match=told):
        preset_elements("snow", walker(2), ground=0.0, **settings)


def test_wrong_particles_are_refused():
    with pytest.raises(ValueError, match="shape: want one of flake, streak"):
        replace(SNOW, shape="cube")
    with pytest.raises(ValueError, match="high: want a corner beyond low"):
        replace(SNOW, high=(1.0, -1.0, 1.0))
    with pytest.raises(ValueError, match="stick: want at most 1 together with run_off"):
        ParticleMaterial(stick=0.6, run_off=0.6)
    with pytest.raises(ValueError, match="splash: want 0 to 64"):
        ParticleMaterial(splash=1000)
    with pytest.raises(ValueError, match="run_off: want 0 to 1"):
        preset_elements("rain", walker(2), run_off=2.0)
    with pytest.raises(ValueError, match="name: 'snow' is no element of particles"):
        measure_particles(SimulationScene(24, 1, ()), MemoryCache(), "snow")


def test_the_box_is_what_the_cameras_see_round_the_character():
    figure = walker(3)
    near = PerspectiveCamera.look_at((0, 1, 5), (0, 1, 0), (160, 90), 0.6)
    wide = PerspectiveCamera.look_at((0, 1, 5), (0, 1, 0), (160, 90), 1.2)
    small, large = (preset_elements("snow", figure, ground=0.0, depth=0.0, cameras=(c,) * 3)[0] for c in (near, wide))
    assert (large.high - large.low > small.high - small.low)[0]
    pixels = np.array([[0, 0], [159, 0], [159, 89]], float)
    corners = near.unproject(pixels, np.full(3, 5.0))
    assert (corners[:, 0] >= small.low[0]).all()
    assert (corners <= small.high).all()
    assert small.low[1] == 0
