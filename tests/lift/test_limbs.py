import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from pegbar import align_limbs
from tests.oracles import lift as oracle

CHAINS = [(0, 1), (1, 2), (1, 3), (3, 4)]


def scene(seed, frames=3, markers=6):
    random = np.random.default_rng(seed)
    return random.normal(size=(frames, markers, 2)), random.normal(size=(frames, markers, 2))


@given(st.integers(0, 2**32))
def test_it_is_the_paper_frame_by_frame(seed):
    projected, drawn = scene(seed)
    assert_allclose(align_limbs(projected, drawn, CHAINS), oracle.align_limbs(projected, drawn, CHAINS), atol=1e-9)


@given(st.integers(0, 2**32), st.floats(0.1, 50))
def test_angles_are_the_drawn_ones_and_lengths_the_clips_wherever_and_however_large_it_is_drawn(seed, scale):
    projected, drawn = scene(seed)
    aligned = align_limbs(projected, drawn, CHAINS)
    assert_allclose(align_limbs(projected, drawn * scale + [7, -3], CHAINS), aligned, atol=1e-9)
    for parent, child in CHAINS:
        got, wanted = aligned[:, child] - aligned[:, parent], drawn[:, child] - drawn[:, parent]
        assert_allclose(got[:, 0] * wanted[:, 1], got[:, 1] * wanted[:, 0], atol=1e-9)
        length = np.linalg.norm(projected[:, child] - projected[:, parent], axis=1)
        assert_allclose(np.linalg.norm(got, axis=1), length, atol=1e-9)
    assert_array_equal(aligned[:, [0, 5]], projected[:, [0, 5]])


def test_a_limb_without_a_drawn_angle_keeps_the_clips():
    projected, drawn = scene(1)
    drawn[0, 3], drawn[1, 3] = np.nan, drawn[1, 1]
    aligned = align_limbs(projected, drawn, CHAINS)
    for frame in (0, 1):
        assert_allclose(aligned[frame, 3] - aligned[frame, 1], projected[frame, 3] - projected[frame, 1])
    assert np.isfinite(aligned).all()


def test_chains_may_share_limbs():
    projected, drawn = scene(2)
    shared = [(0, 1), (1, 2), (0, 1), (1, 3), (3, 4)]
    assert_array_equal(align_limbs(projected, drawn, shared), align_limbs(projected, drawn, CHAINS))
    assert_array_equal(align_limbs(projected, drawn, []), projected)


@pytest.mark.parametrize(
    ("chains", "message"),
    [
        ([(1, 2), (0, 1)], r"\(0, 1\) must stand before"),
        ([(0, 2), (1, 2)], "marker 2 hangs on two"),
        ([(2, 2)], "marker 2 hangs on itself"),
        ([(0, 6)], "0..5, got 6"),
        ([(0, 1, 2)], "want shape"),
    ],
)
def test_chains_that_are_no_tree_from_the_root_are_refused(chains, message):
    with pytest.raises(ValueError, match=f"chains: .*{message}"):
        align_limbs(*scene(3), chains)


def test_wrong_markers_are_named():
    projected, drawn = scene(4)
    with pytest.raises(ValueError, match="drawn: want shape"):
        align_limbs(projected, drawn[:, :5], CHAINS)
    projected[1, 2, 0] = np.nan
    with pytest.raises(ValueError, match="projected: want finite"):
        align_limbs(projected, drawn, CHAINS)
