"""The cache as meshes, finer sheets, patterns, shadows, measures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pegbar import _kernels
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.mesh import Mesh
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.elements import Balls, Boxes, Cloth, Pin, Prop
from pegbar.simulate.finer import finer_sheet
from pegbar.simulate.layers import SHADOW_ID, exr_channels, render_shadow, shadow_meshes, under
from pegbar.simulate.materials import Look
from pegbar.simulate.measures import measure_cloth
from pegbar.simulate.meshes import Models, volume_meshes
from pegbar.simulate.passes import Ink, render_passes
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.wearing import grid_triangles
from tests.walkers import walker

RED, BLUE = (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)


def areas(vertices, triangles):
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def towel(look: Look, around: float | None = None) -> Cloth:
    i, j = np.meshgrid(np.arange(9), np.arange(9), indexing="ij")
    places = np.stack([0.1 * j, 0.1 * i], axis=-1).reshape(-1, 2)
    vertices = np.concatenate([places, np.zeros((81, 1))], axis=1)
    return Cloth("towel", vertices, grid_triangles(9, 9), coordinates=places, around=around, look=look)


def models_of(cloth: Cloth, finer: int = 3) -> list[Mesh]:
    cache = MemoryCache()
    cache.write(cloth.name, 0, {"positions": cloth.vertices})
    return Models(SimulationScene(24, 1, (cloth,)), finer=finer).meshes(cache, 0)


@pytest.mark.parametrize("parts", [1, 2, 3, 5])
def test_a_flat_sheet_stays_itself_when_divided(parts):
    cloth = towel(Look())
    finer = finer_sheet(81, cloth.triangles, parts)
    assert len(finer.triangles) == len(cloth.triangles) * parts**2
    vertices = finer.place(cloth.vertices)
    assert len(vertices) == (8 * parts + 1) ** 2
    assert areas(vertices, finer.triangles) == pytest.approx(0.005 / parts**2)
    a, b, c = (vertices[finer.triangles[:, k]] for k in range(3))
    signs = np.cross(b - a, c - a)[:, 2]
    whole = np.cross(*(cloth.vertices[cloth.triangles[0, k]] - cloth.vertices[cloth.triangles[0, 0]] for k in (1, 2)))
    assert (np.sign(signs) == np.sign(whole[2])).all()
    given = cloth.vertices[cloth.triangles[finer.owner]]
    assert np.einsum("mc,mci->mi", finer.shares, given) == pytest.approx(vertices)


def test_a_round_sheet_is_rounder_when_divided():
    turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    ring = np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=1)
    vertices = np.concatenate([ring + np.array([0, h, 0]) for h in (0, 0.4, 0.8)])
    triangles = grid_triangles(3, 16, closed=True)
    finer = finer_sheet(48, triangles, 4)
    flat, smooth = finer.weights @ vertices, finer.place(vertices)
    inner = np.abs(flat[:, 1] - 0.4) < 0.3
    errors = [np.abs(np.hypot(points[inner, 0], points[inner, 2]) - 1).max() for points in (flat, smooth)]
    assert errors[1] < 0.5 * errors[0]


def test_patterns_have_their_size_and_close_round_a_closed_sheet():
    for pattern, share in (("stripes", 0.5), ("bands", 0.5), ("checks", 0.5), ("dots", np.pi * 0.28**2)):
        (mesh,) = models_of(towel(Look(RED, BLUE, pattern, 0.2)), finer=8)
        second = (mesh.colors[:, 2] == 1).mean()
        assert second == pytest.approx(share, abs=0.05)
    (mesh,) = models_of(towel(Look(RED, BLUE, "stripes", 0.4)))
    first = mesh.vertices[:, 0] % 0.4 < 0.19
    assert (mesh.colors[first, 2] == 1).all()
    (mesh,) = models_of(towel(Look(RED, BLUE, "bands", 0.4)))
    assert (mesh.colors[mesh.vertices[:, 1] % 0.4 < 0.19, 2] == 1).all()
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    ring = np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=1)
    places = np.stack([np.tile(turn, 2), np.repeat([0, 0.5], 12)], axis=1)
    vertices = np.concatenate([ring, ring + np.array([0, 0.5, 0])])
    look = Look(RED, BLUE, "stripes", 1.1)
    tube = Cloth("tube", vertices, grid_triangles(2, 12, closed=True), coordinates=places, around=2 * np.pi, look=look)
    (mesh,) = models_of(tube, finer=6)
    at = np.arctan2(mesh.vertices[:, 2], mesh.vertices[:, 0]) % (2 * np.pi)
    period = 2 * np.pi / 6
    sure = np.abs((at / period) % 0.5 - 0.25) < 0.15
    assert (mesh.colors[sure, 2] == ((at[sure] / period) % 1 < 0.5)).all()


def test_a_texture_is_laid_once_and_the_back_has_its_colour():
    texture = np.zeros((2, 2, 4), np.uint8)
    texture[..., 3] = 255
    texture[0, 1] = (255, 0, 0, 255)
    front, back = models_of(towel(Look(back=BLUE, texture=texture)))
    corner = np.argmin(np.linalg.norm(front.vertices[:, :2] - (0.79, 0.01), axis=1))
    other = np.argmin(np.linalg.norm(front.vertices[:, :2] - (0.01, 0.79), axis=1))
    assert front.colors[corner].tolist() == pytest.approx([1, 0, 0, 1])
    assert front.colors[other].tolist() == pytest.approx([0, 0, 0, 1])
    assert (back.colors == BLUE).all()
    apart = front.vertices - back.vertices
    assert np.einsum("ni,ni->n", apart, front.normals) == pytest.approx(0.0015)


def test_balls_boxes_and_props_are_where_the_cache_says():
    balls = Balls("balls", np.zeros((2, 3)), np.array([0.5, 0.25]), colors=np.array([RED, BLUE]))
    boxes = Boxes("boxes", np.zeros((1, 3)), np.array([[2.0, 0.2, 0.4]]))
    prop = Prop("rod", np.eye(3), np.array([[0, 1, 2]]), Pin("world"))
    cache = MemoryCache()
    places = np.array([[0, 1.0, 0], [3, 0, 0]])
    turns = np.array([[0, 0, 0, 1.0], [1, 0, 0, 0]])
    cache.write("balls", 0, {"positions": places, "rotations": turns})
    quarter = np.array([[0, 0, np.sqrt(0.5), np.sqrt(0.5)]])
    cache.write("boxes", 0, {"positions": places[1:], "rotations": quarter})
    cache.write("rod", 0, {"positions": 2 * np.eye(3)})
    ball, box, rod = Models(SimulationScene(24, 1, (balls, boxes, prop))).meshes(cache, 0)
    half = len(ball.vertices) // 2
    assert np.linalg.norm(ball.vertices[:half] - places[0], axis=1) == pytest.approx(0.5)
    assert np.linalg.norm(ball.vertices[half:] - places[1], axis=1) == pytest.approx(0.25)
    assert (ball.colors[:half] == RED).all()
    assert ball.normals[:half] == pytest.approx((ball.vertices[:half] - places[0]) * 2)
    assert np.ptp(box.vertices, axis=0) == pytest.approx([0.2, 2.0, 0.4])
    a, b, c = (box.vertices[box.triangles[:, k]] for k in range(3))
    assert (np.einsum("ti,ti->t", np.cross(b - a, c - a), (a + b + c) / 3 - places[1]) > 0).all()
    assert rod.vertices == pytest.approx(2 * np.eye(3))
    assert [mesh.object_id for mesh in (ball, box, rod)] == [1, 2, 3]


def test_volumes_are_seen_as_they_are():
    figure = walker(4)
    scene = SimulationScene(24, 4, (), (figure,))
    (mesh,) = volume_meshes(scene, 2)
    volumes = figure.volumes
    radii = (volumes.start_radius[2, :, None], volumes.end_radius[2, :, None])
    rows = np.concatenate([volumes.start[2], radii[0], volumes.end[2], radii[1]], axis=1)
    gaps, _ = _kernels.capsule_distances(mesh.vertices, np.ascontiguousarray(rows))
    assert gaps.max() < 1e-9
    assert volume_meshes(SimulationScene(24, 1, ()), 0) == []


def test_a_shadow_falls_away_from_the_light_and_lies_under_everything():
    camera = PerspectiveCamera.look_at((0, 5, 0.01), (0, 0, 0), (40, 40), 1.0)
    plate = Mesh([[-0.5, 1, -0.5], [0.5, 1, -0.5], [0.5, 1, 0.5], [-0.5, 1, 0.5]], [[0, 1, 2], [0, 2, 3]], RED)
    shadow = render_shadow([plate], camera, 0.0, light=(1, 1, 0), darkness=0.4)
    columns = np.flatnonzero((shadow.coverage > 0).any(axis=0))
    x = camera.project(np.array([[-1.5, 0, 0], [-0.5, 0, 0]]))[:, 0]
    assert columns[[0, -1]] == pytest.approx(np.sort(x), abs=1)
    covered = shadow.coverage > 0
    assert shadow.depth[covered] == pytest.approx(5, abs=0.02)
    assert shadow.beauty[covered] == pytest.approx(np.tile([0, 0, 0, 0.4], (covered.sum(), 1)))
    both = under(render_passes([plate], camera), shadow)
    assert set(np.unique(both.object_id)) == {0, 1, SHADOW_ID}
    assert (both.object_id[render_passes([plate], camera).coverage > 0] == 1).all()
    at_once = render_passes([plate, *shadow_meshes([plate], 0.0, light=(1, 1, 0), darkness=0.4)], camera)
    for name in ("beauty", "depth", "object_id"):
        assert (getattr(at_once, name) == getattr(both, name)).all()


def test_no_line_is_drawn_around_a_shadow_and_lines_go_over_it():
    camera = PerspectiveCamera.look_at((0, 5, 0.01), (0, 0, 0), (60, 60), 1.0)
    plate = Mesh([[-0.5, 1, -0.5], [0.5, 1, -0.5], [0.5, 1, 0.5], [-0.5, 1, 0.5]], [[0, 1, 2], [0, 2, 3]], RED)
    shadow = shadow_meshes([plate], 0.0, light=(1, 1, 0))
    lines = render_passes([plate, *shadow], camera, ink=Ink(2.0))
    bare = render_passes(shadow, camera)
    alone = render_passes(shadow, camera, ink=Ink(2.0))
    assert (alone.beauty == bare.beauty).all()
    drawn = (lines.object_id == 1) & (lines.beauty[..., 0] == 0)
    assert (drawn & (bare.coverage > 0)).any()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"light": (1, -1, 0)}, "light: want"),
        ({"darkness": 2}, "darkness: want 0 to 1"),
        ({"ground": np.inf}, "ground:"),
    ],
)
def test_a_wrong_shadow_is_named(settings, words):
    ground = settings.pop("ground", 0.0)
    with pytest.raises(ValueError, match=words):
        shadow_meshes([], ground, **settings)


def test_layers_have_their_names():
    camera = PerspectiveCamera.look_at((0, 5, 0.01), (0, 0, 0), (6, 4), 1.0)
    passes, shadow = render_passes([], camera), render_shadow([], camera, 0.0)
    channels = exr_channels(passes, shadow)
    assert set(channels) == {"", "Z", "coverage.Y", "object.ID", "shadow.A", "shadow.Z"}
    assert channels["object.ID"].dtype == np.uint32
    with pytest.raises(ValueError, match="shadow: want pictures of"):
        under(passes, render_shadow([], camera, 0.0, samples=2))


def test_measures_find_the_deepest_point_and_the_stretch():
    figure = walker(2, speed=0.0)
    index = figure.limb_names.index("left_thigh")
    start, end = figure.volumes.start[0, index], figure.volumes.end[0, index]
    radius = (figure.volumes.start_radius[0, index] + figure.volumes.end_radius[0, index]) / 2
    middle = (start + end) / 2
    vertices = middle + np.array([[0, 0, 0], [9, 0, 0], [9, 1, 0], [9, 0, 1.0]])
    cloth = Cloth("flag", vertices, np.array([[0, 1, 2], [1, 3, 2]]), (Pin("world", vertices=np.array([3])),))
    scene, cache = SimulationScene(24, 2, (cloth,), (figure,)), MemoryCache()
    cache.write("flag", 0, {"positions": vertices})
    cache.write("flag", 1, {"positions": vertices * 1.5 + (50, 0, 0)})
    measures = measure_cloth(scene, cache, "flag")
    assert measures.penetration[0] == pytest.approx(radius, abs=0.003)
    assert measures.limb == ("left_thigh", "")
    assert measures.penetration[1] == 0
    assert measures.stretch[0] == pytest.approx(0)
    assert measures.stretch[1] == pytest.approx(0.5)
    later = measure_cloth(scene, cache, "flag", frames=[1, 0])
    assert later.limb == ("", "left_thigh")
    np.testing.assert_array_equal(later.penetration, measures.penetration[::-1])
    np.testing.assert_array_equal(later.stretch, measures.stretch[::-1])
    pinned = replace(cloth, pins=(Pin("world", vertices=np.array([0, 1, 2])),))
    free = measure_cloth(replace(scene, elements=(pinned,)), cache, "flag")
    assert free.penetration[0] == 0
    with pytest.raises(ValueError, match="'kilt' is no cloth of the scene"):
        measure_cloth(scene, cache, "kilt")
