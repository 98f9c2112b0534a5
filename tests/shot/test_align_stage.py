import dataclasses
import json
import shutil

import numpy as np
import pytest

from pegbar import read_annotations, write_annotations
from pegbar.cli.main import main
from pegbar.errors import FormatError, ShotError
from pegbar.io.alignment import read_alignment
from pegbar.io.frames import read_image, write_image
from pegbar.sample.shot import write_sample
from pegbar.shot.align_stage import AlignStage
from pegbar.shot.drawn import check_drawing
from pegbar.shot.plan import open_shot
from tests.pages import complaints


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The sample shot, 16 small frames, aligned with its own clip; annotations without cameras and depths."""
    folder = tmp_path_factory.mktemp("aligned")
    shot = write_sample(folder, size=(240, 136), frames=16, samples=1)
    marks = json.loads((folder / "annotation.json").read_text())
    for key in ("camera", "cameras", "depths"):
        marks.pop(key, None)
    for frame in marks["frames"]:
        for key in ("camera", "depths"):
            frame.pop(key, None)
    (folder / "annotation.json").write_text(json.dumps(marks))
    assert read_annotations(folder / "annotation.json").depths is None
    assert main(["align", str(shot)]) == 0
    return shot


def copy(shot, folder):
    """The shot for a test that changes it."""
    shutil.copytree(shot.parent, folder / "copy")
    return folder / "copy" / shot.name


def test_depth_order_of_the_limbs_is_the_truths(made):
    alignment = read_alignment(made.parent / "align" / "alignment.npz")
    truth = np.load(made.parent / "truth.npz")
    order = [truth["names"].tolist().index(name) for name in alignment.names]
    true = np.einsum("fi,fni->fn", truth["matrices"][:, 2, :3], truth["drawn"][:, order])
    apart = true[:, :, None] - true[:, None]
    found = alignment.depths[:, :, None] - alignment.depths[:, None]
    told = np.abs(apart) > 0.02
    assert (np.sign(apart) == np.sign(found))[told].mean() > 0.95


def test_results_stand_until_something_changes(made, capsys):
    stage = AlignStage(open_shot(made, aligned=False))
    before = {path: path.stat().st_mtime_ns for path in stage.outputs()}
    assert main(["align", str(made)]) == 0
    assert "up to date" in capsys.readouterr().out
    assert {path: path.stat().st_mtime_ns for path in stage.outputs()} == before
    assert stage.is_done()
    text = made.read_text()
    made.write_text(text + "\n[align]\nsmoothing = 2\n")
    assert not AlignStage(open_shot(made, aligned=False)).is_done()
    made.write_text(text)
    (stage.folder / "warp.png").unlink()
    assert not stage.is_done()
    assert main(["align", str(made)]) == 0


def test_aligned_marks_give_the_drawing_its_depth(made):
    shot = open_shot(made)
    assert shot.annotations is not None
    assert shot.annotations.depths is not None
    alignment = read_alignment(made.parent / "align" / "alignment.npz")
    np.testing.assert_allclose(shot.annotations.depths, alignment.depths, atol=1e-6)
    assert main(["depth", str(made), "--frames", "1-2"]) == 0
    assert open_shot(made, aligned=False).annotations.depths is None


def test_stale_marks_are_refused(made, tmp_path):
    path = made.parent / "annotation.json"
    text = path.read_text()
    marks = json.loads(text)
    marks["frames"][0]["xy"][0][0] += 1
    path.write_text(json.dumps(marks))
    try:
        with pytest.raises(ShotError, match="pegbar align again"):
            open_shot(made)
    finally:
        path.write_text(text)
    open_shot(made)


def test_use_decides(made):
    text = made.read_text()
    try:
        made.write_text(text + '\n[align]\nuse = "never"\n')
        assert open_shot(made).annotations.depths is None
        made.write_text(text + '\n[align]\nuse = "always"\noutput = "elsewhere"\n')
        with pytest.raises(ShotError, match="run pegbar align first"):
            open_shot(made)
    finally:
        made.write_text(text)


def test_a_shot_without_a_clip_says_what_to_do(made, capsys):
    text = made.read_text()
    try:
        made.write_text(text.replace('[clip]\npath = "clip.bvh"\n', ""))
        assert main(["align", str(made)]) == 2
        assert "[clip]" in capsys.readouterr().err
        made.write_text(text.replace("clip.bvh", "nothing.bvh"))
        assert main(["align", str(made)]) == 2
        assert "nothing.bvh" in capsys.readouterr().err
        made.write_text(text.replace('path = "clip.bvh"', "start = 3"))
        assert main(["align", str(made)]) == 2
        assert "want a path, or a folder" in capsys.readouterr().err
        made.write_text(text.replace('"clip.bvh"', '"clip.bvh"\nstart = 900'))
        assert main(["align", str(made)]) == 2
        assert "16 frames" in capsys.readouterr().err
    finally:
        made.write_text(text)


@pytest.mark.parametrize(
    ("lines", "problem"),
    [
        ("stop = 17", "clip.stop: the clip has 16 frames, from 0 to 15; got 17"),
        ("start = 16", "clip.start: the clip has 16 frames, from 0 to 15; got 16"),
        ("start = 3\nstop = 6\nazimuth = 0\nelevation = 0", "frames 3 to 5 are too few for 16 drawings"),
    ],
)
def test_parts_that_the_clip_does_not_have_are_said_by_their_keys(made, capsys, lines, problem):
    text = made.read_text()
    try:
        made.write_text(text.replace('"clip.bvh"', f'"clip.bvh"\n{lines}'))
        assert main(["align", str(made)]) == 2
        assert problem in capsys.readouterr().err
    finally:
        made.write_text(text)


def test_a_drawing_with_too_few_marks_is_named_with_its_joints(made, capsys):
    path = made.parent / "annotation.json"
    text = path.read_text()
    marks = json.loads(text)
    count = len(marks["markers"])
    marks["frames"][4]["visible"] = [True] * 3 + [False] * (count - 3)
    path.write_text(json.dumps(marks))
    try:
        assert main(["align", str(made), "--overwrite"]) == 2
        assert "drawing 5: too few visible marks (pelvis, chest, neck), want 4 or more" in capsys.readouterr().err
    finally:
        path.write_text(text)


def test_a_broken_alignment_is_named(tmp_path):
    (tmp_path / "a.npz").write_bytes(b"PK\x03\x04nonsense")
    with pytest.raises(FormatError, match=r"a\.npz"):
        read_alignment(tmp_path / "a.npz")
    np.savez(tmp_path / "b.npz", names=["x"])
    with pytest.raises(FormatError, match=r"b\.npz"):
        read_alignment(tmp_path / "b.npz")


def test_the_report_has_a_section_for_each_stage_that_has_run(made, capsys):
    page = made.parent / "pages" / "report.html"
    assert main(["report", str(made), "-o", str(page)]) == 0
    text = page.read_text(encoding="utf-8")
    assert "in " in capsys.readouterr().out
    titles = ("The shot", "Alignment", "Lift", "Secondary motion")
    assert [title for title in titles if f"<h2>{title}</h2>" in text] == ["The shot", "Alignment"]
    assert text.count("data:image/png;base64,") in (3, 4)  # 4 after a test has made a depth picture
    assert "Out of date" not in text
    assert complaints(page) == []
    # Whoever gets the page learns nothing of this machine's folders, and what is good.
    assert str(made.parent) not in page.read_text()
    assert "good: up to 10% of the height" in page.read_text()
    settings = made.read_text()
    made.write_text(settings + "\n[align]\nsmoothing = 3\n")
    assert main(["report", str(made), "-o", str(page)]) == 0
    assert "Out of date" in page.read_text(encoding="utf-8")
    made.write_text(settings)


def test_a_clip_without_the_drawn_poses_is_warned_of_however_long_its_limbs(made, test_data, capsys):
    settings = made.read_text()
    try:
        other = test_data / "mocap/bvh/ad_fair1_jumping.bvh"
        made.write_text(
            settings.replace('path = "clip.bvh"', f'path = "{other.as_posix()}"') + '\n[align]\noutput = "o"\n'
        )
        main(["align", str(made)])
        assert "warning: the clip does not fit: the limbs of ad_fair1_jumping.bvh are" in capsys.readouterr().err
    finally:
        made.write_text(settings)


def test_check_tells_of_the_cameras_error(made, capsys, monkeypatch):
    command = ["check", str(made), "--jobs", "1"]
    assert main(command) == 0, capsys.readouterr().err
    found = read_alignment(made.parent / "align" / "alignment.npz")

    def told(errors):
        changed = dataclasses.replace(found, errors=np.array(errors, float))
        monkeypatch.setattr("pegbar.shot.check_sections.read_alignment", lambda _: changed)
        assert main(command) == 1
        return capsys.readouterr().err.splitlines()

    (line,) = told([1.0] * 6 + [60.0] + [1.0] * 9)
    assert "drawing.annotations: drawing 7: camera error 60 px, " in line
    assert "-> look at its marks" in line
    (line,) = told([50.0] * 16)
    assert "clip: camera error 50 px" in line
    assert "does not fit -> another clip" in line
    text = made.read_text()
    made.write_text(text + "\n[align]\nsmoothing = 2\n")
    try:
        assert main(command) == 0
        told = capsys.readouterr()
        assert "align: " in told.err
        assert "out of date: marks, clip, settings" in told.err
        assert told.err.rstrip().endswith("-> pegbar align")
        assert "no problems" in told.out
    finally:
        made.write_text(text)


def test_a_clip_that_is_not_there_is_named_with_key_and_line(made, capsys):
    text = made.read_text()
    made.write_text(text.replace('path = "clip.bvh"', 'path = "clap.bvh"'))
    try:
        assert main(["align", str(made)]) == 2
        number = made.read_text().splitlines().index('path = "clap.bvh"') + 1
        assert f"{made}:{number}: clip.path: " in (line := capsys.readouterr().err)
        assert "clap.bvh: no such file" in line
    finally:
        made.write_text(text)


def test_what_align_told_is_not_told_again_by_what_builds_on_it(made, tmp_path, capsys):
    made = copy(made, tmp_path)
    assert main(["align", str(made), "--overwrite"]) == 0
    told = capsys.readouterr().err.splitlines()
    assert any(line.startswith("pegbar: note: ") for line in told)
    assert main(["align", str(made)]) == 0
    assert capsys.readouterr().err.splitlines() == told
    for command in ("lift", "export"):
        assert main([command, str(made)]) == 0
        again = capsys.readouterr().err.splitlines()
        assert not set(told) & set(again), command
    # Where it is aligned on the way, it is told.
    (made.parent / "align/alignment.npz").unlink()
    assert main(["lift", str(made)]) == 0
    assert set(told) <= set(capsys.readouterr().err.splitlines())


def test_a_note_on_the_clip_names_its_file(made, tmp_path, test_data, capsys):
    shot = copy(made, tmp_path)
    # An AMC file says no frame rate.
    clip = test_data / "mocap/asfamc/16_11.amc"
    shot.write_text(shot.read_text().replace('path = "clip.bvh"', f"path = {json.dumps(str(clip))}"))
    main(["align", str(shot)])
    assert "pegbar: note: 16_11.amc: it says no frame rate: 120 frames a second assumed\n" in capsys.readouterr().err


@pytest.mark.parametrize("source", ["shot.size", "as the joint marks say"])
def test_drawings_of_another_size_are_named_and_not_their_labels(made, tmp_path, capsys, source):
    shot = copy(made, tmp_path)
    text = shot.read_text()
    shot.write_text(text if source == "shot.size" else text.replace("\nsize = [240, 136]\n", "\n"))
    for number in (5, 7):
        path = shot.parent / f"drawings/dancer.{number:04d}.png"
        write_image(path, np.pad(read_image(path), ((0, 0), (0, 20), (0, 0))))
    told = [
        f"pegbar: {shot.parent / f'drawings/dancer.000{number}.png'}: want 240 x 136 pixels ({source}), got 260 x 136"
        for number in (5, 7)
    ]
    for command in ("align", "secondary", "lift"):
        assert main([command, str(shot)]) == 2
        assert capsys.readouterr().err.splitlines() == told, command
    # What has no header to be read beforehand is refused when it is read.
    opened = open_shot(shot, aligned=False)
    with pytest.raises(ShotError, match=r"dancer.0001.png: want 240 x 136 pixels .*, got 136 x 240"):
        check_drawing(opened, 1, np.zeros((240, 136, 3), np.uint8))
    check_drawing(opened, 1, np.zeros((136, 240, 3), np.uint8))


@pytest.mark.parametrize("clip", ["clip", "no clip"])
def test_a_misspelt_marker_is_blamed_on_the_annotations_not_on_the_clip(made, tmp_path, capsys, clip):
    shot = copy(made, tmp_path)
    marks = shot.parent / "annotation.json"
    marks.write_text(marks.read_text().replace('"left_elbow"', '"left_elbwo"'))
    said = "annotation.json: no marker is called 'left_elbwo' (did you mean 'left_elbow'?)"
    if clip == "no clip":
        text = shot.read_text()
        shot.write_text(text[: text.index("[clip]")])
    assert main(["check", str(shot), "--jobs", "1"]) == 1
    told = capsys.readouterr().err
    assert f": drawing.annotations: {said} -> " in told
    assert "no joint for" not in told
    assert main(["match", str(marks), str(shot.parent)]) == 2
    assert capsys.readouterr().err == f"pegbar: {marks.parent}/{said}\n"
    if clip == "clip":
        assert main(["align", str(shot)]) == 2
        assert capsys.readouterr().err == f"pegbar: {said}\n"


def test_so_many_misspelt_markers_that_nothing_can_be_compared(made, tmp_path, capsys):
    shot = copy(made, tmp_path)
    marks = shot.parent / "annotation.json"
    marks.write_text(marks.read_text().replace('"left_', '"let_').replace('"right_', '"rihgt_'))
    assert main(["align", str(shot)]) == 2
    assert "annotation.json: no marker is called 'let_shoulder' (did you mean 'left_shoulder'?)" in (
        capsys.readouterr().err
    )


def test_marks_outside_the_picture_are_warned_of(made, tmp_path, capsys):
    folder = tmp_path / "shot"
    shutil.copytree(made.parent, folder, ignore=shutil.ignore_patterns("align"))
    marks = read_annotations(folder / "annotation.json")
    place = marks.names.index("left_hand")
    marks.visible[[2, 3, 5], place] = True
    marks.markers[[2, 3, 5], place] = (-20, 60)
    write_annotations(folder / "annotation.json", marks)
    assert main(["align", str(folder / made.name)]) == 0
    warnings = [line for line in capsys.readouterr().err.splitlines() if "warning: left_hand is marked outside" in line]
    assert len(warnings) == 1
    assert "240 x 136 picture in drawings 3-4, 6" in warnings[0]


def test_what_a_killed_run_has_half_written_is_not_up_to_date(made, monkeypatch):
    """A run with other settings leaves some of its files: back at the first settings all are made again."""

    def killed(*_):
        raise KeyboardInterrupt

    stage = AlignStage(open_shot(made, aligned=False), overwrite=True)
    monkeypatch.setattr(AlignStage, "_write", killed)
    with pytest.raises(KeyboardInterrupt):
        stage.run()
    assert all(path.is_file() for path in stage.outputs())
    assert not AlignStage(open_shot(made, aligned=False)).is_done()
    monkeypatch.undo()
    assert main(["align", str(made)]) == 0
    assert AlignStage(open_shot(made, aligned=False)).is_done()
