"""Deformation against the slow oracle, its promises, and what it refuses."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pegbar import Deformer, DegenerateError, average_triangles, fit_triangles, triangulate
from tests.oracles import deform as oracle

STRIP = [[0, 0], [0, 1], [1, 0], [1, 1], [2, 0], [2, 1], [3, 0], [3, 1]]
STRIP_TRIANGLES = [[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5], [4, 6, 5], [5, 6, 7]]
STRIP_HANDLES = [0, 3, 6]


def grid(seed=0):
    """A mesh of a 6 x 4 rectangle with inner points, and five of its vertices as handles."""
    rng = np.random.default_rng(seed)
    mesh = triangulate([[[0, 0], [6, 0], [6, 4], [0, 4]]], points=rng.uniform(0.3, 3.7, (20, 2)), spacing=0.9)
    handles = rng.choice(len(mesh.vertices), 5, replace=False)
    return mesh.vertices, mesh.triangles, handles


def layers():
    """Three strips that share the edge of vertices 0 and 1: an edge of three triangles."""
    vertices, triangles = [[0, 0], [0, 1]], []
    for _ in range(3):
        new = [len(vertices) + k for k in range(4)]
        vertices += [[1, 0], [1, 1], [2, 0], [2, 1]]
        strip = [0, 1, *new]
        triangles += [[strip[i] for i in t] for t in ([0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5])]
    return vertices, triangles, [0, 4, 8, 12]


def turned(points, angle, shift=(0, 0)):
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(points) @ np.array([[c, s], [-s, c]]) + shift


@pytest.mark.parametrize("stitch", ["poisson", "average"])
@pytest.mark.parametrize("iterations", [1, 3])
@pytest.mark.parametrize("make", [grid, layers, lambda: (STRIP, STRIP_TRIANGLES, STRIP_HANDLES)])
def test_deform_equals_the_dense_oracle(make, iterations, stitch):
    vertices, triangles, handles = make()
    rng = np.random.default_rng(1)
    positions = np.asarray(vertices, float)[handles] * 1.3 + rng.normal(0, 0.3, (len(handles), 2))
    shapes = np.asarray(vertices, float)[np.asarray(triangles)] + rng.normal(0, 0.1, (len(triangles), 3, 2))
    mesh = Deformer(vertices, triangles, handles)
    for given_shapes in (None, shapes):
        got = mesh.deform(positions, shapes=given_shapes, iterations=iterations, stitch=stitch)
        want = oracle.deform(vertices, triangles, handles, positions, given_shapes, iterations, stitch)
        np.testing.assert_allclose(got, want, atol=1e-9)
        assert np.array_equal(got[handles], positions)


@settings(deadline=None, max_examples=30)
@given(st.floats(-7, 7), st.floats(-1e4, 1e4), st.integers(0, 50), st.sampled_from(["poisson", "average"]))
def test_a_rigid_motion_of_the_handles_is_that_motion_of_the_mesh(angle, shift, seed, stitch):
    vertices, triangles, handles = grid(seed)
    mesh = Deformer(vertices, triangles, handles)
    want = turned(vertices, angle, (shift, -2 * shift))
    np.testing.assert_allclose(mesh.deform(want[handles], iterations=2, stitch=stitch), want, atol=1e-8)


def test_the_rest_pose_gives_the_rest_mesh():
    vertices, triangles, handles = grid()
    got = Deformer(vertices, triangles, handles).deform(vertices[handles])
    np.testing.assert_allclose(got, vertices, atol=1e-12)


def test_foreshortening_shrinks_length_and_keeps_width():
    along = np.arange(0, 21)
    vertices = np.array([[x, y] for x in along for y in (0, 2, 4)], float)
    cells = [(3 * i + k, 3 * i + 3 + k, 3 * i + 1 + k, 3 * i + 4 + k) for i in range(20) for k in range(2)]
    triangles = [t for a, b, c, d in cells for t in ([a, b, c], [c, b, d])]
    handles = np.arange(1, 63, 3)
    short = vertices * [0.4, 1]
    mesh = Deformer(vertices, triangles, handles)

    def width(places):
        return np.linalg.norm(places[32] - places[30])

    shapes = short[np.asarray(triangles)]
    assert width(mesh.deform(short[handles], shapes=shapes)) > 0.9 * 4
    assert width(mesh.deform(short[handles])) > width(mesh.deform(short[handles], stitch="average"))


def test_many_frames_have_the_bits_of_single_ones():
    vertices, triangles, handles = grid()
    positions = vertices[handles] + np.random.default_rng(3).normal(0, 0.2, (7, len(handles), 2))
    shapes = np.random.default_rng(4).normal(0, 1, (7, len(triangles), 3, 2))
    mesh = Deformer(vertices, triangles, handles)
    for given_shapes in (None, shapes):
        many = mesh.deform_many(positions, shapes=given_shapes, iterations=2)
        for frame, position in enumerate(positions):
            one = mesh.deform(position, shapes=None if given_shapes is None else shapes[frame], iterations=2)
            assert np.array_equal(many[frame], one)
    assert mesh.deform_many(np.empty((0, len(handles), 2))).shape == (0, len(vertices), 2)


def test_a_piece_with_one_handle_turns_with_the_others():
    loose = np.array([[5, 0], [6, 0], [5, 1]])
    vertices = np.concatenate([STRIP, loose])
    mesh = Deformer(vertices, [*STRIP_TRIANGLES, [8, 9, 10]], [*STRIP_HANDLES, 9])
    want = turned(vertices, 1.1, (4, 2))
    np.testing.assert_allclose(mesh.deform(want[[*STRIP_HANDLES, 9]]), want, atol=1e-10)
    alone = Deformer(loose, [[0, 1, 2]], [1])
    np.testing.assert_allclose(alone.deform([[0, 0]]), loose - loose[1], atol=1e-12)


def test_a_piece_without_a_handle_is_named():
    vertices = [*STRIP, [5, 0], [6, 0], [5, 1]]
    with pytest.raises(DegenerateError, match=r"piece 1 .* first is vertex 8\) has no handle"):
        Deformer(vertices, [*STRIP_TRIANGLES, [8, 9, 10]], STRIP_HANDLES)
    with pytest.raises(DegenerateError, match="vertex 8 is in no triangle"):
        Deformer([*STRIP, [9, 9]], STRIP_TRIANGLES, STRIP_HANDLES)
    with pytest.raises(DegenerateError, match="piece 0"):
        Deformer(STRIP, STRIP_TRIANGLES, [])


def test_a_handle_of_no_triangle_goes_to_its_place():
    mesh = Deformer([*STRIP, [9, 9]], STRIP_TRIANGLES, [*STRIP_HANDLES, 8])
    rest = np.asarray(STRIP, float)
    got = mesh.deform([*rest[STRIP_HANDLES], [3, 3]])
    np.testing.assert_allclose(got, [*rest, [3, 3]], atol=1e-12)


def test_parts_that_hang_by_one_vertex_follow_it():
    vertices = np.array([*STRIP, [4, 1], [4, 2]], float)
    mesh = Deformer(vertices, [*STRIP_TRIANGLES, [7, 8, 9]], STRIP_HANDLES)
    want = turned(vertices, -0.7)
    np.testing.assert_allclose(mesh.deform(want[STRIP_HANDLES]), want, atol=1e-8)
    bent = mesh.deform(want[STRIP_HANDLES] + np.array([[0, 0], [0.2, 0], [0, 0.3]]))
    np.testing.assert_allclose(np.linalg.norm(bent[8] - bent[9]), 1, atol=0.05)


@pytest.mark.parametrize(
    "flat", [[[3, 0], [3, 1], [3, 0.5]], [[3, 0], [3, 1], [3, 1]], [[3, 0], [3, 0], [3, 0]], [[3, 0], [3, 1], [3, 9]]]
)
def test_triangles_of_no_area_leave_a_finite_mesh(flat):
    vertices = np.array([*STRIP, flat[2]], float)
    vertices[[6, 7]] = flat[:2]
    triangles = [*STRIP_TRIANGLES, [6, 8, 7]]
    mesh = Deformer(vertices, triangles, [0, 3, 8])
    want = turned(vertices, 0.4)
    np.testing.assert_allclose(mesh.deform(want[[0, 3, 8]]), want, atol=1e-8)
    assert np.isfinite(mesh.deform([[0, 0], [1, 3], [-2, 5]], iterations=3)).all()
    assert np.isfinite(mesh.deform([[0, 0]] * 3, iterations=3)).all()


def test_handles_in_one_place_do_not_break_it():
    mesh = Deformer(STRIP, STRIP_TRIANGLES, [0, 7])
    assert np.isfinite(mesh.deform([[1, 1], [1, 1]], iterations=2)).all()
    twins = [*STRIP, [0, 0]]
    pair = Deformer(twins, [*STRIP_TRIANGLES, [8, 2, 1]], [0, 8])
    assert np.isfinite(pair.deform([[0, 0], [0.5, 0]])).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((STRIP, [[0, 1, 8]], [0, 1]), "triangles: want values in 0..7, got 8"),
        ((STRIP, STRIP_TRIANGLES, [0, 8]), "handles: want values in 0..7"),
        ((STRIP, STRIP_TRIANGLES, [0, 6, 6]), "handles: vertex 6 is given twice"),
        (([[0, np.nan]], [], [0]), "vertices: want finite"),
        (([[0, 0, 0]], [], [0]), r"vertices: want shape \(n, 2\)"),
    ],
)
def test_what_the_deformer_refuses(arguments, message):
    with pytest.raises(ValueError, match=message):
        Deformer(*arguments)


def test_what_deform_refuses():
    mesh = Deformer(STRIP, STRIP_TRIANGLES, STRIP_HANDLES)
    rest = np.asarray(STRIP, float)[STRIP_HANDLES]
    for name, positions, options in (
        ("positions", rest[:2], {}),
        ("positions", rest + np.inf, {}),
        ("shapes", rest, {"shapes": np.zeros((5, 3, 2))}),
        ("iterations", rest, {"iterations": 0}),
        ("stitch", rest, {"stitch": "mean"}),
    ):
        with pytest.raises(ValueError, match=f"^{name}: want"):
            mesh.deform(positions, **options)


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10_000))
def test_fitting_and_averaging_equal_the_oracle(seed):
    rng = np.random.default_rng(seed)
    shapes, places = rng.normal(0, 3, (9, 3, 2)), rng.normal(0, 3, (7, 2))
    triangles = np.stack([rng.permutation(7)[:3] for _ in range(9)])
    triangles[:3, 0], triangles[:3, 1], triangles[:3, 2] = [0, 3, 6], [1, 4, 0], [2, 5, 1]
    fitted = fit_triangles(shapes, places, triangles)
    np.testing.assert_allclose(fitted, oracle.fit_triangles(shapes, places, triangles), atol=1e-12)
    np.testing.assert_allclose(
        average_triangles(fitted, triangles, 7), oracle.average_triangles(fitted, triangles, 7), atol=1e-12
    )


def test_fortran_order_lists_and_small_floats_give_the_same():
    places, triangles = np.asarray(STRIP, np.float32), np.asfortranarray(STRIP_TRIANGLES)
    shapes = places[triangles]
    want = fit_triangles(shapes.astype(float), places.astype(float), triangles)
    assert np.array_equal(fit_triangles(shapes.tolist(), np.asfortranarray(places), triangles.tolist()), want)


def test_what_fitting_and_averaging_refuse():
    with pytest.raises(ValueError, match="triangles: want values in 0..7"):
        fit_triangles(np.zeros((1, 3, 2)), STRIP, [[0, 1, -1]])
    with pytest.raises(ValueError, match=r"shapes: want shape \(6, 3, 2\)"):
        fit_triangles(np.zeros((1, 3, 2)), STRIP, STRIP_TRIANGLES)
    with pytest.raises(ValueError, match="no triangle has the vertex at index 3"):
        average_triangles(np.zeros((1, 3, 2)), [[0, 1, 2]], 4)
    with pytest.raises(ValueError, match="n: want the number of vertices"):
        average_triangles(np.zeros((1, 3, 2)), [[0, 1, 2]], -1)


@pytest.mark.parametrize(("name", "edges", "flips"), [("char1", 6.6, 7.3), ("char4", 5.8, 9.0)])
def test_real_figures_keep_their_edges_and_sides(test_data, name, edges, flips):
    data = np.load(test_data / "deform" / f"arap_{name}.npz")
    vertices, triangles, positions = data["vertices"], data["triangles"], data["positions"]
    got = Deformer(vertices, triangles, data["handles"]).deform_many(positions)
    pairs = np.unique(
        np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])), axis=0
    )

    def lengths(places):
        return np.linalg.norm(places[..., pairs[:, 0], :] - places[..., pairs[:, 1], :], axis=-1)

    def areas(places):
        a, b = (places[..., triangles[:, k], :] - places[..., triangles[:, 0], :] for k in (1, 2))
        return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]

    assert 100 * np.abs(lengths(got) / lengths(vertices) - 1).mean() <= edges
    assert 100 * (areas(got) * areas(vertices) <= 0).mean() <= flips
