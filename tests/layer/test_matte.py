import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pegbar import ink_alpha, matte
from tests.oracles import matte as oracle


@st.composite
def pictures(draw, channels=(3, 4), side=20):
    shape = (draw(st.integers(0, side)), draw(st.integers(0, side)), draw(st.sampled_from(channels)))
    return draw(hnp.arrays(np.uint8, shape, elements=st.sampled_from([0, 1, 90, 127, 128, 254, 255])))


@given(pictures())
def test_ink_equals_the_oracle(image):
    got = ink_alpha(image)
    assert got.dtype == np.float32
    np.testing.assert_allclose(got, oracle.ink_alpha(image), rtol=3e-7, atol=1e-15)
    assert got.min(initial=0) >= 0
    assert got.max(initial=0) <= 1
    drawn = matte(image, "ink")
    assert np.array_equal(drawn.alpha, got)
    assert abs(drawn.color - oracle.over_white(image)).max(initial=0) <= 0.5


def test_white_is_exactly_clear_and_every_black_exactly_opaque():
    image = np.zeros((2, 40, 3), np.uint8)
    image[0] = 255
    assert np.array_equal(ink_alpha(image), [[0.0] * 40, [1.0] * 40])
    opaque = np.dstack([image, np.full((2, 40), 255, np.uint8)])
    assert np.array_equal(ink_alpha(opaque), [[0.0] * 40, [1.0] * 40])
    assert not ink_alpha(np.zeros((2, 2, 4), np.uint8)).any()


@given(pictures())
def test_unmix_equals_the_oracle_and_is_exact_over_white(image):
    got, (color, alpha) = matte(image, "unmix"), oracle.unmix(image)
    np.testing.assert_allclose(got.alpha, alpha, rtol=1e-6, atol=1e-9)
    assert abs(got.color - color).max(initial=0) <= 0.5 + 1e-9
    back = got.color * got.alpha[..., None] + 255 * (1 - got.alpha[..., None])
    assert abs(back - np.rint(oracle.over_white(image))).max(initial=0) <= 0.5 + 1e-4


@given(pictures(side=12), st.data())
def test_fill_equals_the_oracle_and_is_exact_over_white(image, data):
    labels = data.draw(hnp.arrays(np.uint8, image.shape[:2], elements=st.sampled_from([0, 1, 1, 9])))
    got, (color, alpha) = matte(image, "fill", labels=labels), oracle.fill(image, labels)
    np.testing.assert_allclose(got.alpha, alpha, rtol=1e-6, atol=1e-9)
    assert abs(got.color - color).max(initial=0) <= 0.5 + 1e-6
    back = got.color * got.alpha[..., None] + 255 * (1 - got.alpha[..., None])
    assert abs(back - np.rint(oracle.over_white(image))).max(initial=0) <= 0.5 + 1e-4


def test_flat_paint_with_hard_borders_is_opaque_to_its_border():
    labels = np.zeros((20, 30), np.uint8)
    labels[4:15, 5:22], labels[0:4, 10:14] = 3, 1
    for paint in ([240, 200, 170], [255, 255, 255], [250, 250, 250], [0, 0, 0]):
        image = np.where(labels[..., None] > 0, np.array(paint), 255).astype(np.uint8)
        got = matte(image, labels=labels)
        assert got.mode == "fill"
        assert np.array_equal(got.alpha, labels > 0)
        assert (got.color[labels > 0] == paint).all()


@given(pictures(channels=(4,)))
def test_alpha_is_the_files_own(image):
    got = matte(image, "alpha")
    assert np.array_equal(got.color, image)
    assert np.array_equal(got.alpha, (image[..., 3] / np.float32(255)).astype(np.float32))


def test_auto_takes_alpha_then_labels_then_unmix():
    image = np.full((3, 3, 4), 255, np.uint8)
    labels = np.ones((3, 3), np.uint8)
    assert matte(image).mode == "unmix"
    assert matte(image[..., :3]).mode == "unmix"
    assert matte(image, labels=labels).mode == "fill"
    image[2, 2, 3] = 254
    assert matte(image).mode == "alpha"
    assert matte(image, labels=labels).mode == "alpha"


@given(pictures(), st.sampled_from(["ink", "unmix", "fill"]), st.integers(1, 255))
def test_the_white_point_spreads_the_levels_before_the_matte(image, mode, white_point):
    labels = image[..., 0] % 3
    got = matte(image, mode, labels=labels, white_point=white_point)
    want = matte(oracle.whiten(image, white_point), mode, labels=labels)
    assert np.array_equal(got.color, want.color)
    assert np.array_equal(got.alpha, want.alpha)


def test_every_level_is_spread_to_the_nearest():
    levels = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 3, axis=2)
    for white_point in (1, 2, 100, 244, 254, 255):
        got = matte(levels, "ink", white_point=white_point)
        assert np.array_equal(got.color, oracle.whiten(levels, white_point))
        assert np.array_equal(got.alpha == 0, np.arange(256)[None] >= white_point - 0.5 * white_point / 255)


def test_the_white_point_leaves_the_files_own_alpha_alone():
    image = np.full((2, 2, 4), 90, np.uint8)
    assert np.array_equal(matte(image, white_point=100).color, image)


@given(pictures())
def test_memory_order_and_kind_of_input_do_not_matter(image):
    wide = np.repeat(image, 2, axis=1)[:, ::2]
    for mode in ("ink", "unmix", "fill"):
        labels = image[..., 0] % 3
        want = matte(image, mode, labels=labels)
        for other in (np.asfortranarray(image), wide, image.astype(int)):
            got = matte(other, mode, labels=np.asfortranarray(labels))
            assert np.array_equal(got.color, want.color)
            assert np.array_equal(got.alpha, want.alpha)


IMAGE = np.zeros((2, 3, 3), np.uint8)


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("image", lambda: ink_alpha(IMAGE[..., :2])),
        ("image", lambda: ink_alpha(IMAGE / 255)),
        ("image", lambda: ink_alpha(IMAGE.astype(int) - 1)),
        ("image", lambda: matte(IMAGE, "alpha")),
        ("mode", lambda: matte(IMAGE, "matting")),
        ("white_point", lambda: matte(IMAGE, white_point=0)),
        ("white_point", lambda: matte(IMAGE, white_point=256)),
        ("white_point", lambda: matte(IMAGE, white_point=244.5)),
        ("labels", lambda: matte(IMAGE, "fill")),
        ("labels", lambda: matte(IMAGE, "fill", labels=[[1, 1]])),
        ("labels", lambda: matte(IMAGE, labels=[[1, 1, 1], [1, 1, 300]])),
    ],
)
def test_wrong_input_is_named(name, call):
    with pytest.raises(ValueError, match=f"^{name}: "):
        call()
