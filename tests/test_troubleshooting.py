"""Every message of the troubleshooting page is one that pegbar gives: each is provoked here."""

import json
import re
import shutil

import numpy as np
import pytest

from pegbar.io.frames import write_image
from tests.guide import ROOT, call
from tests.shots import make_shot

MESSAGES = re.findall(r"^#### `(.*)`$", (ROOT / "docs/troubleshooting.md").read_text(encoding="utf-8"), re.MULTILINE)
CUT = "HIERARCHY\nROOT Hips\n{\n"


def change(shot, old, new):
    """Replace ``old`` in the shot file."""
    text = shot.read_text()
    assert old in text
    shot.write_text(text.replace(old, new))


def add(shot, text):
    """Put ``text`` at the end of the shot file."""
    shot.write_text(shot.read_text() + text)


def mark(shot, change_marks):
    """Change the annotations beside the shot file."""
    path = shot.parent / "marks.json"
    marks = json.loads(path.read_text())
    change_marks(marks)
    path.write_text(json.dumps(marks))


def dots(shot, number=1, limbs=""):
    """A layer with one red dot, and another joint's green one that no picture has."""
    picture = np.zeros((32, 48, 4), np.uint8)
    picture[10:15, 10:15] = (255, 0, 0, 255)
    write_image(shot.parent / f"dots.{number:04d}.png", picture)
    change(shot, '"marks.json"', '"new.json"')
    joints = '{ "#ff0000" = "neck", "#00ff00" = "pelvis" }'
    add(shot, f'[dots]\nframes = "dots.####.png"\njoints = {joints}\n{limbs}')


def several_sequences(shot):
    """Nothing says which pictures are drawn."""
    shot.unlink()
    (shot.parent / "marks.json").unlink()
    return ["init", shot.parent]


def broken_frames(shot):
    """A frame for each thing that can be wrong with pictures."""
    folder = shot.parent
    (folder / "d.0001.png").write_bytes((folder / "d.0001.png").read_bytes()[:60])
    labels = np.zeros((32, 48, 3), np.uint8)
    write_image(folder / "l.0002.png", labels)
    (folder / "p.0003.exr").unlink()
    write_image(folder / "d.0004.png", np.zeros((8, 8, 4), np.uint8))
    labels[4:20, 4:20] = 7
    write_image(folder / "l.0005.png", labels)
    return ["check", shot]


def no_depths(shot):
    """Marks alone."""
    mark(shot, lambda marks: [marks.pop("depths", None), *(frame.pop("depths", None) for frame in marks["frames"])])
    return ["check", shot, "--frames", "1"]


def cut_clip(shot):
    """A BVH that ends in its hierarchy."""
    (shot.parent / "walk.bvh").write_text(CUT)
    return ["match", shot.parent / "marks.json", shot.parent]


def fast_dance(shot):
    """The sample's marks, said to be twice as fast as they were danced."""
    from pegbar.sample.shot import write_sample

    sample = write_sample(shot.parent / "sample", size=(96, 54), frames=12, samples=1)
    return ["align", sample]


def without(shot, old, arguments):
    """The shot without ``old``."""
    change(shot, old, "")
    return arguments


#: For a part of each message, what a user does to get it: changes to a sound shot, and the command.
PROVOKE = {
    "no such key": lambda shot: [change(shot, "labels =", "label ="), ["check", shot]][1],
    "not TOML": lambda shot: [add(shot, "[drawing]\n"), ["check", shot]][1],
    "a folder, not a shot file": lambda shot: ["check", shot.parent],
    "is there already": lambda shot: ["init", shot.parent],
    "several sequences": several_sequences,
    "no sequence of drawn frames": lambda shot: [(shot.parent / "x").mkdir(), ["init", shot.parent / "x"]][1],
    "is also": lambda shot: [change(shot, "final/f.", "d."), ["composite", shot]][1],
    "the shot has no [clip]": lambda shot: ["align", shot],
    "the shot has no [secondary]": lambda shot: ["secondary", shot],
    "no preset": lambda shot: [add(shot, '[secondary]\nelements = ["hat"]\n'), ["secondary", shot]][1],
    "no [passes]": lambda shot: without(shot, '[passes]\nbeauty = "p.####.exr"\n', ["composite", shot]),
    "pixels match no limb": broken_frames,
    "no limb is marked": broken_frames,
    "no such file or": broken_frames,
    "pixels, got": broken_frames,
    "cut short": broken_frames,
    "no depths of the markers": no_depths,
    "frames are marked": lambda shot: [mark(shot, lambda marks: marks["frames"].pop()), ["check", shot]][1],
    "not JSON": lambda shot: [(shot.parent / "marks.json").write_text("{"), ["check", shot]][1],
    "the shot has no [dots]": lambda shot: ["dots", shot],
    "no file has the number": lambda shot: [dots(shot, 9), ["dots", shot]][1],
    "no drawing has a dot": lambda shot: [dots(shot), ["dots", shot]][1],
    "dots.limbs": lambda shot: [dots(shot, limbs='limbs = { wing = "#0000ff" }\n'), ["dots", shot]][1],
    "no .bvh": lambda shot: ["match", shot.parent / "marks.json", shot.parent],
    "cannot be read": cut_clip,
    "ends inside the hierarchy": cut_clip,
    "faster than people": fast_dance,
    "no option": lambda shot: ["check", shot, "--frame", "1"],
    "is missing": lambda shot: ["match", shot.parent / "marks.json"],
    "the shot has no frame": lambda shot: ["check", shot, "--frames", "1-9"],
    "WIDTHxHEIGHT": lambda shot: ["animate", "a.png", "--clip", "a.bvh", "-o", "a.gif", "--size", "500"],
    "want a suffix": lambda shot: [
        (shot.parent / "walk.bvh").write_text(CUT),
        ["animate", shot.parent / "d.0001.png", "--clip", shot.parent / "walk.bvh", "-o", shot.parent / "a.avi"],
    ][1],
    "want a picture with joints": lambda shot: [
        (shot.parent / "none").mkdir(),
        ["animate", shot.parent / "none", "--clip", shot.parent / "none", "-o", shot.parent / "a.gif"],
    ][1],
}


@pytest.fixture(scope="module")
def said(tmp_path_factory):
    """What is said when something is provoked; each way is gone once."""
    known = {}

    def say(key, capsys):
        way = PROVOKE[key]
        if way not in known:
            shot = make_shot(tmp_path_factory.mktemp("trouble"), count=5)
            assert call(["pegbar", *map(str, way(shot))]) in (0, 1, 2)
            known[way] = capsys.readouterr().err
            shutil.rmtree(shot.parent)
        return known[way]

    return say


@pytest.mark.parametrize("message", MESSAGES)
def test_the_message_can_be_provoked(message, said, capsys):
    (key,) = [key for key in PROVOKE if key in message]
    pattern = ".+".join(re.escape(part) for part in message.split("…"))
    assert re.search(pattern, said(key, capsys)), said(key, capsys)


def test_every_way_belongs_to_a_message():
    assert len(MESSAGES) >= 30
    assert [key for key in PROVOKE if sum(key in message for message in MESSAGES) != 1] == []
