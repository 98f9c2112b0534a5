"""A shot whose exposure sheet moves the camera: finished frames, mattes, depth and layers are what it sees."""

from contextlib import nullcontext

import numpy as np
import pytest

from pegbar import ShotError
from pegbar.cli.main import main
from pegbar.io.exr import read_exr, read_passes, write_exr
from pegbar.io.frames import read_picture
from pegbar.layer.reframe import reframe_nearest, reframe_picture
from pegbar.scene.film_view import FilmView
from pegbar.shot.plan import open_shot
from pegbar.shot.preflight import preflight
from tests.shots import HEIGHT, WIDTH, make_shot

PAPER = (WIDTH, HEIGHT)
PAN = "frame,A,pan_x,pan_y\n1,1,0,0\n2,2,3,\n4,4,-5,3\n"
TURN = "frame,A,pan_x,zoom,rotate\n1,1,0,1,0\n2,2,,,\n4,4,6,2.5,45\n"
OUTPUTS = 'holdout = "final/h.####.png"\nvisible = "final/v.####.png"\nlayers = "layers/l.####.exr"\n'


def moved_shot(folder, sheet=PAN, *, drawing="", passes="", output=OUTPUTS):
    shot = make_shot(folder, 4)
    (folder / "sheet.csv").write_text(sheet)
    text = shot.read_text().replace("[drawing]\n", f'[drawing]\nexposure = "sheet.csv"\n{drawing}')
    shot.write_text(text.replace("[passes]\n", f"[passes]\n{passes}") + output)
    return shot


def made(shot):
    assert main(["composite", str(shot), "--jobs", "1"]) == 0
    assert main(["depth", str(shot), "--jobs", "1"]) == 0
    return shot.parent


@pytest.fixture(scope="module")
def still(tmp_path_factory):
    """The shot without moves."""
    return made(moved_shot(tmp_path_factory.mktemp("still"), drawing='camera = "drawn"\n'))


def shifted(picture, right, down, empty=0):
    """What a camera moved by whole pixels sees."""
    seen = np.full_like(picture, empty)
    rows, columns = np.arange(HEIGHT) + down, np.arange(WIDTH) + right
    there = np.ix_((rows >= 0) & (rows < HEIGHT), (columns >= 0) & (columns < WIDTH))
    seen[there] = picture[np.ix_(rows[(rows >= 0) & (rows < HEIGHT)], columns[(columns >= 0) & (columns < WIDTH)])]
    return seen


def test_a_pan_by_whole_pixels_shifts_every_output(tmp_path, still):
    folder = made(moved_shot(tmp_path))
    for frame, (right, down) in {1: (0, 0), 2: (3, 1), 3: (-1, 2), 4: (-5, 3)}.items():
        for name in ("final/f", "final/h", "final/v", "depth/z"):
            seen, whole = (read_picture(each / f"{name}.{frame:04d}.png") for each in (folder, still))
            assert np.array_equal(seen, shifted(whole, right, down, whole[0, 0])), (frame, name)
        depths = [read_passes(each / f"depth/z.{frame:04d}.exr", want=("depth",)).depth for each in (folder, still)]
        assert np.array_equal(depths[0], shifted(depths[1], right, down, np.inf))
        seen, whole = (read_exr(each / f"layers/l.{frame:04d}.exr").channels for each in (folder, still))
        assert set(seen) == set(whole) == {"R", "G", "B", "A", "depth.Z", "matte_body.A", "matte_arm.A"}
        for name, plane in whole.items():
            expected = shifted(plane, right, down, 1e10 if name == "depth.Z" else 0)
            np.testing.assert_allclose(seen[name], expected, atol=1e-3, err_msg=name)


def test_zoom_and_turn_are_seen_at_the_frame_s_size(tmp_path, still):
    folder = made(moved_shot(tmp_path, TURN, output=OUTPUTS + "size = [40, 20]\n"))
    for frame, (pan, zoom, turn) in {1: (0, 1, 0), 2: (2, 1.5, 15), 4: (6, 2.5, 45)}.items():
        view = FilmView(PAPER, (40, 20), pan, 0, zoom, turn)
        final, whole = (read_picture(each / f"final/f.{frame:04d}.png") for each in (folder, still))
        assert np.array_equal(final, reframe_picture(whole, view))
        depth, flat = (
            read_passes(each / f"depth/z.{frame:04d}.exr", want=("depth",)).depth for each in (folder, still)
        )
        assert np.array_equal(depth, reframe_nearest(flat, view, np.inf))
        layers = read_exr(folder / f"layers/l.{frame:04d}.exr").channels
        assert layers["A"].shape == (20, 40)
        np.testing.assert_allclose(layers["matte_body.A"] + layers["matte_arm.A"], layers["A"], atol=1e-3)
        assert (layers["depth.Z"][layers["A"] > 0.02] < 1e9).all()


def test_linear_frames_are_seen_in_linear_light(tmp_path, still):
    output = OUTPUTS.replace("h.####", "h2.####")
    shot = moved_shot(tmp_path, TURN, output=output)
    shot.write_text(shot.read_text().replace("final/f.####.png", "final/f.####.exr"))
    whole = moved_shot(tmp_path / "whole", TURN, drawing='camera = "drawn"\n', output=output)
    whole.write_text(whole.read_text().replace("final/f.####.png", "final/f.####.exr"))
    seen, flat = (read_exr(made(each) / "final/f.0004.exr").channels for each in (shot, whole))
    stacked = np.stack([np.asarray(flat[name], np.float32) for name in "RGBA"], axis=2)
    expected = reframe_picture(stacked, FilmView(PAPER, PAPER, 6, 0, 2.5, 45))
    np.testing.assert_allclose(np.stack([seen[name] for name in "RGBA"], axis=2), expected, atol=2e-3)


