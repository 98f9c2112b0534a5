"""`pegbar secondary` on the sample shot: from drawings to finished frames, again only what is out of date."""

import json

import numpy as np
import pytest

from pegbar.cli.main import main
from pegbar.cli.secondary import _deep
from pegbar.errors import SimulationError
from pegbar.io.exr import read_passes
from pegbar.io.frames import read_picture
from pegbar.sample.shot import write_sample
from pegbar.shot import secondary_stage
from pegbar.simulate.cloth import ClothEngine

OWN = '\n[secondary]\nelements = ["scarves", "skirt", "balls"]\n'
SECTION = """
[secondary]
elements = [{ preset = "scarves", hands = "left", fineness = 4 }, { preset = "balls", count = 4 }]
pre_roll = 4
samples = 1
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The sample shot, 6 small frames, with a scarf and balls."""
    shot = write_sample(tmp_path_factory.mktemp("secondary"), size=(240, 136), frames=6, samples=1)
    text = shot.read_text()
    assert OWN in text
    shot.write_text(text.replace(OWN, "") + SECTION)
    assert main(["secondary", str(shot), "--jobs", "1"]) == 0
    return shot


def states(folder):
    return {path: path.stat().st_mtime_ns for path in sorted(folder.rglob("*.*")) if ".pegbar" not in path.parts}


def test_frames_passes_animation_sheet_and_report_are_there(made):
    folder = made.parent / "secondary"
    finals = [read_picture(folder / f"final/final.{n:04d}.png") for n in range(1, 7)]
    drawings = [read_picture(made.parent / f"drawings/dancer.{n:04d}.png") for n in range(1, 7)]
    for final, drawing in zip(finals, drawings, strict=True):
        assert final.shape == drawing.shape
        added = (final[..., 3] > 0) & (drawing[..., 3] == 0)
        assert 100 < added.sum() < 0.5 * added.size
        assert (final[drawing[..., 3] > 250] == drawing[drawing[..., 3] > 250]).all(axis=1).mean() > 0.8
    passes = read_passes(folder / "passes/passes.0003.exr")
    assert passes.beauty.shape == (136, 240, 4)
    assert 2 < passes.depth[np.isfinite(passes.depth)].min() < 10
    report = json.loads((folder / "report.json").read_text())
    assert report["reprojection_px"] < 1e-6
    assert report["deepest_penetration_m"] < 0.01 * report["height_m"]
    assert set(report["seconds"]) >= {"align", "volumes", "simulation", "render and composite"}
    assert report["elements"] == ["scarves_left", "balls"]
    assert (folder / "animation.png").stat().st_size > 1000
    assert read_picture(folder / "sheet.png").shape[1] > 640


def test_a_second_run_makes_nothing(made, capsys):
    before = states(made.parent / "secondary/cache") | states(made.parent / "secondary/final")
    assert main(["secondary", str(made), "--jobs", "1"]) == 0
    out = capsys.readouterr().out
    assert "simulation: 6 frames up to date" in out
    assert "6 up to date" in out
    assert states(made.parent / "secondary/cache") | states(made.parent / "secondary/final") == before


def test_another_colour_renders_again_and_simulates_nothing(made, capsys):
    text, final = made.read_text(), made.parent / "secondary/final/final.0002.png"
    before, old = states(made.parent / "secondary/cache"), read_picture(final)
    try:
        made.write_text(text.replace("count = 4", 'count = 4, colors = ["#ffffff"]'))
        assert main(["secondary", str(made), "--jobs", "1", "--frames", "2"]) == 0
        assert "simulation: 6 frames up to date" in capsys.readouterr().out
        assert states(made.parent / "secondary/cache") == before
        assert not np.array_equal(read_picture(final), old)
    finally:
        made.write_text(text)


