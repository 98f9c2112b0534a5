"""What Blender simulates, against what must be so."""

from __future__ import annotations

import numpy as np
import pytest

from pegbar.scene.volumes import TaperedCylinders
from pegbar.simulate.blender.engine import BlenderEngine
from pegbar.simulate.blender.locate import Blender
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.chains import Bobs
from pegbar.simulate.cloth import ClothEngine
from pegbar.simulate.elements import Balls, Boxes, Cloth, Pin, Prop, Strands
from pegbar.simulate.engine import simulate_scene
from pegbar.simulate.materials import StrandMaterial, Wind
from pegbar.simulate.measures import measure_cloth, measure_particles, measure_strands
from pegbar.simulate.particles import DROPLET, FALLING, SETTLED, SLIDING, ParticleEngine
from pegbar.simulate.scene import Character, PreRoll, SimulationScene
from pegbar.simulate.strands import StrandEngine
from pegbar.simulate.weather import ParticleMaterial, Particles

STILL = PreRoll(0, 0)


def post(frames: int, *, start=(0.0, 0.0, 0.0), end=(0.0, 1.0, 0.0), step=(0.0, 0.0, 0.0), radius=0.1) -> Character:  # type: ignore[no-untyped-def]
    """One limb from ``start`` to ``end`` that moves by ``step`` a frame, with a marker above its end."""
    way = np.arange(frames)[:, None, None] * np.array(step)
    radii = np.full((frames, 1), radius)
    volumes = TaperedCylinders(way + np.array(start), way + np.array(end), radii, radii)
    return Character("post", ("top",), way + np.array(end) + (0, 0.3, 0), ("trunk",), volumes)


def sheet(name: str, rows: int, columns: int, step: float, corner: tuple[float, float, float], **more: object) -> Cloth:
    """A sheet that hangs from ``corner`` along x, its first row pinned where ``more`` says."""
    down, across = np.meshgrid(np.arange(rows) * step, np.arange(columns) * step, indexing="ij")
    places = np.stack([corner[0] + across, corner[1] - down, np.full_like(across, corner[2])], -1).reshape(-1, 3)
    corners = []
    for i in range(rows - 1):
        for j in range(columns - 1):
            a = i * columns + j
            corners += [(a, a + columns, a + 1), (a + 1, a + columns, a + columns + 1)]
    return Cloth(name, places, np.array(corners), **more)  # type: ignore[arg-type]


def track(cache: MemoryCache, name: str, frames: int, what: str = "positions") -> np.ndarray:
    return np.array([cache.read(name, frame)[what] for frame in range(frames)])


def test_balls_fall_and_rest_as_they_must(blender: Blender) -> None:
    centers = np.array([[0, 2.0, 0], [1, 0.1, 0]])
    balls = Balls("balls", centers, np.array([0.1, 0.1]))
    frames = 49
    scene = SimulationScene(24, frames, (balls,), ground=0.0, pre_roll=STILL)
    cache = MemoryCache()
    simulate_scene(scene, cache, [BlenderEngine(blender)])
    places = track(cache, "balls", frames)
    assert np.allclose(places[0], centers, atol=1e-4)
    time = 12 / 24
    assert places[12, 0, 1] == pytest.approx(2 - 9.81 / 2 * time**2, abs=0.05)
    assert np.abs(places[:, 1] - centers[1]).max() < 5e-3
    assert places[..., 1].min() > 0.1 - 5e-3
    assert np.allclose(np.linalg.norm(track(cache, "balls", frames, "rotations"), axis=2), 1, atol=1e-4)


def test_a_limb_kicks_a_ball_and_a_box_rests_turned_level(blender: Blender) -> None:
    frames = 30
    ball = Balls("ball", np.array([[0.5, 0.1, 0.0]]), np.array([0.1]))
    box = Boxes("box", np.array([[3.0, 0.6, 0.0]]), np.array([[0.2, 0.4, 0.3]]))
    character = post(frames, start=(0, 0.1, 0), end=(0, 0.5, 0), step=(0.05, 0, 0))
    scene = SimulationScene(24, frames, (ball, box), (character,), ground=0.0, pre_roll=STILL)
    cache = MemoryCache()
    simulate_scene(scene, cache, [BlenderEngine(blender)])
    x = track(cache, "ball", frames)[:, 0, 0]
    limb = 0.05 * np.arange(frames)
    assert x[3] == pytest.approx(0.5, abs=0.01)
    assert (x[10:] > limb[10:] + 0.15).all()
    assert track(cache, "box", frames)[-1, 0, 1] == pytest.approx(0.2, abs=0.01)


