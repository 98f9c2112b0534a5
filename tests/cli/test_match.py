import json
import shutil

import cv2
import numpy as np
import pytest

from pegbar import write_annotations
from pegbar.cli.main import main
from pegbar.io.bvh import write_bvh
from pegbar.sample.dancer import dance
from pegbar.scene.body import MARKERS
from pegbar.scene.drawing import Drawing
from pegbar.shot.load import load_shot
from tests.dancers import RATE, dance_clip, drawn

SHOT = """\
# My shot.
[shot]
frame_rate = 24   # film

[drawing]
frames = "d.####.png"  # on ones
"""


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def clips(tmp_path):
    folder = tmp_path / "clips"
    folder.mkdir()
    motion = dance(240).clip
    object.__setattr__(motion, "frame_rate", 120.0)
    write_bvh(folder / "dance.bvh", motion)
    return folder


def annotate(path, marks, **options):
    pictures = options.pop("pictures", False)
    images = ()
    if pictures:
        images = tuple(path.parent / f"d.{number:04d}.png" for number in range(1, len(marks) + 1))
        for image in images:
            cv2.imwrite(str(image), np.full((480, 640, 3), 240, np.uint8))
    visible = np.ones(marks.shape[:2], bool)
    given = {"frame_rate": RATE, "images": images, **options}
    write_annotations(path, Drawing(MARKERS, marks, visible, (640, 480), **given))
    return path


def run(capsys, *words):
    code = main(["match", *map(str, words)])
    said = capsys.readouterr()
    return code, said.out, said.err


def test_the_clip_is_found_shown_and_written_into_the_shot(tmp_path, clips, capsys):
    marks = annotate(tmp_path / "a.json", drawn(dance_clip(), 40, 30, 60), pictures=True)
    shot = tmp_path / "shot.toml"
    shot.write_text(SHOT)
    code, out, err = run(capsys, marks, clips, "-o", tmp_path / "out", "--write", shot)
    assert (code, err) == (0, "")
    assert "dance.bvh" in out
    assert "dance.bvh fits best" in out
    written = load_shot(shot).clip
    assert written.path == "clips/dance.bvh"
    assert (written.start, written.stop) == (pytest.approx(40, abs=2), pytest.approx(186, abs=2))
    assert written.azimuth == pytest.approx(60, abs=2)
    assert shot.read_text().startswith(SHOT)
    sheet = cv2.imread(str(tmp_path / "out" / "match.png"))
    assert sheet.shape[1] == 300 + 6 * 220
    for blue_green_red in ((200, 100, 40), (40, 84, 214), (176, 176, 176), (240, 240, 240)):
        assert (sheet == blue_green_red).all(axis=2).sum() > 100


def test_without_a_shot_file_the_section_is_printed(tmp_path, clips, capsys):
    marks = annotate(tmp_path / "a.json", drawn(dance_clip(), 40, 30, 60))
    code, out, _ = run(capsys, marks, clips, "--top", 1)
    assert code == 0
    assert '[clip]\npath = "clips/dance.bvh"\nstart = ' in out
    assert not (tmp_path / "match.png").exists()


def test_nothing_fits_is_said_and_the_shot_file_left_alone(tmp_path, clips, capsys):
    scribble = np.random.default_rng(0).uniform(0, 400, (24, 16, 2))
    marks = annotate(tmp_path / "a.json", scribble)
    (tmp_path / "shot.toml").write_text(SHOT)
    code, out, _ = run(capsys, marks, clips, "--write", "shot.toml")
    assert code == 0
    assert "Nothing fits: the nearest clip is" in out
    assert "[clip]" not in out
    assert (tmp_path / "shot.toml").read_text() == SHOT


def test_exchanged_sides_are_said(tmp_path, clips, capsys):
    from pegbar.align.marks import EXCHANGED

    marks = annotate(tmp_path / "a.json", drawn(dance_clip(), 40, 30, 60, 10)[:, EXCHANGED])
    _, out, _ = run(capsys, marks, clips)
    assert "Left and right seem to be exchanged in the drawing, or it is the clip's mirror image" in out
    assert "swapped = true" in out


