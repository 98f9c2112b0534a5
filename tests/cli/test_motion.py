import json
import re

import numpy as np
import pytest

from pegbar import read_joint_map
from pegbar.cli.main import COMMANDS, GROUPS, main
from pegbar.io.frames import read_image
from pegbar.scene.conventions import up_rotation
from tests.clips import bvh


def run(*arguments):
    return main(["motion", *(str(argument) for argument in arguments)])


@pytest.fixture
def clip(tmp_path):
    file = tmp_path / "walk.bvh"
    file.write_text(bvh(unit=0.01))
    return file


def test_the_table_says_what_was_found(clip, capsys):
    other = clip.with_name("z up.bvh")
    other.write_text(
        bvh(unit=0.02, turn=up_rotation("z").T, rename=lambda name: {"head": "top"}.get(name, name).replace(" ", ""))
    )
    assert run("info", clip, other) == 0
    lines = capsys.readouterr().out.splitlines()
    heads = "clip frames rate seconds height unit up T-pose floor faces way joints"
    assert re.sub(" +", " ", lines[0]).strip() == heads
    values = "walk.bvh 30 30 1.00 1.69 m 0.01 m (cm) y - +0.020 m 0 2.0 m forwards 16/16"
    assert re.sub(" +", " ", lines[1]).strip() == values
    assert lines[2].startswith("z up.bvh")
    assert "z " in lines[2]
    assert lines[2].split()[-1] == "16/16"  # the head is found above the neck


def test_notes_stand_below_the_table(clip, capsys):
    assert run("info", clip, "--up", "-y", "--unit", "0.02", "--frame-rate", "15") == 0
    out = capsys.readouterr().out
    assert "walk.bvh: the head is along y from the feet, though -y is up\n" in out
    assert "walk.bvh: the person would be 3.3" in out
    assert " 15 " in out


def test_a_broken_file_does_not_hide_the_others(clip, tmp_path, capsys):
    (tmp_path / "broken.bvh").write_text("HIERARCHY\nROOT a {\nOFFSET 0 0 nan\n")
    assert run("info", tmp_path / "broken.bvh", tmp_path / "none.bvh", clip) == 1
    captured = capsys.readouterr()
    assert "walk.bvh" in captured.out
    errors = captured.err.splitlines()
    assert len(errors) == 2
    assert errors[0].startswith(f"pegbar: {tmp_path / 'broken.bvh'}:3: ")
    assert errors[1] == f"pegbar: {tmp_path / 'none.bvh'}: no such file or directory"
    assert run("info", tmp_path / "none.bvh") == 1
    assert capsys.readouterr().out == ""


def test_a_folder_is_looked_through_with_those_below(clip, capsys):
    below = clip.parent / "runs/fast"
    below.mkdir(parents=True)
    (below / "walk.BVH").write_text(bvh(unit=0.01))
    (below / "broken.bvh").write_text("HIERARCHY\n")
    (below / "notes.txt").write_text("no clip")
    assert run("info", clip.parent, "--unit", "0.02") == 1
    out, err = capsys.readouterr()
    rows = [line.split()[0] for line in out.splitlines()[1:]]
    # By their paths, also in what is said of them: two clips may have one name.
    assert rows[:2] == ["runs/fast/walk.BVH", "walk.bvh"]
    assert {"runs/fast/walk.BVH:", "walk.bvh:"} <= set(rows[2:])
    assert err.startswith(f"pegbar: {below / 'broken.bvh'}")
    assert len(err.splitlines()) == 1
    assert run("info", clip.parent, clip, "--json") == 1
    assert len(json.loads(capsys.readouterr().out)) == 3


def test_a_note_on_many_clips_stands_once(clip, capsys):
    for number in range(3):
        clip.with_name(f"b{number}.bvh").write_text(clip.read_text())
    assert run("info", clip.parent, "--unit", "0.02") == 0
    lines = capsys.readouterr().out.splitlines()[5:]
    assert lines == ["4 clips (b0.bvh, b1.bvh, b2.bvh, ...): the person would be 3.38 m tall: the unit may be wrong"]
    clip.unlink()
    assert run("info", clip.parent, "--unit", "0.02") == 0
    lines = capsys.readouterr().out.splitlines()[4:]
    assert [line.partition(":")[0] for line in lines] == ["b0.bvh", "b1.bvh", "b2.bvh"]


