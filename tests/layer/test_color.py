import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pegbar.layer.color import decode_srgb, encode_srgb
from tests.oracles import composite as oracle

pictures = hnp.arrays(
    np.float32, st.tuples(st.integers(1, 3), st.integers(1, 90), st.just(4)), elements=st.floats(-4, 4, width=32)
)


@given(pictures)
def test_equal_the_oracle(picture):
    picture[..., 3] = np.where(picture[..., 3] < 1e-3, 0, np.minimum(picture[..., 3], 1))
    for product, curve in ((encode_srgb, oracle.encode), (decode_srgb, oracle.decode)):
        np.testing.assert_allclose(product(picture), oracle.converted(picture, curve), rtol=1e-5, atol=2e-6)


def test_an_opaque_ramp_is_encoded_far_below_half_an_8_bit_step():
    ramp = np.linspace(0, 1, 4 * 16384, dtype=np.float32).reshape(-1, 1, 1)
    picture = np.concatenate([ramp, ramp, ramp, np.ones_like(ramp)], axis=-1)
    assert np.abs(encode_srgb(picture) - oracle.converted(picture, oracle.encode)).max() < 2e-6


@given(pictures)
def test_decoding_undoes_encoding(picture):
    picture[..., 3] = 0.25
    np.testing.assert_allclose(decode_srgb(encode_srgb(picture)), picture, rtol=2e-5, atol=1e-5)


def test_glow_without_coverage_is_kept_and_tiny_coverage_stays_finite():
    glow = np.float32([[[0.5, 0, 0, 0], [0.5, 0, 0, 1e-40], [0.5, 0, 0, 1e-30], [1e38, 0, 0, 1e-3]]])
    encoded = encode_srgb(glow)
    assert np.isfinite(encoded).all()
    np.testing.assert_allclose(encoded[0, :2, 0], oracle.encode(0.5), atol=2e-6)
    assert np.array_equal(encoded[..., 3], glow[..., 3])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("channel", [0, 3])
def test_wrong_values_are_named(value, channel):
    picture = np.ones((3, 70, 4))
    picture[1, 65, channel] = value
    for product in (encode_srgb, decode_srgb):
        with pytest.raises(ValueError, match="^pixels: .* row 1, column 65$"):
            product(picture)
        with pytest.raises(ValueError, match="^pixels: want shape"):
            product(picture[..., :3])