def test_broken_clips_are_named_and_skipped(tmp_path, clips, capsys):
    (clips / "bad.bvh").write_text("HIERARCHY\nROOT Hips\n{\n")
    marks = annotate(tmp_path / "a.json", drawn(dance_clip(), 40, 30, 60))
    code, out, err = run(capsys, marks, clips)
    assert code == 0
    assert "warning: bad.bvh cannot be read" in err
    assert "dance.bvh fits best" in out
    (clips / "dance.bvh").unlink()
    code, _, err = run(capsys, marks, clips)
    assert code == 1
    assert "no clip that can be used" in err


def test_some_of_the_drawings_holds_and_one_drawing(tmp_path, clips, capsys):
    marks = annotate(tmp_path / "a.json", drawn(dance_clip(), 40, 40, 60)[::2], holds=(2,) * 20)
    code, out, _ = run(capsys, marks, clips, "--frames", "6-20")
    assert code == 0
    assert "start = 8" in out or "start = 9" in out
    code, out, _ = run(capsys, marks, clips, "--frames", "6")
    assert (code, "dance.bvh fits best" in out) == (0, True)
    code, _, err = run(capsys, marks, clips, "--frames", "6-21")
    assert code == 2
    assert "there is no drawing 21" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("missing.json", "clips"), "missing.json: no such file"),
        (("a.json", "nowhere"), "nowhere: no such folder"),
        (("a.json", "empty"), "no .bvh, .amc, .c3d file"),
        (("few.json", "clips"), "names: want marks of at least 4 limbs"),
        (("a.json", "clips", "--top", "0"), "top: want values"),
        (("a.json", "clips", "--write", "none.toml"), "none.toml"),
    ],
)
def test_wrong_use_is_one_line_and_exit_code_2(tmp_path, clips, capsys, words, said):
    annotate(tmp_path / "a.json", drawn(dance_clip(), 40, 10, 60))
    (tmp_path / "empty").mkdir()
    few = {"markers": ["head"], "image_size": [9, 9], "frames": [{"xy": [[4, 5]]}]}
    (tmp_path / "few.json").write_text(json.dumps(few))
    code, _, err = run(capsys, *words)
    assert code == 2
    assert said in err
    assert err.count("\n") == 1


def test_what_cannot_be_written_or_used_is_said_before_the_search(tmp_path, clips, capsys, monkeypatch):
    marks = annotate(tmp_path / "a.json", drawn(dance_clip(), 40, 30, 60))
    monkeypatch.setattr("pegbar.io.clip_folder.read_clips", lambda *_, **__: pytest.fail("searched"))
    code, _, err = run(capsys, marks, clips, "--write", tmp_path / "none.toml")
    assert code == 2
    assert "none.toml" in err
    code, _, err = run(capsys, marks, clips, "--frame-rate", "0")
    assert (code, err) == (2, "pegbar: --frame-rate: want frames a second above 0, got 0.0\n")


def test_the_second_search_reads_no_clip(tmp_path, clips, capsys, monkeypatch):
    marks = annotate(tmp_path / "a.json", drawn(dance_clip(), 40, 30, 60))
    _, first, _ = run(capsys, marks, clips)
    monkeypatch.setattr("pegbar.io.clip_folder._read", lambda *_: pytest.fail("read again"))
    assert run(capsys, marks, clips)[1] == first
    shutil.rmtree(clips / "none", ignore_errors=True)
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    assert run(capsys, marks, clips, "--no-index")[1] == first


def test_a_picture_that_is_missing_leaves_the_sheet_with_the_marks(tmp_path, clips, capsys):
    marks = annotate(tmp_path / "a.json", drawn(dance_clip(), 40, 12, 60), pictures=True)
    for path in tmp_path.glob("d.*.png"):
        path.unlink()
    code, _, err = run(capsys, marks, clips, "-o", "out")
    assert code == 0
    # Once, however many there are.
    first = f"{tmp_path / 'd.0001.png'}: no such file or directory (and so 5 more)"
    assert err == f"pegbar: warning: {first}: the sheet shows these marks without pictures\n"
    assert (tmp_path / "out" / "match.png").stat().st_size > 0


