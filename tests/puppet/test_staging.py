from itertools import pairwise

import numpy as np
import pytest

from pegbar.puppet.figure_picture import FigurePicture
from pegbar.puppet.performance import Direction, perform
from pegbar.puppet.staging import Setting, Stage, put_over
from tests.puppets import SIZE, arm_puppet, clip, turned_poses


def performance(degrees=(0.0, 20.0, 40.0), **changes):
    puppet = arm_puppet().changed(**changes)
    return perform(puppet, clip(turned_poses(puppet, degrees)), Direction(inflation=0))


def test_a_figure_as_drawn_is_the_drawing():
    made = performance()
    setting = Setting(background="transparent", fit=False)
    picture = next(Stage.of_performances([made], setting).pictures())
    texture = made.puppet.textures[0]
    inside = np.s_[82:118, 52:248]
    assert np.array_equal(picture[inside], texture[inside])
    assert picture[:70].max() == 0


def test_a_plain_ground_is_its_colour():
    stage = Stage.of_performances([performance()], Setting(color=(9, 8, 7), size=(120, 100)))
    pictures = list(stage.pictures())
    assert len(pictures) == len(stage) == 3
    assert {picture.shape for picture in pictures} == {(100, 120, 3)}
    assert pictures[0][0, 0].tolist() == [9, 8, 7]
    assert (pictures[0] != (9, 8, 7)).any()


def test_a_fitted_figure_never_leaves_the_canvas():
    made = performance(np.linspace(-60, 60, 9))
    stage = Stage.of_performances([made], Setting(size=(90, 200)))
    places = made.meshes * stage.scales[0] + stage.offsets[0]
    assert places.min() >= 0
    assert (places.max(axis=(0, 1)) <= [89, 199]).all()
    width = np.ptp(places[..., 0])
    assert width == pytest.approx(90 * 0.92, abs=1e-6)


def test_figures_stand_side_by_side_on_one_floor():
    first, second = performance(), performance(degrees=(0.0, 10.0))
    stage = Stage.of_performances([first, second, first], Setting(size=(400, 100)))
    places = [
        made.meshes * k + o for made, k, o in zip((first, second, first), stage.scales, stage.offsets, strict=True)
    ]
    for left, right in pairwise(places):
        assert left[..., 0].max() < right[..., 0].min()
        assert left[..., 1].max() == pytest.approx(right[..., 1].max())
    assert len(stage) == 3
    assert all(picture.shape == (100, 400, 3) for picture in stage.pictures())


def test_what_is_behind_is_seen_and_moves_with_the_camera():
    ground = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    ground[:, 200:] = 200
    made = performance(background=ground)
    picture = next(Stage.of_performances([made], Setting(background="completed")).pictures())
    assert np.array_equal(picture[:60], ground[:60])
    shown = next(Stage.of_performances([made], Setting(background="picture"), ground).pictures())
    assert np.array_equal(shown, picture)
    wide = next(Stage.of_performances([made], Setting(background="completed", size=(600, 200))).pictures())
    assert (wide[0, 0] == 255).all()
    assert (wide[0, 449] == 200).all()
    with pytest.raises(ValueError, match="no completed one"):
        Stage.of_performances([performance()], Setting(background="completed"))


def test_pictures_may_begin_anywhere_and_stop():
    stage = Stage.of_performances([performance(np.linspace(0, 50, 40))], Setting(size=(60, 40)))
    every = list(stage.pictures())
    assert np.array_equal(list(stage.pictures(7, 9)), every[7:9])
    started = stage.pictures()
    assert np.array_equal(next(started), every[0])
    started.close()


def test_small_pictures_have_small_textures():
    puppet = arm_puppet()
    full, half = FigurePicture.of_puppet(puppet), FigurePicture.of_puppet(puppet, 0.5)
    assert half.texture.shape[0] == pytest.approx(full.texture.shape[0] / 2, abs=1)
    mean = full.texture[:, :200, 0].mean()
    assert half.texture[:, :100, 0].mean() == pytest.approx(mean, abs=3)
    assert np.allclose(half.coordinates * 2 + 0.5, full.coordinates, atol=1.1)


def test_layers_that_share_vertices_have_each_their_own_picture():
    puppet = arm_puppet()
    layer = (puppet.triangle_bone == 1).astype(np.int64)
    red, blue = (np.zeros((SIZE[1], SIZE[0], 4), np.uint8) for _ in range(2))
    red[...], blue[...] = (255, 0, 0, 255), (0, 0, 255, 255)
    puppet = puppet.changed(triangle_layer=layer, layers=("near", "far"), textures=(red, blue))
    picture = FigurePicture.of_puppet(puppet)
    shared = len(np.intersect1d(puppet.triangles[layer == 0], puppet.triangles[layer == 1]))
    assert len(picture.vertices) == len(puppet.vertices) + shared > len(puppet.vertices)
    drawn = picture.draw(puppet.vertices, np.zeros(len(layer)), SIZE)
    assert drawn[99, 60].tolist() == [255, 0, 0, 255]
    assert drawn[99, 240].tolist() == [0, 0, 255, 255]
    assert (drawn[80:119, 51:249, 3] == 255).all()


def test_half_covered_pixels_mix():
    lower, upper = np.full((1, 1, 4), (0, 100, 0, 255), np.uint8), np.full((1, 1, 4), (200, 0, 0, 128), np.uint8)
    assert np.abs(put_over(upper, lower)[0, 0].astype(int) - [100, 50, 0, 255]).max() <= 1
    empty = np.zeros((1, 1, 4), np.uint8)
    assert put_over(upper, empty)[0, 0].tolist() == [200, 0, 0, 128]


@pytest.mark.parametrize(
    ("fields", "problem"), [({"background": "sea"}, "background: want one of"), ({"size": (0, 5)}, "size: want")]
)
def test_settings_that_are_none(fields, problem):
    with pytest.raises(ValueError, match=problem):
        Setting(**fields)


def test_scenes_that_cannot_be():
    with pytest.raises(ValueError, match="at least one"):
        Stage.of_performances([], Setting())
    other = perform(arm_puppet(), clip(turned_poses(arm_puppet(), [0, 1.0]), frame_rate=24.0))
    with pytest.raises(ValueError, match="one frame rate, got 24.0, 30.0"):
        Stage.of_performances([performance(), other], Setting())
