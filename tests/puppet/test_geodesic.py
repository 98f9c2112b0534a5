import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import _kernels
from tests.oracles.geodesic import distances_of

COSTS = st.lists(st.sampled_from([1.0, 2.0, 5.0, np.inf]), min_size=30, max_size=30)


@given(COSTS, st.integers(0, 29))
def test_distances_of_one_label_are_the_shortest_ways(costs, seed):
    costs = np.array(costs, np.float32).reshape(5, 6)
    seeds = np.zeros((5, 6), np.uint8)
    seeds.flat[seed] = 1
    labels, far = _kernels.geodesic_labels(seeds, costs, np.array([1.5]))
    np.testing.assert_allclose(far, distances_of(seeds > 0, costs.astype(float), 1.5), rtol=1e-6)
    np.testing.assert_array_equal(labels > 0, np.isfinite(far))


@given(COSTS, st.integers(0, 14), st.integers(15, 29), st.floats(0.3, 3))
def test_a_pixel_is_no_label_that_comes_later_than_the_other_could(costs, first, second, pace):
    costs = np.array(costs, np.float32).reshape(5, 6)
    seeds = np.zeros((5, 6), np.uint8)
    seeds.flat[first], seeds.flat[second] = 1, 2
    labels, far = _kernels.geodesic_labels(seeds, costs, np.array([1.0, pace]))
    alone = [distances_of(seeds == label, costs.astype(float), p) for label, p in ((1, 1.0), (2, pace))]
    # One label may bar the other's way, so a label's own distance is never shorter than alone.
    for label in (1, 2):
        own = labels == label
        assert (far[own] >= alone[label - 1][own] * (1 - 1e-6)).all()
    free = np.isfinite(costs) & np.isfinite(np.minimum(*alone))
    assert (labels[free] > 0).all()


def test_wrong_input_is_named():
    seeds, costs = np.array([[1, 0]], np.uint8), np.ones((1, 2), np.float32)
    with pytest.raises(ValueError, match="seeds: a label without a pace at row 0, column 0"):
        _kernels.geodesic_labels(seeds, costs, np.zeros(0))
    with pytest.raises(ValueError, match="costs: want 2 values, got 1"):
        _kernels.geodesic_labels(seeds, costs[:, :1].copy(), np.ones(1))
