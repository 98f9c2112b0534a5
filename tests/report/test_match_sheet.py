"""The sheet of a search: drawings whole, hair and all, and each match's figure whole below."""

import numpy as np
import pytest

from pegbar.report.match_sheet import SheetRow, match_sheet
from pegbar.scene.body import MARKERS

HAIR, SHOE = (200, 30, 200), (30, 160, 60)
#: Where the cells begin, and how large they are.
LEFT, CELL = 300, 220


def pose(legs):
    """A figure that stands in a 200 x 200 picture, its hips at height 100, its arms out; ``legs`` in pixels."""
    places = {"pelvis": (100, 100), "chest": (100, 80), "neck": (100, 65), "head": (100, 45)}
    for side, way in (("left", 1), ("right", -1)):
        for name, x, y in (("shoulder", 12, 68), ("elbow", 30, 70), ("hand", 48, 72), ("hip", 8, 100)):
            places[f"{side}_{name}"] = (100 + way * x, y)
        places[f"{side}_knee"] = (100 + way * 8, 100 + legs / 2)
        places[f"{side}_foot"] = (100 + way * 8, 100 + legs)
    return np.array([places[name] for name in MARKERS], float)


def drawing(paper):
    """Hair far over the head's mark, a shoe below the foot's; ``paper`` is the colour around."""
    picture = np.full((200, 200, len(paper)), paper, np.uint8)
    picture[20:44, 96:104, :3] = HAIR
    picture[130:140, 104:112, :3] = SHOE
    if len(paper) == 4:
        picture[20:44, 96:104, 3] = picture[130:140, 104:112, 3] = 255
    return picture


@pytest.mark.parametrize("paper", [(0, 0, 0, 0), (250, 248, 240)])
def test_hair_and_shoes_are_not_cut(paper):
    sheet = match_sheet(pose(30)[None], ["drawing 7"], [drawing(paper)], [])
    assert sheet.shape == (CELL, LEFT + CELL, 3)
    for color in (HAIR, SHOE):
        rows, columns = np.nonzero((sheet == color).all(axis=2))
        assert len(rows) > 100, color
        # Whole: there is paper on every side of it.
        assert 10 < rows.min() < rows.max() < CELL - 10
        assert LEFT + 10 < columns.min() < columns.max() < LEFT + CELL - 10
    hair = np.ptp(np.nonzero((sheet == HAIR).all(axis=2))[0])
    shoe = np.ptp(np.nonzero((sheet == SHOE).all(axis=2))[0])
    # In the picture it is 24 to 10 pixels.
    assert hair / shoe == pytest.approx(2.4, rel=0.25)


def test_scenery_does_not_make_the_figure_small():
    street = np.random.default_rng(0).integers(0, 256, (200, 200, 3), dtype=np.uint8)
    figure = pose(30)
    drawn = match_sheet(figure[None], ["drawing 1"], [street], [])
    limbs = np.argwhere((np.abs(drawn[:, LEFT:].astype(int) - (40, 100, 200)) < 20).all(axis=2))
    # Between the marks of the left shoulder and foot lie 62 of the picture's 200 pixels: of scenery half the figure's
    # size at most is shown about it.
    assert np.ptp(limbs[:, 0]) > CELL * 62 / 200


@pytest.mark.parametrize("legs", [10, 30, 90])
def test_the_clips_figure_fits_into_its_cell(legs):
    figure = pose(legs)
    longest = figure.copy()
    longest[:, 1] = 100 + 3 * (figure[:, 1] - 100)
    row = SheetRow(("1 walk.bvh",), longest[None], ("clip frame 3.0",))
    sheet = match_sheet(figure[None], ["drawing 1"], [None], [row])
    blue = np.argwhere((np.abs(sheet[CELL:, LEFT:].astype(int) - (40, 100, 200)) < 20).all(axis=2))
    assert blue.min() > 0
    assert blue.max() < CELL - 1
    # The lowest joint and the highest one are there: feet and shoulders.
    scale = np.ptp(blue[:, 0]) / (longest[:, 1].max() - longest[MARKERS.index("left_shoulder"), 1])
    assert scale == pytest.approx(np.ptp(blue[:, 1]) / 40, rel=0.1)


def test_a_pose_without_hips_is_laid_on_by_its_middle():
    figure, other = pose(30), pose(30) + 500
    figure[[MARKERS.index("left_hip"), MARKERS.index("pelvis")]] = np.nan
    row = SheetRow(("1 walk.bvh",), other[None], ("clip frame 3.0",))
    sheet = match_sheet(figure[None], ["drawing 1"], [None], [row])
    drawn, matched = (
        np.argwhere((np.abs(part[:, LEFT:].astype(int) - (40, 100, 200)) < 20).all(axis=2)).mean(axis=0)
        for part in (sheet[:CELL], sheet[CELL:])
    )
    assert np.abs(drawn - matched).max() < CELL / 4
