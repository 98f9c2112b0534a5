import cv2
import numpy as np
import pytest

from pegbar.io.motion import read_motion
from pegbar.io.puppet_input import read_puppet_input
from pegbar.puppet.make import build_puppet, plan_figure, prepare_figure
from pegbar.puppet.performance import Direction, perform
from pegbar.puppet.staging import Setting, Stage
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
    assert mask[545:590, 645:675].sum() < 250
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


def covering(performance, frame, place):
    """The bones of the triangles that cover ``place`` (2,), farthest first."""
    corners = performance.meshes[frame][performance.puppet.triangles] - place
    sides = [
        a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        for a, b in zip(corners.swapaxes(0, 1), np.roll(corners, -1, 1).swapaxes(0, 1), strict=True)
    ]
    held = np.flatnonzero((np.array(sides) >= 0).all(axis=0) | (np.array(sides) <= 0).all(axis=0))
    ranks = performance.ranks[frame][performance.pieces.of_triangle[held]]
    return performance.puppet.triangle_bone[held[np.argsort(ranks)]]


def test_hands_before_the_body_are_seen_and_nothing_cracks(photo, test_data):
    motion = read_motion(test_data / "mocap" / "bvh" / "ad_fair1_wave_hello.bvh")
    puppet = build_puppet(photo, plan_figure(photo, motion), completion="flat")
    made = perform(puppet, motion, Direction(frame_rate=6))
    stage = Stage.of_performances([made], Setting(background="transparent", fit=False))
    hand = puppet.names.index("right_hand")
    bone = int(np.flatnonzero(puppet.bones[:, 1] == hand)[0])
    column, row = np.rint(puppet.marks[hand]).astype(int)
    skin = photo.image[row - 1 : row + 2, column - 1 : column + 2, :3].mean(axis=(0, 1))
    crossed = 0
    for frame in range(0, len(made), 2):
        place = puppet.camera.project(made.poses[frame, hand][None])[0]
        picture = stage.picture(frame)
        solid = (picture[..., 3] > 127).astype(np.uint8)
        sizes = cv2.connectedComponentsWithStats(solid)[2][1:, cv2.CC_STAT_AREA]
        assert sizes.max() > 0.995 * sizes.sum()
        # Cracks would run through limbs and let through what is behind; where arms close on the body pixels are left.
        holes = cv2.connectedComponentsWithStats(1 - solid, connectivity=4)[2][1:, cv2.CC_STAT_AREA]
        assert holes[holes <= 20].sum() <= 40
        seen = puppet.camera.project(made.poses[frame])[puppet.bones]
        along = np.rint(seen[:, :1] + np.linspace(0.05, 0.95, 60)[:, None] * np.diff(seen, axis=1)).astype(int)
        assert solid[along[..., 1], along[..., 0]].all()
        others = set(covering(made, frame, place).tolist()) - {bone}
        depths = puppet.camera.depth(made.poses[frame])
        if others and all(depths[hand] < depths[puppet.bones[other]].max() for other in others):
            crossed += 1
            column, row = np.rint(place).astype(int)
            assert np.abs(picture[row, column, :3] - skin).max() < 45, (frame, picture[row, column], skin)
    assert crossed >= 3
