import json
import sys

import cv2
import numpy as np
import pytest

from pegbar.cli.main import main
from pegbar.io.frames import read_image, write_image
from pegbar.io.video import CODECS, Codec
from pegbar.scene.body import LIMBS
from tests.clips import bvh

#: A person from the front, marks by name, in a picture of 160 x 220.
MARKS = {
    "pelvis": (80, 120), "chest": (80, 90), "neck": (80, 60), "head": (80, 38),
    "left_shoulder": (100, 64), "left_elbow": (122, 84), "left_hand": (142, 104),
    "right_shoulder": (60, 64), "right_elbow": (38, 84), "right_hand": (18, 104),
    "left_hip": (90, 122), "left_knee": (94, 160), "left_foot": (96, 200),
    "right_hip": (70, 122), "right_knee": (66, 160), "right_foot": (64, 200),
}  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    """A drawing on transparent paper with its marks, and two clips."""
    picture = np.zeros((220, 160, 4), np.uint8)
    limbs = [(limb.start, limb.end) for limb in LIMBS]
    for start, end in [*limbs, ("neck", "left_shoulder"), ("neck", "right_shoulder")]:
        width = 44 if "pelvis" in (start, end) else 16
        cv2.line(picture, MARKS[start], MARKS[end], (180, 120, 60, 255), width)
    cv2.circle(picture, MARKS["head"], 18, (230, 200, 170, 255), -1)
    write_image(tmp_path / "anna.png", picture)
    marks = {
        "markers": list(MARKS),
        "image_size": [160, 220],
        "frames": [{"image": "anna.png", "xy": list(MARKS.values()), "visible": [True] * len(MARKS)}],
    }
    (tmp_path / "anna.json").write_text(json.dumps(marks))
    (tmp_path / "clips").mkdir()
    (tmp_path / "clips" / "walk.bvh").write_text(bvh())
    (tmp_path / "clips" / "stand.bvh").write_text(bvh(np.tile([0, 0.95, 0], (6, 1))))
    return tmp_path


def animate(folder, *arguments, output="out.gif"):
    clip = folder / "clips" / "stand.bvh"
    return main(["animate", str(folder / "anna.png"), "--clip", str(clip), "-o", str(folder / output), *arguments])


def test_a_picture_and_a_clip_become_an_animation(folder, capsys):
    assert animate(folder, "--size", "90x120") == 0
    good, found = cv2.imreadanimation(str(folder / "out.gif"))
    assert good
    assert found.frames[0].shape[:2] == (120, 90)
    assert "6 pictures" in capsys.readouterr().out
    assert list((folder / ".pegbar" / "puppets").iterdir())


def test_frames_keep_what_is_transparent(folder):
    arguments = ("--background", "transparent", "--frames", "2-3", "--no-keep-puppets", "--transition", "0.1")
    assert animate(folder, *arguments, output="f.##.png") == 0
    names = sorted(path.name for path in folder.glob("f.*.png"))
    assert names == [f"f.{number:02}.png" for number in range(1, 7)]
    first = read_image(folder / "f.01.png")
    assert first.shape == (220, 160, 4)
    assert first[..., 3].min() == 0
    assert first[..., 3].max() == 255
    assert not (folder / ".pegbar").exists()


def test_warnings_name_the_figure_or_the_batchs_file(folder, capsys):
    bert = read_image(folder / "anna.png")
    bert[100:102, 80:82, 3] = 0
    write_image(folder / "bert.png", bert)
    (folder / "bert.json").write_text((folder / "anna.json").read_text().replace("anna.png", "bert.png"))
    pictures, clip = (str(folder / "anna.png"), str(folder / "bert.png")), str(folder / "clips" / "stand.bvh")
    for output, name in (("both.gif", "bert"), ("out", "bert_stand.gif")):
        assert main(["animate", *pictures, "--clip", clip, "--size", "60x80", "-o", str(folder / output)]) == 0
        told = [line for line in capsys.readouterr().err.splitlines() if "speck" in line]
        assert len(told) == 1
        assert told[0].startswith(f"pegbar: warning: {name}: 1 hole")


def test_a_batch_does_every_picture_with_every_clip(folder, capsys):
    (folder / "clips" / "broken.bvh").write_text("HIERARCHY\nnothing")
    batch = ["animate", str(folder), "--clip", str(folder / "clips"), "-o", str(folder / "out"), "--size", "60x80"]
    assert main([*batch, "--keep-going", "--format", "gif"]) == 1
    assert sorted(path.name for path in (folder / "out").glob("*.gif")) == ["anna_stand.gif", "anna_walk.gif"]
    told = capsys.readouterr()
    assert "anna_broken.gif: " in told.err
    assert "broken.bvh:2" in told.err
    assert told.out.count("animate: ") == 2


def test_several_pictures_stand_in_one_scene(folder):
    picture = str(folder / "anna.png")
    clips = ["--clip", str(folder / "clips" / "stand.bvh"), "--clip", str(folder / "clips" / "walk.bvh")]
    assert main(["animate", picture, picture, *clips, "-o", str(folder / "two.png"), "--size", "120x80"]) == 0
    seen = (read_image(folder / "two.png")[..., :3] != 255).any(axis=(0, 2))
    assert np.diff(np.flatnonzero(seen)).max() > 1


@pytest.mark.parametrize(
    ("arguments", "output", "problem"),
    [
        ((), "out.avi", "want a suffix of .gif"),
        (("--background", "transparent"), "out.mp4", "no transparency"),
        (("--size", "big"), "out.gif", "--size: want WIDTHxHEIGHT"),
        (("--color", "red"), "out.gif", "--color: want six"),
        (("--frames", "9-2"), "out.gif", "--frames: want FIRST-LAST"),
        (("--frames", "2-99"), "out.gif", "within 1-6"),
        (("--field-of-view", "200"), "out.gif", "--field-of-view: want degrees"),
        (("--map", "left_hand"), "out.gif", "--map: want JOINT=MARKER"),
        (("--transition", "-1"), "out.gif", "--transition: want 0 to 60"),
        (("--rate", "0"), "out.gif", "frame_rate: want"),
        (("--joints", "none.json"), "out.gif", "none.json: no such file"),
        (("--background", "completed", "--mask", "none.png"), "out.gif", "none.png: no such file"),
    ],
)
def test_wrong_usage_is_one_line_and_no_file(folder, capsys, arguments, output, problem):
    assert animate(folder, *arguments, output=output) == 2
    told = capsys.readouterr().err
    assert problem in told
    assert told.count("\n") == 1
    assert not (folder / output).exists()


def test_a_missing_codec_is_said_before_anything_is_read(folder, capsys, monkeypatch):
    monkeypatch.setitem(CODECS, ".mp4", (Codec("h264_of_mars", "yuv420p", None, {}),))
    (folder / "anna.json").write_text("broken")
    assert animate(folder, output="out.mp4") == 2
    assert "without an encoder for .mp4" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "av", None)
    assert animate(folder, output="out.webm") == 2
    assert 'pip install "pegbar[video]"' in capsys.readouterr().err


def test_nothing_to_animate_is_said(folder, capsys):
    (folder / "empty").mkdir()
    clip = str(folder / "clips" / "stand.bvh")
    assert main(["animate", str(folder / "empty"), "--clip", clip, "-o", str(folder / "out.gif")]) == 2
    assert "found 0 and 1" in capsys.readouterr().err
