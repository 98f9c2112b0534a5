import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pegbar import pose_descriptor, pose_distance
from pegbar.align.descriptor import limb_trust
from tests.oracles import align as oracle

LIMBS = [[0, 1], [1, 2], [2, 0], [3, 3], [1, 3]]
poses = hnp.arrays(float, (4, 2), elements=st.integers(-3, 3).map(float))
parents = st.tuples(*(st.sampled_from([p for p in range(-1, 5) if p != limb]) for limb in range(5)))
angles = st.floats(-math.pi, math.pi)


@st.composite
def descriptors(draw, element=angles):
    limbs = draw(st.integers(0, 4))
    shape = st.tuples(st.integers(0, 4), st.just(limbs))
    a, b = draw(hnp.arrays(float, shape, elements=element)), draw(hnp.arrays(float, shape, elements=element))
    return a, b, draw(hnp.arrays(float, limbs, elements=st.floats(0, 5)))


@given(poses, parents)
def test_descriptor_is_the_oracles(pose, parents):
    np.testing.assert_allclose(pose_descriptor(pose, LIMBS), oracle.pose_descriptor(pose, LIMBS), atol=1e-15)
    got, want = pose_descriptor(pose, LIMBS, parents=parents), oracle.pose_descriptor(pose, LIMBS, parents)
    np.testing.assert_allclose(np.exp(1j * got), np.exp(1j * want), atol=1e-12)
    assert ((got > -math.pi) & (got <= math.pi)).all()


@given(poses, st.floats(0.01, 100), hnp.arrays(float, 2, elements=st.integers(-50, 50).map(float)))
def test_descriptor_knows_neither_place_nor_size(pose, scale, place):
    np.testing.assert_allclose(pose_descriptor(pose * scale + place, LIMBS), pose_descriptor(pose, LIMBS), atol=1e-9)


def test_minus_pi_and_limbs_of_no_length():
    assert pose_descriptor([[0.0, 0.0], [-1.0, -0.0]], [[0, 1], [1, 0], [0, 0]]).tolist() == [math.pi, 0, 0]
    assert pose_descriptor([[0.0, 0.0], [0.0, 1.0]], [[0, 0], [0, 1]], parents=[1, 0]).tolist() == [0, math.pi / 2]


def test_many_frames_at_once_and_markers_that_are_not_known():
    markers = np.random.default_rng(2).normal(size=(2, 3, 4, 2))
    markers[1, 2, 1, 0] = np.nan
    got = pose_descriptor(markers, LIMBS, parents=[-1, -1, 0, -1, -1])
    assert got.shape == (2, 3, 5)
    assert np.isnan(got[1, 2]).tolist() == [True, True, True, False, True]
    assert not np.isnan(got[:1]).any()
    np.testing.assert_array_equal(got[0, 1], pose_descriptor(markers[0, 1], LIMBS, parents=[-1, -1, 0, -1, -1]))


@given(descriptors())
def test_distance_is_the_oracles(case):
    a, b, weights = case
    got = pose_distance(a, b, weights=weights)
    want = np.array([[oracle.pose_distance(p, q, weights) for q in b] for p in a]).reshape(len(a), len(b))
    np.testing.assert_allclose(got, want, atol=1e-12)
    ones = np.ones(len(weights))
    np.testing.assert_allclose(
        pose_distance(a, b), [[oracle.pose_distance(p, q, ones) for q in b] for p in a] or got, atol=1e-12
    )


@given(descriptors(), st.integers(-3, 3))
def test_whole_turns_make_no_difference(case, turns):
    a, b, weights = case
    got = pose_distance(a + 2 * math.pi * turns, b, weights=weights)
    np.testing.assert_allclose(got, pose_distance(a, b, weights=weights), atol=1e-12)


@given(descriptors(st.floats(-math.pi, math.pi) | st.just(math.nan)))
def test_unknown_angles_are_left_out_and_the_sum_rescaled(case):
    a, b, weights = case
    got = pose_distance(a, b, weights=weights)
    for i, p in enumerate(a):
        for j, q in enumerate(b):
            known = ~np.isnan(p + q)
            share = weights[known].sum()
            if np.isnan(a).any() or np.isnan(b).any():
                want = oracle.pose_distance(p[known], q[known], weights[known])
                want = want / share * weights.sum() if share > 0 else weights.sum() * math.pi / 2
                assert got[i, j] == pytest.approx(want, abs=1e-9)


def test_trust_moves_the_weight_to_the_limbs_that_are_seen_well():
    a, b = np.array([[0.0, 0.0]]), np.array([[1.0, 0.2], [1.0, 0.2]])
    got = pose_distance(a, b, a_trust=[[1.0, 0.5]], b_trust=[[1.0, 1.0], [0.0, 1.0]], weights=[2, 1])
    np.testing.assert_allclose(got, [[(2 * 1.0 + 0.5 * 0.2) / 2.5 * 3, 0.2 * 3]])


def test_trust_is_projected_over_full_length():
    markers = np.array([[[0, 0], [4.0, 3.0], [4, 3]], [[0, 0], [1.0, 0.0], [np.nan, 0]]])
    limbs = [[0, 1], [1, 2]]
    assert limb_trust(markers, limbs).tolist() == [[1.0, 0.0], [0.2, 0.0]]
    assert limb_trust(markers, limbs, lengths=[2.0, 1.0]).tolist() == [[1.0, 0.0], [0.5, 0.0]]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: pose_descriptor(np.zeros((3, 3)), LIMBS), "^markers: "),
        (lambda: pose_descriptor([[0, 0], [0, np.inf]], [[0, 1]]), "^markers: "),
        (lambda: pose_descriptor(np.zeros((3, 2)), [[0, 3]]), "^limbs: "),
        (lambda: pose_descriptor(np.zeros((3, 2)), [[0, -1]]), "^limbs: "),
        (lambda: pose_descriptor(np.zeros((3, 2)), [[0.5, 1]]), "^limbs: "),
        (lambda: pose_descriptor(np.zeros((3, 2)), [[0, 1]], parents=[-1, 0]), "^parents: want shape"),
        (lambda: pose_descriptor(np.zeros((3, 2)), [[0, 1], [1, 2]], parents=[-1, 1]), "^parents: limb 1 is its own"),
        (lambda: pose_descriptor(np.zeros((3, 2)), [[0, 1], [1, 2]], parents=[-1, 2]), "^parents: "),
        (lambda: pose_distance([[0.0]], [[0.0, 1.0]]), "^b: want shape"),
        (lambda: pose_distance([0.0], [[0.0]]), "^a: want shape"),
        (lambda: pose_distance([[np.inf]], [[0.0]]), "^a: "),
        (lambda: pose_distance([[0.0]], [[0.0]], weights=[1, 2]), "^weights: want shape"),
        (lambda: pose_distance([[0.0]], [[0.0]], weights=[-1]), "^weights: want zero or more"),
        (lambda: pose_distance([[0.0]], [[0.0]], weights=[np.nan]), "^weights: "),
        (lambda: pose_distance([[0.0]], [[0.0]], a_trust=[[1], [1]]), "^a_trust: "),
        (lambda: pose_distance([[0.0]], [[0.0]], b_trust=[[-1]]), "^b_trust: "),
        (lambda: limb_trust(np.zeros((3, 2)), [[0, 1]], lengths=[0]), "^lengths: "),
    ],
)
def test_wrong_arguments_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
