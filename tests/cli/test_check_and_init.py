import dataclasses
import json
import re

import numpy as np
import pytest

from pegbar import Limb, read_annotations, write_annotations
from pegbar.cli.main import main
from pegbar.io.frames import write_image
from tests.shots import draw, make_shot, move_mark


def run(command, *arguments):
    """Run a command; what works through frames does so here, since starting workers takes a second."""
    jobs = ["--jobs", "1"] if command in ("check", "depth", "composite") and "--help" not in arguments else []
    return main([command, *map(str, arguments), *jobs])


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
    text = shot.read_text().replace('"d.####.png"', '"e.####.png"').replace("[48, 32]", "[48]")
    shot.write_text(text + '[drawing.palette]\n"#ff0000" = "tail"\n')
    assert run("check", shot) == 1
    assert f"{shot}:3: shot.size" in capsys.readouterr().err
    text = text.replace("[48]", "[48, 32]")
    shot.write_text(text + '[drawing.palette]\n"#ff0000" = "tail"\n')
    assert run("check", shot) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert f"{shot}:6: drawing.frames: " in lines[0]
    assert f"{shot}:18: drawing.palette.#ff0000: " in lines[1]
    assert '"tail"' in lines[1]
    # Where the marks cannot be read, limbs are not complained of.
    shot.write_text(shot.read_text().replace('"marks.json"', '"none.json"'))
    assert run("check", shot) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert f"{shot}:8: drawing.annotations: " in lines[1]
    shot.write_text("[[shot]]\nframes = '1'\n")
    assert run("check", shot) == 1
    assert f"{shot}:1: shot: want a section, like [shot] ->" in capsys.readouterr().err


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


def test_init_takes_the_marks_frame_rate_or_leaves_it_open(tmp_path):
    make_shot(tmp_path).unlink()
    for rate, line in ((None, "# frame_rate = 24 "), (12.5, "frame_rate = 12.5\n")):
        marks = dataclasses.replace(read_annotations(tmp_path / "marks.json"), frame_rate=rate)
        write_annotations(tmp_path / "marks.json", marks)
        assert run("init", tmp_path, "--overwrite", "--drawings", "d.####.png") == 0
        assert f"\n{line}" in (tmp_path / "shot.toml").read_text()


def test_check_notes_held_drawings_that_no_frame_shows(tmp_path, capsys):
    shot = make_shot(tmp_path)
    text = shot.read_text()
    shot.write_text(text.replace("[drawing]", "[drawing]\nhold = 2"))
    assert run("check", shot) == 0
    told = capsys.readouterr().err
    assert f"{shot}:2: shot.frames: drawings 3-4 are shown in no frame: each is held for 2 of frames 1-4 -> " in told
    # Without a hold a part of the drawings may be meant, and without frames all are shown.
    for changed in (text.replace('"1-4"', '"1-2"'), text.replace('frames = "1-4"\n', "")):
        shot.write_text(changed)
        assert run("check", shot) == 0
        assert capsys.readouterr().err == ""


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
    assert captured.err.startswith("frames 1-6: ")
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
        (
            '[clip]\npath = "none.bvh"\n',
            ("shot.toml:19: clip.path: ", "none.bvh: no such file", "-> put the file there"),
        ),
        ('[clip]\npath = "marks.json"\n', ("shot.toml:19: clip.path: ", "marks.json")),
        ('[clip]\npath = "walk.bvh"\nunit = 1.0\nstart = 9\n', ("clip.start", "2 frames")),
        ('[clip]\nfolder = "nowhere"\n', ("clip.folder", "no such folder")),
        ('[clip]\nfolder = "empty"\n', ("clip.folder", "no .bvh")),
        ('[lift]\nskeleton = "hero.bvh"\n', ("shot.toml:19: lift.skeleton: ", "hero.bvh")),
        ('[lift]\nskeleton = "odd.bvh"\n', ("lift.skeleton", "fewer than four", "lift.skeleton_joints")),
        ('[lift]\nheld = [{joint = "tail", drawings = "1"}]\n', ("shot.toml:19: lift.held: ", "'tail' is not marked")),
        ('[lift]\nflips = [{joint = "neck", drawings = "9"}]\n', ("shot.toml:19: lift.flips: ", "no drawing 9")),
        ('[secondary]\nelements = ["skrit"]\n', ("shot.toml:19: secondary.elements: ", "skrit", "skirt")),
        ('[secondary]\nelements = ["balls"]\n', ("shot.toml:18: secondary: ", "no cameras", "-> name a clip")),
        ('[secondary]\nelements = ["balls"]\ncharacters = ["b.toml"]\n', ("secondary.characters", "b.toml")),
        ('[dots]\nframes = "none.####.png"\njoints = {"#ff0000" = "neck"}\n', ("dots.frames", "none.####.png")),
        ('[dots]\nframes = "d.####.png"\njoints = "no.toml"\n', ("shot.toml:18: dots: ", "no.toml")),
    ],
)
def test_what_would_stop_align_and_lift_is_told(tmp_path, capsys, extra, words):
    shot = make_shot(tmp_path, extra="\n" + extra)
    (tmp_path / "empty").mkdir()
    (tmp_path / "walk.bvh").write_text(CLIP)
    (tmp_path / "odd.bvh").write_text(re.sub("JOINT (\\w+)", r"JOINT x\1", CLIP).replace("Hips", "x"))
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
    drawing = read_annotations(tmp_path / "annotation.json")
    assert drawing.names == ("left_hand", "left_elbow")
    np.testing.assert_allclose(drawing.markers[1], [[12, 20], [30, 8]], atol=0.5)
    assert drawing.limbs[0].color == (0, 0, 255)
    assert "holdout" not in text.partition("[output]")[0]


