import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pegbar import Ink, Mesh, Passes, PerspectiveCamera, render_passes
from tests.meshes import flat_camera, pixel_mesh, rectangle, ribbon, torus
from tests.oracles import raster as oracle

SIZE = (13, 11)
quarter = st.integers(-16, 72).map(lambda k: k / 4)
anywhere = st.floats(-4, 18, allow_subnormal=False)
coordinate = st.one_of(quarter, anywhere, st.integers(-1024, 4096).map(lambda k: k / 256))
camera = flat_camera(*SIZE)


@st.composite
def meshes(draw):
    made = []
    for object_id in range(1, draw(st.integers(1, 3)) + 1):
        pixels = draw(st.lists(st.tuples(coordinate, coordinate), min_size=3, max_size=5))
        count = len(pixels)
        depths = draw(st.lists(st.floats(0.5, 8), min_size=count, max_size=count))
        corners = st.lists(st.integers(0, count - 1), min_size=3, max_size=3)
        triangles = draw(st.lists(corners, min_size=1, max_size=3))
        colors = draw(st.lists(st.tuples(*[st.floats(0, 1, width=32)] * 4), min_size=count, max_size=count))
        made.append(pixel_mesh(camera, pixels, depths, triangles, colors, object_id))
    return made


def is_sound(mesh):
    """No triangle so thin that the oracle's plane is lost in rounding."""
    corners = oracle.snapped(camera, mesh.vertices)
    return all(t[0] == t[1] or abs(oracle.cross(*corners[t].tolist())) > 4000 for t in mesh.triangles)


@settings(max_examples=50)
@given(meshes())
def test_equals_the_oracle(scene):
    scene = [mesh for mesh in scene if is_sound(mesh)]
    got = render_passes(scene, camera)
    depth, coverage, objects, color = oracle.render(scene, camera)
    assert np.array_equal(got.coverage, coverage)
    np.testing.assert_allclose(got.depth, depth, rtol=2e-5)
    for place, among in np.ndenumerate(objects):
        assert got.object_id[place] in among
        if len(among) == 1:
            np.testing.assert_allclose(got.beauty[place], color[place], atol=2e-4)


@settings(max_examples=30)
@given(st.floats(2.1, 9.9), st.floats(2.1, 8.9), st.integers(3, 12), st.booleans())
def test_a_fan_around_any_point_covers_its_square_exactly_once(x, y, spokes, on_a_sample):
    if on_a_sample:
        x, y = round(x), round(y)
    left, top, right, bottom = 2, 2, 10, 9
    turns = np.linspace(0, 4, 4 * spokes, endpoint=False)
    corners = np.array([[left, top], [right, top], [right, bottom], [left, bottom], [left, top]], float)
    side, along = turns.astype(int), (turns % 1)[:, None]
    rim = corners[side] * (1 - along) + corners[side + 1] * along
    count = len(rim)
    fan = [[0, 1 + k, 1 + (k + 1) % count] for k in range(count)]
    points = [[x, y], *rim]
    hits = sum(render_passes([pixel_mesh(camera, points, 2.0, [t])], camera).coverage for t in fan)
    want = np.zeros(SIZE[::-1])
    want[top:bottom, left:right] = 1
    assert np.array_equal(hits, want)


@settings(max_examples=25)
@given(st.lists(st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2)), min_size=9, max_size=9), st.floats(0.3, 5))
def test_a_grid_with_shaken_vertices_covers_its_square_exactly_once(shakes, slope):
    i, j = np.meshgrid(np.arange(5), np.arange(5), indexing="ij")
    points = np.stack([i, j], axis=-1).astype(float)
    points[1:4, 1:4] += np.array(shakes).reshape(3, 3, 2)
    points = points.reshape(-1, 2) * 2.5
    depths = 1 + slope * (points[:, 0] + points[:, 1]) / 20
    cells = [a + 5 * b for a in range(4) for b in range(4)]
    triangles = [t for c in cells for t in ([c, c + 1, c + 6], [c, c + 6, c + 5])]
    hits = sum(render_passes([pixel_mesh(camera, points, depths, [t])], camera).coverage for t in triangles)
    want = np.zeros(SIZE[::-1])
    want[:10, :10] = 1
    assert np.array_equal(hits, want)


