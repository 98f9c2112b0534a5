import cv2
import numpy as np
import pytest

from pegbar.errors import MissingExtraError
from pegbar.puppet.alpha import figure_alpha
from pegbar.puppet.inpaint import complete
from pegbar.puppet.texture import layer_textures, mask_alpha
from tests.figures import COLORS, figure
from tests.puppet.test_layers import ACROSS, cut

RNG = np.random.default_rng(2)


def test_one_layer_paints_the_picture_again():
    source = figure()
    _, layers, _ = cut(source)
    alpha = source.image[..., 3] / np.float32(255)
    (texture,) = layer_textures(np.ascontiguousarray(source.image[..., :3]), alpha, layers, "flat")
    inside = cv2.erode(source.mask.view(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    np.testing.assert_array_equal(texture[inside][:, :3], source.image[inside][:, :3])
    np.testing.assert_array_equal(texture[..., 3][inside], 255)
    assert texture[..., 3][~cv2.dilate(source.mask.view(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)].max() == 0


def test_colour_is_bled_under_alpha():
    source = figure()
    _, layers, _ = cut(source)
    alpha = source.image[..., 3] / np.float32(255)
    (texture,) = layer_textures(np.ascontiguousarray(source.image[..., :3]), alpha, layers, "flat")
    ring = cv2.dilate(source.mask.view(np.uint8), np.ones((5, 5), np.uint8)).astype(bool) & ~source.mask
    # The paper is white: none of it is left beside the figure.
    assert texture[ring][:, :3].min(axis=1).max() < 200


def test_what_the_arm_hides_is_filled_with_the_trunks_colour():
    source = figure(changes=ACROSS)
    _, layers, _ = cut(source, view="front")
    alpha = source.image[..., 3] / np.float32(255)
    arm, body = layer_textures(np.ascontiguousarray(source.image[..., :3]), alpha, layers, "flat", rim=2)
    hidden = layers[1].region & ~layers[1].drawn
    assert hidden.sum() > 100
    found = body[hidden][:, :3].astype(int)
    torso, arm_color, paper = (
        np.abs(found - color).max(axis=1) < 5 for color in (COLORS["torso"], COLORS["left"], 255)
    )
    assert torso.mean() > 0.5
    assert arm_color.mean() < 0.01
    assert paper.mean() < 0.01
    assert (body[hidden][:, 3] > 250).mean() > 0.8
    drawn = cv2.erode(layers[0].drawn.view(np.uint8), np.ones((5, 5), np.uint8)).astype(bool)
    np.testing.assert_array_equal(arm[drawn][:, :3], source.image[drawn][:, :3])


def test_a_masks_edge_is_smooth_and_where_it_was():
    mask = np.zeros((40, 40), bool)
    mask[10:30, 12:28] = True
    alpha = mask_alpha(mask)
    assert alpha.dtype == np.float32
    np.testing.assert_array_equal(alpha >= 0.5, mask)
    assert abs(alpha.sum() - mask.sum()) < 4
    assert set(np.unique(alpha[20, :9])) == {0.0}


@pytest.mark.parametrize("method", ["diffuse", "flat", lambda image, hole: np.where(hole[..., None], 7, image)])
def test_completion_changes_the_hole_only(method):
    image = RNG.integers(0, 256, (30, 40, 3)).astype(np.uint8)
    hole = np.zeros((30, 40), bool)
    hole[10:20, 15:30] = True
    found = complete(image, hole, method)
    np.testing.assert_array_equal(found[~hole], image[~hole])
    assert (found[hole] != image[hole]).any()
    np.testing.assert_array_equal(complete(image, np.zeros_like(hole), method), image)


def test_wrong_completions_are_refused(monkeypatch):
    image, hole = np.zeros((9, 9, 3), np.uint8), np.zeros((9, 9), bool)
    hole[4, 4] = True
    with pytest.raises(ValueError, match="method: want auto, patch, diffuse, flat or a function, got 'magic'"):
        complete(image, hole, "magic")
    with pytest.raises(ValueError, match="hole: want something of the picture left"):
        complete(image, ~np.zeros_like(hole), "flat")
    with pytest.raises(ValueError, match="method: want 9 rows"):
        complete(image, hole, lambda picture, _: picture[1:])
    monkeypatch.setitem(__import__("sys").modules, "patchmatch", None)
    with pytest.raises(MissingExtraError, match=r"pegbar\[inpaint\]"):
        complete(image, hole, "patch")


def test_patches_carry_a_pattern_on():
    pytest.importorskip("patchmatch")
    rows, columns = np.mgrid[:64, :64]
    image = np.repeat(((columns // 4 % 2) * 200).astype(np.uint8)[..., None], 3, axis=2)
    hole = np.zeros((64, 64), bool)
    hole[26:38, 26:38] = True
    found = complete(image, hole, "patch")
    assert (np.abs(found[hole].astype(int) - image[hole]) < 60).mean() > 0.9
    barred = np.where(rows < 32, 0, 1)[..., None] * image
    half = complete(barred.astype(np.uint8), hole, "patch", source=rows >= 32)
    assert half[26:32, 26:38].max() > 100


def test_a_soft_edge_is_found_within_a_band():
    yy, xx = np.mgrid[:80, :80]
    soft = np.clip((25 - np.hypot(xx - 40, yy - 40)) / 4 + 0.5, 0, 1)
    image = np.rint(np.array([200, 30, 30]) * soft[..., None] + 250 * (1 - soft[..., None]) * [0, 1, 0]).astype(
        np.uint8
    )
    found = figure_alpha(image, soft > 0.5, "guided")
    assert np.abs(found - soft).mean() < 0.01
    assert found[40, 40] == 1
    assert found[0, 0] == 0
    with pytest.raises(ValueError, match="method: want auto, closed form, guided, mask, got 'blue screen'"):
        figure_alpha(image, soft > 0.5, "blue screen")


def test_closed_form_needs_its_extra(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pymatting", None)
    mask = np.zeros((30, 30), bool)
    mask[10:20, 10:20] = True
    with pytest.raises(MissingExtraError, match=r"pegbar\[matting\]"):
        figure_alpha(np.zeros((30, 30, 3), np.uint8), mask, "closed form")