def test_a_cloth_keeps_its_pins_lengths_and_distance(blender: Blender) -> None:
    frames = 24
    character = post(frames, step=(0.02, 0, 0))
    cloth = sheet("flag", 12, 6, 0.04, (-0.1, 1.3, 0.2), pins=(Pin("marker", "top", np.arange(6)),))
    scene = SimulationScene(24, frames, (cloth,), (character,), ground=0.0)
    cache = MemoryCache()
    simulate_scene(scene, cache, [BlenderEngine(blender)])
    places = track(cache, "flag", frames)
    expected = cloth.vertices[:6] + np.arange(frames)[:, None, None] * (0.02, 0, 0)
    assert np.abs(places[:, :6] - expected).max() < 1e-4
    measures = measure_cloth(scene, cache, "flag")
    assert measures.penetration.max() < 5e-3
    assert np.abs(measures.percentiles[:2]).max() < 0.03
    # It begins with the speed of its pins.
    speed = (places[1] - places[0]).mean(axis=0) * 24
    assert speed[0] == pytest.approx(0.48, abs=0.12)
    assert places[-1, -6:, 1].mean() < 1.0


def test_lengths_are_those_of_the_rest_shape(blender: Blender) -> None:
    # It begins pushed together to a half, and falls open.
    flat = sheet("curtain", 8, 8, 0.05, (0, 1.5, 0))
    folded = flat.vertices * (1.0, 0.5, 1.0) + (0, 0.75, 0)
    folded[:, 2] = 0.02 * np.sin(40 * folded[:, 1])
    pin = Pin("world", vertices=np.arange(8))
    cloth = Cloth("curtain", folded, flat.triangles, (pin,), rest=flat.vertices)
    scene = SimulationScene(24, 20, (cloth,))
    cache = MemoryCache()
    simulate_scene(scene, cache, [BlenderEngine(blender)])
    places = track(cache, "curtain", 20)[-1].reshape(8, 8, 3)
    assert (places[0, :, 1] - places[-1, :, 1]).mean() == pytest.approx(0.35, rel=0.05)


def test_cloth_falls_onto_a_box_and_a_ball_of_another_engine(blender: Blender) -> None:
    ball = Balls("ball", np.array([[0.0, 0.3, 0.0]]), np.array([0.3]))
    box = Boxes("box", np.array([[2.0, 0.25, 0.0]]), np.array([[0.5, 0.5, 0.5]]))
    cloths = []
    for name, middle in (("over_ball", 0.0), ("over_box", 2.0)):
        hung = sheet(name, 13, 13, 0.05, (0, 0, 0)).vertices - (0.3, -0.3, 0)
        flat = np.stack([hung[:, 0] + middle, np.full(len(hung), 0.8), -hung[:, 1]], axis=1)
        cloths.append(Cloth(name, flat, sheet(name, 13, 13, 0.05, (0, 0, 0)).triangles))
    scene = SimulationScene(24, 20, (ball, box, *cloths), ground=0.0, pre_roll=STILL)
    cache = MemoryCache()
    for frame in range(20):
        for body in (ball, box):
            cache.write(body.name, frame, {"positions": body.centers, "rotations": np.array([[0.0, 0, 0, 1]])})
    engine = BlenderEngine(blender)
    engine.run(scene, cloths, cache, 0, None)
    over_ball, over_box = (track(cache, cloth.name, 20)[-1] for cloth in cloths)
    assert np.linalg.norm(over_ball - ball.centers[0], axis=1).min() > 0.285
    assert over_ball[:, 1].max() == pytest.approx(0.61, abs=0.05)
    assert over_box[:, 1].max() == pytest.approx(0.51, abs=0.05)
    assert over_ball[:, 1].min() < 0.45


def test_wind_blows_a_cloth_as_far_as_our_engine_does_within_a_factor(blender: Blender) -> None:
    cloth = sheet("flag", 10, 6, 0.05, (0, 1.5, 0), pins=(Pin("world", vertices=np.arange(6)),))
    leaned = {}
    for name, engine in (("ours", ClothEngine()), ("theirs", BlenderEngine(blender))):
        scene = SimulationScene(24, 24, (cloth,), wind=Wind((0.0, 0.0, 2.5), 0.0))
        cache = MemoryCache()
        simulate_scene(scene, cache, [engine])
        leaned[name] = track(cache, "flag", 24)[-8:, -6:, 2].mean()
    assert leaned["ours"] > 0.05
    assert 0.4 < leaned["theirs"] / leaned["ours"] < 2.5


