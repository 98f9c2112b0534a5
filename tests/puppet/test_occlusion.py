import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar.puppet.occlusion import BRIEF, HYSTERESIS, Pieces, calmed, nearest_points, piece_ranks, settle
from tests.puppets import camera

BONES = np.array([[0, 1], [2, 3]])


def crossing(depths):
    """Two bones that cross in the picture, the second `depths` (F,) metres farther."""
    pose = np.array([[-0.5, 0, 0], [0.5, 0, 0], [0, -0.5, 0], [0, 0.5, 0.0]])
    poses = np.repeat(pose[None], len(depths), axis=0)
    poses[:, 2:, 2] -= np.asarray(depths)[:, None]
    return poses


def pieces(layers=(0, 1), radii=(20, 20), kinds=(0, 0)):
    return Pieces(np.array([0, 1]), np.array([0, 1]), np.array(layers), np.array(radii, float), np.array(kinds))


@pytest.mark.parametrize("layers", [(0, 1), (1, 0)])
def test_the_nearer_limb_is_in_front(layers):
    ranks = piece_ranks(pieces(layers), BONES, camera(), crossing([0.3, 0.3, -0.3, -0.3, 0.3]))
    assert ranks[:, 0].tolist() == [1, 1, 0, 0, 1]


def test_a_small_difference_changes_nothing():
    size = 1.0
    small = 0.9 * HYSTERESIS * size
    flicker = [0.3, small, -small, small, -small, -0.3, small, -small, small, 0.3]
    ranks = piece_ranks(pieces(), BONES, camera(), crossing(flicker))
    assert ranks[:, 0].tolist() == [1, 1, 1, 1, 1, 0, 0, 0, 0, 1]


def test_what_the_first_frame_does_not_tell_is_as_drawn():
    level = crossing([0.0, 0.001, -0.001])
    assert piece_ranks(pieces((0, 1)), BONES, camera(), level)[:, 0].tolist() == [1, 1, 1]
    assert piece_ranks(pieces((1, 0)), BONES, camera(), level)[:, 0].tolist() == [0, 0, 0]


@pytest.mark.parametrize("kinds", [(1, 2), (2, 1)])
def test_an_arm_beside_the_body_stays_as_drawn(kinds):
    depths = [0.0, -0.04, 0.04, -0.2, 0.2]
    ranks = piece_ranks(pieces((0, 1), kinds=kinds), BONES, camera(), crossing(depths))
    assert ranks[:, 0].tolist() == [1, 1, 1, 0, 1]
    ranks = piece_ranks(pieces((1, 0), kinds=kinds), BONES, camera(), crossing(depths))
    assert ranks[:, 0].tolist() == [0, 0, 0, 0, 1]
    both = piece_ranks(pieces((0, 1), kinds=(2, 2)), BONES, camera(), crossing(depths))
    assert both[:, 0].tolist() == [1, 0, 1, 0, 1]


def test_where_nothing_is_covered_the_order_is_free_to_change():
    behind, cover = np.array([[0.5], [-0.01], [-0.01]]), np.array([[True], [False], [True]])
    assert settle(behind, cover, 0.02, np.array([True]))[:, 0].tolist() == [True, False, False]
    assert settle(behind, cover | True, 0.02, np.array([True]))[:, 0].tolist() == [True, True, True]


def test_an_order_that_goes_round_is_still_an_order():
    bones = np.array([[0, 1], [2, 3], [4, 5]])
    corners = np.array([[0, 0.4], [0.35, -0.2], [-0.35, -0.2]])
    poses = np.zeros((1, 6, 3))
    for bone in range(3):
        start, end = corners[bone], corners[(bone + 1) % 3]
        along = end - start
        poses[0, 2 * bone, :2], poses[0, 2 * bone + 1, :2] = start - 0.2 * along, end + 0.2 * along
        poses[0, 2 * bone : 2 * bone + 2, 2] = 0.2, -0.2
    three = Pieces(np.arange(3), np.arange(3), np.zeros(3, int), np.full(3, 5.0), np.zeros(3, int))
    ranks = piece_ranks(three, bones, camera(), poses)
    assert sorted(ranks[0].tolist()) == [0, 1, 2]


