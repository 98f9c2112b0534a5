import dataclasses
import re

import numpy as np
import pytest

from pegbar import read_annotations, write_annotations
from pegbar.cli.main import main
from pegbar.io.frames import write_image
from tests.shots import draw, make_shot, move_mark


def run(*arguments):
    return main([str(argument) for argument in arguments])


def test_a_sound_shot_has_no_problem(tmp_path, capsys):
    shot = make_shot(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    assert run("check", shot) == 0
    assert "4 frames read, no problems" in capsys.readouterr().out
    assert sorted(tmp_path.rglob("*")) == before


def test_every_problem_is_reported_at_once(tmp_path, capsys):
    shot = make_shot(tmp_path)
    (tmp_path / "d.0001.png").write_bytes(b"not a picture")
    labels = draw(2)[1]
    labels[0, 0] = (7, 7, 7)
    write_image(tmp_path / "l.0002.png", labels)
    (tmp_path / "p.0003.exr").unlink()
    move_mark(shot, 4, "left_hand", (400, 27))
    assert run("check", shot) == 1
    captured = capsys.readouterr()
    lines = captured.err.splitlines()
    assert "4 frames read, 4 problems" in captured.out
    for frame, words in {1: "d.0001.png", 2: "1 pixels match no limb", 3: "p.0003.exr", 4: "left_hand"}.items():
        assert [line for line in lines if line.startswith(f"frame {frame}: ") and words in line], (frame, lines)


def test_problems_of_the_shot_file_itself_come_with_lines(tmp_path, capsys):
    shot = make_shot(tmp_path)
    text = shot.read_text().replace('"d.####.png"', '"e.####.png"').replace('"marks.json"', '"none.json"')
    shot.write_text(text + '[drawing.palette]\n"#ff0000" = "tail"\n')
    assert run("check", shot) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3
    assert f"{shot}:6: drawing.frames: " in lines[0]
    assert f"{shot}:8: drawing.annotations: " in lines[1]
    assert f"{shot}:18: drawing.palette.#ff0000: " in lines[2]
    assert '"tail"' in lines[2]


@pytest.mark.parametrize("told_by", ["file names", "annotations"])
def test_init_writes_a_shot_that_works(tmp_path, capsys, told_by):
    make_shot(tmp_path).unlink()
    if told_by == "file names":
        for path in list(tmp_path.glob("l.*.png")):
            path.rename(tmp_path / path.name.replace("l.", "labels."))
    else:
        marks = read_annotations(tmp_path / "marks.json")
        pictures = [tuple(sorted(tmp_path.glob(f"{letter}.*.png"))) for letter in "dl"]
        marks = dataclasses.replace(marks, images=pictures[0], segmentations=pictures[1])
        write_annotations(tmp_path / "marks.json", marks)
    assert run("init", tmp_path) == 0
    text = (tmp_path / "shot.toml").read_text()
    assert 'frames = "1-4"' in text
    assert "size = [48, 32]" in text
    assert run("check", tmp_path / "shot.toml") == 0
    assert run("composite", tmp_path / "shot.toml") == 0
    assert (tmp_path / "final/final.0004.png").is_file()
    capsys.readouterr()
    assert run("init", tmp_path) == 2
    assert "is there already" in capsys.readouterr().err
    assert run("init", tmp_path, "--overwrite") == 0


def test_init_says_what_it_cannot_find(tmp_path, capsys):
    assert run("init", tmp_path / "none") == 2
    assert run("init", tmp_path) == 2
    assert "no sequence of drawn frames" in capsys.readouterr().err
    for name in ("walk", "run"):
        write_image(tmp_path / f"{name}.0001.png", np.zeros((4, 4, 3), np.uint8))
    assert run("init", tmp_path) == 2
    assert "several sequences" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("beauty", "depth"),
    [
        ("render/beauty", "render/depth"),
        ("passes/beauty", "passes/depth"),
        ("render/beauty/b", "render/depth/d"),
        ("beauty/b", "depth/depth"),
        ("beauty", "depth"),
        ("renders/shot_rgba", "renders/shot_z"),
    ],
)
def test_init_finds_the_rendered_depth_and_never_writes_over_it(tmp_path, beauty, depth):
    make_shot(tmp_path).unlink()
    for path in list(tmp_path.glob("l.*.png")):
        path.rename(tmp_path / path.name.replace("l.", "labels."))
    for path in list(tmp_path.glob("p.*.exr")):
        for name in (beauty, depth):
            target = tmp_path / f"{name}.{path.name[2:]}"
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
        path.unlink()
    rendered = {path: path.read_bytes() for path in tmp_path.rglob("*.exr")}
    assert run("init", tmp_path) == 0
    text = (tmp_path / "shot.toml").read_text()
    assert f'beauty = "{beauty}.####.exr"' in text
    assert f'\ndepth = "{depth}.####.exr"' in text
    assert run("check", tmp_path / "shot.toml") == run("depth", tmp_path / "shot.toml") == 0
    assert {path: path.read_bytes() for path in rendered} == rendered


