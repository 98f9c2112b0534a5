"""What goes to Blender about particles and what comes back, without Blender."""

from __future__ import annotations

import os

import numpy as np
import pytest

from pegbar.errors import BlenderError
from pegbar.scene.volumes import TaperedCylinders
from pegbar.simulate.blender.engine import BlenderEngine
from pegbar.simulate.blender.locate import Blender, find_blender
from pegbar.simulate.blender.particles import met, particles_entry, store_particles
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.elements import Cloth, Pin, Prop
from pegbar.simulate.engine import simulate_scene
from pegbar.simulate.materials import Wind
from pegbar.simulate.particles import FALLING, SETTLED
from pegbar.simulate.scene import Character, PreRoll, SimulationScene
from pegbar.simulate.weather import ParticleMaterial, Particles
from tests.blenders import fake_blender

LOW, HIGH = np.array([-1.0, 0, -1]), np.array([1.0, 2, 1])
SQUARE, SIDES = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1.0, 0]]), np.array([[0, 1, 2], [0, 2, 3]])


def scene_of(*elements, frames=4, **more):
    still = np.zeros((frames, 1, 3))
    radii = np.full((frames, 1), 0.1)
    volumes = TaperedCylinders(still, still + np.array([0.0, 1, 0]), radii, radii)
    post = Character("post", ("top",), still + np.array([0, 1.2, 0]), ("trunk",), volumes)
    return SimulationScene(24, frames, elements, (post,), pre_roll=PreRoll(2, 1), **more)


def snow(count=100, **more):
    material = ParticleMaterial(**({"terminal_velocity": 2.0, "stick": 1.0, "run_off": 0.0, "settle": 0.1} | more))
    return Particles("snow", LOW, HIGH, count, material)


def test_particles_are_told_where_they_begin_and_pulled_to_their_speed():
    wind = (1.0, 0.0, 0.0)
    entry, found = particles_entry(scene_of(snow(), wind=Wind(wind, 0.0)), snow(), "p")
    # Through 2 m at 2 m/s and a fifth more; as many enter as leave: by the top and from the wind's side.
    assert (entry["pre_roll"], entry["total"]) == (29, 33)
    assert len(found["p_filling"]) == 100
    entering = found["p_entering"]
    assert entry["entering"] == len(entering) == round(150 * 33 / 24)
    top, side = entering[:, 1] == 2, entering[:, 0] == -1
    assert (top | side).all()
    assert 0.5 < top.mean() < 0.8
    for places in (entering, found["p_filling"]):
        assert ((places >= LOW) & (places <= HIGH)).all()
    assert entry["stream"] == [1, -2, 0]
    # Drag, the squared speed over the mass, is as large as the pull where the speed is the stream's.
    drag = 5**0.5 * np.array([1.0, -2, 0]) / entry["mass"]
    assert np.allclose(found["p_pull"], drag)
    still, calm = particles_entry(scene_of(snow()), snow(), "p")
    assert np.allclose(calm["p_pull"], [0, -9.81, 0])
    assert still["sticks"] is True
    assert particles_entry(scene_of(), snow(stick=0.0), "p")[0]["sticks"] is False


def test_particles_meet_limbs_and_what_is_in_the_cache():
    cloth = Cloth("cloth", SQUARE, SIDES)
    prop = Prop("prop", SQUARE + 3, SIDES, Pin("limb", "trunk"))
    scene, cache = scene_of(cloth, prop), MemoryCache()
    for frame in range(4):
        cache.write("cloth", frame, {"positions": SQUARE + frame})
        cache.write("prop", frame, {"positions": SQUARE - frame})
    vertices, triangles = met(scene, cache)
    assert vertices.shape[0] == 4
    assert np.allclose(vertices[3, -8:], np.concatenate([SQUARE + 3, SQUARE - 3]))
    assert triangles[-4:].tolist() == (np.concatenate([SIDES, SIDES + 4]) + vertices.shape[1] - 8).tolist()


def result_of(positions, alive=None):
    frames, count = positions.shape[:2]
    each = (frames, count)
    return {
        "positions": positions,
        # What lies: Blender's own velocity goes on growing, and counts only for what was just born.
        "velocities": np.full((*each, 3), -2.0),
        "alive": np.ones(each, bool) if alive is None else alive,
        "born": np.zeros(each, bool),
        "before": positions[0] + np.array([0, 2 / 24, 0]),
        "early": np.array(29),
    }


