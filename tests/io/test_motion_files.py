"""All formats: every clip's count of frames, how files are told apart, and damaged files."""

import csv
import shutil

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import FormatError
from pegbar.io.frames import write_image
from pegbar.io.recording_file import read_recording
from tests.io.c3d_files import make_c3d
from tests.io.damage import check, cuts, flips, outcome, seeded, spoiled_words, swapped_pieces
from tests.io.test_acclaim import AMC, ASF
from tests.io.test_bvh_reader import SMALL

CLIPS = (
    "bvh/cmu_35_17.bvh",
    "bvh/ad_fair1_dab.bvh",
    "asfamc/127_14.amc",
    "asfamc/09_01.amc",
    "c3d/ktk_tennis_serve.c3d",
)


def small_c3d():
    table = np.arange(48.0).reshape(4, 3, 4)
    return make_c3d(table, list("ABC"))


def test_every_clip_has_the_frames_of_the_index(test_data):
    with open(test_data / "INDEX.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["file"].startswith("mocap/") and row["frames"]]
    assert len(rows) == 31
    for row in rows:
        clip = read_recording(test_data / row["file"])
        assert len(clip.positions) == int(row["frames"]), row["file"]
        joints = [name for name in clip.names if not name.endswith("_end")]
        assert len(joints) == int(row["joints"]) or row["file"].endswith("pycgm_movement_trial.c3d")
        if clip.frame_rate is not None:
            assert clip.frame_rate == pytest.approx(float(row["fps"]), abs=1e-3)
        assert clip.positions.shape == (*clip.rotations.shape[:2], 3)


@pytest.mark.parametrize(
    ("content", "suffix"), [(SMALL.encode(), ".bvh"), (small_c3d(), ".c3d"), (AMC.encode(), ".amc")]
)
def test_a_file_of_another_name_is_told_by_its_content(tmp_path, content, suffix):
    (tmp_path / "a.asf").write_text(ASF)
    plain, other = tmp_path / f"a{suffix}", tmp_path / "a.txt"
    for path in (plain, other, tmp_path / f"b{suffix.upper()}"):
        path.write_bytes(content)
        assert len(read_recording(path).positions) in (2, 4)
    with pytest.raises(FormatError, match=r"a\.asf.*skeleton without motion"):
        read_recording(tmp_path / "a.asf")
    if suffix != ".amc":
        with pytest.raises(ValueError, match="^skeleton: "):
            read_recording(plain, tmp_path / "a.asf")


def test_what_is_no_motion_file_is_refused(tmp_path):
    for name in ("a.txt", "a.bvh", "a.amc", "a.c3d"):
        (tmp_path / "a.asf").write_text(ASF)
        for data in (b"", b"\n", b"hello\n", b"\0\1\2" * 999, bytes(range(256)) * 99):
            result, _ = outcome(tmp_path / name, data)
            assert isinstance(result, FormatError), (name, data[:9])
    (tmp_path / "folder.c3d").mkdir()
    with pytest.raises(FormatError, match="folder"):
        read_recording(tmp_path / "folder.c3d")


def test_files_that_are_cut_are_refused(test_data, tmp_path):
    for name in CLIPS:
        data = (test_data / "mocap" / name).read_bytes()
        skeletons = sorted((test_data / "mocap" / "asfamc").glob(f"{name[7:].partition('_')[0]}.asf"))
        path = tmp_path / f"cut{name[-4:]}"
        assert not check(path, cuts(data), *skeletons), name


def test_skeletons_that_are_cut_are_refused(tmp_path):
    for length in range(len(ASF) - 1):
        (tmp_path / "a.asf").write_text(ASF[:length])
        result, _ = outcome(tmp_path / "a.amc", AMC.encode(), tmp_path / "a.asf")
        assert isinstance(result, FormatError), ASF[:length]


def test_real_files_that_are_damaged_are_read_whole_or_refused(test_data, tmp_path):
    for name in CLIPS:
        data = (test_data / "mocap" / name).read_bytes()
        skeletons = sorted((test_data / "mocap" / "asfamc").glob(f"{name[7:].partition('_')[0]}.asf"))
        frames = len(read_recording(test_data / "mocap" / name).positions)
        chance, path = seeded(name), tmp_path / f"a{name[-4:]}"
        for result in check(path, flips(data, chance, 60), *skeletons):
            assert len(result.positions) == frames, name
        if not name.endswith("c3d"):
            for result in check(path, spoiled_words(data, chance, 40), *skeletons):
                assert len(result.positions) == frames, name
        check(path, swapped_pieces(data, chance, 15), *skeletons)


@pytest.mark.parametrize("suffix", [".bvh", ".amc", ".asf", ".c3d"])
def test_small_files_that_are_damaged_never_crash(tmp_path, suffix):
    (tmp_path / "a.asf").write_text(ASF)
    data = {".bvh": SMALL.encode(), ".amc": AMC.encode(), ".asf": ASF.encode(), ".c3d": small_c3d()}[suffix]
    chance = seeded(suffix)
    for way in (flips, spoiled_words, swapped_pieces):
        for variant in way(data, chance, 150):
            if suffix == ".asf":
                (tmp_path / "b.asf").write_bytes(variant)
                check(tmp_path / "b.amc", [AMC.encode()], tmp_path / "b.asf")
            else:
                check(tmp_path / f"a{suffix}", [variant])


def test_any_bytes_are_refused_or_read(tmp_path):
    (tmp_path / "a.asf").write_text(ASF)
    heads = st.sampled_from(
        [b"", b"HIERARCHY\nROOT a {", b":FULLY-SPECIFIED\n1\n", small_c3d()[:520], ASF.encode()[:400]]
    )

    @given(heads, st.binary(max_size=200), st.sampled_from([".bvh", ".amc", ".c3d", ".x"]))
    def try_it(head, tail, suffix):
        check(tmp_path / f"a{suffix}", [head + tail])

    try_it()


def test_a_pipe_is_no_motion_file(tmp_path):
    os = pytest.importorskip("os")
    os.mkfifo(tmp_path / "a.bvh")
    with pytest.raises(FormatError, match="plain file"):
        read_recording(tmp_path / "a.bvh")


def test_names_with_odd_letters_are_paths_too(tmp_path, test_data):
    folder = tmp_path / "mit Leerzeichen [1] (_)"
    folder.mkdir()
    for name in ("09_01.amc", "09.asf"):
        shutil.copy(test_data / "mocap" / "asfamc" / name, folder / name.replace("09", "(+9"))
    assert len(read_recording(folder / "(+9_01.amc").positions) == 148


def test_a_picture_is_no_clip(tmp_path):
    write_image(tmp_path / "walk.png", np.random.default_rng(1).integers(0, 255, (40, 40, 3), np.uint8))
    with pytest.raises(FormatError, match="neither its name nor its content"):
        read_recording(tmp_path / "walk.png")