def test_strands_swing_as_ours_and_lie_over_a_limb(blender: Blender) -> None:
    along = np.arange(30) * 0.04
    zero = np.zeros(30)
    swings = np.stack([along, zero + 1.5, zero + 0.6], 1)
    lies = np.stack([zero + 0.1, zero + 0.75, along - 0.58], 1)
    count, radius, pin = np.array([30]), np.array([0.01]), Pin("world", vertices=np.arange(2))
    strands = (Strands("swings", swings, count, radius, (pin,)), Strands("lies", lies, count, radius))
    bar = post(20, start=(-0.6, 0.6, 0), end=(0.6, 0.6, 0))
    found = {}
    for name, engine in (("ours", StrandEngine()), ("theirs", BlenderEngine(blender))):
        scene = SimulationScene(24, 20, strands, (bar,), ground=0.0, pre_roll=STILL, wind=Wind((0, 0, 3.0), 0.0))
        cache = MemoryCache()
        simulate_scene(scene, cache, [engine])
        found[name] = track(cache, "swings", 20)
    assert np.abs(found["ours"][:10] - found["theirs"][:10]).max() < 0.05
    assert np.abs(found["theirs"][:, :2] - swings[:2]).max() < 1e-4
    for name in ("swings", "lies"):
        measures = measure_strands(scene, cache, name)
        assert measures.penetration.max() < 5e-3
        assert np.abs(measures.stretch).max() < 0.03
    assert track(cache, "lies", 20)[-1, :, 1].max() == pytest.approx(0.71, abs=0.02)


def test_snow_falls_evenly_with_the_wind_and_rides_on_a_limb(blender: Blender) -> None:
    material = ParticleMaterial(terminal_velocity=1.1, flutter=0.3, stick=1.0, run_off=0.0)
    snow = Particles("snow", (-1, 0, -1), (1, 2, 1), 400, material)
    bar = post(20, start=(-0.8, 0.6, 0), end=(0.8, 0.6, 0), step=(0, 0, 0.02), radius=0.2)
    scene = SimulationScene(24, 20, (snow,), (bar,), ground=0.0, wind=Wind((0.4, 0, 0), 0.0))
    caches = [MemoryCache(), MemoryCache()]
    for cache in caches:
        simulate_scene(scene, cache, [BlenderEngine(blender)])
    first, last = (caches[0].read("snow", frame) for frame in (0, 19))
    for state in (first, last):
        falls = state["codes"][:, 2] == FALLING
        assert 300 < falls.sum() < 550
        assert np.allclose(state["velocities"][falls].mean(axis=0), [0.4, -1.1, 0], atol=0.08)
        assert np.median(state["positions"][falls, 1]) == pytest.approx(1.0, abs=0.2)
        sway = state["velocities"][falls].std(axis=0)
        assert ((sway > 0.08) & (sway < 0.4)).all()
    lies = (last["codes"][:, 2] == SETTLED) & (last["positions"][:, 1] > 0.3)
    assert lies.sum() > 20
    assert last["positions"][lies, 2].mean() == pytest.approx(0.38, abs=0.1)
    assert measure_particles(scene, caches[0], "snow").penetration.max() < 0.02
    assert np.array_equal(last["positions"], caches[1].read("snow", 19)["positions"])


def test_rain_bursts_where_it_falls(blender: Blender) -> None:
    material = ParticleMaterial(terminal_velocity=7.0, run_off=0.25, splash=3)
    rain = Particles("rain", (-1, 0, -1), (1, 2, 1), 300, material)
    roof = post(8, start=(-2, 1.0, 0), end=(2, 1.0, 0), radius=0.5)
    scene = SimulationScene(24, 8, (rain,), (roof,), ground=0.0)
    caches = [MemoryCache(), MemoryCache()]
    for cache, engine in zip(caches, (BlenderEngine(blender), ParticleEngine()), strict=True):
        simulate_scene(scene, cache, [engine])
    state = caches[0].read("rain", 7)
    places, phases = state["positions"], state["codes"][:, 2]
    falls = places[phases == FALLING]
    assert np.allclose(np.median(state["velocities"][phases == FALLING], axis=0), [0, -7, 0], atol=0.1)
    assert (falls[:, 1] > 1.6).sum() > 30
    # Under the roof it is dry.
    assert ((falls[:, 1] < 0.8) & (np.abs(falls[:, 2]) < 0.4)).sum() == 0
    droplets = places[phases == DROPLET]
    assert (np.hypot(droplets[:, 1] - 1, droplets[:, 2]) > 0.5 - 0.01).all()
    assert ((droplets[:, 1] > 1) & (np.abs(droplets[:, 2]) < 0.5)).sum() > 40
    assert (phases == SLIDING).sum() > 10
    # As many as of our own rain, from the first frame on.
    for frame in (0, 7):
        ours, theirs = ((cache.read("rain", frame)["codes"][:, 2] == DROPLET).sum() for cache in reversed(caches))
        assert theirs == pytest.approx(ours, rel=0.2)


