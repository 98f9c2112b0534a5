import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pegbar.report.canvas import Canvas
from tests.oracles import paint as oracle

coordinates = st.floats(-30, 50, width=32)
colors = st.tuples(*[st.integers(0, 255)] * 4)


def area(canvas):
    return canvas.image()[..., 3].sum() / 255


@settings(max_examples=60)
@given(hnp.arrays(float, (4, 2), elements=st.integers(-24, 80).map(lambda x: x / 4)))
def test_a_polygon_covers_what_its_winding_covers(points):
    canvas = Canvas(20, 16)
    canvas.polygon(points, (255, 255, 255))
    want = oracle.coverage(points, 20, 16)
    # Edges fall on quarter rows and sixteenth columns: slanted ones lose up to a twelfth of a pixel.
    assert np.abs(canvas.image()[..., 3] / 255 - want).max() < 0.26
    around = np.hypot(*(points - np.roll(points, 1, axis=0)).T).sum()
    assert abs(area(canvas) - want.sum()) < 0.08 * around + 0.3


@settings(max_examples=60)
@given(hnp.arrays(float, (5, 2), elements=coordinates))
def test_without_antialiasing_the_pixels_whose_centre_is_inside_are_painted(points):
    canvas = Canvas(20, 16, antialias=False)
    canvas.polygon(points, (9, 90, 200))
    got = canvas.image()
    assert set(map(tuple, got.reshape(-1, 4).tolist())) <= {(0, 0, 0, 0), (9, 90, 200, 255)}
    far, inside = oracle.inside(points, 20, 16, margin=0.1)
    assert np.array_equal(got[far, 3] == 255, inside[far])


def test_a_rectangle_moved_by_half_a_pixel_covers_halves():
    canvas = Canvas(8, 6)
    canvas.polygon([(2, 0.5), (5, 0.5), (5, 4), (2, 4)], (10, 20, 30))
    want = np.zeros((6, 8))
    want[1:5, 2:6] = 255
    want[:, [2, 5]] /= 2
    want[4] /= 2
    assert np.abs(canvas.image()[..., 3] - want).max() <= 1


@given(colors)
def test_colours_are_straight(color):
    canvas = Canvas(5, 5)
    canvas.polygon([(-1, -1), (6, -1), (6, 6), (-1, 6)], color)
    got = canvas.image()[2, 2].astype(int)
    assert got[3] == color[3]
    assert np.abs(got[:3] - color[:3]).max() * color[3] <= 255 or color[3] == 0
    assert color[3] > 0 or not got.any()


@given(colors, colors)
def test_later_paint_lies_over_earlier(below, above):
    canvas = Canvas(3, 3, below)
    canvas.circle((1, 1), 9, above)
    got = canvas.image()[1, 1] / 255
    under, over = np.array(below) / 255, np.array(above) / 255
    alpha = over[3] + under[3] * (1 - over[3])
    light = over[:3] * over[3] + under[:3] * under[3] * (1 - over[3])
    assert abs(got[3] - alpha) < 0.009
    assert np.abs(got[:3] * got[3] - light).max() < 0.016


def test_a_disc_and_a_rim_have_their_areas():
    canvas = Canvas(60, 60)
    canvas.circle((29.3, 30.1), 20, (255, 0, 0))
    assert area(canvas) == pytest.approx(np.pi * 400, rel=2e-3)
    canvas = Canvas(60, 60)
    canvas.circle((29.3, 30.1), 20, (255, 0, 0), width=3)
    assert area(canvas) == pytest.approx(2 * np.pi * 20 * 3, rel=1e-2)
    assert canvas.image()[30, 29, 3] == 0


def test_a_pen_is_as_wide_as_told_everywhere():
    canvas = Canvas(64, 24)
    canvas.polyline([(-9, 11), (31.5, 11), (72, 11)], [2, 11, 20], (0, 0, 0))
    widths = canvas.image()[..., 3].sum(axis=0) / 255
    slope = 9 / 40.5
    want = 11 + slope * (np.arange(64) - 31.5)
    # The pen's edge touches discs: its width across the line is that of the tangents.
    assert np.abs(widths - want / np.sqrt(1 - (slope / 2) ** 2)).max() < 0.3


def test_a_closed_pen_returns_to_its_beginning():
    corners = [(5, 5), (25, 5), (25, 25)]
    opened, closed = Canvas(30, 30), Canvas(30, 30)
    opened.polyline(corners, 2, (0, 0, 0))
    closed.polyline(corners, 2, (0, 0, 0), closed=True)
    assert opened.image()[15, 15, 3] == 0
    assert closed.image()[15, 15, 3] == 255


