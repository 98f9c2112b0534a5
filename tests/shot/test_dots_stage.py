"""`pegbar dots`: a layer of dots over the sample's drawings becomes its annotations."""

import json
import re

import numpy as np
import pytest

from pegbar import read_annotations
from pegbar.cli.main import main
from pegbar.io.frames import write_image
from pegbar.report.canvas import Canvas
from pegbar.scene.body import MARKERS
from pegbar.shot import dots_stage

COLORS = [(r, g, b) for r in (0, 120, 255) for g in (0, 120, 255) for b in (0, 120, 255) if len({r, g, b}) > 1]
SHOT = """\
[drawing]
frames = "d.##.png"
annotations = "marks.json"

[dots]
frames = "dots/k.##.png"
{joints}
"""


def make(folder, keys=(1, 4, 7), hidden=(), joints=None):
    """A figure whose sixteen joints move to the right by 4 pixels a drawing, seven drawings."""
    (folder / "dots").mkdir(parents=True)
    places = np.stack([20 + 12.0 * (np.arange(16) % 4), 20 + 14.0 * (np.arange(16) // 4)], axis=1)
    colors = COLORS[:16]
    for number in range(1, 8):
        drawing, dots = Canvas(120, 90, (255, 255, 255, 255)), Canvas(120, 90)
        for index, place in enumerate(places + np.array([4.0 * (number - 1), 0])):
            drawing.circle(place, 4, (40 + 10 * index,) * 3)
            if (number, MARKERS[index]) not in hidden:
                dots.circle(place, 2.5, colors[index])
        write_image(folder / f"d.{number:02d}.png", drawing.image()[..., :3].copy())
        if number in keys:
            write_image(folder / f"dots/k.{number:02d}.png", dots.image())
    table = {"#" + bytes(color).hex(): name for color, name in zip(colors, MARKERS, strict=True)}
    written = ", ".join(f'"{color}" = "{name}"' for color, name in table.items())
    (folder / "shot.toml").write_text(SHOT.format(joints=joints or f"joints = {{ {written} }}"))
    return places, table


def test_dots_become_marks_and_are_carried_between_keys(tmp_path, capsys):
    places, _ = make(tmp_path, hidden={(4, "left_hand")})
    assert main(["dots", str(tmp_path / "shot.toml")]) == 0
    assert "left_hand has no dot in drawings 4: hidden there" in capsys.readouterr().err
    drawing = read_annotations(tmp_path / "marks.json")
    assert drawing.names == MARKERS
    hand = MARKERS.index("left_hand")
    assert np.argwhere(~drawing.visible).tolist() == [[row, hand] for row in (2, 3, 4)]
    wanted = places + 4 * np.arange(7)[:, None, None] * [1, 0]
    np.testing.assert_allclose(drawing.markers[[0, 3, 6]], wanted[[0, 3, 6]], atol=0.5)
    np.testing.assert_allclose(drawing.markers, wanted, atol=1.5)
    assert drawing.notes["carried"] == "drawings 2-3, 5-6"
    assert len(drawing.limbs) == 10


def test_up_to_date_until_a_dot_moves(tmp_path, capsys):
    make(tmp_path)
    shot = str(tmp_path / "shot.toml")
    assert main(["dots", shot]) == 0
    assert main(["dots", shot]) == 0
    assert "up to date" in capsys.readouterr().out
    write_image(tmp_path / "dots/k.04.png", np.zeros((90, 120, 4), np.uint8))
    assert main(["dots", shot]) == 0
    assert "written" in capsys.readouterr().out


def test_a_palette_may_be_a_file_and_wrong_ones_are_named(tmp_path, capsys):
    _, table = make(tmp_path, joints='joints = "palette.json"')
    (tmp_path / "palette.json").write_text(json.dumps(table))
    assert main(["dots", str(tmp_path / "shot.toml")]) == 0
    (tmp_path / "palette.json").write_text('{"#ff0000": 3}')
    assert main(["dots", str(tmp_path / "shot.toml")]) == 2
    assert "palette.json: want a table" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('joints = { "#ff0000" = "head", "#00ff00" = "head" }', "head has more than one colour"),
        ("joints = 3", "joints"),
    ],
)
def test_what_cannot_be_is_refused(tmp_path, capsys, text, message):
    make(tmp_path, joints=text)
    assert main(["dots", str(tmp_path / "shot.toml")]) == 2
    assert message in capsys.readouterr().err


def test_a_shot_without_dots_says_so(tmp_path, capsys):
    make(tmp_path)
    text = (tmp_path / "shot.toml").read_text()
    (tmp_path / "shot.toml").write_text(text[: text.index("[dots]")])
    assert main(["dots", str(tmp_path / "shot.toml")]) == 2
    assert "no [dots]" in capsys.readouterr().err


def test_a_colour_of_a_limb_that_is_none_is_named(tmp_path, capsys):
    make(tmp_path)
    shot = tmp_path / "shot.toml"
    text = shot.read_text()
    shot.write_text(text + 'limbs = { left_forearm = "#ff8000", left_wing = "#00ff00" }\n')
    assert main(["dots", str(shot)]) == 2
    told = capsys.readouterr().err
    assert "dots.limbs: no limb left_wing between joints that have dots" in told
    assert "left_forearm" in told
    assert not (tmp_path / "marks.json").exists()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("?", "#ff0000 has no joint yet: write which one its dot is"),
        ("left_hnad", r"#ff0000: no joint 'left_hnad' \(did you mean 'left_hand'\?\)"),
    ],
)
def test_colours_without_a_joint_and_misspelt_joints_are_named_before_dots_are_read(name, message):
    assert re.search(message, dots_stage._problem({"#ff0000": name}) or "")


def test_joints_of_ones_own_may_be_like_known_ones():
    assert dots_stage._problem({"#ff0000": "left_hand", "#00ff00": "left_hand2", "#0000ff": "tail"}) is None
    assert "no colour has a joint yet" in (dots_stage._problem({}) or "")


@pytest.mark.parametrize(
    ("lines", "rate", "holds"),
    [("", None, ()), ("[shot]\nframe_rate = 12\n", 12.0, ()), ("hold = 2\n", None, (2,) * 7)],
)
def test_marks_say_how_fast_the_drawings_run_as_far_as_the_shot_does(tmp_path, lines, rate, holds):
    make(tmp_path)
    shot = tmp_path / "shot.toml"
    text = shot.read_text()
    shot.write_text(lines + text if lines.startswith("[") else text.replace("[drawing]\n", f"[drawing]\n{lines}"))
    assert main(["dots", str(shot)]) == 0
    marks = read_annotations(tmp_path / "marks.json")
    assert (marks.frame_rate, marks.holds) == (rate, holds)
    # A new rate or hold is written at the next run.
    shot.write_text("[shot]\nframe_rate = 30\n" + text)
    assert main(["dots", str(shot)]) == 0
    assert read_annotations(tmp_path / "marks.json").frame_rate == 30


def test_limbs_with_an_end_that_no_dot_shows_name_that_joint(tmp_path, capsys):
    make(tmp_path)
    shot = tmp_path / "shot.toml"
    text = re.sub(r', "#\w+" = "right_hip"', "", shot.read_text())
    assert text != shot.read_text()
    shot.write_text(text + 'limbs = { right_thigh = "#0000ff" }\n')
    assert main(["dots", str(shot)]) == 2
    told = "no limb right_thigh between joints that have dots: dot right_hip too, at least once, where it would be"
    assert f"dots.limbs: {told} (or leave the limb out)\n" in capsys.readouterr().err
