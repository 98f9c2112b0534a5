"""Triangulations of outlines: what is covered, kept, and refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pegbar import triangulate

SQUARE = np.array([[0, 0], [8, 0], [8, 8], [0, 8]], float)


def areas(mesh):
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2


def ring_area(ring):
    x, y = np.asarray(ring, float).T
    return abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) / 2


def edges(mesh):
    pairs = np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]])
    return {tuple(sorted(pair)) for pair in pairs.tolist()}


def star(seed, count=24):
    """A star-shaped outline: never crosses itself."""
    rng = np.random.default_rng(seed)
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return rng.uniform(3, 10, count)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 1000), st.sampled_from([None, 0.7, 2.0]))
def test_triangles_fill_the_outline_and_nothing_else(seed, spacing):
    outline = star(seed)
    mesh = triangulate([outline], points=[[0, 0], [0.5, 0.5]], segments=[[0, 1]], spacing=spacing)
    assert (areas(mesh) > 0).all()
    np.testing.assert_allclose(areas(mesh).sum(), ring_area(outline))
    assert np.array_equal(mesh.vertices[: len(outline)], outline)
    assert mesh.points.tolist() == [24, 25]
    assert (24, 25) in edges(mesh)
    loop = mesh.rings[0]
    assert {tuple(sorted(pair)) for pair in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)} <= edges(mesh)
    assert set(mesh.triangles.ravel()) == set(range(len(mesh.vertices)))


def test_inner_points_are_regular_and_keep_their_distance():
    mesh = triangulate([SQUARE], points=[[4, 4]], spacing=1.0)
    away = np.linalg.norm(mesh.vertices[:, None] - mesh.vertices, axis=-1) + 9 * np.eye(len(mesh.vertices))
    assert away.min() >= 0.5 - 1e-12
    assert away.min(axis=1).max() <= 1.0 + 1e-9
    assert len(mesh.rings[0]) == 32
    assert areas(mesh).max() < 0.8


def test_edges_are_split_only_when_wanted():
    assert triangulate([SQUARE], spacing=3.0, split_edges=False).rings[0].tolist() == [0, 1, 2, 3]
    split = triangulate([SQUARE], spacing=3.0)
    assert len(split.rings[0]) == 12
    places = split.vertices[split.rings[0]]
    np.testing.assert_allclose(np.linalg.norm(np.roll(places, -1, axis=0) - places, axis=1), 8 / 3)


def test_max_area_is_about_the_largest_triangle():
    mesh = triangulate([SQUARE * 10], max_area=4.0)
    assert 2 < np.median(areas(mesh)) <= 4.01
    assert areas(mesh).max() < 8


def test_holes_islands_and_separate_outlines():
    hole, island = SQUARE / 2 + 2, SQUARE / 4 + 3
    mesh = triangulate([SQUARE, island, SQUARE + np.array([20, 0])], holes=[hole[::-1]])
    np.testing.assert_allclose(areas(mesh).sum(), 64 - 16 + 4 + 64)
    assert len(mesh.rings) == 4
    assert np.array_equal(mesh.vertices[mesh.rings[3]], hole[::-1])


def test_the_outline_may_run_either_way():
    for outline in (SQUARE, SQUARE[::-1]):
        assert (areas(triangulate([outline])) > 0).all()


@pytest.mark.parametrize(
    ("outlines", "options", "message"),
    [
        ([], {}, "outlines: want one or more"),
        ([SQUARE[:2]], {}, r"outlines\[0\]: want three places or more, got 2"),
        ([[[0, 0], [1, 1], [3, 3]]], {}, r"outlines\[0\]: all places lie on one line"),
        ([[[2, 2], [2, 2], [2, 2]]], {}, r"outlines\[0\]: all places lie on one line"),
        ([SQUARE[[0, 2, 1, 3]]], {}, r"edge outlines\[0\]\[\d\] - outlines\[0\]\[\d\] crosses the edge outlines"),
        ([SQUARE, SQUARE + 4], {}, r"outlines\[[01]\].* crosses the edge outlines\[[01]\]"),
        ([SQUARE], {"holes": [SQUARE + np.array([4, 0.5])]}, r"crosses the edge"),
        ([SQUARE], {"holes": [SQUARE + 20]}, r"holes\[0\]\[0\]: not inside the outlines"),
        ([SQUARE], {"points": [[1, 1], [9, 9]]}, r"points\[1\]: not inside the outlines"),
        ([SQUARE], {"points": [[1, 1], [8, 8]]}, r"points\[1\]: the same place as outlines\[0\]\[2\]"),
        ([SQUARE], {"points": [[1, 1], [2, 2]], "segments": [[0, 2]]}, "segments: want values in 0..1"),
        ([SQUARE], {"points": [[1, 1]], "segments": [[0, 0]]}, r"segments\[0\]: want two different points"),
        ([SQUARE], {"spacing": 0}, "spacing: want a positive number"),
        ([SQUARE], {"spacing": 1, "max_area": 1}, "max_area: want it or spacing"),
        ([SQUARE + np.inf], {}, r"outlines\[0\]: want finite"),
    ],
)
def test_what_is_refused(outlines, options, message):
    with pytest.raises(ValueError, match=message):
        triangulate(outlines, **options)


def test_a_point_on_the_outline_is_kept():
    mesh = triangulate([SQUARE], points=[[8, 4], [2.5, 0]], spacing=2.0)
    assert set(mesh.points.tolist()) <= set(mesh.triangles.ravel().tolist())
    np.testing.assert_allclose(areas(mesh).sum(), 64)
    assert (areas(mesh) > 0).all()
