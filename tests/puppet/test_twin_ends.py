import dataclasses

import cv2
import numpy as np
import pytest

from pegbar.puppet.twin_ends import _movement, even_ends
from tests.figures import figure

FLOOR, LEG = (120, 110, 100), (60, 60, 90)
TRUNK, WINDOW = 90.0, 40.0
RNG = np.random.default_rng(4)


def standing(blob):
    """The person before a floor, its mask, and a blob of a colour beside the left ankle that the mask takes in."""
    source = figure()
    left = source.marks[source.names.index("left_foot")]
    more = np.zeros(source.mask.shape, np.uint8)
    middle = np.rint(np.add(left, (18, -12))).astype(int)
    cv2.circle(more, middle.tolist(), 9, 1, -1)
    more = more.astype(bool) & ~source.mask
    image = np.full((*source.mask.shape, 3), FLOOR, np.uint8)
    image[source.mask] = LEG
    image[more] = blob
    image = np.clip(image + RNG.integers(-6, 7, image.shape), 0, 255).astype(np.uint8)
    return dataclasses.replace(source, image=image, mask=None), source.mask, more


def test_floor_that_one_foot_has_more_than_the_other_goes():
    source, mask, more = standing(FLOOR)
    made = even_ends(source, mask | more, TRUNK, WINDOW)
    assert (made & more).sum() < 0.25 * more.sum()
    # The figure itself stays, and nothing comes.
    assert (mask & ~made).sum() < 0.01 * mask.sum()
    assert not (made & ~(mask | more)).any()


def test_what_a_foot_has_more_of_its_own_colour_stays():
    source, mask, more = standing(LEG)
    made = even_ends(source, mask | more, TRUNK, WINDOW)
    assert (made & more).sum() > 0.9 * more.sum()


def test_ends_that_are_alike_stay_as_they_are():
    source, mask, _ = standing(FLOOR)
    np.testing.assert_array_equal(even_ends(source, mask, TRUNK, WINDOW), mask)


def test_ends_that_are_not_alike_are_not_compared():
    source, mask, more = standing(FLOOR)
    # Most of the right leg is hidden: nothing can be told by it.
    cut = mask & ~(np.arange(mask.shape[1])[None] < 118)
    np.testing.assert_array_equal(even_ends(source, cut | more, TRUNK, WINDOW), cut | more)


@pytest.mark.parametrize("mirrored", [True, False])
def test_the_movement_takes_a_bone_onto_the_other(mirrored):
    start, target = RNG.uniform(0, 100, (2, 2, 2))
    move = _movement(start, target, mirrored)
    assert np.linalg.det(move[:, :2]) == pytest.approx(-1 if mirrored else 1)
    np.testing.assert_allclose(move @ [*start[1], 1], target[1])
    along = move[:, :2] @ (start[1] - start[0])
    wanted = (target[1] - target[0]) / np.linalg.norm(target[1] - target[0]) * np.linalg.norm(start[1] - start[0])
    np.testing.assert_allclose(along, wanted)
