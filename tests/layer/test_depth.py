import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pegbar import limb_depth
from tests.oracles import depth as oracle

coordinates = st.floats(-20, 40)


@st.composite
def limbs(draw):
    count = draw(st.integers(1, 4))
    labels = draw(
        hnp.arrays(np.uint8, hnp.array_shapes(min_dims=2, max_dims=2, max_side=17), elements=st.integers(0, count))
    )
    ends = draw(hnp.arrays(float, (count, 2, 2), elements=coordinates.filter(lambda x: x == 0 or abs(x) > 1e-6)))
    depths = draw(hnp.arrays(float, (count, 2), elements=st.floats(0.1, 50)))
    return labels, ends, depths


@given(limbs(), st.sampled_from(["linear", "perspective"]))
def test_equals_the_oracle(case, interpolation):
    got = limb_depth(*case, interpolation=interpolation)
    want = oracle.limb_depth(*case, interpolation)
    assert got.dtype == np.float32
    np.testing.assert_allclose(got, want, rtol=1e-6)


@given(limbs())
def test_memory_order_and_kind_of_input_do_not_matter(case):
    labels, ends, depths = case
    want = limb_depth(labels, ends, depths)
    wide = np.repeat(np.repeat(labels, 2, axis=0), 3, axis=1)[::2, ::3]
    assert np.array_equal(limb_depth(np.asfortranarray(labels), ends, depths), want)
    assert np.array_equal(limb_depth(wide, np.asfortranarray(ends), depths.tolist()), want)
    assert np.array_equal(limb_depth(labels.astype(int).tolist() if labels.size else labels, ends, depths), want)


@pytest.mark.parametrize("interpolation", ["linear", "perspective"])
def test_depth_is_as_exact_at_16000_pixels_as_near_the_origin(interpolation):
    labels = np.repeat(np.array([[1, 0, 2, 3, 1]], np.uint8), [3301, 77, 6500, 31, 6475], axis=1)
    ends = np.array([[[16383, 7], [16380, 6.5]], [[3000.3, -20], [9000.7, 60]], [[9900, 0], [9905, 0.25]]])
    depths = np.array([[0.1, 50], [3, 4.5], [40, 0.2]])
    got = limb_depth(labels, ends, depths, interpolation=interpolation)
    np.testing.assert_allclose(got, oracle.limb_depth(labels, ends, depths, interpolation), rtol=1e-6)


def test_an_end_on_limb_takes_its_nearer_end():
    assert limb_depth([[1]], [[[3, 3], [3, 3]]], [[5.0, 2.0]])[0, 0] == 2.0
    assert limb_depth([[1]], [[[3, 3], [3, 3]]], [[2.0, 5.0]])[0, 0] == 2.0


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("labels", ([0, 1], [[[0, 0], [1, 1]]], [[1, 2]])),
        ("labels", ([[0.5]], [[[0, 0], [1, 1]]], [[1, 2]])),
        ("labels", ([[300]], [[[0, 0], [1, 1]]], [[1, 2]])),
        ("labels", ([[2]], [[[0, 0], [1, 1]]], [[1, 2]])),
        ("labels", ([[1], [1, 1]], [[[0, 0], [1, 1]]], [[1, 2]])),
        ("ends", ([[1]], [[0, 0], [1, 1]], [[1, 2]])),
        ("ends", ([[1]], [[[0, 0], [np.nan, 1]]], [[1, 2]])),
        ("ends", ([[1]], [[["a", 0], [1, 1]]], [[1, 2]])),
        ("end_depths", ([[1]], [[[0, 0], [1, 1]]], [[1, 2], [1, 2]])),
        ("end_depths", ([[1]], [[[0, 0], [1, 1]]], [[1, np.inf]])),
    ],
)
def test_wrong_input_is_named(name, arguments):
    with pytest.raises(ValueError, match=f"^{name}: "):
        limb_depth(*arguments)


def test_perspective_refuses_a_depth_at_or_behind_the_camera():
    with pytest.raises(ValueError, match=r"^end_depths: .* at index 1"):
        limb_depth([[1]], [[[0, 0], [1, 1]]] * 2, [[1, 2], [0, 2]], interpolation="perspective")
    with pytest.raises(ValueError, match="interpolation"):
        limb_depth([[1]], [[[0, 0], [1, 1]]], [[1, 2]], interpolation="cubic")


def test_no_limb_is_legal():
    assert np.isinf(limb_depth([[0, 0]], [], [])).all()
