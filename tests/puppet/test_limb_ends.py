import numpy as np
import pytest

from pegbar.io.puppet_input import read_puppet_input
from pegbar.puppet.make import prepare_figure
from tests.figures import figure

RNG = np.random.default_rng(11)


@pytest.fixture(scope="module")
def photo(test_data):
    source = read_puppet_input(test_data / "annotated" / "yogait_photos" / "annotation.json")
    return prepare_figure(source, matting="mask")


def test_a_photos_hands_have_fingers_and_its_feet_no_floor(photo):
    mask = photo.mask
    # The carpet beside and behind the left foot, as dark as the trousers; the first cut takes all of it.
    assert not mask[525:540, 570:590].any()
    assert not mask[600:640].any()
    # Columns through the spread fingers of both hands cross the outline of more than one.
    for columns in (range(815, 826), range(296, 304)):
        crossings = [np.count_nonzero(np.diff(mask[150:280, column].astype(int)) == 1) for column in columns]
        assert max(crossings) >= 2
    assert mask[560:590, 610:640].mean() > 0.8


def test_an_outline_that_the_picture_hardly_shows_is_told(photo):
    told = [note for note in photo.notes if "hardly tells" in note]
    assert len(told) == 1
    assert "left_foot" in told[0]
    assert "hand" not in told[0]


def test_feet_on_a_floor_of_their_own_colour_are_told():
    source = figure()
    image = np.full((*source.mask.shape, 3), (120, 130, 90), np.uint8)
    image = np.where(source.mask[..., None], source.image[..., :3], image)
    image[240:, 140:] = (60, 160, 60)
    image = np.clip(image + RNG.integers(-4, 5, image.shape), 0, 255).astype(np.uint8)
    notes = " ".join(prepare_figure(figure(image=image, mask=None), matting="mask").notes)
    assert "hardly tells the figure from what is behind it at left_foot" in notes
    assert "right_foot" not in notes
