import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pegbar import time_warp
from tests.oracles import align as oracle

sizes = st.tuples(st.integers(1, 5), st.integers(1, 5))
tables = hnp.arrays(float, sizes, elements=st.integers(0, 6).map(float))
rough = hnp.arrays(float, st.tuples(st.integers(1, 25), st.integers(1, 25)), elements=st.floats(0, 10, width=16))
opens = st.fixed_dictionaries({"open_begin": st.booleans(), "open_end": st.booleans()})


@given(tables, opens)
def test_cost_is_that_of_the_best_of_all_paths(cost, ends):
    warp = time_warp(cost, **ends)
    assert warp.cost == oracle.time_warp(cost, **ends)[1]
    check_path(warp, cost, **ends)


@given(tables, opens, st.integers(1, 4))
def test_cost_under_a_slope_limit_is_that_of_the_best_gentle_path(cost, ends, limit):
    want = oracle.time_warp(cost, slope_limit=limit, **ends)
    if want is None:
        with pytest.raises(ValueError, match="^slope_limit: "):
            time_warp(cost, slope_limit=limit, **ends)
        return
    warp = time_warp(cost, slope_limit=limit, **ends)
    assert warp.cost == want[1]
    check_path(warp, cost, **ends)
    assert oracle._gentle([tuple(cell) for cell in warp.path.tolist()], limit)


def check_path(warp, cost, open_begin, open_end):
    rows, columns = cost.shape
    steps = np.diff(warp.path, axis=0)
    assert {tuple(step) for step in steps.tolist()} <= {(1, 1), (1, 0), (0, 1)}
    assert warp.path[0, 0] == 0
    assert warp.path[-1, 0] == rows - 1
    assert open_begin or warp.path[0, 1] == 0
    assert open_end or warp.path[-1, 1] == columns - 1
    assert warp.cost == cost[tuple(warp.path.T)].sum()


@given(rough, opens)
def test_frames_are_the_cheapest_partners_and_times_run_smoothly_through_the_partners(cost, ends):
    warp = time_warp(cost, **ends)
    for row, frame in enumerate(warp.frames):
        partners = warp.path[warp.path[:, 0] == row, 1]
        assert frame == partners[np.argmin(cost[row, partners])]
        assert partners.min() - 0.5 <= warp.times[row] <= partners.max() + 0.5
        assert warp.partners[row].tolist() == [partners.min(), partners.max()]
    assert (np.diff(warp.frames) >= 0).all()
    assert (np.diff(warp.times) >= 0).all()
    assert warp.times.min() >= 0
    assert warp.times.max() <= cost.shape[1] - 1


def test_ties_go_to_the_diagonal_then_to_the_next_drawn_frame():
    assert time_warp(np.zeros((3, 3))).path.tolist() == [[0, 0], [1, 1], [2, 2]]
    assert time_warp(np.zeros((3, 2))).path.tolist() == [[0, 0], [1, 0], [2, 1]]
    assert time_warp([[0.0, 9.0, 0.0], [0.0, 0.0, 0.0]], open_end=True).path.tolist() == [[0, 0], [1, 0]]


@given(tables)
def test_float32_fortran_and_lists_give_the_same(cost):
    cost = cost.astype(np.float32).astype(float)
    want = time_warp(cost)
    for other in (cost.astype(np.float32), np.asfortranarray(cost), cost.tolist(), np.repeat(cost, 2, 1)[:, ::2]):
        got = time_warp(other)
        assert np.array_equal(got.path, want.path)
        assert got.cost == want.cost


def test_a_sequence_warped_to_itself_stays():
    curve = np.cumsum(np.random.default_rng(1).normal(size=200))
    warp = time_warp(abs(curve[:, None] - curve))
    assert warp.cost == 0
    assert np.array_equal(warp.frames, np.arange(200))
    np.testing.assert_allclose(warp.times, np.arange(200), atol=1e-3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"cost": [1.0, 2.0]}, "^cost: want shape"),
        ({"cost": [["a"]]}, "^cost: "),
        ({"cost": np.zeros((0, 3))}, "^cost: want at least one row"),
        ({"cost": np.zeros((3, 0))}, "^cost: want at least one row"),
        ({"cost": [[0.0, 1.0], [np.nan, 1.0]]}, "^cost: want finite.*row 1, column 0"),
        ({"cost": [[0.0, np.inf], [1.0, 1.0]]}, "^cost: want finite.*row 0, column 1"),
        ({"cost": np.full((3, 3), 1e308)}, "^cost: .*infinity"),
        ({"slope_limit": 0}, "^slope_limit: "),
        ({"slope_limit": 129}, "^slope_limit: "),
        ({"slope_limit": 1.5}, "^slope_limit: "),
        ({"cost": np.zeros((2, 9)), "slope_limit": 4}, "^slope_limit: 2 drawn frames and 9 clip frames.*want 5.*open"),
        ({"cost": np.zeros((9, 2)), "slope_limit": 4, "open_end": True}, "^slope_limit: .*want 5 at least$"),
        ({"holds": [1, 2]}, "^holds: want shape"),
        ({"holds": [1, 0, 1]}, "^holds: .*at 1"),
        ({"stiffness": -1}, "^stiffness: "),
        ({"slack": 0}, "^slack: "),
        ({"slack": np.nan}, "^slack: "),
    ],
)
def test_wrong_arguments_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        time_warp(**{"cost": np.zeros((3, 4))} | arguments)