def test_init_takes_the_drawings_that_are_named(tmp_path, capsys):
    make_shot(tmp_path).unlink()
    (tmp_path / "clean").mkdir()
    for path in list(tmp_path.glob("d.*.png")):
        (tmp_path / "clean" / path.name).write_bytes(path.read_bytes())
    assert run("init", tmp_path) == 2
    assert "--drawings" in capsys.readouterr().err
    assert run("init", tmp_path, "--drawings", "clean/d.####.png") == 0
    assert 'frames = "clean/d.####.png"' in (tmp_path / "shot.toml").read_text()


def test_words_inside_names_say_nothing(tmp_path):
    for name in ("man_climb", "man_walk"):
        write_image(tmp_path / f"{name}.0001.png", np.zeros((4, 4, 3), np.uint8))
    assert run("init", tmp_path) == 2
    assert run("init", tmp_path, "--drawings", "man_walk.####.png") == 0
    assert "# labels" in (tmp_path / "shot.toml").read_text()


def test_one_cause_in_many_frames_is_one_line(tmp_path, capsys):
    shot = make_shot(tmp_path, 6)
    shot.write_text(shot.read_text().replace("size = [48, 32]", "size = [48, 31]"))
    assert run("check", shot) == 1
    captured = capsys.readouterr()
    assert len(captured.err.splitlines()) == 1
    assert "6 frames: 1-6" in captured.err
    assert "1 problem\n" in captured.out


def test_a_wrong_unit_is_suspected(tmp_path, capsys):
    shot = make_shot(tmp_path)
    shot.write_text(shot.read_text().replace("[passes]", '[passes]\nunit = "cm"'))
    assert run("check", shot) == 1
    assert "passes.unit" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["init", "check", "depth", "composite", "demo"])
def test_every_command_has_help_with_an_example(command, capsys):
    assert run(command, "--help") == 0
    assert f"Example: pegbar {command}" in " ".join(capsys.readouterr().out.split())


CLIP = """\
HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Neck
  {
    OFFSET 0 0.5 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT LeftForeArm
    {
      OFFSET 0.4 0 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT LeftHand
      {
        OFFSET 0.3 0 0
        CHANNELS 3 Zrotation Xrotation Yrotation
        End Site
        {
          OFFSET 0.1 0 0
        }
      }
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.04
0 1 0 0 0 0 0 0 0 0 0 0 0 0 0
0 1 0 0 0 0 0 0 0 0 0 0 0 0 0
"""


@pytest.mark.parametrize(
    ("extra", "words"),
    [
        ('[clip]\npath = "none.bvh"\n', ("clip: ", "none.bvh")),
        ('[clip]\npath = "marks.json"\n', ("clip: ", "marks.json")),
        ('[clip]\npath = "walk.bvh"\nunit = 1.0\nstart = 9\n', ("clip.start", "2 frames")),
        ('[clip]\nfolder = "nowhere"\n', ("clip.folder", "no such folder")),
        ('[clip]\nfolder = "empty"\n', ("clip.folder", "no .bvh")),
        ('[lift]\nskeleton = "hero.bvh"\n', ("lift.skeleton", "hero.bvh")),
    ],
)
def test_what_would_stop_align_and_lift_is_told(tmp_path, capsys, extra, words):
    shot = make_shot(tmp_path, extra="\n" + extra)
    (tmp_path / "empty").mkdir()
    (tmp_path / "walk.bvh").write_text(CLIP)
    assert run("check", shot) == 1
    lines = capsys.readouterr().err.splitlines()
    assert [line for line in lines if all(word in line for word in words)], lines


