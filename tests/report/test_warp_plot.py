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