def test_passes_rendered_through_the_sheet_s_camera_meet_the_drawing_there(tmp_path, still):
    """The bar, rendered as the camera sees it, is composited as if it had been seen with the drawing."""
    shot = moved_shot(tmp_path, passes='camera = "sheet"\n')
    for frame, (right, down) in {1: (0, 0), 2: (3, 1), 3: (-1, 2), 4: (-5, 3)}.items():
        flat = read_exr(tmp_path / f"p.{frame:04d}.exr").channels
        beyond = {"Z": np.inf}
        seen = {name: shifted(plane, right, down, beyond.get(name, 0)) for name, plane in flat.items()}
        write_exr(tmp_path / f"p.{frame:04d}.exr", seen)
    folder = made(shot)
    for frame, (right, down) in {2: (3, 1), 4: (-5, 3)}.items():
        for name in ("f", "h", "v"):
            final, whole = (read_picture(each / f"final/{name}.{frame:04d}.png") for each in (folder, still))
            apart = final.astype(int) - shifted(whole, right, down)
            assert abs(apart).max() <= 1


def test_passes_of_another_size_are_told(tmp_path, capsys):
    shot = moved_shot(tmp_path, passes='camera = "sheet"\n', output="size = [40, 20]\n")
    assert main(["composite", str(shot), "--jobs", "1"]) == 1
    assert "the same whole number of times the drawing's 40 x 20" in capsys.readouterr().err
    assert main(["check", str(shot), "--jobs", "1"]) == 1
    assert "40 x 20" in capsys.readouterr().err


def test_a_changed_key_makes_its_frames_anew(tmp_path, capsys):
    shot = moved_shot(tmp_path)
    made(shot)
    capsys.readouterr()
    assert main(["composite", str(shot), "--jobs", "1"]) == 0
    assert "0 frames made, 4 up to date" in capsys.readouterr().out
    (tmp_path / "sheet.csv").write_text(PAN.replace("-5", "-7"))
    assert main(["composite", str(shot), "--jobs", "1"]) == 0
    assert "2 frames made, 2 up to date" in capsys.readouterr().out


def notes(shot):
    found, _ = preflight(shot, list, 1, lambda *_: nullcontext(lambda: None))
    return [problem.line for problem in found if problem.note], [line.line for line in found if not line.note]


@pytest.mark.parametrize(
    ("sheet", "note", "problem"),
    [
        (PAN.replace("4,4,-5", "4,4,-9"), "the camera's view leaves the paper, by 9 px in frame 4", None),
        (PAN, "frames 2-4: the camera's view leaves the paper", None),
        ("frame,A,pan_x\n1,1,0\n4,4,300\n", None, "frames 2-4: the camera sees nothing of the paper (pan 100, 0"),
        ("frame,A,pan_x\n1,1,0\n4,4,\n9,x,0\n", "the camera has keys at frames 9: the shot has 1-4", None),
    ],
)
def test_check_tells_where_the_camera_goes(tmp_path, sheet, note, problem):
    told, wrong = notes(moved_shot(tmp_path, sheet))
    assert [note in line for line in told] == ([True] if note else [])
    assert [problem in line for line in wrong] == ([True] if problem else [])


def test_a_frame_on_the_paper_and_a_sheet_without_moves_need_no_note(tmp_path):
    smaller = moved_shot(tmp_path / "a", PAN, output="size = [38, 26]\n")
    assert notes(smaller) == ([], [])
    assert notes(moved_shot(tmp_path / "b", "frame,A\n1,1\n4,4\n")) == ([], [])
    assert notes(moved_shot(tmp_path / "c", drawing='camera = "drawn"\n')) == ([], [])


def test_check_names_every_bad_row_and_nothing_is_made(tmp_path, capsys):
    shot = moved_shot(tmp_path, "frame,A,pan_x,zoom\n1,1,left,1\n2,2,,0\n4,4,,-2\n")
    assert main(["check", str(shot), "--jobs", "1"]) == 1
    said = capsys.readouterr().err
    for row in ("sheet.csv:2: frame 1: pan_x", "sheet.csv:3: frame 2: zoom", "sheet.csv:4: frame 4: zoom"):
        assert row in said
    assert said.count("correct that cell of the sheet") == 3
    with pytest.raises(ShotError, match="drawing.exposure: sheet.csv:2"):
        open_shot(shot)
    shot.write_text(shot.read_text().replace("[drawing]\n", '[drawing]\ncamera = "drawn"\n'))
    assert open_shot(shot).moves is None


def test_words_for_numbers_are_told(tmp_path):
    shot = moved_shot(tmp_path)
    text = (
        '{"timeTables": [{"duration": 4, "fields": [{"fieldId": 0, "tracks": [{"trackNo": 0, "frames": '
        '[{"frame": 0, "data": [{"id": 0, "values": ["1"]}]}]}]}, {"fieldId": 5, "tracks": [{"trackNo": 0, "frames": '
        '[{"frame": 0, "data": [{"id": 0, "values": ["T.U"]}]}]}]}], '
        '"timeTableHeaders": [{"fieldId": 0, "names": ["A"]}]}]}'
    )
    (tmp_path / "sheet.csv").write_text("exchangeDigitalTimeSheet Save Data\n" + text)
    told, wrong = notes(shot)
    assert wrong == []
    assert any("camera work in words is not used: T.U" in line for line in told)
