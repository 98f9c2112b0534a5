import math

import numpy as np
import pytest

from pegbar import Ink, Mesh, PerspectiveCamera, render_passes
from tests.meshes import box, flat_camera, pixel_mesh, rectangle, sheet, torus

camera = flat_camera(60, 50)
INK = (0.5, 0.0, 1.0, 1.0)


def lines(passes):
    return (passes.beauty == np.float32(INK)).all(axis=-1)


def ring(left, top, right, bottom, width, shape=(50, 60)):
    """Samples within ``width`` of a rectangle, but not inside."""
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    # The rectangle's last samples stand half a sample within its rim.
    x = np.maximum(np.maximum(left - columns, columns - (right - 1)), 0)
    y = np.maximum(np.maximum(top - rows, rows - (bottom - 1)), 0)
    distance = np.hypot(x, y)
    return (distance > 0) & (distance <= width + 0.5)


@pytest.mark.parametrize("width", [1, 2, 3.5])
@pytest.mark.parametrize("samples", [1, 2])
def test_an_outline_grows_out_over_the_farther_with_the_nearer_depth_and_object(width, samples):
    wall = rectangle(camera, -9, -9, 70, 70, 4.0, (0, 1, 0, 1), 7)
    front = rectangle(camera, 20, 15, 40, 30, 2.0, (1, 0, 0, 1), 3)
    got = render_passes([wall, front], camera, samples=samples, ink=Ink(width, INK))
    k = samples
    # Corners at pixels (20, 15) are samples 20 k + (k - 1) / 2, so the first covered one is that, rounded up.
    edge = [math.ceil(v * k + (k - 1) / 2) for v in (20, 15, 40, 30)]
    want = ring(*edge, width * k, (50 * k, 60 * k))
    assert np.array_equal(lines(got), want)
    assert (got.depth[want] == 2).all()
    assert (got.object_id[want] == 3).all()
    plain = render_passes([wall, front], camera, samples=samples)
    for name in ("beauty", "depth", "coverage", "object_id"):
        assert np.array_equal(getattr(got, name)[~want], getattr(plain, name)[~want])


def test_an_outline_never_covers_what_is_nearer_and_covers_the_background():
    front = rectangle(camera, 20, 15, 40, 30, 2.0, (1, 0, 0, 1), 3)
    nearer = rectangle(camera, 38, 10, 50, 20, 1.0, (0, 0, 1, 1), 4)
    got = render_passes([front, nearer], camera, ink=Ink(3, INK))
    assert (got.object_id[10:20, 38:50] == 4).all()
    assert not lines(got)[10:20, 38:50].any()
    assert (got.depth[10:20, 51] == 1).all()
    assert (got.object_id[15:20, 35:38] == 4).all()
    assert (got.depth[24:28, 41] == 2).all()
    assert (got.coverage[lines(got)] == 1).all()
    assert not got.coverage[:5].any()


def test_the_same_object_is_outlined_where_its_depth_jumps():
    parts = [rectangle(camera, 5, 5, 55, 45, 4.0), rectangle(camera, 20, 15, 40, 30, 3.9)]
    vertices = np.concatenate([part.vertices for part in parts])
    both = Mesh(vertices, np.concatenate([parts[0].triangles, parts[1].triangles + 4]), (0, 1, 0, 1))
    inner = ring(20, 15, 40, 30, 2)
    got = render_passes([both], camera, ink=Ink(2, INK, depth_jump=0.02))
    assert np.array_equal(lines(got)[8:42, 8:52], inner[8:42, 8:52])
    assert np.unique(got.depth[inner]) == np.float32(3.9)
    got = render_passes([both], camera, ink=Ink(2, INK, depth_jump=0.03))
    assert not lines(got)[8:42, 8:52].any()


def test_a_floor_seen_at_a_slant_has_no_lines_on_it():
    view = PerspectiveCamera.look_at((0, 0.3, 0), (0, 0, 8), (60, 50), 1.0)
    x, z = np.meshgrid(np.linspace(-60, 60, 7), np.linspace(-3, 300, 9))
    points = np.stack([x, 0 * x, z], axis=-1).reshape(-1, 3)
    cells = [a + 7 * b for b in range(8) for a in range(6)]
    floor = Mesh(points, [t for c in cells for t in ([c, c + 1, c + 8], [c, c + 8, c + 7])], (0, 1, 0, 1))
    got = render_passes([floor], view, ink=Ink(1, INK))
    drawn = lines(got)
    horizon = np.flatnonzero(drawn.any(axis=1))
    assert drawn.any()
    assert np.ptp(horizon) <= 1
    assert got.coverage[horizon.max() + 1 :].all()


@pytest.mark.parametrize(("width", "thickness"), [(1, 1), (2, 2), (3, 3), (4, 4)])
def test_a_crease_lies_on_its_surface_half_to_either_side(width, thickness):
    # A roof whose ridge stands upright in the picture's middle, nearer than its eaves, 90 degrees wide.
    roof = Mesh(
        [[0, -9, 2], [0, 9, 2], [-9, -9, 11], [-9, 9, 11], [9, -9, 11], [9, 9, 11]],
        [[0, 1, 2], [1, 2, 3], [0, 1, 4], [1, 4, 5]],
        (0, 1, 0, 1),
    )
    got = render_passes([roof], camera, ink=Ink(width, INK, crease_angle=math.radians(89)))
    plain = render_passes([roof], camera)
    row = lines(got)[25]
    assert row.sum() == thickness
    assert abs(np.flatnonzero(row).mean() - 29.5) <= 0.5
    assert np.array_equal(got.depth, plain.depth)
    assert np.array_equal(got.object_id, plain.object_id)
    for none in (math.radians(91), None):
        assert not lines(render_passes([roof], camera, ink=Ink(width, INK, crease_angle=none))).any()