def change_marks(folder, **changes):
    write_annotations(folder / "marks.json", dataclasses.replace(read_annotations(folder / "marks.json"), **changes))


def test_json_has_every_problem_with_its_place_and_how_to_mend_it(tmp_path, capsys):
    shot = make_shot(tmp_path, extra='\n[clip]\nfolder = "nowhere"\n')
    (tmp_path / "d.0002.png").unlink()
    assert run("check", shot, "--json") == 1
    captured = capsys.readouterr()
    found = json.loads(captured.out)
    assert (captured.err, found["frames_read"]) == ("", 4)
    clip, drawing = found["problems"]
    assert (clip["file"], clip["line"], clip["key"], clip["frames"]) == (str(shot), 19, "clip.folder", [])
    assert (drawing["file"], drawing["line"], drawing["key"], drawing["frames"]) == ("", None, "drawing.frames", [2])
    assert "no such file" in drawing["what"]
    assert all(problem["mend"] for problem in found["problems"])
    (tmp_path / "d.0002.png").write_bytes((tmp_path / "d.0001.png").read_bytes())
    assert run("check", shot, "--json", "--frames", "2") == 1
    assert json.loads(capsys.readouterr().out)["frames_read"] == 1


def test_a_terminal_gets_one_table(tmp_path, capsys, monkeypatch):
    shot = make_shot(tmp_path, 6)
    shot.write_text(shot.read_text().replace("size = [48, 32]", "size = [48, 31]"))
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "400")
    assert run("check", shot) == 1
    lines = capsys.readouterr().err.splitlines()
    header = next(line for line in lines if "where" in line)
    assert header.index("where") < header.index("what") < header.index("how to mend")
    assert len([line for line in lines if "frames 1-6" in line and "correct shot.size" in line]) == 1


def test_colours_that_mean_two_things_or_nothing_are_told(tmp_path, capsys):
    shot = make_shot(tmp_path)
    body, arm = read_annotations(tmp_path / "marks.json").limbs
    hip = Limb("hip", "pelvis", "left_elbow", (9, 9, 9))
    change_marks(tmp_path, limbs=(body, arm, hip, Limb("foot", "pelvis", "left_hand")))
    assert run("check", shot) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert "shot.toml:8: drawing.annotations: limb foot has no colour" in lines[0]
    assert "shot.toml:7: drawing.labels: no label picture shows hip ->" in lines[1]
    # A part of the shot does not tell which limbs are never shown.
    assert run("check", shot, "--frames", "1-2") == 1
    assert "hip" not in capsys.readouterr().err
    change_marks(tmp_path, limbs=(body, arm))
    extra = 'background = ["#000000", "#ffff00"]\npalette = {"#0080ff" = "body"}\n[passes]'
    shot.write_text(shot.read_text().replace("[passes]", extra))
    assert run("check", shot) == 1
    text = capsys.readouterr().err
    assert "#0080ff is the colour of arm in the annotations, and of body here -> give every limb" in text
    assert "#ffff00 is a limb's colour and background as well" in text


def test_marks_behind_the_camera_are_told(tmp_path, capsys):
    shot = make_shot(tmp_path)
    depths = read_annotations(tmp_path / "marks.json").depths.copy()
    depths[2, 3] = -1
    change_marks(tmp_path, depths=depths)
    assert run("check", shot) == 1
    assert "frame 3: marker left_hand lies behind the camera: depth -1 m ->" in capsys.readouterr().err


def test_a_shot_that_is_yet_to_be_aligned_needs_no_depths(tmp_path, capsys):
    shot = make_shot(tmp_path)
    change_marks(tmp_path, depths=None)
    assert run("check", shot) == 1
    assert "frames 1-4: the annotations give no depths" in capsys.readouterr().err
    (tmp_path / "walk.bvh").write_text(CLIP.replace("LeftForeArm", "LeftForeArm"))
    shot.write_text(shot.read_text() + '\n[clip]\npath = "walk.bvh"\nunit = 1.0\n')
    assert run("check", shot) == 0, capsys.readouterr().err


def test_places_that_cannot_be_written_are_told(tmp_path, capsys, monkeypatch):
    shot = make_shot(tmp_path)
    (tmp_path / "depth").write_text("a file")
    assert run("check", shot) == 1
    text = capsys.readouterr().err
    assert f"shot.toml:15: output.depth: {tmp_path}/depth: not a directory -> a file stands where" in text
    (tmp_path / "depth").unlink()
    # Root may write everywhere, so the right is taken away here.
    monkeypatch.setattr("os.access", lambda path, mode: False)
    assert run("check", shot) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert f"output.frames: {tmp_path}: cannot be written ->" in lines[0]


def test_a_missing_codec_is_told(tmp_path, capsys, monkeypatch):
    shot = make_shot(tmp_path)
    monkeypatch.setattr("cv2.haveImageWriter", lambda name: not name.endswith(".png"))
    assert run("check", shot) == 1
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(": ")[1] for line in lines] == ["output.frames", "output.depth_picture"]
    assert all("no codec for .png files here" in line for line in lines)
