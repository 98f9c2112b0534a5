import os
import shutil

import numpy as np
import pytest

from pegbar.cli.main import main
from pegbar.io.exr import read_passes, write_exr
from pegbar.io.frames import read_image, read_picture, write_image
from tests.shots import HEIGHT, WIDTH, bar, draw, make_shot, move_mark

RED = [255, 0, 0, 255]


def run(*arguments):
    return main([str(argument) for argument in arguments])


@pytest.fixture
def shot(tmp_path):
    return make_shot(tmp_path / "a shot of ünïcode")


def finals(shot):
    return sorted(path.name for path in (shot.parent / "final").glob("*.png"))


def test_the_bar_covers_the_far_limb_and_not_the_near_one(shot, capsys):
    assert run("composite", shot) == 0
    assert finals(shot) == [f"f.{n:04d}.png" for n in (1, 2, 3, 4)]
    for frame in (1, 4):
        final = read_picture(shot.parent / f"final/f.{frame:04d}.png")
        assert (final[12:20, 5 + frame : 19 + frame] == RED).all()
        assert (final[12:20, 29 + frame : 43 + frame] == (90, 160, 90, 255)).all()
        assert (final[12:20, :2] == RED).all()
        assert (final[:2] == 0).all()
        assert (final[3, 6 + frame] == (20, 20, 20, 128)).all()
        assert final[15, 28 + frame - 1].tolist() == [137, 10, 10, 255]
    assert "4 frames made" in capsys.readouterr().out


def test_a_second_run_makes_only_what_has_changed(shot, capsys):
    assert run("composite", shot) == 0
    before = {p.name: p.stat().st_mtime_ns for p in (shot.parent / "final").glob("*.png")}
    os.utime(shot.parent / "d.0001.png")  # newer, but the same contents
    drawing = draw(3)[0]
    drawing[..., :3] //= 2
    write_image(shot.parent / "d.0003.png", drawing)
    (shot.parent / "final/f.0004.png").unlink()
    capsys.readouterr()
    assert run("composite", shot) == 0
    assert "2 frames made, 2 up to date" in capsys.readouterr().out
    after = {p.name: p.stat().st_mtime_ns for p in (shot.parent / "final").glob("*.png")}
    assert {name for name in before if before[name] != after[name]} == {"f.0003.png", "f.0004.png"}
    assert run("composite", shot, "--overwrite") == 0
    assert "4 frames made" in capsys.readouterr().out


def test_settings_and_marks_that_decide_the_result_make_frames_out_of_date(shot, capsys):
    assert run("composite", shot) == 0
    text = shot.read_text()
    shot.write_text(text.replace("[passes]", '[passes]\nunit = "cm"'))
    capsys.readouterr()
    assert run("composite", shot) == 0
    assert "4 frames made" in capsys.readouterr().out
    move_mark(shot, 2, "pelvis", (15, 27))
    assert run("composite", shot) == 0
    assert "1 frame made, 3 up to date" in capsys.readouterr().out


@pytest.mark.parametrize("jobs", [1, 2])
def test_keep_going_does_the_other_frames(shot, capsys, jobs):
    damaged = shot.parent / "p.0002.exr"
    damaged.write_bytes(damaged.read_bytes()[:200])
    (shot.parent / "d.0003.png").unlink()
    assert run("composite", shot, "--keep-going", "--jobs", jobs) == 1
    errors = sorted(capsys.readouterr().err.splitlines())
    assert len(errors) == 2
    assert "frame 2: " in errors[0]
    assert "p.0002.exr" in errors[0]
    assert "frame 3: no such file: " in errors[1]
    assert "d.0003.png" in errors[1]
    assert finals(shot) == ["f.0001.png", "f.0004.png"]
    assert not list((shot.parent / "final").glob(".*part*"))