def test_marks_from_another_folder_are_shown_on_the_shots_drawings(tmp_path, clips, capsys):
    marks = annotate(tmp_path / "a.json", drawn(dance_clip(), 40, 12, 60), pictures=True)
    marks.write_text(marks.read_text().replace('"d.0', '"../gone/d.0'))
    shot = tmp_path / "shot.toml"
    shot.write_text(SHOT)
    code, _, err = run(capsys, marks, clips, "-o", "out", "--write", shot)
    assert (code, err) == (0, "")
    # The drawings' light grey.
    assert (cv2.imread(str(tmp_path / "out" / "match.png")) == 240).all(axis=2).sum() > 10_000


def test_drawings_are_counted_as_their_files_are(tmp_path, clips, capsys):
    files = tuple(tmp_path / f"d.{number:04d}.png" for number in range(100, 120))
    marks = annotate(tmp_path / "a.json", drawn(dance_clip(), 40, 20, 60), images=files)
    assert run(capsys, marks, clips, "--frames", "100-119")[0] == 0
    code, _, err = run(capsys, marks, clips, "--frames", "1-20")
    assert (code, err) == (2, "pegbar: --frames: there is no drawing 1-20 (there are 100-119)\n")


def test_the_frame_rate_that_was_found_is_told_and_written(tmp_path, clips, capsys):
    # 24 drawings a second of a clip of 120 frames: every fifth.
    shot = tmp_path / "shot.toml"
    marks = annotate(tmp_path / "a.json", drawn(dance_clip(), 40, 30, 60), frame_rate=None)
    found = (
        "No frame rate is given: 8, 12 and 24 frames a second were tried; 24 is nearest to the clip's own pace "
        "(or say --frame-rate).\n"
    )
    _, out, _ = run(capsys, marks, clips)
    assert found in out
    assert "[shot]\nframe_rate = 24\n\n[clip]\n" in out
    shot.write_text(SHOT.replace("frame_rate", "# frame_rate").replace("= 24", "= 12"))
    _, out, _ = run(capsys, marks, clips, "--write", shot)
    assert found in out
    assert f"match: wrote [clip] and frame_rate = 24 to {shot}" in out
    assert load_shot(shot).shot.frame_rate == 24
    # What the shot file says now is not looked for any more.
    _, out, _ = run(capsys, marks, clips, "--write", shot)
    assert f"24 frames a second ({shot}).\n" in out
    assert f"match: wrote [clip] to {shot}" in out


def test_the_frame_rate_that_is_given_is_told_and_written(tmp_path, clips, capsys):
    shot = tmp_path / "shot.toml"
    shot.write_text(SHOT)
    marks = annotate(tmp_path / "a.json", drawn(dance_clip(), 40, 30, 60))
    _, out, _ = run(capsys, marks, clips, "--write", shot)
    assert f"{RATE:g} frames a second (as marked).\n" in out
    _, out, _ = run(capsys, marks, clips, "--frame-rate", "20", "--write", shot)
    assert "20 frames a second (--frame-rate).\n" in out
    assert "and frame_rate = 20 to" in out
    assert load_shot(shot).shot.frame_rate == 20


def test_drawings_on_twos_take_twice_as_long_as_the_shot_file_says(tmp_path, clips, capsys):
    shot = tmp_path / "shot.toml"
    shot.write_text(SHOT + "hold = 2\n")
    marks = annotate(tmp_path / "a.json", drawn(dance_clip(), 40, 40, 60)[::2], frame_rate=None)
    _, out, _ = run(capsys, marks, clips, "--write", shot)
    assert f"24 frames a second ({shot}), drawings held for 2 frames.\n" in out
    clip = load_shot(shot).clip
    assert (clip.start, clip.stop) == (pytest.approx(40, abs=2), pytest.approx(40 + 39 * 5, abs=7))