@settings(max_examples=25)
@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.sampled_from([0.01, 0.6, 2.0]), st.sampled_from([50.0, 1e9]))
def test_a_ground_around_the_camera_is_cut_at_the_near_plane(turn, tilt, near, reach):
    eye = np.array([0.0, 1.6, 0.0])
    ahead = np.array([np.sin(turn), 0, np.cos(turn)])
    view = PerspectiveCamera.look_at(eye, eye + ahead + [0, 0.3 * tilt - 0.4, 0], (40, 30), 1.2)
    # A fan around a point behind the camera: every triangle passes through the near plane or far outside.
    rim = [[reach * np.cos(a), 0, reach * np.sin(a)] for a in np.linspace(0, 2 * np.pi, 9)[:-1]]
    fan = [[0, 1 + k, 1 + (k + 1) % 8] for k in range(8)]
    ground = Mesh([-ahead, *rim], fan, (1, 1, 1, 1))
    got = render_passes([ground], view, near=near)
    rows, columns = np.mgrid[:30, :40]
    rays = view.unproject(np.stack([columns, rows], axis=-1), np.ones((30, 40))) - eye
    with np.errstate(divide="ignore"):
        depth = np.where(rays[..., 1] < 0, -eye[1] / rays[..., 1], np.inf)
    seen = (depth >= near) & (depth < 0.7 * reach)
    rim_of_cut = np.abs(depth / near - 1) < 0.05
    np.testing.assert_allclose(got.depth[seen & ~rim_of_cut], depth[seen & ~rim_of_cut], rtol=1e-5)
    assert not got.coverage[(depth < near) & ~rim_of_cut].any()
    assert not got.coverage[rays[..., 1] >= 0].any()
    hits = sum(render_passes([Mesh(ground.vertices, [t], (1, 1, 1, 1))], view, near=near).coverage for t in fan)
    assert np.array_equal(hits, got.coverage)


def test_the_near_plane_cuts_a_slanted_square_where_its_depth_is_near():
    # Depth runs linearly in the world from 0.5 left to 3 right: the cut is a vertical line of known place.
    mesh = Mesh([[-0.5, -9, 0.5], [3, -9, 3], [3, 9, 3], [-0.5, 9, 0.5]], [[0, 1, 2], [0, 2, 3]], (1, 1, 1, 1))
    x = -0.5 + 3.5 * (1.25 - 0.5) / 2.5
    column = 64 * x / 1.25 + SIZE[0] / 2
    wide = flat_camera(120, 9)
    column += (120 - SIZE[0]) / 2
    got = render_passes([mesh], wide, near=1.25)
    assert np.array_equal(got.coverage[4] > 0, np.arange(120) >= np.ceil(column))
    assert got.depth.min() == pytest.approx(1.25, rel=0.02)


def test_what_is_behind_far_or_without_area_is_not_drawn_and_harms_nothing():
    odd = Mesh(
        [[0, 0, -1], [1, 0, -1], [0, 1, -2], [0, 0, 0], [1, 0, 0], [0, 1, 0], [1e20, 0, 5], [1e20, 1, 5], [0, 0, 2]],
        [[0, 1, 2], [3, 4, 5], [6, 7, 6], [8, 8, 8], [0, 3, 4], [6, 7, 2]],
        (1, 1, 1, 1),
    )
    assert not render_passes([odd], camera).coverage.any()
    with pytest.raises(ValueError, match=r"^vertices: .* at index 1"):
        render_passes([Mesh([[0, 0, 1], [1e200, 0, 1], [0, 1, 1]], [[0, 1, 2]], (1, 1, 1, 1))], camera)


def test_huge_triangles_cover_the_picture_with_their_depth():
    far = 1e8
    mesh = Mesh([[-far, -far, 3], [far, -far, 3], [0, 2 * far, 3]], [[0, 1, 2]], (0.5, 0.5, 0.5, 1))
    got = render_passes([mesh], camera)
    assert (got.depth == 3).all()
    assert (got.coverage == 1).all()
    assert (got.beauty == [0.5, 0.5, 0.5, 1]).all()


