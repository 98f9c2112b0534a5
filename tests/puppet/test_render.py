"""The mesh renderer against the slow oracle: no cracks, no double blending, order, textures kept exactly."""

import os
import subprocess
import sys

import numpy as np
import pytest

from pegbar import render_mesh, triangulate
from tests.oracles import render as oracle

QUAD = np.array([[-0.5, -0.5], [7.5, -0.5], [7.5, 5.5], [-0.5, 5.5]])
HALVES = [[0, 1, 2], [0, 2, 3]]


def noise(seed, height=6, width=8, opaque=False):
    texture = np.random.default_rng(seed).integers(0, 256, (height, width, 4), dtype=np.uint8)
    if opaque:
        texture[..., 3] = 255
    return texture


def plain(*color):
    return np.full((2, 2, 4), color, np.uint8)


@pytest.mark.parametrize("triangles", [HALVES, [[0, 2, 1], [0, 3, 2]], [[1, 2, 3], [3, 0, 1]]])
def test_a_texture_that_is_not_moved_is_kept_exactly(triangles):
    texture = noise(0)
    texture[..., 3] |= 1
    assert np.array_equal(render_mesh(QUAD, triangles, QUAD, texture, (8, 6)), texture)


def test_a_checkerboard_under_a_fine_mesh_is_kept_exactly():
    rows, columns = np.mgrid[:40, :50]
    texture = np.where((rows + columns)[..., None] % 2, np.uint8([250, 10, 30, 255]), np.uint8([0, 0, 0, 77]))
    texture[texture[..., 3] == 0] = 0
    outline = [[-0.5, -0.5], [49.5, -0.5], [49.5, 39.5], [-0.5, 39.5]]
    mesh = triangulate([outline], points=np.random.default_rng(1).uniform(1, 38, (60, 2)), spacing=7.3)
    assert np.array_equal(render_mesh(mesh.vertices, mesh.triangles, mesh.vertices, texture, (50, 40)), texture)


@pytest.mark.parametrize("samples", [1, 3])
def test_a_translucent_mesh_has_no_seam(samples):
    rng = np.random.default_rng(2)
    outline = [[-2, -2], [42, -2], [42, 32], [-2, 32]]
    mesh = triangulate([outline], points=np.unique(np.round(rng.uniform(0, 30, (150, 2)) * 4) / 4, axis=0))
    moved = mesh.vertices.copy()
    moved[mesh.points[::2]] += rng.uniform(-0.02, 0.02, (len(mesh.points[::2]), 2))
    got = render_mesh(moved, mesh.triangles, moved % 1, plain(90, 200, 30, 100), (40, 30), samples=samples)
    assert np.array_equal(got, np.broadcast_to(np.uint8([90, 200, 30, 100]), got.shape))


@pytest.mark.parametrize(("seed", "samples"), [(0, 1), (1, 1), (2, 2)])
def test_pictures_equal_the_oracle(seed, samples):
    rng = np.random.default_rng(seed)
    vertices = np.round(rng.uniform(-3, 15, (9, 2)) * 64) / 64
    vertices[:3] = np.round(vertices[:3])
    triangles = np.stack([rng.permutation(9)[:3] for _ in range(6)])
    coordinates = rng.uniform(-2, 9, (9, 2))
    texture = noise(seed)
    depth = rng.integers(0, 3, 9)
    got = render_mesh(vertices, triangles, coordinates, texture, (13, 11), vertex_depth=depth, samples=samples)
    order = depth[triangles].mean(axis=1)
    want = oracle.render_mesh(vertices, triangles, coordinates, texture, (13, 11), order, samples)
    straight = got / 255
    straight[..., :3] *= straight[..., 3:]
    np.testing.assert_allclose(straight, want, atol=1.01 / 255)


def test_farther_triangles_are_painted_first():
    vertices = np.concatenate([QUAD, QUAD])
    coordinates = np.concatenate([np.zeros((4, 2)), np.full((4, 2), 1)])
    texture = np.uint8([[[255, 0, 0, 255], [0, 0, 0, 0]], [[0, 0, 0, 0], [0, 0, 255, 255]]])
    triangles = [*HALVES, [4, 5, 6], [4, 6, 7]]

    def top(**depths):
        return render_mesh(vertices, triangles, coordinates, texture, (8, 6), **depths)[3, 3].tolist()

    red, blue = [255, 0, 0, 255], [0, 0, 255, 255]
    assert top() == blue
    assert top(triangle_depth=[1, 1, 2, 2]) == red
    assert top(triangle_depth=[2, 2, 1, 1]) == blue
    assert top(triangle_depth=[1, 1, 1, 1]) == blue
    assert top(vertex_depth=[-5, -5, -5, -5, -4, -4, -4, -4]) == red


