"""The strand engine: catenary, pendulum, balloon, cantilever, limbs, taken up again, and the same bits every time."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipk

from pegbar.errors import SimulationError
from pegbar.scene.volumes import TaperedCylinders
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.elements import Balls, Bobs, Pin, Strands
from pegbar.simulate.engine import simulate_scene
from pegbar.simulate.materials import StrandMaterial, Wind
from pegbar.simulate.measures import measure_strands
from pegbar.simulate.presets import preset_elements
from pegbar.simulate.scene import Character, PreRoll, SimulationScene
from pegbar.simulate.strands import StrandEngine, point_rows
from tests.conftest import ROOT
from tests.oracles.strands import catenary, substep
from tests.walkers import walker

STILL = PreRoll(0, 0)
PRESETS = ("rope", "balloon", "pompoms", "strands")
BARE = StrandMaterial(drag=0, damping=0)


def run(scene: SimulationScene, name: str = "line", engine: StrandEngine | None = None):
    """Simulate; return the positions (F, n, 3), and the measures."""
    cache = MemoryCache()
    simulate_scene(scene, cache, [engine or StrandEngine()])
    places = np.array([cache.read(name, frame)["positions"] for frame in range(scene.frames)])
    return places, measure_strands(scene, cache, name)


def line(points: np.ndarray, pins: tuple[int, ...] = (), **others) -> Strands:
    held = (Pin("world", vertices=np.array(pins)),) if pins else ()
    return Strands("line", points, np.array([len(points)]), np.array([0.005]), held, **others)


def upright(count: int, length: float, start: float = 0.0) -> np.ndarray:
    return np.stack([np.zeros(count), start + np.linspace(0, length, count), np.zeros(count)], axis=1)


def test_a_rope_between_two_nails_hangs_as_a_catenary():
    share, length = np.linspace(0, 1, 41), 1.4
    drop = np.sqrt((length / 2) ** 2 - 0.25)
    vee = np.stack([share, -drop * (1 - np.abs(2 * share - 1)), 0 * share], axis=1)
    rope = line(vee, (0, 40), material=StrandMaterial(damping=3, drag=0))
    places, measures = run(SimulationScene(24, 100, (rope,), pre_roll=STILL))
    assert np.abs(places[-1][:, 1] - catenary(places[-1][:, 0], 1.0, length)).max() < 1e-3
    assert np.abs(measures.stretch).max() < 1e-3


@pytest.mark.parametrize("density", [500.0, 8000.0])
@pytest.mark.parametrize("amplitude", [0.1, 1.2])
def test_a_heavy_bob_on_a_thin_string_swings_with_the_pendulums_period(amplitude, density):
    way = np.concatenate([np.linspace(0, 0.9, 16), [1.0]])[:, None]
    points = way * (np.sin(amplitude), -np.cos(amplitude), 0.0)
    string = replace(line(points, (0,), bobs=Bobs([0.1], density), material=BARE), radii=np.array([0.001]))
    places, measures = run(SimulationScene(24, 97, (string,), pre_roll=STILL))
    across = places[:, -1, 0]
    before = np.flatnonzero(across[:-1] * across[1:] < 0)
    crossings = before + across[before] / (across[before] - across[before + 1])
    # Buoyancy lightens the bob, and the air that it takes along makes it slower to move.
    ease = (density - 1.2) / (density + 0.6)
    period = 4 * np.sqrt(1 / (9.81 * ease)) * ellipk(np.sin(amplitude / 2) ** 2)
    assert 2 * np.diff(crossings).mean() / 24 == pytest.approx(period, rel=0.01)
    assert np.abs(across[-48:]).max() > 0.85 * np.abs(across[0])
    assert np.abs(measures.stretch).max() < 2e-3


def test_a_balloon_rises_at_the_speed_at_which_drag_holds_its_lift():
    radius = 0.14
    points = np.concatenate([upright(8, 0.4), [[0, 0.4 + radius, 0]]])
    balloon = line(points, bobs=Bobs([radius], 0.5), material=replace(BARE, drag=1.0, density=10.0))
    string = 10.0 * np.pi * 0.005**2 * 0.4
    places, _ = run(SimulationScene(24, 97, (balloon,), pre_roll=STILL))
    volume = 4 / 3 * np.pi * radius**3
    lift = 9.81 * ((1.2 - 0.5) * volume - string)
    # The string is dragged along its length, a little.
    drag = 0.6 * (0.47 * np.pi * radius**2 + 0.1 * 2 * 0.005 * 0.4)
    assert places[96, -1, 1] - places[72, -1, 1] == pytest.approx(np.sqrt(lift / drag), rel=0.02)
    sinking = replace(balloon, bobs=Bobs([radius], 3.0))
    assert run(SimulationScene(24, 12, (sinking,), pre_roll=STILL))[0][11, -1, 1] < points[-1, 1] - 0.1


def test_a_stiff_strand_held_level_droops_as_a_cantilever():
    count, weight = 33, 800 * np.pi * 0.005**2 * 9.81
    points = upright(count, 1.0)[:, [1, 0, 2]]
    bar = line(points, (0, 1), material=StrandMaterial(bend=5 * weight, damping=5.0))
    places, _ = run(SimulationScene(24, 120, (bar,), pre_roll=STILL))
    # Held at two points it bends from between them on.
    assert -places[-1, -1, 1] == pytest.approx((1 - 1 / 64) ** 4 / 8 / 5, rel=0.03)
    limp = replace(bar, material=StrandMaterial(damping=5.0))
    assert run(SimulationScene(24, 120, (limp,), pre_roll=STILL))[0][-1, -1, 1] < -0.9


def test_stretch_is_what_the_material_says():
    points = upright(3, -1.0)
    rubber = line(points, (0,), material=StrandMaterial(stretch=0.5, damping=5.0), bobs=Bobs([0.05], 1000.0))
    _, measures = run(SimulationScene(24, 96, (rubber,), pre_roll=STILL))
    load = 9.81 * (1000 - 1.2) * 4 / 3 * np.pi * 0.05**3
    assert measures.stretch[-1, 0] == pytest.approx(0.5 * load / 10, rel=0.02)


def test_a_substep_is_that_of_slow_numpy():
    rng = np.random.default_rng(4)
    points = upright(6, -0.5) + rng.uniform(-0.01, 0.01, (6, 3))
    strand = line(points, (0,), material=StrandMaterial(bend=0.003, damping=0.4, drag=1.0))
    scene = SimulationScene(24, 2, (strand,), wind=Wind((3.0, 0, 1.0), gusts=0), pre_roll=STILL)
    got, _ = run(scene, engine=StrandEngine(substeps=1, rounds=12))
    rows = point_rows(strand, np.array([0]))
    want = substep(points, rows, 1 / 24, np.array([3.0, 0, 1.0]), damping=0.4)
    assert np.abs(got[1] - want).max() < 1e-4


def test_strands_lie_on_the_ground_and_on_balls():
    balls = Balls("ball", np.array([[0.0, 0.2, 0.0]]), np.array([0.2]))
    level = upright(30, 0.9)[:, [1, 0, 2]] + (-0.45, 0.5, 0.0)
    scene = SimulationScene(24, 30, (balls, line(level)), ground=0.0, pre_roll=STILL)
    cache = MemoryCache()
    for frame in range(30):
        cache.write("ball", frame, {"positions": balls.centers})
    StrandEngine().run(scene, [scene.elements[1]], cache, 0, None)
    end = cache.read("line", 29)["positions"]
    assert end[:, 1].min() > 0.0049
    assert np.linalg.norm(end - balls.centers[0], axis=1).min() > 0.2049
    assert end[:, 1].max() > 0.35


def test_a_rope_that_is_pulled_too_long_stays_on_its_line():
    frames, share = 48, np.linspace(0, 1, 25)
    markers = np.zeros((frames, 2, 3))
    markers[:, 1, 0] = 1 + 0.012 * np.arange(frames)
    none = TaperedCylinders(
        np.empty((frames, 0, 3)), np.empty((frames, 0, 3)), np.empty((frames, 0)), np.empty((frames, 0))
    )
    hands = Character("hands", ("left", "right"), markers, (), none)
    points = np.stack([share, -0.25 * np.sin(np.pi * share), 0 * share], axis=1)
    pins = (Pin("marker", "left", np.array([0])), Pin("marker", "right", np.array([24])))
    rope = replace(line(points), pins=pins)
    length = rope.link_lengths.sum()
    assert 1.05 < length < 1.3 < markers[-1, 1, 0]
    places, measures = run(SimulationScene(24, frames, (rope,), (hands,), pre_roll=STILL))
    assert np.ptp(places[-1][:, 1]) < 0.03
    assert measures.stretch[-1].max() < 1.2 * (markers[-1, 1, 0] / length - 1)
    assert np.abs(measures.stretch[:10]).max() < 5e-3


@pytest.fixture(scope="module")
def held() -> tuple[SimulationScene, MemoryCache]:
    """A walking figure with everything that hangs, in gusts."""
    figure = walker()
    fewer = {"pompoms": {"count": 60}, "balloon": {"count": 3}, "rope": {}, "strands": {"count": 20}}
    elements = sum((preset_elements(kind, figure, ground=0.0, **fewer[kind]) for kind in PRESETS), ())
    scene = SimulationScene(24, 24, elements, (figure,), ground=0.0, wind=Wind((1.0, 0, 0.5), seed=3))
    cache = MemoryCache()
    simulate_scene(scene, cache, [StrandEngine()])
    return scene, cache


def test_strands_keep_out_of_moving_limbs_and_keep_their_length(held):
    scene, cache = held
    for element in scene.elements:
        measures = measure_strands(scene, cache, element.name)
        assert measures.penetration.max() < 0.005 * scene.characters[0].height, element.name
        assert np.abs(measures.percentiles[0]) < 0.01, element.name
        assert np.abs(measures.stretch).max() < 0.06, element.name
        assert all(cache.read(element.name, frame)["positions"][:, 1].min() > -0.05 for frame in range(24))


def test_balloons_keep_clear_of_each_other_and_above_the_hand(held):
    scene, cache = held
    balloons = next(element for element in scene.elements if element.name == "balloon")
    ends, radius = np.cumsum(balloons.counts) - 1, balloons.bobs.radii[0]
    hand = scene.characters[0].markers[:, scene.characters[0].marker_names.index("left_hand")]
    for frame in range(24):
        centers = cache.read("balloon", frame)["positions"][ends]
        apart = np.linalg.norm(centers[:, None] - centers, axis=2)[np.triu_indices(3, 1)]
        assert apart.min() > 1.98 * radius
        assert centers[:, 1].min() > hand[frame, 1]


@pytest.mark.parametrize("seed", range(3))
def test_a_bunch_that_is_squeezed_together_stays_calm(seed):
    figure = walker(12)
    elements = preset_elements("balloon", figure, ground=0.0, count=9, seed=seed)
    scene = SimulationScene(24, 12, elements, (figure,), ground=0.0)
    cache = MemoryCache()
    simulate_scene(scene, cache, [StrandEngine()])
    assert max(np.linalg.norm(cache.read("balloon", frame)["velocities"], axis=1).max() for frame in range(12)) < 12


def test_a_run_taken_up_again_has_the_same_bits(held):
    scene, cache = held
    again = MemoryCache()
    for element in scene.elements:
        for frame in range(10):
            again.write(element.name, frame, cache.read(element.name, frame))
    simulate_scene(scene, again, [StrandEngine()])
    for element in scene.elements:
        assert again.frames(element.name) == list(range(24))
        assert (again.read(element.name, 23)["positions"] == cache.read(element.name, 23)["positions"]).all()


def digest() -> str:
    """What becomes of all presets in wind, as a hash."""
    figure = walker(4)
    elements = sum((preset_elements(kind, figure, ground=0.0, seed=7) for kind in PRESETS), ())
    scene = SimulationScene(24, 4, elements, (figure,), wind=Wind((2.0, 0, 0), seed=5), pre_roll=PreRoll(4, 4))
    cache = MemoryCache()
    simulate_scene(scene, cache, [StrandEngine()])
    return hashlib.sha256(b"".join(cache.read(e.name, 3)["positions"].tobytes() for e in elements)).hexdigest()


def test_another_process_with_one_thread_gives_the_same_bits():
    code = "from tests.simulate.test_strands import digest; print(digest())"
    alone = os.environ | {"RAYON_NUM_THREADS": "1"}
    other = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT, env=alone
    )
    assert other.stdout.strip() == digest()


def test_an_explosion_names_the_frame_and_keeps_the_frames_before():
    figure = walker(8)
    markers = figure.markers.copy()
    markers[5:] += 5000.0
    wild = replace(figure, markers=markers)
    strand = replace(line(upright(5, 0.4, 1.0)), pins=(Pin("marker", "left_hand", np.array([0])),))
    cache = MemoryCache()
    with pytest.raises(SimulationError, match=r"line: frame 5: the simulation exploded"):
        simulate_scene(SimulationScene(24, 8, (strand,), (wild,), pre_roll=STILL), cache, [StrandEngine()])
    assert cache.frames("line") == [0, 1, 2, 3, 4]


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"counts": [4]}, "counts: want 5 points in all"),
        ({"counts": [4, 1]}, "counts"),
        ({"radii": [0.0]}, "radii: want numbers above zero, got 0"),
        ({"radii": [0.1, 0.1]}, "radii"),
        ({"points": np.zeros((5, 3))}, "points: line: neighbouring points of a strand coincide"),
        ({"points": np.full((5, 3), np.nan)}, "points"),
        ({"pins": (Pin("world", vertices=np.array([5])),)}, "pins: line: vertex 5 is not one of 5"),
        ({"bobs": Bobs([0.1, 0.1])}, "bobs: want 1, one a strand, got 2"),
        ({"colors": np.zeros((2, 4))}, "colors"),
    ],
)
def test_strands_that_cannot_be_are_refused(fields, words):
    good = {"points": upright(5, 0.4), "counts": [5], "radii": [0.01]}
    with pytest.raises(ValueError, match=words):
        Strands("line", **good | fields)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Bobs([-1.0]), "bobs.radii: want numbers above zero, got -1"),
        (lambda: Bobs([1.0], density=0), "density: want a number above zero"),
        (lambda: StrandMaterial(bend=-1), "bend: want a finite number"),
        (lambda: StrandMaterial(density=np.nan), "density: want a finite number"),
    ],
)
def test_materials_that_cannot_be_are_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_what_a_pin_in_a_limb_holds_there_is_no_penetration_and_what_is_deeper_is():
    figure = walker(1)
    hand, elbow = (figure.markers[0, figure.marker_names.index(f"left_{joint}")] for joint in ("hand", "elbow"))
    inward = (elbow - hand) / np.linalg.norm(elbow - hand)
    pins = (Pin("marker", "left_hand", np.array([0])),)
    depths = []
    for way in (np.array([1.0, 0, 0]), inward):
        strand = replace(line(hand + np.linspace(0, 0.09, 4)[:, None] * way), pins=pins)
        cache, scene = MemoryCache(), SimulationScene(24, 1, (strand,), (figure,))
        cache.write("line", 0, {"positions": strand.points})
        measures = measure_strands(scene, cache, "line")
        depths.append(measures.penetration[0])
    assert depths[0] < 1e-9
    assert 0.02 < depths[1] < 0.045
    assert measures.limb == ("left_forearm",)


def test_only_strands_are_measured():
    scene = SimulationScene(24, 1, (line(upright(3, 1.0)),))
    with pytest.raises(ValueError, match="name: 'rope' is no strands of the scene"):
        measure_strands(scene, MemoryCache(), "rope")
