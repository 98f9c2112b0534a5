"""Characters among rendered elements, some rows at a time, against the whole picture at once."""

import numpy as np
import pytest

from pegbar import depth_composite
from pegbar.layer.rim import rim_depth
from pegbar.shot import layered as rooms
from pegbar.shot.drawn import Drawn
from pegbar.shot.layered import layered
from pegbar.shot.view import View
from pegbar.simulate.passes import Passes

SIZE, WINDOW, SAMPLES = (70, 50), (8, 11, 60, 43), 2


def drawn(chance, depth):
    height, width = SIZE[::-1]
    alpha = np.clip(chance.normal(0.5, 0.6, (height, width)), 0, 1).astype(np.float32)
    depths = np.where(alpha > 0.2, chance.normal(depth, 0.5, (height, width)), np.inf).astype(np.float32)
    return Drawn(chance.integers(0, 256, (height, width, 3), np.uint8), alpha, depths)


@pytest.fixture
def scene():
    """Elements at random in a window, some samples covered in part and without depth, and two characters."""
    chance = np.random.default_rng(5)
    shape = (WINDOW[3] - WINDOW[1] + 1) * SAMPLES, (WINDOW[2] - WINDOW[0] + 1) * SAMPLES
    alpha = np.clip(chance.normal(0.4, 0.8, shape), 0, 1).astype(np.float32)
    beauty = np.concatenate([chance.random((*shape, 3), np.float32) * alpha[..., None], alpha[..., None]], axis=2)
    depth = np.where(alpha > 0.3, chance.normal(4, 0.5, shape), np.inf).astype(np.float32)
    passes = Passes(beauty, depth, alpha, (alpha > 0).astype(np.uint16), SAMPLES)
    return View(SIZE, WINDOW, passes, None), [drawn(chance, 4.0), drawn(chance, 2.0)]


def whole(view):
    left, top, right, bottom = (SAMPLES * edge for edge in WINDOW)
    shape = SIZE[1] * SAMPLES, SIZE[0] * SAMPLES
    beauty, depth = np.zeros((*shape, 4), np.float32), np.full(shape, np.inf, np.float32)
    part = np.s_[top : bottom + SAMPLES, left : right + SAMPLES]
    beauty[part], depth[part] = view.passes.beauty, view.passes.depth
    return beauty, rim_depth(beauty, depth)


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
@pytest.mark.parametrize("space", ["display", "linear"])
@pytest.mark.parametrize("rows", [7, 128])
def test_one_character_is_the_whole_pictures_composite(scene, monkeypatch, dtype, space, rows):
    monkeypatch.setattr(rooms, "_ROWS", rows)
    view, (one, _) = scene
    beauty, depth = whole(view)
    want = depth_composite(
        one.color, one.alpha, one.depth, beauty, depth, rendered_space="linear", space=space, dtype=dtype
    )
    np.testing.assert_array_equal(layered(view, [one], [1.0], space, dtype), want)


@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_a_second_character_stands_before_or_behind_the_first_by_its_own_scale(scene, monkeypatch, scale):
    monkeypatch.setattr(rooms, "_ROWS", 16)
    view, (one, two) = scene
    beauty, depth = whole(view)
    first = depth_composite(one.color, one.alpha, one.depth, beauty, depth, rendered_space="linear", dtype=np.float32)
    nearest = depth.reshape(SIZE[1], SAMPLES, SIZE[0], SAMPLES).min(axis=(1, 3))
    nearest = np.minimum(nearest, np.where(one.alpha > 0, one.depth, np.inf))
    want = depth_composite(two.color, two.alpha, two.depth * np.float32(scale), first, nearest, dtype=np.uint8)
    got = layered(view, [one, two], [1.0, scale], "display", np.uint8)
    np.testing.assert_array_equal(got, want)
    assert (got != layered(view, [one, two], [1.0, 4.0 - scale], "display", np.uint8)).mean() > 0.1
