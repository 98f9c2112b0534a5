import csv
import json

import numpy as np
import pygltflib
import pytest

from pegbar import read_motion
from pegbar.cli.main import main
from pegbar.io.alignment import read_alignment
from pegbar.sample.shot import write_sample
from pegbar.scene.body import MARKERS, bones_between
from pegbar.shot.film import on_film
from tests.motions import swaying


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The sample shot, 24 small frames, lifted on twos."""
    shot = write_sample(tmp_path_factory.mktemp("lifted"), size=(240, 136), frames=24, samples=1)
    shot.write_text(shot.read_text() + '\n[lift]\nformats = ["bvh", "glb", "usd", "csv", "npz"]\n')
    assert main(["lift", str(shot)]) == 0
    return shot


def test_the_markers_are_the_drawn_ones_and_near_the_truth(made):
    folder = made.parent
    held, truth = np.load(folder / "lift/markers.npz"), np.load(folder / "truth.npz")
    alignment = read_alignment(folder / "align/alignment.npz")
    names = held["names"].tolist()
    for frame, camera in enumerate(alignment.cameras):
        known = [alignment.names.index(name) for name in names]
        np.testing.assert_allclose(camera.project(held["markers"][frame]), alignment.markers[frame, known], atol=1e-6)
    true = truth["drawn"][:, [truth["names"].tolist().index(name) for name in names]]
    found = held["markers"]
    root = names.index("pelvis")
    away = (found - found[:, [root]]) - (true - true[:, [root]])
    assert np.sqrt(np.mean(np.sum(away**2, axis=2))) < 0.06


def test_the_skeleton_comes_onto_the_markers_and_reads_back(made):
    folder = made.parent / "lift"
    held, film = np.load(folder / "markers.npz"), read_motion(folder / "animation.bvh")
    assert len(film.positions) == 24
    assert film.frame_rate == pytest.approx(24)
    posed = film.markers(held["names"].tolist())
    assert np.sqrt(np.mean(np.sum((posed - held["markers"]) ** 2, axis=2))) < 0.06
    bones = np.linalg.norm(posed[:, 1] - posed[:, 0], axis=1)
    np.testing.assert_allclose(bones, bones[0], rtol=1e-3)
    document = pygltflib.GLTF2().load(str(folder / "animation.glb"))
    assert {node.name for node in document.nodes} >= {"pelvis", "left_knee"}
    report = json.loads((folder / "report.json").read_text())
    assert report["marker_reprojection_px"] < 1e-6
    assert 0 < report["skeleton_reprojection_px"] < 5
    rows = list(csv.DictReader((folder / "markers.csv").read_text().splitlines()))
    assert len(rows) == 24 * len(held["names"])
    assert float(rows[0]["y"]) == pytest.approx(held["markers"][0, 0, 1], abs=1e-5)


def test_nothing_is_done_twice(made, capsys):
    before = (made.parent / "lift/animation.bvh").stat().st_mtime_ns
    assert main(["lift", str(made)]) == 0
    assert "up to date" in capsys.readouterr().out
    assert (made.parent / "lift/animation.bvh").stat().st_mtime_ns == before


def test_depth_from_lengths_and_flips_are_passed_on(made, capsys):
    text = made.read_text()
    try:
        flip = '\noutput = "other"\ndepth = "lengths"\nflips = [{{ joint = "{}", drawings = "{}" }}]\n'
        made.write_text(text + flip.format("left_hand", "3-5"))
        assert main(["lift", str(made)]) == 0
        held = np.load(made.parent / "other/markers.npz")
        ends = held["bones"]
        lengths = np.linalg.norm(held["markers"][:, ends[:, 1]] - held["markers"][:, ends[:, 0]], axis=2)
        np.testing.assert_allclose(lengths, np.broadcast_to(lengths[0], lengths.shape), rtol=1e-6)
        made.write_text(text + flip.format("wing", "3-5"))
        assert main(["lift", str(made)]) == 2
        assert "wing" in capsys.readouterr().err
        made.write_text(text + flip.format("left_hand", "99"))
        assert main(["lift", str(made)]) == 2
        assert "no drawing 99" in capsys.readouterr().err
    finally:
        made.write_text(text)


def test_film_frames_hold_drawings_or_run_on():
    motion = swaying(4)
    stepped = on_film(motion, [2, 1, 2, 1], 24.0, stepped=True, rate=24.0, loop=False)
    np.testing.assert_allclose(stepped.positions[:, 0], motion.positions[[0, 0, 1, 2, 2, 3], 0], atol=1e-9)
    smooth = on_film(motion, [2, 1, 2, 1], 24.0, stepped=False, rate=24.0, loop=False)
    middle = (motion.positions[0, 0] + motion.positions[1, 0]) / 2
    np.testing.assert_allclose(smooth.positions[1, 0], middle, atol=1e-9)
    looped = on_film(motion, [2, 1, 2, 1], 24.0, stepped=True, rate=48.0, loop=True)
    assert looped.frame_rate == 48
    assert len(looped.positions) == 13
    np.testing.assert_array_equal(looped.positions[-1], looped.positions[0])


def test_bones_skip_markers_that_are_not_there():
    assert len(bones_between(MARKERS)) == len(MARKERS) - 1
    assert bones_between(("pelvis", "head", "left_foot")) == ((0, 1), (0, 2))
    assert bones_between(("left_hand", "left_elbow")) == ((1, 0),)
