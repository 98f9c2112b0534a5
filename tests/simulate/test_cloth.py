"""The cloth engine: against slow numpy, hanging, resting, pinned, taken up again, and the same bits every time."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pegbar import _kernels
from pegbar.errors import SimulationError
from pegbar.scene.volumes import TaperedCylinders
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.cloth import ClothEngine
from pegbar.simulate.elements import Balls, Cloth, Pin
from pegbar.simulate.engine import simulate_scene
from pegbar.simulate.materials import ClothMaterial, Wind
from pegbar.simulate.measures import measure_cloth
from pegbar.simulate.presets import preset_elements
from pegbar.simulate.scene import Character, PreRoll, SimulationScene
from pegbar.simulate.wearing import grid_triangles
from tests.conftest import ROOT
from tests.oracles import cloth as oracle
from tests.walkers import walker

STILL = PreRoll(0, 0)


def sheet(rows: int = 9, columns: int = 7, size: float = 0.05, height: float = 1.0, *, flat: bool = True) -> Cloth:
    """A cloth in the plane y = ``height`` (or hanging from there), pinned nowhere."""
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    other = np.full(i.shape, height) if flat else height - size * i
    vertices = np.stack([size * j, other, size * i if flat else 0.0 * i], axis=-1).reshape(-1, 3)
    return Cloth("cloth", vertices, grid_triangles(rows, columns))


def run(scene: SimulationScene, engine: ClothEngine | None = None) -> np.ndarray:
    cache = MemoryCache()
    simulate_scene(scene, cache, [engine or ClothEngine()])
    return np.array([cache.read("cloth", frame)["positions"] for frame in range(scene.frames)])


@given(arrays(float, (8,), elements=st.floats(0.05, 2)), arrays(float, (3,), elements=st.floats(-3, 3)))
def test_the_distance_is_that_of_the_union_of_spheres(row, point):
    got = _kernels.capsule_distances(np.ascontiguousarray(point[None]), row[None])[0][0]
    assert got == pytest.approx(oracle.capsule_distance(point, row), abs=2e-3)


def test_a_substep_is_that_of_slow_numpy():
    cloth = replace(sheet(2, 2, 0.1), material=ClothMaterial(bend=0, stretch=0, damping=0, drag=0))
    cloth = replace(cloth, pins=(Pin("world", vertices=np.array([0])),))
    got = run(SimulationScene(24, 2, (cloth,), pre_roll=STILL), ClothEngine(substeps=1))[1]
    area = 0.1 * 0.1 / 2
    corners = np.bincount(cloth.triangles.ravel(), minlength=4)
    weights = 1 / (corners * area / 3 * 0.15)
    weights[0] = 0
    places, speeds = cloth.vertices, np.zeros((4, 3))
    # With a single diagonal that reaches the pin, the order of links from the pin is that of their lengths.
    diagonal = next(pair for pair in ((0, 3), (1, 2)) if any(set(pair) <= set(t) for t in cloth.triangles.tolist()))
    links = [(0, 1, 0.1), (0, 2, 0.1), (*diagonal, 0.1 * 2**0.5), (1, 3, 0.1), (2, 3, 0.1)]
    want, _ = oracle.hang(places, speeds, weights, links, 1 / 24)
    assert np.abs(got - want).max() < 0.01
    assert (got[0] == cloth.vertices[0]).all()


def test_what_is_free_falls_and_what_is_pinned_hangs_at_its_length():
    fall = run(SimulationScene(24, 13, (replace(sheet(), material=ClothMaterial(drag=0, damping=0)),), pre_roll=STILL))
    assert fall[12, :, 1].mean() == pytest.approx(1 - 9.81 / 2 * 0.25, abs=0.03)
    cloth = replace(sheet(12, 5, flat=False), pins=(Pin("world", vertices=np.arange(5)),))
    scene = SimulationScene(24, 48, (cloth,), pre_roll=STILL)
    cache = MemoryCache()
    simulate_scene(scene, cache, [ClothEngine()])
    measures = measure_cloth(scene, cache, "cloth")
    assert measures.percentiles[2] < 0.01
    assert measures.limb[0] == ""
    assert np.abs(cache.read("cloth", 47)["positions"] - cloth.vertices).max() < 0.01


def test_seams_close_and_hold():
    two = sheet(6, 4, flat=False)
    other = two.vertices + np.array([0.15, 0, 0])
    joined = Cloth(
        "cloth",
        np.concatenate([two.vertices, other]),
        np.concatenate([two.triangles, two.triangles + 24]),
        (Pin("world", vertices=np.arange(4)),),
        np.stack([np.arange(3, 24, 4), np.arange(24, 48, 4)], axis=1),
    )
    end = run(SimulationScene(24, 30, (joined,), pre_roll=STILL))[-1]
    assert np.linalg.norm(end[joined.seams[:, 0]] - end[joined.seams[:, 1]], axis=1).max() < 0.01
    assert end[:, 1].min() > 0.5


def test_cloth_lies_on_the_ground_and_on_balls():
    balls = Balls("ball", np.array([[0.15, 0.2, 0.2]]), np.array([0.2]))
    scene = SimulationScene(
        24,
        30,
        (
            replace(
                sheet(height=0.5),
            ),
        ),
        ground=0.0,
        pre_roll=STILL,
    )
    end = run(scene)[-1]
    assert end[:, 1].min() > 0.0059
    assert end[:, 1].max() < 0.02
    cache = MemoryCache()
    both = replace(scene, elements=(balls, sheet(height=0.5)))
    for frame in range(30):
        cache.write("ball", frame, {"positions": balls.centers})
    ClothEngine().run(both, [both.elements[1]], cache, 0, None)
    end = cache.read("cloth", 29)["positions"]
    assert np.linalg.norm(end - balls.centers[0], axis=1).min() > 0.2059
    assert end[:, 1].max() > 0.39


@pytest.fixture(scope="module")
def dressed() -> tuple[SimulationScene, MemoryCache]:
    figure = walker()
    elements = preset_elements("skirt", figure, fineness=40) + preset_elements("scarves", figure, hands="left")
    scene = SimulationScene(24, 24, elements, (figure,), ground=0.0, wind=Wind((1.0, 0, 0.5), seed=3))
    cache = MemoryCache()
    simulate_scene(scene, cache, [ClothEngine()])
    return scene, cache


def test_cloth_keeps_out_of_moving_limbs_and_keeps_its_length(dressed):
    scene, cache = dressed
    for element in scene.elements:
        measures = measure_cloth(scene, cache, element.name)
        assert measures.penetration.max() < 0.01 * scene.characters[0].height
        assert measures.percentiles[1] < 0.05


def test_pins_follow_their_limb(dressed):
    scene, cache = dressed
    figure, scarf = scene.characters[0], scene.elements[1]
    index = figure.limb_names.index("left_forearm")
    for frame in (0, 11, 23):
        ends = (figure.volumes.start, figure.volumes.end)
        radii = (figure.volumes.start_radius, figure.volumes.end_radius)
        row = np.array([[*end[frame, index], radius[frame, index]] for end, radius in zip(ends, radii, strict=True)])
        pins = np.ascontiguousarray(cache.read(scarf.name, frame)["positions"][scarf.pins[0].vertices])
        gaps = _kernels.capsule_distances(pins, row.reshape(1, 8))[0]
        assert gaps.min() > 0.003
        assert gaps.max() < 0.02


def test_a_run_taken_up_again_has_the_same_bits(dressed):
    scene, cache = dressed
    again = MemoryCache()
    for element in scene.elements:
        for frame in range(10):
            again.write(element.name, frame, cache.read(element.name, frame))
    simulate_scene(scene, again, [ClothEngine()])
    for element in scene.elements:
        assert again.frames(element.name) == list(range(24))
        assert (again.read(element.name, 23)["positions"] == cache.read(element.name, 23)["positions"]).all()


def digest() -> str:
    """What becomes of a skirt and scarves in wind, as a hash."""
    figure = walker(4)
    elements = preset_elements("skirt", figure, fineness=24) + preset_elements("scarves", figure)
    scene = SimulationScene(24, 4, elements, (figure,), wind=Wind((2.0, 0, 0), seed=5))
    cache = MemoryCache()
    simulate_scene(scene, cache, [ClothEngine()])
    return hashlib.sha256(b"".join(cache.read(e.name, 3)["positions"].tobytes() for e in elements)).hexdigest()


def test_another_process_gives_the_same_bits():
    code = "from tests.simulate.test_cloth import digest; print(digest())"
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert other.stdout.strip() == digest()


def test_wind_blows_and_its_seed_counts():
    cloth = replace(sheet(10, 6, flat=False), pins=(Pin("world", vertices=np.arange(6)),))
    scene = SimulationScene(24, 24, (cloth,), pre_roll=STILL)
    ends = [
        run(replace(scene, wind=wind))[-1] for wind in (Wind(), Wind((0, 0, 6.0), seed=1), Wind((0, 0, 6.0), seed=2))
    ]
    assert ends[1][:, 2].mean() > ends[0][:, 2].mean() + 0.05
    assert np.abs(ends[1] - ends[2]).max() > 1e-3


def test_an_explosion_names_the_frame_and_keeps_the_frames_before():
    figure = walker(8)
    markers = figure.markers.copy()
    markers[5:] += 5000.0
    wild = replace(figure, markers=markers)
    cloth = replace(sheet(), pins=(Pin("marker", "left_hand", np.arange(7)),))
    scene = SimulationScene(24, 8, (cloth,), (wild,), pre_roll=STILL)
    cache = MemoryCache()
    with pytest.raises(SimulationError, match=r"cloth: frame 5: the simulation exploded"):
        simulate_scene(scene, cache, [ClothEngine()])
    assert cache.frames("cloth") == [0, 1, 2, 3, 4]


def test_a_limb_of_no_length_and_gaps_in_volumes_do_no_harm():
    figure = walker(6)
    start = figure.volumes.start.copy()
    start[2:4, 0] = np.nan
    start[:, 3] = figure.volumes.end[:, 3]
    start[:, 1] = np.nan
    holes = TaperedCylinders(start, figure.volumes.end, figure.volumes.start_radius, figure.volumes.end_radius)
    broken: Character = replace(figure, volumes=holes)
    scene = SimulationScene(24, 6, preset_elements("scarves", figure, hands="right", fineness=4), (broken,))
    cache = MemoryCache()
    simulate_scene(scene, cache, [ClothEngine()])
    assert np.isfinite(cache.read("scarves_right", 5)["positions"]).all()