def test_a_pasted_picture_is_cut_at_the_border_and_blended():
    canvas = Canvas(4, 3, (0, 0, 255, 255))
    picture = np.arange(5 * 4 * 3, dtype=np.uint8).reshape(5, 4, 3)
    canvas.paste(picture, 2, -1)
    assert np.array_equal(canvas.image()[:, 2:, :3], picture[1:4, :2])
    canvas.paste(np.full((2, 2, 4), (255, 0, 0, 128), np.uint8), -1, 2)
    assert canvas.image()[2, 0].tolist() == [128, 0, 127, 255]
    before = canvas.image()
    canvas.paste(picture, 40, 40)
    canvas.paste(picture, -40, -40)
    assert np.array_equal(canvas.image(), before)


def test_text_stands_on_its_corner_and_has_its_size():
    canvas = Canvas(200, 60)
    canvas.text((10, 50), "HE", 30, (255, 0, 0))
    rows, columns = np.nonzero(canvas.image()[..., 3] > 127)
    assert abs(rows.max() - 50) <= 3
    assert abs((rows.max() - rows.min()) - 30) <= 4
    assert 8 <= columns.min() <= 16
    other = Canvas(200, 60)
    other.text((10, 50), "été", 30, (255, 0, 0))
    assert other.image()[..., 3].any()


def test_any_order_and_kind_of_input_gives_the_same_picture():
    points = np.array([(2.3, 1.0), (17.0, 4.5), (9.0, 13.2)])
    pictures = []
    for given_points in (points, np.asfortranarray(points), points.tolist(), np.repeat(points, 2, axis=0)[::2]):
        canvas = Canvas(20, 16)
        canvas.polygon(given_points, [1, 2, 3])
        canvas.polyline(given_points, [1, 2, 3], (4, 5, 6, 70))
        pictures.append(canvas.image())
    assert all(np.array_equal(picture, pictures[0]) for picture in pictures)


@pytest.mark.parametrize("place", [(-500, 5), (500, 5), (5, -300), (5, 400), (15, 11), (-3, 9)])
def test_words_are_cut_at_the_rims(place):
    small, large = Canvas(20, 12), Canvas(620, 512)
    small.text(place, "Hallo", 9, (1, 2, 3))
    large.text((place[0] + 300, place[1] + 250), "Hallo", 9, (1, 2, 3))
    np.testing.assert_array_equal(small.image(), large.image()[250:262, 300:320])
    assert small.image().any() == (abs(place[0]) < 20 and abs(place[1]) < 20)


@given(hnp.arrays(float, (6, 2), elements=st.floats(-16000, 16000)), st.floats(0, 16000))
@settings(max_examples=40)
def test_far_points_are_clipped_in_peace(points, width):
    canvas = Canvas(7, 5)
    color = (10, 100, 200)
    canvas.polygon(points, color)
    canvas.polyline(points, width, color)
    image = canvas.image()
    # Two layers round premultiplied colour and alpha to 8 bits; half coverage doubles what is lost.
    assert np.abs(image[image[..., 3] > 127][:, :3] - np.array(color, float)).max(initial=0) <= 5


@pytest.mark.parametrize(
    ("name", "work"),
    [
        ("points", lambda c: c.polygon([(0, 0), (1, np.nan)], (0, 0, 0))),
        ("points", lambda c: c.polygon([(0, 0), (1, 1e6)], (0, 0, 0))),
        ("points", lambda c: c.polyline([0, 1], 1, (0, 0, 0))),
        ("width", lambda c: c.polyline([(0, 0)], -1, (0, 0, 0))),
        ("width", lambda c: c.polyline([(0, 0)] * 3, [1, 2], (0, 0, 0))),
        ("color", lambda c: c.polygon([(0, 0)], (0, 0, 256))),
        ("color", lambda c: c.polygon([(0, 0)], (0, 0))),
        ("color", lambda c: c.text((0, 0), "a", 9, (0.5, 0, 0))),
        ("radius", lambda c: c.circle((0, 0), -1, (0, 0, 0))),
        ("center", lambda c: c.circle((0, 0, 0), 1, (0, 0, 0))),
        ("image", lambda c: c.paste(np.zeros((2, 2)), 0, 0)),
        ("size", lambda c: Canvas(0, 4)),
        ("background", lambda c: Canvas(4, 4, (0, 0, -1, 0))),
    ],
)
def test_wrong_input_is_named(name, work):
    with pytest.raises(ValueError, match=f"^{name}: "):
        work(Canvas(4, 4))