def test_pieces_without_a_bone_keep_to_their_layer():
    three = Pieces(np.arange(3), np.array([0, -1, 1]), np.array([0, 1, 2]), np.full(3, 5.0), np.zeros(3, int))
    ranks = piece_ranks(three, BONES, camera(), crossing([0.3]))
    assert ranks[0].tolist() == [2, 1, 0]
    assert piece_ranks(three, BONES, camera(), crossing([])).shape == (0, 3)


points = st.tuples(*(st.floats(-10, 10) for _ in range(8)))


@given(points)
def test_nearest_points_are_the_nearest(numbers):
    start, end, other, last = np.array(numbers).reshape(4, 2)
    first, second, distance = nearest_points(start, end - start, other, last - other)
    assert 0 <= first <= 1
    assert 0 <= second <= 1
    shares = np.linspace(0, 1, 41)
    a = start + shares[:, None] * (end - start)
    b = other + shares[:, None] * (last - other)
    least = np.linalg.norm(a[:, None] - b[None], axis=2).min()
    assert distance <= least + 1e-6


@pytest.mark.parametrize(("layers", "ranks"), [((0, 0, 1), [1, 0]), ((1, 1, 0), [0, 1])])
def test_where_a_limb_hangs_on_another_layer_the_order_stays_as_drawn(layers, ranks):
    bones = np.array([[0, 1], [1, 2], [2, 3]])
    poses = np.zeros((2, 4, 3))
    poses[:, :, :2] = [[0, 1], [0, 0.6], [0.1, 0.3], [0.1, 0]]
    poses[:, 2:, 2] = np.array([[0.5], [-0.5]])
    coat_and_thigh = Pieces(np.arange(2), np.array([1, 2]), np.array(layers)[1:], np.full(2, 50.0), np.zeros(2, int))
    found = piece_ranks(coat_and_thigh, bones, camera(), poses)
    assert found.tolist() == [ranks, ranks]


def flags(text):
    return np.array([[letter == "1"] for letter in text])


def calm(shown, front=None, touching=None):
    """`calmed` of one pair, its flags as text; ``front`` is another order throughout where it is not given."""
    shown = flags(shown)
    touching = np.ones(shown.shape, bool) if touching is None else flags(touching)
    made = calmed(shown, ~shown if front is None else flags(front), touching)
    return "".join("1" if flag else "0" for flag in made[:, 0])


def test_a_change_that_is_undone_at_once_is_none():
    assert calm("000110000000") == "000000000000"
    assert calm("111101011111") == "111111111111"
    # What lasts stays, and so does what the clip begins or ends with.
    assert BRIEF == 3
    assert calm("000111000000") == "000000000000"
    assert calm("000111100000") == "000111100000"
    assert calm("011111111110") == "011111111110"


def test_two_limbs_own_changes_stay_however_brief():
    assert calm("000110000", front="000110000") == "000110000"
    assert calm("000110000", front="000100000") == "000000000"
    assert calm("000110000", front="111110000") == "000000000"


def test_a_hand_that_flies_past_a_face_is_in_front_of_it_though_briefly():
    # They cover each other only there: before and after nobody sees which is nearer.
    assert calm("000110000", touching="000110000") == "000110000"
    assert calm("000110000", touching="001111000") == "000000000"


def test_each_pair_is_calmed_by_itself_and_the_input_stays():
    shown = np.concatenate([flags("0001000"), flags("0111100"), flags("1011111")], axis=1)
    before = shown.copy()
    made = calmed(shown, ~shown, np.ones(shown.shape, bool))
    np.testing.assert_array_equal(made, np.concatenate([flags("0000000"), flags("0111100"), flags("1111111")], axis=1))
    np.testing.assert_array_equal(shown, before)
