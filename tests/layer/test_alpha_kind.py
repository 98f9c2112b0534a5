"""Premultiplied or straight, told by soft edges of known colours."""

import numpy as np
import pytest

from pegbar.layer.alpha_kind import alpha_kind


def disc(color, soft=3.0, premultiplied=True):
    """A disc of one colour with an edge ``soft`` pixels wide."""
    row, column = np.mgrid[:60, :80]
    alpha = np.clip((20 - np.hypot(row - 30, column - 40)) / soft, 0, 1).astype(np.float32)
    colors = np.broadcast_to(np.array(color, np.float32), (60, 80, 3)) * (alpha[..., None] if premultiplied else 1)
    return np.concatenate([colors, alpha[..., None]], axis=2).astype(np.float32)


@pytest.mark.parametrize("color", [(1, 1, 1), (0.02, 0.3, 0.01), (4.0, 2.0, 0.5)])
@pytest.mark.parametrize("premultiplied", [True, False])
def test_edges_tell(color, premultiplied):
    kind = "premultiplied" if premultiplied else "straight"
    assert alpha_kind([disc(color, premultiplied=premultiplied)]) == kind
    hole = disc(color, premultiplied=premultiplied)
    hole[..., :3] *= hole[..., 3:] > 0
    assert alpha_kind([hole]) == kind


@pytest.mark.parametrize("picture", [disc((0, 0, 0)), disc((1, 1, 1), soft=0.01), np.zeros((9, 9, 4), np.float32)])
def test_black_hard_and_empty_pictures_do_not(picture):
    assert alpha_kind([picture]) is None
