"""The rigid engine: balls fall, roll and are kicked, boxes stand, props are carried; the same bits every time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pegbar import _kernels
from pegbar.scene.volumes import TaperedCylinders
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.elements import Balls, Boxes, Cloth, Pin, Prop
from pegbar.simulate.engine import simulate_scene
from pegbar.simulate.hulls import hull_triangles, hull_vertices, poses
from pegbar.simulate.presets import preset_elements
from pegbar.simulate.rapier import RapierEngine
from pegbar.simulate.scene import Character, PreRoll, SimulationScene
from tests.walkers import walker

STILL = PreRoll(0, 0)


def run(scene: SimulationScene) -> MemoryCache:
    cache = MemoryCache()
    simulate_scene(scene, cache, [RapierEngine()])
    return cache


def club(frames: int, speed: float) -> Character:
    """One upright limb that moves along +X."""
    along = np.arange(frames)[:, None] / 24 * speed * np.array([1.0, 0, 0])
    start, end = along[:, None] + np.array([0, 0.1, 0]), along[:, None] + np.array([0, 0.9, 0])
    radius = np.full((frames, 1), 0.1)
    return Character("club", ("hand",), end.copy(), ("arm",), TaperedCylinders(start, end, radius, radius))


def test_a_ball_falls_and_comes_to_rest_on_the_ground():
    ball = Balls("ball", np.array([[0.0, 1.0, 0.0]]), np.array([0.1]))
    cache = run(SimulationScene(24, 96, (ball,), ground=0.5, pre_roll=STILL))
    heights = np.array([cache.read("ball", frame)["positions"][0, 1] for frame in range(96)])
    assert heights[0] == 1.0
    assert heights[4] == pytest.approx(1 - 9.81 / 2 * (4 / 24) ** 2, abs=0.02)
    assert heights.min() > 0.59
    assert heights[-1] == pytest.approx(0.6, abs=0.005)


def test_a_limb_kicks_a_ball_and_a_box():
    frames = 24
    ball = Balls("ball", np.array([[0.4, 0.1, 0.0]]), np.array([0.1]))
    box = Boxes("box", np.array([[0.9, 0.1, 0.05]]), np.array([[0.2, 0.2, 0.2]]))
    figure = club(frames, 1.5)
    cache = run(SimulationScene(24, frames, (ball, box), (figure,), ground=0.0, pre_roll=STILL))
    assert cache.read("ball", 23)["positions"][0, 0] > 1.3
    assert cache.read("box", 23)["positions"][0, 0] > 1.2
    quaternion = cache.read("box", 23)["rotations"][0]
    assert np.linalg.norm(quaternion) == pytest.approx(1, abs=1e-5)
    for frame in range(frames):
        volumes = figure.volumes
        row = np.array([[*volumes.start[frame, 0], 0.1, *volumes.end[frame, 0], 0.1]])
        center = np.ascontiguousarray(cache.read("ball", frame)["positions"])
        assert _kernels.capsule_distances(center, row)[0][0] > 0.085


def test_feet_kick_balls_the_same_way_every_time_and_after_a_restart():
    figure = walker(20, speed=1.5)
    elements = preset_elements("balls", figure, ground=0.05, count=12, seed=4)
    scene = SimulationScene(24, 20, elements, (figure,), ground=0.05)
    first, second = run(scene), run(scene)
    ways = first.read("balls", 19)["positions"] - first.read("balls", 0)["positions"]
    assert np.linalg.norm(ways, axis=1).max() > 0.1
    again = MemoryCache()
    for frame in range(9):
        again.write("balls", frame, first.read("balls", frame))
    simulate_scene(scene, again, [RapierEngine()])
    for cache in (second, again):
        for name in ("positions", "rotations"):
            assert (cache.read("balls", 19)[name] == first.read("balls", 19)[name]).all()


def test_a_prop_follows_its_hand_and_pushes():
    figure = walker(12, speed=0.0)
    hand = figure.markers[0, figure.marker_names.index("right_hand")]
    vertices = hand + np.array([[0, 0, 0], [0, 0, 0.5], [0, 0.05, 0.5]])
    rod = np.array([[*hand, 0.05, *vertices[1], 0.05]])
    prop = Prop("rod", vertices, np.array([[0, 1, 2]]), Pin("marker", "right_hand"), rod)
    ball = Balls("ball", (hand + np.array([0, 0.2, 0.45]))[None], np.array([0.1]))
    cache = run(SimulationScene(24, 12, (prop, ball), (figure,), pre_roll=STILL))
    for frame in (0, 7):
        moved = figure.markers[frame, figure.marker_names.index("right_hand")] - hand
        assert cache.read("rod", frame)["positions"] == pytest.approx(vertices + moved)
    free = run(SimulationScene(24, 12, (ball,), (figure,), pre_roll=STILL))
    assert cache.read("ball", 11)["positions"][0, 1] > free.read("ball", 11)["positions"][0, 1] + 0.1


def test_an_element_without_an_engine_is_refused_by_name():
    cloth = Cloth("flag", np.eye(3), np.array([[0, 1, 2]]))
    with pytest.raises(ValueError, match=r"rapier cannot simulate flag \(Cloth\)"):
        run(SimulationScene(24, 2, (cloth,)))


def test_hulls_touch_the_capsule_from_inside():
    for length, first, last in ((1.0, 0.3, 0.1), (0.5, 0.1, 0.2), (0.8, 0.15, 0.15)):
        row = np.array([0, -length / 2, 0, first, 0, length / 2, 0, last])
        gaps = _kernels.capsule_distances(hull_vertices(length, first, last), row[None])[0]
        assert np.abs(gaps).max() < 1e-9
    vertices, triangles = hull_vertices(1.0, 0.3, 0.1), hull_triangles()
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    outward = np.einsum("ti,ti->t", np.cross(b - a, c - a), (a + b + c) / 3 * (1, 0.2, 1))
    assert outward.min() > 0
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_poses_bring_the_upright_onto_the_axis():
    from scipy.spatial.transform import Rotation

    axes = np.array([[0, 1, 0], [0, -1, 0], [1, 0, 0], [0.3, -0.9, 0.2], [0, 0, 0.0]])
    rows = np.zeros((5, 8))
    rows[:, 4:7] = axes
    middles, turns = poses(rows)
    lengths = np.linalg.norm(axes[:4], axis=1, keepdims=True)
    assert Rotation.from_quat(turns[:4]).apply([0.0, 1, 0]) == pytest.approx(axes[:4] / lengths)
    assert middles == pytest.approx(axes / 2)
    assert turns[4].tolist() == [0, 0, 0, 1]


def test_a_bouncier_ball_bounces_higher():
    tops = []
    for bounce in (0.0, 0.9):
        balls = Balls("ball", np.array([[0.0, 1.0, 0.0]]), np.array([0.1]))
        balls = replace(balls, material=replace(balls.material, bounce=bounce))
        cache = run(SimulationScene(24, 30, (balls,), ground=0.0, pre_roll=STILL))
        tops.append(max(cache.read("ball", frame)["positions"][0, 1] for frame in range(14, 30)))
    assert tops[1] > tops[0] + 0.2
