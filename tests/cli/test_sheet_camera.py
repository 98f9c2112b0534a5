"""A sheet that moves the camera, on the small sample shot: exported, rendered elsewhere, imported and composited."""

import json
import tomllib

import numpy as np
import pytest

from pegbar import PerspectiveCamera
from pegbar.cli.main import main
from pegbar.export.limbs import limb_meshes
from pegbar.io.exr import read_exr, read_passes, write_exr
from pegbar.io.frames import read_picture
from pegbar.layer.reframe import reframe_nearest, reframe_picture
from pegbar.sample.shot import write_sample
from pegbar.scene.film_view import FilmView
from pegbar.shot.plan import open_shot
from pegbar.shot.shot_scene import Tracked, film_scene, shot_scene
from pegbar.simulate.passes import render_passes

PAPER, FRAMES = (240, 136), (1, 2, 3)
SHEET = "frame,drawing,pan_x,pan_y,zoom,rotate,ease\n1,1,-20,0,1.2,0,ease\n2,2,,,,,\n3,3,24,6,1.6,12,\n"


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    """The sample shot with a sheet, in frames of 160 x 90."""
    shot = write_sample(tmp_path_factory.mktemp("camera"), size=PAPER, frames=3, samples=1)
    (shot.parent / "sheet.csv").write_text(SHEET)
    text = shot.read_text().replace("[drawing]\n", '[drawing]\nexposure = "sheet.csv"\n')
    text = text.replace("[output]\n", "[output]\nsize = [160, 90]\n")
    shot.write_text(text.replace('["scarves", "skirt", "balls"]', '["balls"]'))
    return shot


def render(shot, folder, camera, size):
    """The limbs of the shot as another package would render them from shot.json, and a board before them."""
    table = json.loads((shot.parent / "export/shot.json").read_text())
    scene, _ = shot_scene(Tracked(shot))
    (shot.parent / folder).mkdir(exist_ok=True)
    for row, frame in enumerate(FRAMES):
        seen = PerspectiveCamera(table["camera"]["matrix"][row], table["image_size"])
        assert (seen.image_size, table["image_size"]) == (size, list(size))
        limbs = render_passes(limb_meshes(scene.characters, row), seen)
        channels = {"": limbs.beauty, "Z": limbs.depth, "check.Z": limbs.depth}
        write_exr(shot.parent / folder / f"r.{frame:04d}.exr", channels)
    return str(shot.parent / folder / "r.####.exr")


def test_passes_of_the_exported_camera_are_taken_and_meet_the_drawing(sample, capsys):
    assert main(["export", str(sample), "--formats", "npz,exposure"]) == 0
    assert "160 x 90 pixels" in capsys.readouterr().out
    pattern = render(sample, "seen", "sheet", (160, 90))
    assert main(["import-passes", str(sample), pattern]) == 0
    said = capsys.readouterr().out
    assert "limbs are where the shot's camera sees them" in said
    assert tomllib.loads(sample.read_text())["passes"]["camera"] == "sheet"
    assert main(["composite", str(sample), "--jobs", "1"]) == 0
    for frame in FRAMES:
        final = read_picture(sample.parent / f"final/final.{frame:04d}.png")
        assert final.shape == (90, 160, 4)
        # Limbs of the render lie within the drawn ones, at their depth.
        limbs = read_passes(sample.parent / f"seen/r.{frame:04d}.exr", want=("depth",)).depth
        drawn = read_picture(sample.parent / f"drawings/dancer.{frame:04d}.png")
        view = open_shot(sample).view(frame, PAPER)
        there = reframe_picture(drawn, view)[..., 3] > 128
        assert (np.isfinite(limbs) & there).sum() > 0.8 * np.isfinite(limbs).sum()


def test_passes_of_the_whole_drawing_are_known_as_such(sample, capsys):
    assert main(["export", str(sample), "--formats", "npz", "--camera", "drawn"]) == 0
    pattern = render(sample, "whole", "drawn", PAPER)
    assert main(["import-passes", str(sample), pattern]) == 0
    assert "camera" not in tomllib.loads(sample.read_text())["passes"]
    assert main(["import-passes", str(sample), pattern, "--camera", "sheet", "--check"]) == 1
    assert "want" not in capsys.readouterr().err
    assert main(["composite", str(sample), "--jobs", "1"]) == 0
    assert read_picture(sample.parent / "final/final.0002.png").shape == (90, 160, 4)