def test_drawings_with_too_few_marks_and_clips_that_lack_joints_are_told(tmp_path, capsys):
    shot = make_shot(tmp_path, extra='\n[clip]\npath = "walk.bvh"\nunit = 1.0\n')
    (tmp_path / "walk.bvh").write_text(CLIP.replace("LeftForeArm", "Gadget"))
    marks = read_annotations(tmp_path / "marks.json")
    visible = marks.visible.copy()
    visible[1, 0] = False
    write_annotations(tmp_path / "marks.json", dataclasses.replace(marks, visible=visible))
    assert run("check", shot) == 1
    text = capsys.readouterr().err
    assert "drawing 2: fewer than four joints" in text
    assert "fewer than four of the drawing's joints" in text


def test_a_full_disk_is_told(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("shutil.disk_usage", lambda _: type("Usage", (), {"free": 1000})())
    assert run("check", make_shot(tmp_path)) == 1
    assert "GB left" in capsys.readouterr().err


def test_init_finds_dots_and_says_where_each_colour_is(tmp_path, capsys):
    for name in ("dots", "labels", "drawings", "holdout"):
        (tmp_path / name).mkdir()
    paper = np.full((40, 60, 3), 255, np.uint8)
    dots = {1: {(255, 0, 0): (10, 20)}, 2: {(255, 0, 0): (12, 20), (0, 128, 0): (30, 8)}}
    for number, places in dots.items():
        write_image(tmp_path / f"drawings/d.{number:04d}.png", paper)
        write_image(tmp_path / f"holdout/d.{number:04d}.png", paper)
        layer, labels = np.zeros((40, 60, 4), np.uint8), np.zeros((40, 60, 3), np.uint8)
        for color, (x, y) in places.items():
            layer[y - 2 : y + 3, x - 2 : x + 3] = (*color, 255)
        labels[5:15, 20:31] = (0, 0, 255)
        # Ink that was left in the layer, and a rim.
        layer[30:34, 40:50], layer[17, 9:12] = (60, 50, 40, 255), (255, 0, 0, 90)
        write_image(tmp_path / f"dots/d.{number:04d}.png", layer)
        write_image(tmp_path / f"labels/d.{number:04d}.png", labels)
    assert run("init", tmp_path) == 0
    shot = tmp_path / "shot.toml"
    lines = shot.read_text().splitlines()
    colors = [line for line in lines if re.match(r'# ("#|\? = )', line) and " at x " in line]
    assert [line[:14] for line in colors] == ['# "#ff0000" = ', '# "#008000" = ', '# ? = "#0000ff']
    assert [line.rpartition("# ")[2] for line in colors] == [
        "at x 10, y 20 in d.0001.png",
        "at x 30, y 8 in d.0002.png",
        "at x 25, y 9 in d.0001.png",
    ]
    # Filled in as the file says, it is read.
    text = shot.read_text().replace('# "#ff0000" = "?"', '"#ff0000" = "left_hand"')
    text = text.replace('# "#008000" = "?"', '"#008000" = "left_elbow"').replace("# ? = ", "left_forearm = ")
    shot.write_text(text)
    assert run("dots", shot) == 0
    drawing = read_annotations(tmp_path / "marks.json")
    assert drawing.names == ("left_hand", "left_elbow")
    np.testing.assert_allclose(drawing.markers[1], [[12, 20], [30, 8]], atol=0.5)
    assert drawing.limbs[0].color == (0, 0, 255)
    assert "holdout" not in text.partition("[output]")[0]
