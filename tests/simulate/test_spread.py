import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pegbar.simulate.spread import Spread

PARTS = st.lists(arrays(float, st.tuples(st.integers(0, 5), st.integers(0, 7)), elements=st.floats(-2, 9)), max_size=6)


@given(PARTS, st.lists(st.floats(0, 100), min_size=1, max_size=4))
def test_percentiles_of_parts_are_those_of_the_whole(parts, shares):
    spread = Spread(1e-5)
    for part in parts:
        spread.add(part)
    every = np.concatenate([np.empty(0), *(part.ravel() for part in parts)])
    assert spread.count == len(every)
    if not len(every):
        with pytest.raises(ValueError, match="no values"):
            spread.percentiles(shares)
        return
    np.testing.assert_allclose(spread.percentiles(shares), np.percentile(every, shares), atol=1e-5)
    assert spread.percentiles([0, 100]) == [every.min(), every.max()]


def test_what_is_far_out_takes_no_memory_and_is_still_the_largest():
    spread = Spread(1e-5)
    spread.add(np.array([0.0, 1e12, -1e9, 0.5, 0.25]))
    assert spread.percentiles([0, 50, 100]) == [-1e9, pytest.approx(0.25, abs=1e-5), 1e12]
    assert len(spread._counts) <= 2_000_001
