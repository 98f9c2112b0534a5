"""Scenes and elements: what is wrong is named; tracks over time; caches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pegbar.errors import FormatError, SimulationError
from pegbar.io.simulation_cache import DiskCache
from pegbar.simulate.cache import MemoryCache, complete_until
from pegbar.simulate.elements import Balls, Boxes, Cloth, Pin
from pegbar.simulate.engine import simulate_scene
from pegbar.simulate.materials import ClothMaterial, Look, RigidMaterial, Wind
from pegbar.simulate.rapier import RapierEngine
from pegbar.simulate.scene import Character, PreRoll, SimulationScene
from pegbar.simulate.tracks import Volumes, at_times, filled, limb_frames, pin_track
from tests.walkers import walker

TRIANGLE = (np.eye(3), np.array([[0, 1, 2]]))


def flag(*pins: Pin) -> Cloth:
    return Cloth("flag", *TRIANGLE, pins)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"frame_rate": 0}, "frame_rate: want a number above zero"),
        ({"frames": 0}, "frames: want a whole number"),
        ({"ground": np.nan}, "ground: want a finite height"),
        ({"gravity": (0, 1)}, "gravity: want shape"),
        ({"elements": (flag(), flag())}, "elements: want every name once"),
        ({"cameras": (None,)}, "cameras: want 4, one a frame"),
        ({"frames": 5}, "characters: walker: want 5 frames, got 4"),
        ({"elements": (flag(Pin("limb", "tail")),)}, "pins: flag: no limb 'tail': there are torso, head"),
        ({"elements": (flag(Pin("marker", "tail")),)}, "pins: flag: no marker 'tail'"),
        ({"elements": (flag(Pin("limb", "torso", character="bob")),)}, "pins: flag: no character bob: there is walker"),
    ],
)
def test_a_wrong_scene_is_named(change, words):
    good = SimulationScene(24, 4, (flag(),), (walker(4),))
    with pytest.raises(ValueError, match=words):
        replace(good, **change)


def test_a_pin_to_a_marker_that_is_never_there_is_refused_and_gaps_are_filled():
    figure = walker(4)
    markers = figure.markers.copy()
    index = figure.marker_names.index("left_hand")
    markers[:, index] = np.nan
    with pytest.raises(ValueError, match="marker 'left_hand' is missing in all frames"):
        SimulationScene(24, 4, (flag(Pin("marker", "left_hand")),), (replace(figure, markers=markers),))
    markers[1, index], markers[3, index] = (0, 0, 0), (2, 2, 2)
    scene = SimulationScene(24, 4, (flag(Pin("marker", "left_hand")),), (replace(figure, markers=markers),))
    track = pin_track(scene, Pin("marker", "left_hand"), np.zeros((1, 3)))
    assert track[:, 0, 0].tolist() == [0, 0, 1, 2]


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Pin("tail", "x"), "kind: want one of marker, limb, path, world"),
        (lambda: Pin("path"), "path: want one for the kind 'path', and for no other, got 'path'"),
        (lambda: Pin("world", path=np.zeros((2, 3, 4))), "path: want one for the kind 'path'.*got 'world'"),
        (lambda: Pin("path", path=np.zeros((2, 4, 4))), "path: want shape"),
        (lambda: Pin("limb"), "target: a pin to a limb wants its name"),
        (lambda: flag(Pin("world", vertices=np.array([3]))), "pins: flag: vertex 3 is not one of 3"),
        (lambda: Cloth("c", np.eye(3), np.array([[0, 1, 3]])), "triangles: want values in 0..2"),
        (lambda: Balls("b", np.zeros((2, 3)), np.array([1.0, 0.0])), "radii: want numbers above zero"),
        (lambda: Boxes("b", np.zeros((1, 3)), np.array([[1.0, -1, 1]])), "sizes: want numbers above zero"),
        (lambda: ClothMaterial(density=0), "density: want a number above zero"),
        (lambda: ClothMaterial(bend=-1), "bend: want a finite number of zero or more"),
        (lambda: RigidMaterial(bounce=2), "bounce: want 0 to 1"),
        (lambda: Wind(gusts=np.inf), "gusts: want a finite number"),
        (lambda: Look(pattern="paisley"), "pattern: want one of plain, stripes"),
        (lambda: Look(color=(1, 1, 1, 2)), "color: want alpha in 0..1"),
        (lambda: PreRoll(4, 5), "blend: want 0 to 4 frames"),
        (lambda: replace(walker(3), limb_names=("a", "a")), "limb_names: want every name once"),
        (lambda: replace(walker(3), limb_markers=(("a", "b"),)), "limb_markers: want 10 pairs, got 1"),
    ],
)
def test_a_wrong_element_is_named(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@given(arrays(float, (5, 2), elements=st.floats(-9, 9)), st.floats(-2, 8))
def test_tracks_go_through_their_frames_and_never_beyond_their_neighbours(track, time):
    assert at_times(track, np.arange(5.0)) == pytest.approx(track)
    got = at_times(track, np.array([time]))[0]
    before, after = track[int(np.clip(np.floor(time), 0, 4))], track[int(np.clip(np.ceil(time), 0, 4))]
    assert (got >= np.minimum(before, after) - 1e-9).all()
    assert (got <= np.maximum(before, after) + 1e-9).all()
    np.testing.assert_array_equal(got, at_times(track, np.array([0, time, 4]))[1])


def test_one_frame_is_held_and_what_is_never_known_stays_unknown():
    assert at_times(np.array([[3.0]]), np.array([-1.0, 0.5])).tolist() == [[3.0], [3.0]]
    assert np.isnan(filled(np.array([[np.nan, 1], [np.nan, np.nan]]))[:, 0]).all()


def test_volumes_grow_in_the_pre_roll_and_lack_what_is_never_known():
    figure = walker(3)
    start = figure.volumes.start.copy()
    start[:, 2] = np.nan
    figure = replace(figure, volumes=replace(figure.volumes, start=start))
    scene = SimulationScene(24, 3, (), (figure,), pre_roll=PreRoll(10, 4))
    rows = Volumes(scene, ()).at(np.array([-10.0, -6.0, 0.0]))
    assert rows.shape == (3, 9, 8)
    assert (rows[0, :, 3] == 0).all()
    assert rows[1] == pytest.approx(rows[2])


def test_a_pin_on_a_limb_turns_and_grows_with_it():
    figure = walker(12)
    point = figure.volumes.end[0, 0] * 0.5 + figure.volumes.start[0, 0] * 0.5 + (0.13, 0, 0)
    scene = SimulationScene(24, 12, (), (figure,))
    held = pin_track(scene, Pin("limb", "torso"), point[None])[:, 0]
    middle = (figure.volumes.start[:, 0] + figure.volumes.end[:, 0]) / 2
    thick = figure.volumes.start_radius[:, 0] / figure.volumes.start_radius[0, 0]
    assert np.linalg.norm(held - middle, axis=1) == pytest.approx(0.13 * thick)
    # Turned by half a turn, the trunk's axes follow the hips though its axis does not move.
    turned = figure.markers.copy()
    for side, other in (("left", "right"), ("right", "left")):
        index = figure.marker_names.index(f"{side}_hip")
        turned[6:, index] = figure.markers[6:, figure.marker_names.index(f"{other}_hip")]
    axes = limb_frames(replace(figure, markers=turned), "torso")[1]
    assert axes[0, :, 0] @ axes[11, :, 0] == pytest.approx(-1)


def test_axes_are_rotations_and_do_not_twist():
    axes = limb_frames(walker(24), "left_shin")[1]
    assert np.einsum("fij,fik->fjk", axes, axes) == pytest.approx(np.tile(np.eye(3), (24, 1, 1)), abs=1e-9)
    assert np.linalg.det(axes) == pytest.approx(1)


@pytest.mark.parametrize("kind", ["memory", "disk"])
def test_caches_keep_frames_and_forget_them(kind, tmp_path):
    cache = MemoryCache() if kind == "memory" else DiskCache(tmp_path / "cache")
    assert cache.frames("ball") == []
    for frame in (0, 1, 3):
        cache.write("ball", frame, {"positions": np.full((2, 3), frame), "turn": np.zeros(1)})
    assert cache.frames("ball") == [0, 1, 3]
    assert complete_until(cache, "ball") == 2
    assert cache.read("ball", 1)["positions"][0, 0] == 1
    cache.clear("ball", 1)
    assert cache.frames("ball") == [0]
    with pytest.raises(KeyError):
        cache.read("ball", 1)


def test_a_damaged_file_and_a_bad_name_are_refused(tmp_path):
    cache = DiskCache(tmp_path)
    cache.write("ball", 0, {"positions": np.zeros((1, 3))})
    file = tmp_path / "ball" / "0000.npz"
    file.write_bytes(file.read_bytes()[:40])
    with pytest.raises(FormatError, match=r"0000\.npz: the cache's frame is damaged"):
        cache.read("ball", 0)
    with pytest.raises(ValueError, match="group: want letters"):
        cache.frames("../ball")


def test_runs_continue_where_the_cache_ends_and_not_beyond():
    ball = Balls("ball", np.zeros((1, 3)), np.ones(1))
    scene = SimulationScene(24, 4, (ball,), pre_roll=PreRoll(0, 0))
    seen: list[int] = []
    cache = MemoryCache()
    engine = RapierEngine()
    simulate_scene(replace(scene, frames=2), cache, [engine])
    simulate_scene(scene, cache, [engine], progress=lambda name, done, count: seen.append(done))
    assert seen == [3, 4]
    simulate_scene(scene, cache, [engine], progress=lambda name, done, count: seen.append(done))
    assert seen == [3, 4]
    with pytest.raises(ValueError, match="start: rapier can begin at frames 0 to 4, got 5"):
        simulate_scene(scene, cache, [engine], start=5)
    simulate_scene(scene, cache, [engine], start=1)
    assert cache.frames("ball") == [0, 1, 2, 3]


def test_the_error_says_element_and_frame_and_can_be_sent():
    import pickle

    error = pickle.loads(pickle.dumps(SimulationError("skirt", 7, "gone")))
    assert (error.element, error.frame, str(error)) == ("skirt", 7, "skirt: frame 7: gone")


def test_a_character_knows_its_height():
    figure: Character = walker(4)
    assert figure.height == pytest.approx(1.65, abs=0.1)