def test_without_keep_going_the_first_failure_ends_the_run(shot, capsys):
    (shot.parent / "d.0001.png").write_bytes(b"")
    assert run("composite", shot, "--jobs", 1) == 1
    captured = capsys.readouterr()
    assert "frame 1: " in captured.err
    assert "the file is empty" in captured.err
    assert "0 frames made, 1 failed, 3 not begun" in captured.out
    assert finals(shot) == []


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: write_image(f / "d.0002.png", draw(2)[0][:16]), "want 48 x 32 pixels, got 48 x 16"),
        (lambda f: write_image(f / "l.0002.png", draw(2)[1][:, :9]), "want 48 x 32 pixels, got 9 x 32"),
        (lambda f: write_exr(f / "p.0002.exr", {n: v[:-1] for n, v in bar().items()}), "whole number of times"),
        (lambda f: write_exr(f / "p.0002.exr", {"": bar()[""], "Z": nan_depth()}), "row 7, column 9"),
        (lambda f: write_exr(f / "p.0002.exr", {"Z": bar()["Z"]}), "beauty"),
        (lambda f: (f / "l.0002.png").write_bytes(b"GIF89a"), "not a PNG"),
        (lambda f: (f / "marks.json").write_text("{"), "marks.json"),
    ],
)
def test_what_does_not_fit_is_named_with_file_and_frame(shot, capsys, change, message):
    change(shot.parent)
    code = run("composite", shot, "--keep-going")
    error = capsys.readouterr().err
    assert message in error
    assert len(error.splitlines()) == 1
    if "marks.json" in message:
        assert code == 2
    else:
        assert code == 1
        assert "frame 2: " in error
        assert finals(shot) == ["f.0001.png", "f.0003.png", "f.0004.png"]


def nan_depth():
    depth = bar()["Z"]
    depth[7, 9] = np.nan
    return depth


def test_unknown_colours_are_counted_and_placed(shot, capsys):
    labels = draw(2)[1]
    labels[10, 20:23] = (1, 2, 3)
    write_image(shot.parent / "l.0002.png", labels)
    assert run("composite", shot, "--keep-going") == 1
    error = capsys.readouterr().err
    assert "frame 2: " in error
    assert "3 pixels match no limb, first #010203 at row 10, column 20" in error
    assert finals(shot) == ["f.0001.png", "f.0003.png", "f.0004.png"]
    shot.write_text(shot.read_text().replace("[drawing]", "[drawing]\nunknown_colors = 'note'"))
    assert run("composite", shot) == 0
    assert "3 pixels match no limb" in capsys.readouterr().err
    shot.write_text(shot.read_text() + "[drawing.palette]\n'#010203' = 'body'\n")
    assert run("composite", shot) == 0
    assert capsys.readouterr().err == ""


def test_a_matte_that_the_drawing_lacks_is_refused(shot, capsys):
    write_image(shot.parent / "d.0001.png", draw(1)[0][..., :3])
    shot.write_text(shot.read_text().replace("[drawing]", '[drawing]\nmatte = "alpha"'))
    assert run("composite", shot, "--keep-going") == 1
    error = capsys.readouterr().err
    assert "frame 1: " in error
    assert "alpha" in error
    assert finals(shot) == ["f.0002.png", "f.0003.png", "f.0004.png"]


def test_plain_options_do_without_a_shot_file(shot, monkeypatch, capsys):
    assert run("composite", shot) == 0
    want = read_image(shot.parent / "final/f.0002.png")
    monkeypatch.chdir(shot.parent)
    shot.unlink()
    sources = ["--drawings", "d.####.png", "--labels", "l.####.png", "--annotations", "marks.json"]
    assert run("composite", *sources, "--beauty", "p.####.exr", "--output", "plain/o.####.png") == 0
    assert np.array_equal(read_image("plain/o.0002.png"), want)
    assert run("composite", "--drawings", "d.####.png") == 2
    assert "--beauty" in capsys.readouterr().err


def test_a_given_drawing_depth_replaces_labels_and_marks(shot, monkeypatch):
    monkeypatch.chdir(shot.parent)
    assert run("composite", shot) == run("depth", shot) == 0
    arguments = ["--drawings", "d.####.png", "--drawing-depth", "depth/z.####.exr", "--beauty", "p.####.exr"]
    assert run("composite", *arguments, "--output", "plain/o.####.png") == 0
    assert np.array_equal(read_image("plain/o.0002.png"), read_image("final/f.0002.png"))