def test_attributes_are_perspective_correct():
    view = flat_camera(200, 20)
    edge = pixel_mesh(view, [[0, 0], [200, 0], [200, 20], [0, 20]], [1, 9, 9, 1], [[0, 1, 2], [0, 2, 3]])
    ramp = np.array([0, 1, 1, 0])[:, None] * [1, 1, 1, 0] + [0, 0, 0, 1]
    got = render_passes([Mesh(edge.vertices, edge.triangles, ramp)], view)
    x = view.unproject(np.stack([np.arange(200), np.full(200, 10)], axis=1), got.depth[10])[:, 0]
    want = (x - edge.vertices[0, 0]) / np.ptp(edge.vertices[:, 0])
    np.testing.assert_allclose(got.beauty[10, :, 0], want, atol=1e-5)
    assert got.beauty[10, 100, 0] == pytest.approx(0.1, abs=0.01)


def test_of_equal_depths_the_first_stays_and_alpha_does_not_blend():
    first = rectangle(camera, 0, 0, 13, 11, 2.0, (1, 0, 0, 0.25), 5)
    second = rectangle(camera, 0, 0, 13, 11, 2.0, (0, 1, 0, 1), 6)
    got = render_passes([first, second], camera)
    assert (got.object_id == 5).all()
    assert (got.beauty == [0.25, 0, 0, 0.25]).all()
    assert (got.coverage == 1).all()
    assert (render_passes([second, first], camera).object_id == 6).all()


def test_nothing_gives_background():
    empty = Mesh(np.empty((0, 3)), np.empty((0, 3), int), (1, 1, 1, 1))
    for scene in ([], [empty]):
        got = render_passes(scene, camera, samples=2, bands=[1], ink=Ink())
        assert got.beauty.shape == (22, 26, 4)
        assert (got.depth == np.inf).all()
        for part in (got.beauty, got.coverage, got.object_id):
            assert not part.any()
        assert (got.beauty.dtype, got.depth.dtype, got.coverage.dtype) == (np.float32,) * 3
        assert got.object_id.dtype == np.uint16


def test_supersamples_are_the_samples_of_a_larger_picture():
    view = PerspectiveCamera.look_at((0.6, 0.9, 2.6), (0, 0, 0), (48, 36), 0.8)
    scene = [torus(0.7, 0.2), ribbon()]
    got, large = render_passes(scene, view, samples=3), render_passes(scene, view.scaled(3))
    assert got.samples == 3
    assert np.array_equal(got.depth, large.depth)
    assert np.array_equal(got.object_id, large.object_id)
    assert np.array_equal(got.beauty, large.beauty)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("given_normals", [None, 1, -1])
def test_bands_divide_the_cosine_evenly_on_the_side_that_is_seen(turned, given_normals):
    # The square looks along -z to the camera whatever its winding or its normals say.
    order = [[0, 2, 1], [0, 3, 2]] if turned else [[0, 1, 2], [0, 2, 3]]
    square = rectangle(camera, 0, 0, 13, 11, 2.0, (0.5, 1, 0.25, 0.5))
    normals = None if given_normals is None else np.tile([0, 0, given_normals], (4, 1))
    mesh = Mesh(square.vertices, order, square.colors, normals=normals)
    for cosine, factor in [
        (-0.99, 0.1),
        (-0.51, 0.1),
        (-0.49, 0.2),
        (-0.01, 0.2),
        (0.01, 0.4),
        (0.49, 0.4),
        (0.51, 0.8),
    ]:
        light = 7 * np.array([np.sqrt(1 - cosine**2), 0, -cosine])
        got = render_passes([mesh], camera, light=light, bands=[0.1, 0.2, 0.4, 0.8])
        np.testing.assert_allclose(
            got.beauty, np.tile([0.25 * factor, 0.5 * factor, 0.125 * factor, 0.5], (11, 13, 1)), rtol=1e-6
        )


def test_bands_follow_the_interpolated_normal():
    view = PerspectiveCamera.look_at((0, 2.6, 0.1), (0, 0, 0), (90, 70), 0.8)
    ring = torus(0.8, 0.3, (1, 1, 1, 1), detail=(96, 48))
    got = render_passes([ring], view, light=(1, 0, 0), bands=[0.25, 1])
    inside = np.isfinite(got.depth)
    rows, columns = np.nonzero(inside)
    points = view.unproject(np.stack([columns, rows], axis=1), got.depth[inside])
    outward = points[:, 0] * (1 - 0.8 / np.linalg.norm(points[:, [0, 2]], axis=1))
    clear = np.abs(outward) > 0.02
    assert np.array_equal(got.beauty[inside][clear][:, 0] == 1, outward[clear] > 0)