def test_what_stops_lies_and_melts_and_what_leaves_is_gone():
    frames = 6
    fall = np.array([0, -2 / 24, 0]) * np.arange(frames)[:, None]
    falls, lands = fall + np.array([0.7, 1, 0]), fall + np.array([0.5, 1, 0])
    lands[2:] = lands[1]
    leaves, dies = fall + np.array([0, -0.3, 0]), fall + np.array([0.3, 1, 0])
    alive = np.ones((frames, 4), bool)
    alive[3:, 3] = False
    cache = MemoryCache()
    scene = scene_of(snow(), frames=frames)
    store_particles(scene, snow(), result_of(np.stack([falls, lands, leaves, dies], axis=1), alive), cache, 1)
    assert cache.frames("snow") == [1, 2, 3, 4, 5]
    seen = [cache.read("snow", frame)["codes"][:, [0, 2]].tolist() for frame in range(1, frames)]
    here, lying = [0, FALLING], [1, SETTLED]
    assert seen[0] == [here, [1, FALLING], [2, FALLING], [3, FALLING]]
    assert seen[1] == [here, lying, [2, FALLING], [3, FALLING]]
    assert seen[2] == [here, lying]
    # It has melted after 0.1 s.
    assert seen[4] == [here]
    state = cache.read("snow", 3)
    assert np.allclose(state["velocities"], [[0, -2, 0], [0, 0, 0]])
    assert np.allclose(state["sizes"][:, 1], [0, 1 / 24])
    assert ((state["sizes"][:, 0] > 0.6 * 0.008) & (state["sizes"][:, 0] < 1.4 * 0.008)).all()


def test_what_does_not_stick_is_gone_where_it_lands():
    places = np.repeat(np.array([[[0.5, 1.0, 0]]]), 4, axis=0)
    cache = MemoryCache()
    store_particles(scene_of(snow()), snow(stick=0.0), result_of(places), cache, 0)
    assert [len(cache.read("snow", frame)["codes"]) for frame in range(4)] == [1, 0, 0, 0]


def test_what_a_limb_overtakes_is_gone_for_good():
    # In the post of radius 0.1 in the second frame only.
    places = np.array([[[0.3, 0.5, 0]], [[0.05, 0.42, 0]], [[0.3, 0.34, 0]], [[0.3, 0.26, 0]]])
    cache = MemoryCache()
    store_particles(scene_of(snow()), snow(), result_of(places), cache, 0)
    assert [len(cache.read("snow", frame)["codes"]) for frame in range(4)] == [1, 0, 0, 0]


WRITES = """
sys.path.insert(0, {tree!r})
import json, numpy as np
folder = arguments[-1]
(entry,) = json.load(open(folder + "/simulate.json"))["particles"]
given = np.load(folder + "/simulate.npz")
count = len(given["element_0_filling"]) + len(given["element_0_entering"])
frames = entry["total"] - entry["pre_roll"]
each = (frames, count)
state = dict(positions=np.ones((*each, 3)), velocities=np.zeros((*each, 3)), alive=np.ones(each, bool))
state |= dict(born=np.zeros(each, bool), before=np.ones((count, 3)) + np.array([0, 2 / 24, 0]))
{spoil}
np.savez(folder + "/element_0.npz", **state)
print("pegbar:progress:1:1")
print("pegbar:done")
"""


def engine_that(folder, spoil="pass"):
    return BlenderEngine(find_blender(fake_blender(folder, WRITES.format(tree=str(folder), spoil=spoil))))


@pytest.mark.skipif(os.name == "nt", reason="the pretended programs are scripts")
def test_the_engine_puts_particles_into_the_cache(tmp_path):
    cache, told = MemoryCache(), []
    simulate_scene(scene_of(snow(10)), cache, [engine_that(tmp_path)], progress=lambda *step: told.append(step))
    state = cache.read("snow", 0)
    assert state["positions"].tolist() == np.ones((len(state["codes"]), 3)).tolist()
    assert len(state["codes"]) == 10 + round(10 * 33 / 24)
    assert told == [("blender", 4, 4)]


@pytest.mark.skipif(os.name == "nt", reason="the pretended programs are scripts")
@pytest.mark.parametrize("what", ["positions", "velocities"])
def test_a_particle_whose_place_is_no_number_is_gone(tmp_path, what):
    cache = MemoryCache()
    simulate_scene(scene_of(snow(10)), cache, [engine_that(tmp_path, f"state['{what}'][1:3, 5, 0] = np.nan")])
    gone = [5 not in cache.read("snow", frame)["codes"][:, 0] for frame in range(4)]
    assert gone == [False, True, True, True]
    assert np.isfinite(cache.read("snow", 3)["velocities"]).all()


@pytest.mark.skipif(os.name == "nt", reason="the pretended programs are scripts")
@pytest.mark.parametrize(
    ("spoil", "problem"),
    [
        ("state['alive'] = state['alive'][:, 1:]", r"snow: Blender wrote alive of shape \(4, 23\), want \(4, 24\)"),
        ("del state['born']", "snow: what Blender wrote cannot be read"),
    ],
)
def test_a_wrong_result_is_an_error(tmp_path, spoil, problem):
    with pytest.raises(BlenderError, match=problem):
        simulate_scene(scene_of(snow(10)), MemoryCache(), [engine_that(tmp_path, spoil)])


def test_particles_that_a_puddle_throws_up_are_not_blenders():
    engine = BlenderEngine(Blender("blender", False, "5.0.1"))
    assert engine.supports(snow(1))
    assert not engine.supports(snow(0))