def test_a_folder_without_clips_is_named(tmp_path, clip, capsys):
    (tmp_path / "none").mkdir()
    assert run("info", tmp_path / "none") == 2
    assert capsys.readouterr().err == f"pegbar: {tmp_path / 'none'}: no .bvh, .amc, .c3d file here or below\n"
    assert run("info", tmp_path, "--joints", tmp_path / "map.toml") == 2
    assert f"--joints: want one clip, got the folder {tmp_path}" in capsys.readouterr().err


def test_json_has_everything(clip, tmp_path, capsys):
    assert run("info", "--json", clip, tmp_path / "none.bvh") == 1
    good, bad = json.loads(capsys.readouterr().out)
    assert bad == {"file": str(tmp_path / "none.bvh"), "error": f"{tmp_path / 'none.bvh'}: no such file or directory"}
    assert (good["file"], good["frames"], good["rest_frame"]) == (str(clip), 30, None)
    assert good["frame_rate"] == pytest.approx(30, abs=1e-3)
    assert good["unit"] == 0.01
    assert good["up"] == "y"
    assert good["way"] == "forwards"
    assert good["joints"]["left_knee"] == "left_knee"


def test_a_joint_map_is_written_edited_and_given_back(clip, tmp_path, capsys):
    map_file = tmp_path / "map.toml"
    assert run("info", clip, "--joints", map_file) == 0
    capsys.readouterr()
    found = read_joint_map(map_file)
    assert len(found) == 20  # sixteen, two collars and two toes; the wrists are the hands
    map_file.write_text(map_file.read_text().replace('left_hand = "left_wrist"', 'left_hand = "left_finger"'))
    assert run("info", clip, "--json", "--joint-map", map_file) == 0
    assert json.loads(capsys.readouterr().out)[0]["joints"]["left_hand"] == "left_finger"
    map_file.write_text('left_hand = "finger"\n')
    assert run("info", clip, "--joint-map", map_file) == 1
    assert f"{map_file}:1: left_hand: the clip has no joint 'finger'" in capsys.readouterr().err


def test_one_joint_map_is_of_one_clip(clip, tmp_path, capsys):
    assert run("info", clip, clip, "--joints", tmp_path / "map.toml") == 2
    assert "--joints: want one clip, got 2" in capsys.readouterr().err
    assert not (tmp_path / "map.toml").exists()


def test_a_plot_is_drawn(clip, tmp_path, capsys):
    assert run("plot", clip) == 0
    assert capsys.readouterr().out == f"motion plot: wrote {clip.with_suffix('.png')}\n"
    whole = read_image(clip.with_suffix(".png"))
    assert run("plot", clip, "-o", tmp_path / "b.png", "--frames", "0,29", "--unit", "cm") == 0
    part = read_image(tmp_path / "b.png")
    assert part.shape == whole.shape
    assert np.any(part != whole)


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["--frames", "0,30"], "--frames: the clip has no frame 30 (it has 0-29)"),
        (["--frames", "x"], "frames: want numbers and runs"),
        (["--unit", "cubit"], "unit: want metres above 0 or one of"),
    ],
)
def test_wrong_options_are_wrong_usage(arguments, problem, clip, capsys):
    assert run("plot", clip, *arguments) == 2
    assert problem in capsys.readouterr().err
    assert not clip.with_suffix(".png").exists()


def test_the_groups_commands_are_those_that_there_are(capsys):
    assert set(GROUPS) <= set(COMMANDS)
    for group, commands in GROUPS.items():
        for command in commands:
            assert main([group, command, "--help"]) == 0
            assert f"pegbar {group} {command}" in capsys.readouterr().out
