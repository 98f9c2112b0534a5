import csv

import numpy as np
import pytest

from pegbar.cli.main import main
from pegbar.report import jain2010_figure9
from pegbar.report.clips import find_clip, moving_markers, read_clips
from pegbar.report.foot_contact import level, measure, table
from pegbar.report.jain2010 import SOURCES, TRUTH, Result, figure9
from pegbar.scene.body import MARKERS
from pegbar.scene.contacts import ankle_heights, foot_contacts


@pytest.fixture(scope="module")
def motions(test_data):
    return read_clips(test_data, (TRUTH, *(source.clip for source in SOURCES)))


def test_figure_9_comes_out_in_the_papers_order(motions):
    result = figure9(motions, registered=False)
    side = {source.clip: result.mean("side", source.clip) for source in SOURCES}
    assert min(side, key=side.get) == "35_01"
    assert max(side, key=side.get) == "127_32"
    assert max(side[clip] for clip in ("35_17", "09_01", "16_05")) < 1.5 * min(side[c] for c in ("35_17", "16_05"))
    assert max(side[clip] for clip in ("35_17", "09_01", "16_05")) < side["16_11"]
    assert 1.7 < result.mean("side, whole", "16_11") / result.mean("side, whole", "35_01") < 2.6
    for source in SOURCES:
        assert 0.4 < side[source.clip] / source.slow < 1.6
        assert result.errors["side"][source.clip].shape == (79,)
    # The curve turns away: its error is larger in the second half.
    curve = result.errors["side"]["16_11"]
    assert curve[40:].mean() > 1.5 * curve[:40].mean()


def test_depth_of_the_walk_itself_is_without_error(motions):
    same = dict.fromkeys(motions, motions[TRUTH])
    result = figure9(same, registered=False)
    assert result.mean("three-quarter", "35_01") < 1e-12


def test_files_and_table(motions, tmp_path, monkeypatch, test_data):
    random = np.random.default_rng(0)
    ways = ("side", "side, whole", "side, registered", "three-quarter")
    made = Result({way: {s.clip: random.uniform(0, 0.1, 5) for s in SOURCES} for way in ways}, 30.0)
    monkeypatch.setattr(jain2010_figure9, "figure9", lambda _: made)
    lines = jain2010_figure9.reproduce(test_data, tmp_path / "new" / "folder")
    text = "\n".join(lines)
    assert "ducks" in text
    assert "happy walk" in text
    assert f"{made.mean('side', '16_05'):.3f}" in text
    with (tmp_path / "new/folder/jain2010-fig9.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["clip"] for row in rows] == [source.clip for source in SOURCES]
    assert float(rows[2]["side, whole (m)"]) == pytest.approx(made.mean("side, whole", "35_17"), abs=1e-5)
    with (tmp_path / "new/folder/jain2010-fig9-frames.csv").open() as file:
        frames = list(csv.reader(file))
    assert len(frames) == 1 + 4 * 5
    assert frames[2][:3] == ["side", "1", "0.0333"]
    assert (tmp_path / "new/folder/jain2010-fig9.png").read_bytes()[:4] == b"\x89PNG"


def test_what_is_missing_is_named(tmp_path, capsys):
    assert main(["reproduce", "jain2010-fig9", "--data", str(tmp_path / "no")]) == 2
    assert "no: no such folder" in capsys.readouterr().err
    (tmp_path / "cmu_07_01.bvh").write_text("")
    assert main(["reproduce", "jain2010-fig9", "--data", str(tmp_path)]) == 2
    assert "lacks the CMU clip 35_01 (cmu_35_01.bvh, 35_01.bvh or 35_01.amc)" in capsys.readouterr().err
    assert main(["reproduce", "fig9", "--data", str(tmp_path)]) == 2
    assert "jain2010-fig9 or foot-contact, got fig9" in capsys.readouterr().err


def test_clips_are_found_in_folders_bvh_before_amc(tmp_path):
    (tmp_path / "b").mkdir()
    for name in ("b/07_01.bvh", "07_01.amc", "35_01.amc"):
        (tmp_path / name).touch()
    assert find_clip(tmp_path, "07_01") == tmp_path / "b/07_01.bvh"
    assert find_clip(tmp_path, "35_01") == tmp_path / "35_01.amc"


def test_the_floor_mends_the_feet_of_a_walk_seen_from_above(motions):
    chosen = {clip: motions[clip] for clip in ("35_01", "17_03")}
    every = measure(chosen, registered=False)
    cases = [case for case in every if case.elevation == 30]
    assert [(case.truth, case.source) for case in cases] == [("35_01", "17_03")] * 2
    for case in cases:
        assert case.feet[1] < 0.95 * case.feet[0]
    assert len(table(every)) == 6


def test_level_floors(motions):
    points = level(moving_markers(motions["07_01"], 5))
    standing = foot_contacts(points, MARKERS, 24.0)
    assert standing.mean() > 0.3
    np.testing.assert_allclose(ankle_heights(points, MARKERS, standing), 0.08, atol=0.01)
