"""A shot whose exposure sheet moves the camera, for other packages: what they render is what the film frame shows."""

import json

import numpy as np
import pytest

from pegbar.export.shot_gltf import gltf_notes
from pegbar.export.shot_scene import filmed, lenses
from pegbar.export.shot_values import shot_table
from pegbar.io.camera_cells import camera_moves
from pegbar.io.exposure_sheet import read_exposure_sheet
from pegbar.layer.reframe import reframe_nearest
from pegbar.scene.camera_moves import CameraKey, CameraMoves
from pegbar.shot.export_stage import write_shot
from pegbar.simulate.passes import render_passes
from tests.export.rendered import small
from tests.export.shots import FRAMES

MOVES = CameraMoves(
    {
        "pan_x": (CameraKey(101, 0.0, "ease"), CameraKey(108, 30.0)),
        "zoom": (CameraKey(102, 1.0), CameraKey(108, 2.2)),
        "rotate": (CameraKey(101, -10.0, "ease"), CameraKey(105, 25.0, "hold"), CameraKey(108, 0.0)),
    }
)
SIZE = (200, 110)


@pytest.fixture(scope="module")
def scenes():
    scene = small(shift=(3.0, -2.0))
    return scene, filmed(scene, MOVES, SIZE)


def test_markers_are_seen_where_the_film_shows_them(scenes):
    scene, seen = scenes
    for row, view in enumerate(seen.views):
        points = scene.characters[0].markers[row]
        drawn = np.column_stack([scene.cameras[row].project(points), np.ones(len(points))])
        shown = (drawn @ view.to_film.T)[:, :2]
        np.testing.assert_allclose(seen.cameras[row].project(points), shown, atol=1e-9)
        np.testing.assert_allclose(seen.cameras[row].depth(points), scene.cameras[row].depth(points))


def test_what_is_rendered_is_what_the_film_shows_of_the_drawing_s_render(scenes):
    from pegbar.export.limbs import limb_meshes

    scene, seen = scenes
    for row in (0, 4, 7):
        meshes = limb_meshes(scene.characters, row)
        whole = render_passes(meshes, scene.cameras[row]).depth
        film = render_passes(meshes, seen.cameras[row]).depth
        expected = reframe_nearest(whole, seen.views[row], np.inf)
        both = np.isfinite(film) & np.isfinite(expected)
        assert both.sum() > 500
        # Only outlines, where nearest pixels fall on either side, and steps between limbs may differ.
        assert (np.isfinite(film) != np.isfinite(expected)).mean() < 0.08
        assert np.percentile(abs(film[both] / expected[both] - 1), 90) < 0.01


def test_lenses_have_no_skew_and_follow_the_zoom(scenes):
    scene, seen = scenes
    for row, (before, after) in enumerate(zip(lenses(scene), lenses(seen), strict=True)):
        longer = after.focal_length / after.width * SIZE[0] / (before.focal_length / before.width * scene.image_size[0])
        assert longer == pytest.approx(MOVES.at(FRAMES[row])["zoom"], rel=1e-6)
    assert any("no film offset" in note for note in gltf_notes(seen))


def test_json_says_what_moved_and_names_no_picture_that_would_not_fit(scenes, tmp_path):
    scene, seen = scenes
    table = shot_table(seen, tmp_path)
    assert table["image_size"] == [200, 110]
    assert table["pictures"] == [None] * len(FRAMES)
    moved = table["exposure_sheet"]
    assert moved["paper"] == list(scene.image_size)
    assert moved["zoom"] == [MOVES.at(frame)["zoom"] for frame in FRAMES]
    assert "exposure_sheet" not in {*shot_table(scene, tmp_path)}
    json.dumps(table)


def test_a_sheet_goes_round(scenes, tmp_path):
    write_shot(tmp_path, scenes[1], ["exposure"])
    found, problems = camera_moves(read_exposure_sheet(tmp_path / "exposure.csv").camera, "exposure.csv")
    assert problems == []
    assert found == MOVES
    again, _ = camera_moves(read_exposure_sheet(tmp_path / "exposure.xdts").camera, "exposure.xdts")
    assert [again.at(row) for row in range(1, 9)] == [MOVES.at(frame) for frame in FRAMES]


def test_keys_outside_the_shot_are_written_frame_by_frame(scenes, tmp_path):
    moves = CameraMoves({"pan_y": (CameraKey(90, 0.0, "ease"), CameraKey(130, 80.0))})
    write_shot(tmp_path, filmed(scenes[0], moves, None), ["exposure"])
    found, _ = camera_moves(read_exposure_sheet(tmp_path / "exposure.csv").camera, "exposure.csv")
    assert [found.at(frame) for frame in FRAMES] == [moves.at(frame) for frame in FRAMES]


def test_a_camera_at_rest_changes_nothing(scenes):
    scene = scenes[0]
    for moves in (None, CameraMoves({"zoom": (CameraKey(101, 1.0),)})):
        still = filmed(scene, moves, None)
        assert still.cameras is scene.cameras
        assert still.pictures is scene.pictures
        assert still.views == ()
