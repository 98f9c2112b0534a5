import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import ndimage

from pegbar import grow_labels, palette_labels, segment_stick_figure
from tests.oracles import segmentation as oracle

small = hnp.array_shapes(min_dims=2, max_dims=2, max_side=20)
PALETTE = np.array([[255, 0, 0], [255, 128, 0], [255, 255, 0], [0, 255, 0], [0, 128, 0], [128, 0, 255]], np.uint8)
LABELS = np.arange(1, 7, dtype=np.uint8)


@st.composite
def stick_figures(draw):
    gray = draw(hnp.arrays(np.uint8, small, elements=st.sampled_from([0, 127, 128, 255])))
    ends = draw(st.lists(hnp.arrays(int, (2, 2), elements=st.integers(-5, 22)), min_size=1, max_size=4))
    halves = draw(st.lists(st.integers(0, 12).map(lambda k: k / 2), min_size=len(ends), max_size=len(ends)))
    return gray, [end.tolist() for end in ends], halves


@given(stick_figures(), st.sampled_from([0, 127.5, 128, 256]))
def test_stick_figure_equals_the_exact_oracle(case, threshold):
    got = segment_stick_figure(*case, threshold=threshold)
    assert got.dtype == np.uint8
    assert np.array_equal(got, oracle.segment_stick_figure(*case, threshold))


def test_stick_figure_takes_one_width_for_all_limbs():
    gray, ends = np.zeros((9, 9), np.uint8), [[[0, 4], [8, 4]], [[4, 0], [4, 8]]]
    got = segment_stick_figure(np.asfortranarray(gray), ends, 1)
    assert np.array_equal(got, segment_stick_figure(gray, ends, [1, 1]))
    assert (got[3:6, 3:6] == [[1, 2, 1], [1, 1, 1], [1, 2, 1]]).all()


# Rows that are longer than the blocks in which a kernel looks at them.
rows = st.tuples(st.integers(1, 5), st.integers(1, 70))
COLORS = np.concatenate([PALETTE, [[0, 0, 0], [9, 60, 90]]]).astype(np.uint8)


def painted(picture, channels):
    """The colours of a picture's indices; with an alpha channel, what has 128 in red is transparent."""
    image = COLORS[picture]
    return image if channels == 3 else np.dstack([image, np.where(image[..., 0] == 128, 127, 128).astype(np.uint8)])


@given(rows.flatmap(lambda shape: hnp.arrays(np.uint8, shape, elements=st.integers(0, 7))), st.sampled_from([3, 4]))
def test_exact_colours_equal_the_oracle(picture, channels):
    image = painted(picture, channels)
    got = palette_labels(image, PALETTE, LABELS)
    want, strangers = oracle.palette_labels(image, PALETTE.tolist(), LABELS.tolist(), [(0, 0, 0)])
    assert np.array_equal(got.labels, want)
    assert (got.unmatched, got.first_unmatched) == (len(strangers), strangers[0] if strangers else None)
    assert got.first_unmatched_color == (tuple(image[strangers[0]].tolist()) if strangers else None)


@given(hnp.arrays(np.uint8, (4, 6), elements=st.integers(0, 7)), st.sampled_from([3, 4]))
def test_a_tolerance_changes_no_solid_colour(picture, channels):
    blocks = np.kron(picture, np.ones((5, 5), np.uint8))
    got = palette_labels(painted(blocks, channels), PALETTE, LABELS, tolerance=20)
    want, _ = oracle.palette_labels(painted(picture, channels), PALETTE.tolist(), LABELS.tolist(), [(0, 0, 0)])
    assert np.array_equal(got.labels[2::5, 2::5], want)