def test_alpha_is_blended_premultiplied():
    vertices = np.concatenate([QUAD, QUAD])
    coordinates = np.concatenate([np.zeros((4, 2)), np.full((4, 2), 1)])
    texture = np.uint8([[[200, 0, 0, 255], [0, 0, 0, 0]], [[0, 0, 0, 0], [0, 100, 0, 51]]])
    got = render_mesh(vertices, [*HALVES, [4, 5, 6], [4, 6, 7]], coordinates, texture, (8, 6))
    assert got[2, 2].tolist() == [160, 20, 0, 255]
    only = render_mesh(QUAD, HALVES, np.full((4, 2), 1), texture, (9, 7))
    assert only[2, 2].tolist() == [0, 100, 0, 51]
    assert not only[6].any()
    assert not only[:, 8].any()
    halfway = render_mesh(QUAD, HALVES, [[0.5, 0]] * 4, texture, (8, 6))
    assert halfway[0, 0].tolist() == [200, 0, 0, 128]


def test_samples_smooth_the_outline_only():
    triangle = [[2, 2], [30, 9], [7, 28]]
    one = render_mesh(triangle, [[0, 1, 2]], triangle, plain(10, 20, 30, 255), (32, 32))
    four = render_mesh(triangle, [[0, 1, 2]], triangle, plain(10, 20, 30, 255), (32, 32), samples=4)
    assert set(np.unique(one[..., 3])) == {0, 255}
    assert len(np.unique(four[..., 3])) > 8
    assert (four[four[..., 3] > 0][:, :3] == [10, 20, 30]).all()
    area = abs(np.linalg.det(np.array([[28, 7], [5, 26]]))) / 2
    assert abs(four[..., 3].sum() / 255 - area) < 0.01 * area


def test_far_thin_and_folded_triangles_stay_finite():
    vertices = [[-1e9, 3], [1e9, 3.5], [5, 1e9], [4, 4], [4, 4], [1e300, -1e300]]
    triangles = [[0, 1, 2], [3, 4, 0], [5, 0, 2], [3, 3, 3]]
    got = render_mesh(vertices, triangles, np.zeros((6, 2)), plain(1, 2, 3, 255), (9, 9))
    assert got.shape == (9, 9, 4)
    assert (got[5] == [1, 2, 3, 255]).all()


def test_an_empty_mesh_is_an_empty_picture():
    assert not render_mesh([], [], [], plain(1, 2, 3, 4), (5, 4)).any()
    assert not render_mesh(QUAD - 99, HALVES, QUAD, noise(0), (5, 4)).any()


def test_the_bits_do_not_depend_on_the_threads():
    code = """
import hashlib, numpy as np
from pegbar import Deformer, render_mesh, triangulate
t = np.linspace(0, 6.283, 60)[:-1]
mesh = triangulate([np.stack([60 * np.cos(t) + 70, 50 * np.sin(t) + 60], 1)], points=[[70, 60], [40, 60]], spacing=6)
positions = np.array([[70, 60], [40, 60]]) + np.random.default_rng(0).normal(0, 4, (20, 2, 2))
moved = Deformer(mesh.vertices, mesh.triangles, mesh.points).deform_many(positions)
texture = np.random.default_rng(1).integers(0, 256, (120, 140, 4), dtype=np.uint8)
pictures = [render_mesh(v, mesh.triangles, mesh.vertices, texture, (140, 120), samples=2) for v in moved]
print(hashlib.sha256(moved.tobytes() + np.array(pictures).tobytes()).hexdigest())
"""

    def run(threads):
        environment = {**os.environ, "RAYON_NUM_THREADS": str(threads)}
        return subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, check=True).stdout

    assert run(1) == run(3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"triangles": [[0, 1, 4]]}, "triangles: want values in 0..3, got 4"),
        ({"texture_coordinates": QUAD[:3]}, "texture_coordinates: want shape"),
        ({"texture": np.zeros((2, 2, 3), np.uint8)}, "texture: want shape"),
        ({"texture": np.zeros((0, 2, 4), np.uint8)}, "texture: want 1 to 16384"),
        ({"texture": np.zeros((2, 2, 4))}, "texture: want integers"),
        ({"vertices": QUAD + np.nan}, "vertices: want finite"),
        ({"size": (0, 5)}, "size: want values in"),
        ({"size": (40_000, 5), "samples": 4}, "size: want 1 to 65536 samples"),
        ({"samples": 0}, "samples: want a whole number"),
        ({"vertex_depth": [1, 2, 3]}, "vertex_depth: want shape"),
        ({"triangle_depth": [1, np.nan]}, "triangle_depth: want finite"),
        ({"vertex_depth": [1] * 4, "triangle_depth": [1] * 2}, "triangle_depth: want it or vertex_depth"),
    ],
)
def test_what_the_renderer_refuses(changes, message):
    arguments = {
        "vertices": QUAD,
        "triangles": HALVES,
        "texture_coordinates": QUAD,
        "texture": noise(0),
        "size": (8, 6),
    }
    with pytest.raises(ValueError, match=message):
        render_mesh(**{**arguments, **changes})


def test_other_memory_orders_give_the_same():
    want = render_mesh(QUAD * 0.7, HALVES, QUAD, noise(3), (8, 6))
    got = render_mesh(
        np.asfortranarray(QUAD * 0.7), np.array(HALVES, np.int16), QUAD.tolist(), noise(3).tolist(), (8, 6)
    )
    assert np.array_equal(got, want)
