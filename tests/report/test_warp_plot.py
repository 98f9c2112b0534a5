import numpy as np
import pytest

from pegbar import time_warp
from pegbar.report.warp_plot import warp_picture


def test_costs_path_and_times_are_drawn():
    cost = abs(np.arange(12.0)[:, None] - np.arange(20.0) / 2) + 0.1
    warp = time_warp(cost)
    picture = warp_picture(cost, warp, size=(640, 480), clip_offset=100, clip_step=5, title="walk")
    assert picture.shape == (480, 640, 4)
    assert (picture[..., 3] == 255).all()
    red, blue = (np.abs(picture[..., :3].astype(int) - c).max(axis=2) < 12 for c in ((214, 39, 40), (31, 119, 180)))
    assert red.sum() > 100
    assert blue.sum() > 20
    with pytest.raises(ValueError, match="^cost: want shape"):
        warp_picture(cost[1:], warp)
    with pytest.raises(ValueError, match="^size: "):
        warp_picture(cost, warp, size=(0, 10))


def test_costs_of_a_long_shot_may_be_thinned():
    cost = abs(np.arange(120.0)[:, None] - np.arange(202.0) / 2) + 0.1
    warp = time_warp(cost)
    whole, thin = (
        warp_picture(cost[::rows, ::columns], warp, thinned=(rows, columns)).astype(int)[..., :3]
        for rows, columns in ((1, 1), (2, 3))
    )
    assert whole.shape == thin.shape
    # The axes end with the last thinned column, one clip frame later.
    assert np.abs(whole - thin).mean() < 6
    with pytest.raises(ValueError, match="^cost: want shape"):
        warp_picture(cost, warp, thinned=(2, 3))
    with pytest.raises(ValueError, match="^thinned: "):
        warp_picture(cost, warp, thinned=(0, 1))
