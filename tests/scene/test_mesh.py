import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import Mesh
from tests.meshes import box, torus

CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("vertices", {"vertices": [[0, 0], [1, 0], [0, 1]]}),
        ("vertices", {"vertices": [[0, 0, np.nan], [1, 0, 0], [0, 1, 0]]}),
        ("vertices", {"vertices": [[0, 0, np.inf], [1, 0, 0], [0, 1, 0]]}),
        ("triangles", {"triangles": [[0, 1, 3]]}),
        ("triangles", {"triangles": [[0, 1, -1]]}),
        ("triangles", {"triangles": [[0.0, 1.0, 2.0]]}),
        ("triangles", {"triangles": [[0, 1]]}),
        ("colors", {"colors": (1, 1, 1)}),
        ("colors", {"colors": [[1, 1, 1, 1]] * 2}),
        ("colors", {"colors": (1, 1, 1, 1.5)}),
        ("colors", {"colors": (1, 1, np.nan, 1)}),
        ("object_id", {"object_id": 0}),
        ("object_id", {"object_id": 65536}),
        ("object_id", {"object_id": 1.0}),
        ("normals", {"normals": [[0, 0, 1]] * 2}),
        ("normals", {"normals": [[0, 0, np.nan]] * 3}),
    ],
)
def test_wrong_input_is_named(name, arguments):
    with pytest.raises(ValueError, match=f"^{name}: "):
        Mesh(**{"vertices": CORNERS, "triangles": [[0, 1, 2]], "colors": (1, 1, 1, 1), **arguments})


def test_one_color_is_every_vertex_color_and_normals_get_length_one():
    mesh = Mesh(CORNERS, [[0, 1, 2]], (0.1, 0.2, 0.3, 0.4), normals=[[0, 0, 5], [3, 0, 4], [0, 0, 0]])
    assert mesh.colors.dtype == np.float32
    np.testing.assert_allclose(mesh.colors, np.tile([0.1, 0.2, 0.3, 0.4], (3, 1)), rtol=1e-6)
    np.testing.assert_allclose(mesh.normals, [[0, 0, 1], [0.6, 0, 0.8], [0, 0, 0]])


def test_normals_are_weighted_by_area_and_a_vertex_of_no_triangle_has_none():
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 3], [9, 9, 9]]
    mesh = Mesh(vertices, [[0, 1, 2], [0, 2, 3]], (1, 1, 1, 1))
    np.testing.assert_allclose(mesh.normals[0], np.array([3, 0, 1]) / np.sqrt(10))
    np.testing.assert_allclose(mesh.normals[4], 0)


def test_a_torus_has_the_normals_of_a_torus():
    mesh = torus(1.0, 0.4)
    ring = mesh.vertices * [1, 0, 1]
    outward = mesh.vertices - ring / np.linalg.norm(ring, axis=1, keepdims=True)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    assert np.abs(np.einsum("ij,ij->i", outward, mesh.normals)).min() > 0.998


@given(st.integers(1, 65535))
def test_a_mesh_may_be_empty_and_is_never_rewritten(object_id):
    empty = Mesh(np.empty((0, 3)), np.empty((0, 3), int), (1, 1, 1, 1), object_id)
    assert empty.colors.shape == (0, 4)
    assert empty.normals.shape == (0, 3)
    with pytest.raises(AttributeError):
        box((0, 0, 0), 1).object_id = 2