def test_larger_passes_separate_depth_and_units(shot, monkeypatch):
    monkeypatch.chdir(shot.parent)
    assert run("composite", shot) == 0
    want = read_image("final/f.0003.png")
    for frame in (1, 2, 3, 4):
        big = {name: np.repeat(np.repeat(image, 3, 0), 3, 1) for name, image in bar().items()}
        write_exr(f"b.{frame:04d}.exr", {"": big[""]})
        write_exr(f"z.{frame:04d}.exr", {"Z": np.where(big["Z"] < 9, big["Z"] * 100, 1e10)})
    changes = ["--beauty", "b.####.exr", "--depth", "z.####.exr", "--unit", "cm", "--output", "big/o.####.png"]
    assert run("composite", shot, *changes) == 0
    assert np.array_equal(read_image("big/o.0003.png"), want)


def test_a_renders_soft_edge_without_depth_covers_the_far_limb_and_not_the_near_one(shot, monkeypatch):
    monkeypatch.chdir(shot.parent)
    passes = bar()
    passes[""][11] = (0.5, 0, 0, 0.5)
    for frame in (1, 2, 3, 4):
        write_exr(f"p.{frame:04d}.exr", passes)
    assert run("composite", shot, "--holdout", "hold/h.####.png") == 0
    final, holdout = (read_image(name) for name in ("final/f.0001.png", "hold/h.0001.png"))
    assert (final[11, 6:20] == (228, 75, 50, 255)).all()
    assert (final[11, 30:44] == (90, 160, 90, 255)).all()
    assert (holdout[11, 6:20] == 0).all()
    assert (holdout[11, 30:44] == 255).all()


