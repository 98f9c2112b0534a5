"""A shot of one drawing: every command makes one frame of it, and what needs more says so."""

import json

import numpy as np
import pytest

from pegbar import read_motion
from pegbar.cli.main import main
from pegbar.io.frames import read_picture
from pegbar.sample.shot import write_sample


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    shot = write_sample(tmp_path_factory.mktemp("one"), size=(320, 180), frames=1, samples=1)
    shot.write_text(shot.read_text().replace('["scarves", "skirt", "balls"]', '["balls"]'))
    return shot


def changed(sample, name, *pairs):
    """Another shot file beside the sample's."""
    text = sample.read_text()
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    path = sample.with_name(name)
    path.write_text(text)
    return path


def test_every_stage_makes_its_frame(sample, capsys):
    folder = sample.parent
    for command in ("check", "align", "depth", "composite", "secondary", "export", "report"):
        assert main([command, str(sample)]) == 0, command
    said = capsys.readouterr().out
    for words in ("1 frame read", "1 drawing aligned", "1 frame made", "simulation: 1 frame made"):
        assert words in said
    for name in ("final/final.0001.png", "secondary/final/final.0001.png", "depth/depth.0001.png"):
        assert read_picture(folder / name).any()
    assert json.loads((folder / "export/shot.json").read_text())["frames"] == [1]
    assert main(["import-passes", str(sample), str(folder / "passes/passes.####.exr"), "--check"]) == 0
    clip = ["--joints", str(folder / "annotation.json"), "--clip", str(folder / "clip.bvh")]
    assert main(["animate", str(folder / "drawings/dancer.0001.png"), *clip, "-o", str(folder / "one.gif")]) == 0
    assert main(["match", str(folder / "annotation.json"), str(folder)]) == 0


@pytest.mark.parametrize("hold", [1, 6])
def test_a_lifted_drawing_is_a_pose(sample, capsys, hold):
    formats = '\n[lift]\nformats = ["bvh", "glb", "csv", "npz"]\noutput = "pose"\n[output]'
    shot = changed(sample, "pose.toml", ("\n[output]", formats), ("[drawing]\n", f"[drawing]\nhold = {hold}\n"))
    assert main(["lift", str(shot)]) == 0
    said = capsys.readouterr()
    assert "one drawing is one pose" in said.err
    motion = read_motion(sample.parent / "pose/animation.bvh")
    # A shot file's frames stay what they are; a drawing is written for as long as it is shown.
    assert len(motion.positions) == hold
    assert (np.ptp(motion.positions, axis=0) < 1e-6).all()
    truth = np.load(sample.parent / "pose/markers.npz")
    assert all(np.isfinite(truth[name]).all() for name in truth.files if truth[name].dtype.kind == "f")
    report = json.loads((sample.parent / "pose/report.json").read_text())
    assert report["marker_reprojection_px"] < 0.5
    assert report["skeleton_reprojection_px"] < 2


def test_a_pose_from_the_lengths_of_limbs(sample, capsys):
    lift = '\n[lift]\ndepth = "lengths"\nlengths = "clip"\noutput = "lengths"\nframe_rate = "drawings"\n[output]'
    assert main(["lift", str(changed(sample, "lengths.toml", ("\n[output]", lift)))]) == 0
    assert len(read_motion(sample.parent / "lengths/animation.bvh").positions) == 1


def test_a_loop_needs_more(sample, capsys):
    shot = changed(sample, "loop.toml", ("\n[output]", '\n[lift]\nloop = true\noutput = "loop"\n[output]'))
    assert main(["lift", str(shot)]) == 2
    assert "lift.loop: want 3 drawings with marks or more to close a loop, got 1" in capsys.readouterr().err