@st.composite
def soft_borders(draw):
    """Two colours with a straight border of one pixel's blur, and how much of each pixel the second covers."""
    first, second = draw(st.permutations(range(len(PALETTE) + 1)))[:2]
    angle, offset = draw(st.floats(0, 2 * np.pi)), draw(st.floats(-3, 3))
    y, x = np.mgrid[-10:11, -10:11]
    cover = np.clip(0.5 + np.cos(angle) * x + np.sin(angle) * y - offset, 0, 1)
    colors = np.concatenate([[[0, 0, 0]], PALETTE]).astype(float)
    image = np.rint(colors[first] * (1 - cover[..., None]) + colors[second] * cover[..., None]).astype(np.uint8)
    return image, first, second, cover


@given(soft_borders())
def test_a_soft_border_goes_to_the_colour_that_covers_most_and_to_no_third(case):
    image, first, second, cover = case
    got = palette_labels(image, PALETTE, LABELS, tolerance=12)
    assert got.unmatched == 0
    clear = abs(cover - 0.5) > 0.1
    assert np.array_equal(got.labels[clear], np.where(cover > 0.5, second, first)[clear])
    assert set(np.unique(got.labels)) <= {first, second}


@given(hnp.arrays(int, (24, 30, 3), elements=st.integers(-6, 6)), st.integers(0, 5))
def test_noise_below_the_tolerance_changes_nothing(noise, limb):
    picture = np.zeros((24, 30), int)
    picture[5:20, 8:22] = limb + 1
    clean = np.concatenate([[[0, 0, 0]], PALETTE])[picture]
    noisy = np.clip(clean + noise, 0, 255).astype(np.uint8)
    got = palette_labels(noisy, PALETTE, LABELS, tolerance=11)
    assert got.unmatched == 0
    assert np.array_equal(got.labels, picture)
    assert palette_labels(noisy, PALETTE, LABELS, tolerance=np.sqrt(3 * 36)).unmatched == 0


def test_white_paper_and_clear_pixels_are_background():
    image = np.full((6, 8, 4), 255, np.uint8)
    image[:, 4:, :3] = 0
    image[0, 0] = [9, 9, 9, 0]
    both = palette_labels(image, PALETTE, LABELS, background=[[0, 0, 0], [255, 255, 255]])
    assert both.unmatched == 0
    assert not both.labels.any()
    none = palette_labels(image, PALETTE, LABELS, background=())
    assert (none.unmatched, none.first_unmatched, none.first_unmatched_color) == (47, (0, 1), (255, 255, 255, 255))


def test_several_colours_may_stand_for_one_limb():
    hair = [[[10, 20, 30], [255, 0, 0], [10, 20, 30]]]
    assert palette_labels(hair, [[255, 0, 0], [10, 20, 30]], [4, 4]).labels.tolist() == [[4, 4, 4]]


@given(
    hnp.arrays(np.uint8, small, elements=st.sampled_from([0, 0, 0, 0, 1, 2, 255])),
    st.data(),
    st.sampled_from([None, 0, 1, 2**0.5, 13**0.5, 4.9, 9]),
)
def test_growth_equals_the_oracle(labels, data, reach):
    figure = data.draw(hnp.arrays(bool, labels.shape))
    got = grow_labels(labels, figure, reach=reach)
    assert np.array_equal(got, oracle.grow_labels(labels, figure, reach))


@pytest.mark.parametrize("share", [0.001, 0.3, 1.0])
def test_growth_takes_a_nearest_label_however_much_is_missing(share):
    chance = np.random.default_rng(5)
    labels = np.where(chance.random((150, 210)) < 0.002, chance.integers(1, 9, (150, 210)), 0).astype(np.uint8)
    figure = chance.random(labels.shape) < share
    got = grow_labels(labels, figure)
    away = ndimage.distance_transform_edt(labels == 0)
    grown = figure & (labels == 0)
    assert grown.sum() > 20
    assert (got[grown] > 0).all()
    for label in range(1, 9):
        mine = grown & (got == label)
        assert np.array_equal(ndimage.distance_transform_edt(labels != label)[mine], away[mine])