@pytest.mark.parametrize(("density", "wind", "level"), [(0.5, (1.0, 0, 0), False), (600.0, (0, 0, 0), True)])
def test_bobs_rise_swing_and_lean_as_ours(
    blender: Blender, density: float, wind: tuple[float, float, float], level: bool
) -> None:
    # A balloon that the wind leans over, and a weight that swings down from where its string is level.
    radius = 0.15 if density < 1 else 0.03
    way = np.array([1.0, 0, 0]) if level else np.array([0, 1.0, 0])
    points = np.append(np.linspace(0, 0.8, 20), 0.8 + 1.15 * radius)[:, None] * way + (0, 1.5, 0)
    strands = Strands(
        *("balloon", points, np.array([21]), np.array([0.0015]), (Pin("world", vertices=np.arange(1)),)),
        bobs=Bobs(np.array([radius]), density),
        material=StrandMaterial(density=400.0),
    )
    scene = SimulationScene(24, 24, (strands,), pre_roll=STILL, wind=Wind(wind, 0.0))
    found = {}
    for engine in (StrandEngine(), BlenderEngine(blender)):
        cache = MemoryCache()
        simulate_scene(scene, cache, [engine])
        found[engine.name] = track(cache, "balloon", 24)
    ours, theirs = found["strands"][:, -1], found["blender"][:, -1]
    assert np.linalg.norm(ours[-1] - ours[0]) > 0.15
    assert np.linalg.norm(ours - theirs, axis=1).max() < 0.05
    links = np.linalg.norm(np.diff(found["blender"], axis=1), axis=2)
    assert np.abs(links.sum(axis=1) / strands.link_lengths.sum() - 1).max() < 0.01
    assert np.abs(links[:, -1] / (1.15 * radius) - 1).max() < 0.01


def test_bobs_keep_clear_of_each_other_and_of_a_limb(blender: Blender) -> None:
    # Balloons whose strings are held at one place rise against each other, and under a bar.
    begin = np.array([[-0.2, 0, 0], [0.2, 0, 0], [0, 0, 0.25]])
    rows = [np.linspace((0, 0.2, 0), (x, 0.6, z), 10) for x, _, z in begin]
    points = np.concatenate([np.vstack([row, row[-1] + (0, 0.17, 0)]) for row in rows])
    pin = Pin("world", vertices=np.array([0, 11, 22]))
    bobs = Bobs(np.full(3, 0.15), 0.4)
    strands = Strands("bunch", points, np.full(3, 11), np.full(3, 0.0015), (pin,), bobs=bobs)
    bar = post(24, start=(-0.6, 1.1, 0), end=(0.6, 1.1, 0))
    cache = MemoryCache()
    simulate_scene(SimulationScene(24, 24, (strands,), (bar,), pre_roll=STILL), cache, [BlenderEngine(blender)])
    centers = track(cache, "bunch", 24)[:, 10::11]
    apart = [np.linalg.norm(centers[:, a] - centers[:, b], axis=1).min() for a, b in ((0, 1), (1, 2), (0, 2))]
    # Flat between their vertices, balls come a little nearer than round ones.
    assert min(apart) > 0.285
    assert np.hypot(centers[..., 1] - 1.1, centers[..., 2]).min() > 0.24


def test_the_same_bits_every_time_and_a_run_that_is_taken_up(blender: Blender) -> None:
    frames = 8
    character = post(frames, step=(0.03, 0, 0))
    cloth = sheet("flag", 6, 4, 0.05, (-0.1, 1.3, 0.2), pins=(Pin("marker", "top", np.arange(4)),))
    balls = Balls("balls", np.array([[0.2, 0.1, 0.0], [0.25, 0.3, 0.0]]), np.array([0.1, 0.1]))
    prop = Prop("stick", np.array([[0, 1, 0], [0, 2, 0], [0.1, 1, 0.0]]), np.array([[0, 1, 2]]), Pin("limb", "trunk"))
    scene = SimulationScene(24, frames, (balls, prop, cloth), (character,), ground=0.0, pre_roll=PreRoll(4, 2))
    caches = [MemoryCache(), MemoryCache()]
    told: list[tuple[str, int, int]] = []
    for cache in caches:
        simulate_scene(scene, cache, [BlenderEngine(blender)], progress=lambda *step: told.append(step))
    caches[1].clear("flag", 5)
    caches[1].clear("balls", 5)
    simulate_scene(scene, caches[1], [BlenderEngine(blender)])
    for name in ("balls", "stick", "flag"):
        assert np.array_equal(track(caches[0], name, frames), track(caches[1], name, frames))
    assert told[-1] == ("blender", frames, frames)
    assert [step[1] for step in told[: len(told) // 2]] == sorted(step[1] for step in told[: len(told) // 2])