SCRIPT = """
import hashlib
from pegbar import Ink, PerspectiveCamera, render_passes
from tests.meshes import box, ribbon, torus
view = PerspectiveCamera.look_at((0.6, 0.9, 2.6), (0, 0, 0), (160, 120), 0.8)
got = render_passes([torus(0.7, 0.2), ribbon(), box((0.5, 0.1, 0.1), 0.5)], view, samples=2, bands=[0.4, 1], ink=Ink(2))
small = got.resolved()
for part in (got.beauty, got.depth, got.coverage, got.object_id, small.beauty, small.depth, small.object_id):
    print(hashlib.sha256(part.tobytes()).hexdigest())
"""


def test_the_number_of_threads_changes_no_bit():
    results = []
    for threads in ("1", "2", "5"):
        run = subprocess.run(
            [sys.executable, "-c", SCRIPT],
            env={**os.environ, "RAYON_NUM_THREADS": threads},
            capture_output=True,
            text=True,
            check=True,
        )
        results.append(run.stdout)
    assert len(results[0].split()) == 7
    assert results[0] == results[1] == results[2]


@given(st.integers(1, 4), st.integers(0, 5), st.integers(0, 4), st.integers(0, 2**32 - 1))
def test_resolving_equals_the_oracle(factor, height, width, seed):
    random = np.random.default_rng(seed)
    shape = (height * factor, width * factor)
    depth = random.choice(np.array([0.5, 1, 2, np.inf], np.float32), shape)
    object_id = random.integers(0, 5, shape).astype(np.uint16)
    beauty, coverage = random.random((*shape, 4), np.float32), random.random(shape, np.float32)
    got = Passes(beauty, depth, coverage, object_id, factor).resolved()
    want = oracle.resolve(beauty, depth, coverage, object_id, factor)
    assert got.samples == 1
    np.testing.assert_allclose(got.beauty, want[0], atol=1e-6)
    np.testing.assert_allclose(got.coverage, want[2], atol=1e-6)
    assert np.array_equal(got.depth, want[1])
    nearest = np.isfinite(got.depth)
    assert np.array_equal(got.object_id[nearest], want[3][nearest])
    assert not got.object_id[~nearest].any()


def test_wrong_passes_are_named_when_resolved():
    plane, color, ids = np.ones((4, 6), np.float32), np.ones((4, 6, 4), np.float32), np.ones((4, 6), np.uint16)
    for name, parts in [
        ("samples", (color, plane, plane, ids, 4)),
        ("samples", (color, plane, plane, ids, 0)),
        ("beauty", (color[:2], plane, plane, ids, 2)),
        ("coverage", (color, plane, plane[:, :2], ids, 2)),
        ("object_id", (color, plane, plane, plane, 2)),
    ]:
        with pytest.raises(ValueError, match=f"^{name}: "):
            Passes(*parts).resolved()
    broken = plane.copy()
    broken[3, 5] = np.nan
    for name, parts in [
        ("depth", (color, broken, plane, ids, 2)),
        ("coverage", (color, plane, broken, ids, 2)),
        ("beauty", (color * broken[..., None], plane, plane, ids, 2)),
    ]:
        with pytest.raises(ValueError, match=f"^{name}: .* row 3, column 5"):
            Passes(*parts).resolved()


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("samples", {"samples": 0}),
        ("samples", {"samples": 1.5}),
        ("near", {"near": 0}),
        ("near", {"near": np.nan}),
        ("light", {"light": (0, 0, 0)}),
        ("light", {"light": (0, np.nan, 0)}),
        ("bands", {"bands": []}),
        ("bands", {"bands": [0.5, -1]}),
        ("bands", {"bands": [np.inf]}),
        ("ink", {"ink": Ink(width=1000)}),
    ],
)
def test_wrong_options_are_named(name, options):
    with pytest.raises(ValueError, match=f"^{name}: "):
        render_passes([rectangle(camera, 0, 0, 5, 5, 2.0)], camera, **options)
