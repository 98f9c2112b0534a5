import csv

import numpy as np
import pytest

from pegbar import read_motion
from pegbar.cli.main import main
from pegbar.report import jain2009, jain2009_table1
from pegbar.report.jain2009 import LIMBS, MARKERS, PAIRS, WAYS, lift_walk, limb_lengths, walk_poses

CLOSED, FREE, GIVEN = WAYS


@pytest.fixture(scope="module")
def walks(test_data):
    clips = sorted({clip for pair in PAIRS for clip in pair})
    return {clip: walk_poses(read_motion(test_data / f"mocap/bvh/cmu_{clip}.bvh", unit="cmu")) for clip in clips}


@pytest.fixture(scope="module")
def lifted(walks):
    return [lift_walk(walks[truth], walks[clip], (45, 15)) for truth, clip in PAIRS]


def test_the_protocols_figures(walks, lifted):
    assert [len(walks[clip]) for clip in ("07_01", "35_01", "02_01")] == [79, 90, 86]
    assert [round(one.clip_error(), 4) for one in lifted] == [0.0817, 0.0705, 0.0761]
    assert [round(one.error(CLOSED), 4) for one in lifted] == [0.0526, 0.0492, 0.0519]


def test_the_closed_form_beats_the_clip_as_printed(walks, lifted):
    assert max(one.ratio(CLOSED) for one in lifted) <= 0.73
    for offset in ((10, 0), (-10, 0), (0, 10), (0, -10)):
        off = [lift_walk(walks[truth], walks[clip], (45, 15), offset=offset) for truth, clip in PAIRS]
        assert max(one.ratio(CLOSED) for one in off) < 0.8
        assert max(one.ratio(FREE) for one in off) < 0.75


def test_rigid_limbs_beat_the_closed_form(lifted):
    assert np.mean([one.ratio(FREE) for one in lifted]) <= 0.3
    assert np.mean([one.ratio(GIVEN) for one in lifted]) <= 0.15
    assert np.mean([one.ratio(FREE, slice(None)) for one in lifted]) <= 0.4
    for one in lifted:
        np.testing.assert_allclose(
            limb_lengths(one.ways[GIVEN]), np.tile(limb_lengths(one.truth)[0], (len(one.clip), 1)), atol=1e-3
        )


@pytest.mark.parametrize(("angles", "noise", "most"), [((90, 10), 0, 0.4), ((45, 15), 1, 0.55), ((45, 15), 5, 0.75)])
def test_other_views_and_noisy_marks(walks, angles, noise, most):
    cases = [lift_walk(walks[truth], walks[clip], angles, noise=noise) for truth, clip in PAIRS]
    assert np.mean([one.ratio(FREE) for one in cases]) <= most
    assert np.mean([one.ratio(GIVEN) for one in cases]) <= most


def test_knees_that_would_break_tell_the_legs_apart_from_the_front(walks):
    cases = [lift_walk(walks[truth], walks[clip], (0, 10), noise=1) for truth, clip in PAIRS]
    # Without them 0.63: the clip is on the other foot, and from the front both swing alike.
    assert np.mean([one.ratio(FREE, slice(None)) for one in cases]) <= 0.55


def test_poses_are_root_relative_and_face_along_z(walks):
    for poses in walks.values():
        assert not poses[:, 0].any()
        across = (poses[:, MARKERS.index("LeftUpLeg")] - poses[:, MARKERS.index("RightUpLeg")]).mean(axis=0)
        assert across[0] > 0.1
        assert abs(across[2]) < 1e-12
    assert LIMBS.shape == (18, 2)
    assert set(LIMBS[:, 1]) == set(range(1, 19))


def test_the_command_writes_tables_and_a_plot(test_data, tmp_path, monkeypatch, capsys):
    for module in (jain2009, jain2009_table1):
        monkeypatch.setattr(module, "VIEWS", {"side": (90.0, 10.0)})
        monkeypatch.setattr(module, "NOISES", (1,))
        monkeypatch.setattr(module, "OFFSETS", ((0, 0), (5, 0), (0, 10)))
    assert main(["reproduce", "jain2009-table1", "--data", str(test_data), "-o", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    assert "0.73 (0.0045)" in printed
    assert "(0.73): yes (0.64, 0.70, 0.68)" in printed
    assert "10 degrees off: yes" in printed
    assert "one cycle of 07_01 with its next: clip 0.0050 m, lifted 0.0037 m" in printed
    with (tmp_path / "jain2009-table1.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert len(rows) == 1 + 9
    assert [float(cell) for cell in rows[1][4:7]] == pytest.approx([0.0817, 0.0526, 0.643], abs=5e-4)
    assert (tmp_path / "jain2009-table1-views.csv").read_text().count("\n") == 4
    assert (tmp_path / "jain2009-table1.png").read_bytes()[1:4] == b"PNG"


def test_missing_clips_are_named(tmp_path, capsys):
    assert main(["reproduce", "jain2009-table1", "--data", str(tmp_path)]) == 2
    assert "lacks the CMU clip 02_01" in capsys.readouterr().err
    assert main(["reproduce", "jain2009-table1", "--data", str(tmp_path / "none")]) == 2
    assert "none" in capsys.readouterr().err
