"""A shot that follows an exposure sheet: frames, holds and gaps, from `pegbar init` to finished frames."""

import tomllib

import numpy as np
import pytest

from pegbar import ShotError
from pegbar.cli.main import main
from pegbar.io.frames import read_picture
from pegbar.shot.plan import open_shot
from tests.shots import make_shot

SHEET = "frame,A,B\n1,2,1\n3,x,1\n4,4,1\n6,1,1\n"


def with_sheet(folder, sheet=SHEET, keys='exposure = "sheet.csv"\nlevel = "A"\n'):
    shot = make_shot(folder, 4)
    (folder / "sheet.csv").write_text(sheet)
    text = shot.read_text().replace("[drawing]\n", f"[drawing]\n{keys}")
    shot.write_text(text.replace('frames = "1-4"\n', "").replace('[passes]\nbeauty = "p.####.exr"\n', ""))
    return shot


def test_frames_show_the_sheet_s_drawings(tmp_path):
    shot = with_sheet(tmp_path)
    plan = open_shot(shot)
    assert plan.frames == (1, 2, 4, 5, 6)
    assert [plan.exposure.drawing(frame) for frame in plan.frames] == [2, 2, 4, 4, 1]
    assert main(["depth", str(shot), "--jobs", "1"]) == 0
    depths = {frame: read_picture(tmp_path / f"depth/z.{frame:04d}.png") for frame in plan.frames}
    assert not (tmp_path / "depth/z.0003.png").exists()
    assert np.array_equal(depths[1], depths[2])
    assert not np.array_equal(depths[2], depths[4])


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ('exposure = "sheet.csv"\n', "drawing.level: sheet.csv: the sheet has several levels, name one: A, B"),
        ('exposure = "sheet.csv"\nlevel = "C"\n', "no level 'C'"),
        ('exposure = "none.csv"\n', "none.csv"),
        ('exposure = "sheet.csv"\nlevel = "A"\nhold = 2\n', "leave one of them out"),
        ('level = "A"\n', "only an exposure sheet has levels"),
    ],
)
def test_wrong_keys_are_named(tmp_path, keys, said):
    with pytest.raises(ShotError, match=said):
        open_shot(with_sheet(tmp_path, keys=keys))


def test_drawings_that_are_not_there_are_named(tmp_path):
    with pytest.raises(ShotError, match="sheet.csv shows drawing 7-8: there is no such picture"):
        open_shot(with_sheet(tmp_path, "frame,A\n1,1\n2,7\n3,8\n"))


def test_init_puts_the_sheet_into_the_shot_file(tmp_path, capsys):
    make_shot(tmp_path / "shot", 4)
    sheet = tmp_path / "sheet.csv"
    sheet.write_text("frame,B,d,pan_x\n1,9,1,0\n3,9,3,20\n5,x,x,40\n")
    arguments = ["init", str(tmp_path / "shot"), "--drawings", "d.####.png", "--exposure", str(sheet), "--overwrite"]
    assert main(arguments) == 0
    said = capsys.readouterr().out
    assert "the sheet moves the camera (pan_x): finished frames are what it sees" in said
    assert "in words" not in said
    table = tomllib.loads((tmp_path / "shot/shot.toml").read_text())
    assert (table["drawing"]["exposure"], table["drawing"]["level"]) == ("../sheet.csv", "d")
    assert table["drawing"]["camera"] == "sheet"
    assert table["shot"]["frames"] == "1-4"
    plan = open_shot(tmp_path / "shot/shot.toml")
    assert [plan.exposure.drawing(frame) for frame in plan.frames] == [1, 1, 3, 3]
    assert [plan.moves.at(frame)["pan_x"] for frame in plan.frames] == [0, 10, 20, 30]