def test_of_two_cameras_with_frames_of_one_size_the_one_that_fits_is_found(sample, capsys, tmp_path):
    whole = sample.with_name("same.toml")
    whole.write_text(sample.read_text().replace("size = [160, 90]\n", ""))
    for camera in ("drawn", "sheet"):
        assert main(["export", str(whole), "--formats", "npz", "--camera", camera]) == 0
        pattern = render(whole, f"same_{camera}", camera, PAPER)
        assert main(["import-passes", str(whole), pattern, "-o", str(tmp_path / camera)]) == 0
        assert tomllib.loads(whole.read_text())["passes"].get("camera", "drawn") == camera


def test_a_camera_that_nothing_shows_is_a_guess(sample, capsys):
    """Balls alone are in these passes, in a size that is a multiple of both."""
    for frame in FRAMES:
        passes = {"": np.zeros((180, 320, 4), np.float32), "Z": np.full((180, 320), np.inf, np.float32)}
        passes[""][40:60, 50:70], passes["Z"][40:60, 50:70] = 1, 4
        (sample.parent / "bare").mkdir(exist_ok=True)
        write_exr(sample.parent / f"bare/r.{frame:04d}.exr", passes)
    either = sample.with_name("either.toml")
    either.write_text(sample.read_text().replace("size = [160, 90]\n", ""))
    pattern = str(sample.parent / "bare/r.####.exr")
    assert main(["import-passes", str(sample), pattern, "--check"]) == 0
    assert "taken for" not in capsys.readouterr().out
    for frame in FRAMES:
        passes = {"": np.zeros((136, 240, 4), np.float32), "Z": np.full((136, 240), np.inf, np.float32)}
        passes[""][40:60, 50:70], passes["Z"][40:60, 50:70] = 1, 4
        write_exr(sample.parent / f"bare/r.{frame:04d}.exr", passes)
    assert main(["import-passes", str(either), pattern, "--check"]) == 0
    assert "taken for the exposure sheet's camera" in capsys.readouterr().out
    assert main(["import-passes", str(either), pattern, "--check", "--camera", "drawn"]) == 0
    assert "taken for" not in capsys.readouterr().out


def test_secondary_frames_and_passes_are_what_the_camera_sees(sample, tmp_path):
    """Simulated and composited in the drawing's pixels, as without the sheet, and then seen."""
    still = sample.with_name("still.toml")
    text = sample.read_text().replace("[drawing]\n", '[drawing]\ncamera = "drawn"\n').replace("size = [160, 90]\n", "")
    still.write_text(text.replace('["balls"]', '["balls"]\noutput = "still"\nframes = "still/final/f.####.png"'))
    assert main(["secondary", str(sample), "--jobs", "1"]) == 0
    assert main(["secondary", str(still), "--jobs", "1"]) == 0
    for frame in FRAMES:
        move = open_shot(sample).moves.at(frame)
        view = FilmView(PAPER, (160, 90), **move)
        final = read_picture(sample.parent / f"secondary/final/final.{frame:04d}.png")
        assert np.array_equal(
            final, reframe_picture(read_picture(sample.parent / f"still/final/f.{frame:04d}.png"), view)
        )
        name = f"passes/passes.{frame:04d}.exr"
        seen, whole = (read_exr(sample.parent / folder / name).channels for folder in ("secondary", "still"))
        assert set(seen) == set(whole)
        depth = read_passes(sample.parent / f"still/passes/passes.{frame:04d}.exr", want=("depth",)).depth
        assert np.isfinite(depth).any()
        assert np.array_equal(seen["Z"], reframe_nearest(depth, view, np.inf))
        assert np.array_equal(seen["object.ID"], reframe_nearest(whole["object.ID"], view, 0))
        assert seen["R"].shape == (90, 160)
        assert set(np.unique(seen["object.ID"])) <= set(np.unique(whole["object.ID"]))


def test_the_exported_sheet_is_the_shot_s_own(sample):
    assert main(["export", str(sample), "--formats", "exposure"]) == 0
    assert (sample.parent / "export/exposure.csv").read_text() == SHEET
    moved = film_scene(shot_scene(Tracked(sample))[0], Tracked(sample))
    assert [view.zoom for view in moved.views] == pytest.approx([1.2, 1.4, 1.6])