def test_linear_light_stays_linear_in_exr(shot, monkeypatch):
    monkeypatch.chdir(shot.parent)
    assert run("composite", shot, "--output", "final/f.####.exr") == 0
    beauty = read_passes("final/f.0001.exr", want=["beauty"]).beauty
    assert beauty[15, 10].tolist() == [1, 0, 0, 1]
    decoded = ((np.array([90, 160, 90]) / 255 + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(beauty[15, 36, :3], decoded, rtol=1e-3)
    assert run("composite", shot, "--space", "linear") == 2


def test_the_holdout_is_where_the_drawing_is_in_front(shot, monkeypatch):
    monkeypatch.chdir(shot.parent)
    assert run("composite", shot, "--holdout", "hold/h.####.png") == 0
    holdout = read_image("hold/h.0001.png")[..., 0]
    assert (holdout[12:20, 6:20] == 0).all()
    assert (holdout[12:20, 30:44] == 255).all()


def test_on_twos_each_drawing_is_shown_for_two_frames(shot, monkeypatch):
    monkeypatch.chdir(shot.parent)
    for frame in (5, 6, 7, 8):
        shutil.copy("p.0001.exr", f"p.{frame:04d}.exr")
    shot.write_text(shot.read_text().replace('"1-4"', '"1-8"').replace("[drawing]", "[drawing]\nhold = 2"))
    assert run("composite", shot) == 0
    pictures = [read_image(f"final/f.{frame:04d}.png") for frame in range(1, 9)]
    assert all(np.array_equal(pictures[i], pictures[i + 1]) for i in (0, 2, 4, 6))
    assert not np.array_equal(pictures[1], pictures[2])


def test_wrong_usage_exits_with_two_and_one_line(shot, capsys, tmp_path):
    cases = [
        ["composite", tmp_path / "none.toml"],
        ["composite", shot, "--frames", "1-9"],
        ["composite", shot, "--frames", "4-1"],
        ["composite", shot, "--jobs", "0"],
        ["composite", shot, "--jobz", "2"],
        ["compose", shot],
        ["composite", shot, "--matte", "magic"],
    ]
    for case in cases:
        assert run(*case) == 2, case
        assert len(capsys.readouterr().err.splitlines()) == 1, case
    assert finals(shot) == []


def test_an_output_folder_that_cannot_be_made_is_named(shot, capsys):
    (shot.parent / "final").write_text("a file in the way")
    assert run("composite", shot) == 2
    assert "final" in capsys.readouterr().err


def test_depth_is_that_of_the_limbs_and_can_be_looked_at(shot):
    assert run("depth", shot) == 0
    depth = read_passes(shot.parent / "depth/z.0002.exr", want=["depth"]).depth
    assert depth.shape == (HEIGHT, WIDTH)
    assert (depth[5:27, 7:21] == 5).all()
    assert (depth[5:27, 31:45] == 3).all()
    assert depth[3, 8] == 5  # the soft line takes the nearest limb
    assert np.isinf(depth[0, 0])
    picture = read_picture(shot.parent / "depth/z.0002.png")
    assert picture[10, 35, 0] > picture[10, 35, 2]
    assert picture[10, 10, 2] > picture[10, 10, 0]
    assert picture[0, 0, 3] == 0


def test_an_output_that_would_replace_an_input_or_another_output_is_refused(shot, monkeypatch, capsys):
    monkeypatch.chdir(shot.parent)
    before = {path: path.read_bytes() for path in shot.parent.iterdir() if path.is_file()}
    for options in (
        ["--output", "d.####.png"],
        ["--output", "./x/../l.%04d.png"],
        ["--output", "p.####.exr"],
        ["--output", "o.####.png", "--holdout", "o.####.png"],
    ):
        (shot.parent / "x").mkdir(exist_ok=True)
        assert run("composite", shot, *options) == 2
        assert "writing would replace it" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in shot.parent.iterdir() if path.is_file()} == before


@pytest.mark.parametrize("hold", ["1", "'sparse'"])
def test_a_missing_drawing_does_not_shift_the_marks_of_the_others(shot, capsys, hold):
    assert run("depth", shot) == 0
    want = read_image(shot.parent / "depth/z.0004.png")
    shot.write_text(shot.read_text().replace("[drawing]", f"[drawing]\nhold = {hold}"))
    for number in (1, 2):
        (shot.parent / f"d.{number:04d}.png").unlink()
        capsys.readouterr()
        if number == 1 or hold != "1":
            assert run("check", shot) == 1
            assert "drawing.first_marked" in capsys.readouterr().err
    shot.write_text(shot.read_text().replace("[drawing]", "[drawing]\nfirst_marked = 1"))
    assert run("depth", shot, "--frames", "4") == 0
    assert np.array_equal(read_image(shot.parent / "depth/z.0004.png"), want)


def test_jpeg_frames_are_put_over_white(shot, monkeypatch):
    monkeypatch.chdir(shot.parent)
    assert run("composite", shot, "--output", "o/f.####.jpg", "--frames", "1") == 0
    final = read_image("o/f.0001.jpg").astype(int)
    assert final.shape == (HEIGHT, WIDTH, 3)
    assert (final[:2] > 245).all()
    assert abs(final[15, 12] - RED[:3]).max() < 12


def test_a_figure_without_any_limb_colour_and_a_lost_alpha_are_refused(shot, capsys):
    write_image(shot.parent / "l.0002.png", np.zeros((HEIGHT, WIDTH, 3), np.uint8))
    write_image(shot.parent / "d.0003.png", draw(3)[0][..., :3])
    assert run("composite", shot, "--keep-going") == 1
    lines = sorted(capsys.readouterr().err.splitlines())
    assert "frame 2: " in lines[0]
    assert "no limb is marked" in lines[0]
    assert "frame 3: " in lines[1]
    assert "alpha" in lines[1]
    assert finals(shot) == ["f.0001.png", "f.0004.png"]


def test_a_picture_beauty_needs_a_depth_pass(shot, monkeypatch, capsys):
    monkeypatch.chdir(shot.parent)
    for frame in (1, 2, 3, 4):
        beauty = np.rint(bar()[""] * 255).astype(np.uint8)
        write_image(f"b.{frame:04d}.png", beauty)
    assert run("composite", shot, "--beauty", "b.####.png", "--output", "o/f.####.png") == 2
    assert "passes.depth" in capsys.readouterr().err
    assert run("composite", shot) == 0
    assert run("composite", shot, "--beauty", "b.####.png", "--depth", "p.####.exr", "--output", "o/f.####.png") == 0
    assert np.array_equal(read_image("o/f.0002.png"), read_image("final/f.0002.png"))


def test_frames_in_work_are_finished_and_counted_when_one_fails(shot, capsys):
    (shot.parent / "d.0001.png").write_bytes(b"")
    assert run("composite", shot, "--jobs", 2) == 1
    out = capsys.readouterr().out
    made = len(finals(shot))
    assert f"{made} frame{'' if made == 1 else 's'} made, 1 failed" in out