def test_an_explosion_names_the_frame_and_keeps_what_was_made(made, monkeypatch, capsys):
    text = made.read_text()

    def explode(engine, scene, elements, cache, start, progress):
        cache.write(elements[0].name, 0, {"positions": elements[0].vertices})
        raise SimulationError(elements[0].name, 1, "the simulation exploded: it is 1e9 m away")

    monkeypatch.setattr(ClothEngine, "run", explode)
    try:
        made.write_text(text.replace("pre_roll = 4", "pre_roll = 3"))
        assert main(["secondary", str(made), "--jobs", "1"]) == 1
        error = capsys.readouterr().err
        assert "scarves_left: frame 2: the simulation exploded" in error
        assert "kept" in error
        assert (made.parent / "secondary/driving.npz").is_file()
        assert (made.parent / "secondary/cache/balls/0005.npz").is_file()
    finally:
        made.write_text(text)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"scarves", hands = "left"', '"scarfs"', "no preset 'scarfs': there are scarves"),
        ('"balls"', '"balls", character = "bob"', "no character 'bob': there is sample"),
        ('hands = "left"', "lenght = 2", "no setting 'lenght'"),
        ("[secondary]", '[secondary]\nframes = "f.####.xyz"', "secondary.frames: want a name that ends in .png"),
        ("[secondary]", "[secondary]\nelement = 3", "secondary.element: no such key"),
        ('elements = [{ preset = "scarves"', 'misfit = 0\nelements = [{ preset = "scarves"', "secondary.misfit"),
    ],
)
def test_what_cannot_be_is_named(made, tmp_path, capsys, old, new, message):
    text = made.read_text()
    assert old in text
    try:
        made.write_text(text.replace(old, new))
        assert main(["secondary", str(made)]) == 2
        assert message in capsys.readouterr().err
    finally:
        made.write_text(text)


def test_a_wrong_preset_is_found_by_check_and_before_volumes(made, tmp_path, capsys):
    text = made.read_text()
    try:
        made.write_text(text.replace('"scarves"', '"scarfs"').replace("[secondary]", '[secondary]\noutput = "none"'))
        assert main(["check", str(made)]) == 1
        assert "secondary.elements: no preset 'scarfs'" in capsys.readouterr().err
        assert main(["secondary", str(made)]) == 2
        assert not (made.parent / "none").exists()
    finally:
        made.write_text(text)


def test_a_clip_that_fits_no_drawing_is_refused_with_the_worst_one(made, capsys):
    text = made.read_text()
    try:
        made.write_text(text.replace("[secondary]", '[align]\nuse = "always"\n\n[secondary]\nmisfit = 1e-5'))
        assert main(["secondary", str(made)]) == 2
        error = capsys.readouterr().err
        assert "the clip clip.bvh fits no drawing" in error
        assert "worst is drawing" in error
    finally:
        made.write_text(text)


def test_a_shot_without_the_section_says_what_is_enough(made, capsys):
    text = made.read_text()
    try:
        made.write_text(text.replace(SECTION, ""))
        assert main(["secondary", str(made)]) == 2
        assert 'elements = ["skirt"] is enough' in capsys.readouterr().err
    finally:
        made.write_text(text)


def test_two_characters_are_put_in_one_scene_and_one_picture(made, tmp_path):
    text = made.read_text()
    other = made.parent / "twin.toml"
    try:
        made.write_text(text + 'characters = ["twin.toml"]\noutput = "two"\nframes = "two/f.####.png"\n')
        other.write_text(text.replace(SECTION, "").replace('name = "sample"', 'name = "twin"'))
        assert main(["secondary", str(made), "--jobs", "1", "--frames", "3"]) == 0
        report = json.loads((made.parent / "two/report.json").read_text())
        assert report["characters"] == ["sample", "twin"]
        alone, both = (
            read_picture(made.parent / name) for name in ("secondary/final/final.0003.png", "two/f.0003.png")
        )
        inside = (alone[..., 3] == 255) & (both[..., 3] == 255)
        assert (np.abs(alone[inside].astype(int) - both[inside]).max(axis=1) <= 2).mean() > 0.9
    finally:
        made.write_text(text)
        other.unlink(missing_ok=True)


def test_engines_run_bodies_before_cloth_and_what_falls_on_both_last():
    assert [engine.name for engine in secondary_stage.ENGINES] == ["rapier", "cloth", "strands", "particles"]


def test_frames_are_nearly_the_same_without_passes(made):
    text, final = made.read_text(), made.parent / "secondary/final/final.0002.png"
    assert main(["secondary", str(made), "--jobs", "1"]) == 0
    with_passes = read_picture(final)
    try:
        made.write_text(text.replace("pre_roll = 4", "pre_roll = 4\npasses = false"))
        assert main(["secondary", str(made), "--jobs", "1", "--overwrite"]) == 0
        apart = np.abs(read_picture(final).astype(int) - with_passes)
        # Lines differ in a few pixels, where an element touches the ground in its own shadow.
        assert (apart.max(axis=2) > 0).mean() < 1e-3
    finally:
        made.write_text(text)


def test_what_lies_deep_in_a_limb_is_warned_of_with_limb_and_frame():
    part = {"deepest_penetration_m": 0.02, "in_limb": "left_forearm", "in_frame": 6}
    slight = {**part, "deepest_penetration_m": 0.01}
    report = {"height_m": 1.5, "cloth": {"skirt": slight}, "strands": {}, "particles": {"snow": part}}
    assert _deep(report) == ["snow lies 20 mm deep in left_forearm in frame 6"]