def test_smooth_surfaces_have_no_creases_where_they_turn_away_nor_where_windings_disagree():
    def strip(u, v):
        turn, across = np.pi * u, (v - 0.5) * 0.8
        return np.stack([2 * (u - 0.5), across * np.cos(turn), across * np.sin(turn)], axis=-1)

    # From here a few samples that show the strip's back lie beside such that show its front.
    view = PerspectiveCamera.look_at((0, 0.3, 4), (0, 0, 0), (121, 61), 0.6)
    for mesh in (sheet(strip, 40, 4), torus(0.7, 0.22)):
        with_creases, without = (render_passes([mesh], view, ink=Ink(2, INK, angle)) for angle in (math.pi / 3, None))
        assert lines(without).any()
        assert np.array_equal(lines(with_creases), lines(without))
    square = rectangle(camera, 5, 5, 55, 45, 4.0)
    mixed = Mesh(square.vertices, [[0, 1, 2], [0, 3, 2]], (0, 1, 0, 1))
    assert not lines(render_passes([mixed], camera, ink=Ink(2, INK)))[5:45, 5:55].any()


def test_a_line_where_two_objects_cut_each_other_has_its_own_width():
    wall = rectangle(camera, -9, -9, 70, 70, 4.0, (0, 1, 0, 1), 7)
    slant = pixel_mesh(
        camera, [[-9, -9], [70, -9], [70, 70], [-9, 70]], [3, 6, 6, 3], [[0, 1, 2], [0, 2, 3]], (1, 0, 0, 1), 8
    )
    got, plain = (render_passes([wall, slant], camera, ink=ink) for ink in (Ink(4, INK), None))
    assert (lines(got).sum(axis=1) == 4).all()
    assert np.array_equal(got.depth, plain.depth)
    assert np.array_equal(got.object_id, plain.object_id)


def test_lines_grow_in_from_outside_of_the_picture():
    outside = rectangle(camera, -30, 10, 0, 30, 2.0, object_id=9)
    got = render_passes([outside], camera, ink=Ink(3, INK))
    assert np.array_equal(np.unique(np.nonzero(got.object_id)[1]), [0, 1, 2])
    assert (got.depth[10:30, :3] == 2).all()


def test_a_part_of_the_picture_has_the_lines_of_the_whole():
    scene = [torus(0.7, 0.2), box((0.5, 0.1, 0.1), 0.5)]
    whole = PerspectiveCamera.look_at((0.6, 0.9, 2.6), (0, 0, 0), (120, 150), 0.8)
    part = PerspectiveCamera([[1, 0, -17], [0, 1, -45], [0, 0, 1]] @ whole.matrix, (80, 70))
    want, got = (render_passes(scene, view, bands=[0.3, 1], ink=Ink(2.5, INK)) for view in (whole, part))
    window = np.s_[45:115, 17:97]
    assert lines(got).sum() > 300
    assert np.array_equal(lines(got), lines(want)[window])
    assert np.array_equal(got.object_id, want.object_id[window])
    np.testing.assert_allclose(got.depth, want.depth[window], rtol=1e-6)


def test_ink_lies_over_what_it_covers_by_its_alpha():
    wall = rectangle(camera, -9, -9, 70, 70, 4.0, (0, 1, 0, 1), 7)
    front = rectangle(camera, 20, 15, 40, 30, 2.0, (1, 0, 0, 1), 3)
    got = render_passes([wall, front], camera, ink=Ink(1, (1, 1, 1, 0.25)))
    np.testing.assert_allclose(got.beauty[20, 19], [0.25, 1.0, 0.25, 1], rtol=1e-6)
    assert got.depth[20, 19] == 2
    over_nothing = render_passes([front], camera, ink=Ink(1, (1, 1, 1, 0.25)))
    np.testing.assert_allclose(over_nothing.beauty[20, 19], [0.25] * 4, rtol=1e-6)
    assert over_nothing.coverage[20, 19] == 1


def test_ink_of_no_width_is_no_ink():
    scene = [torus(0.7, 0.2), box((0.5, 0.1, 0.1), 0.5)]
    view = PerspectiveCamera.look_at((0.6, 0.9, 2.6), (0, 0, 0), (60, 50), 0.8)
    got, want = (render_passes(scene, view, ink=ink) for ink in (Ink(0), None))
    assert np.array_equal(got.beauty, want.beauty)
    assert np.array_equal(got.depth, want.depth)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("width", {"width": -1}),
        ("width", {"width": math.nan}),
        ("color", {"color": (0, 0, 0)}),
        ("color", {"color": (0, 0, 0, 2)}),
        ("color", {"color": (math.inf, 0, 0, 1)}),
        ("crease_angle", {"crease_angle": -0.1}),
        ("depth_jump", {"depth_jump": math.inf}),
    ],
)
def test_wrong_ink_is_named(name, options):
    with pytest.raises(ValueError, match=f"^{name}: "):
        Ink(**options)