@given(hnp.arrays(np.uint8, small, elements=st.integers(0, 3)), st.data())
def test_growth_keeps_what_is_there_and_may_be_repeated(labels, data):
    figure = data.draw(hnp.arrays(np.uint8, labels.shape, elements=st.sampled_from([0, 1, 200])))
    grown = grow_labels(np.asfortranarray(labels), figure.tolist() if figure.size else figure)
    assert np.array_equal(grown[labels > 0], labels[labels > 0])
    assert not grown[(labels == 0) & (figure == 0)].any()
    assert np.array_equal(grow_labels(grown, figure), grown)


IMAGE, ENDS = np.zeros((2, 2, 3), np.uint8), [[[0, 0], [1, 1]]]


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("gray", lambda: segment_stick_figure(IMAGE, ENDS, 1)),
        ("gray", lambda: segment_stick_figure([[0.5]], ENDS, 1)),
        ("ends", lambda: segment_stick_figure([[0]], [[[0, 0], [np.inf, 1]]], 1)),
        ("ends", lambda: segment_stick_figure([[0]], ENDS * 256, 1)),
        ("half_width", lambda: segment_stick_figure([[0]], ENDS, [1, 1])),
        ("half_width", lambda: segment_stick_figure([[0]], ENDS, -1)),
        ("half_width", lambda: segment_stick_figure([[0]], ENDS, np.nan)),
        ("threshold", lambda: segment_stick_figure([[0]], ENDS, 1, threshold=np.nan)),
        ("segmentation", lambda: palette_labels(IMAGE[0], PALETTE, LABELS)),
        ("segmentation", lambda: palette_labels(IMAGE + 0.5, PALETTE, LABELS)),
        ("colors", lambda: palette_labels(IMAGE, PALETTE[:, :2], LABELS)),
        ("colors", lambda: palette_labels(IMAGE, [[300, 0, 0]], [1])),
        ("colors", lambda: palette_labels(IMAGE, [[1, 2, 3], [1, 2, 3]], [1, 2])),
        ("colors", lambda: palette_labels(IMAGE, [[0, 0, 0]], [1])),
        ("colors", lambda: palette_labels(IMAGE, [[i, 1, 1] for i in range(254)], [1] * 254)),
        ("labels", lambda: palette_labels(IMAGE, PALETTE, LABELS[:-1])),
        ("tolerance", lambda: palette_labels(IMAGE, PALETTE, LABELS, tolerance=-1)),
        ("tolerance", lambda: palette_labels(IMAGE, PALETTE, LABELS, tolerance=np.nan)),
        ("background", lambda: palette_labels(IMAGE, PALETTE, LABELS, background=[0, 0])),
        ("labels", lambda: grow_labels([0, 1], [[1, 1]])),
        ("figure", lambda: grow_labels([[0, 1]], [[1, 1, 1]])),
        ("figure", lambda: grow_labels([[0, 1]], [[0.5, 1]])),
        ("reach", lambda: grow_labels([[0, 1]], [[1, 1]], reach=-1)),
        ("reach", lambda: grow_labels([[0, 1]], [[1, 1]], reach=np.nan)),
    ],
)
def test_wrong_input_is_named(name, call):
    with pytest.raises(ValueError, match=f"^{name}: "):
        call()


@pytest.mark.parametrize("shape", [(0, 0), (0, 5), (5, 0), (1, 1)])
def test_empty_pictures_are_no_error(shape):
    blank = np.zeros(shape, np.uint8)
    assert segment_stick_figure(blank, ENDS, 1).shape == shape
    assert palette_labels(np.zeros((*shape, 3), np.uint8), PALETTE, LABELS, tolerance=5).labels.shape == shape
    assert palette_labels(np.zeros((*shape, 4), np.uint8), PALETTE, LABELS).labels.shape == shape
    assert grow_labels(blank, blank).shape == shape
