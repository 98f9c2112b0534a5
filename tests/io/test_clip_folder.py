import os
import shutil
import time

import numpy as np
import pytest

from pegbar import Clip, FormatError, read_clips, read_motion
from pegbar.io import clip_folder, clip_index
from pegbar.io.bvh import write_bvh
from pegbar.sample.dancer import dance
from pegbar.scene.body import MARKERS
from pegbar.scene.clip import interpolate

WALK = "mocap/bvh/cmu_118_01_trim.bvh"


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def folder(tmp_path):
    root = tmp_path / "clips"
    (root / "below").mkdir(parents=True)
    write_bvh(root / "dance.bvh", dance(30).clip)
    write_bvh(root / "below" / "again.bvh", dance(24).clip)
    (root / "broken.bvh").write_text("HIERARCHY\nROOT Hips\n{\n")
    (root / "table.bvh").write_text(
        "HIERARCHY\nROOT Top { OFFSET 0 0 0 CHANNELS 3 Xposition Yposition Zposition\n End Site { OFFSET 0 1 0 } }\n"
        "MOTION\nFrames: 2\nFrame Time: 0.04\n0 100 0\n0 100 4\n"
    )
    (root / ".hidden.bvh").write_text("nothing")
    (root / "notes.txt").write_text("nothing")
    return root


def names(found):
    return [clip.name for clip in found.clips]


def test_clips_broken_files_and_what_is_no_person_are_told_apart(folder):
    found = read_clips(folder)
    assert names(found) == ["below/again.bvh", "dance.bvh"]
    assert list(found.broken) == ["broken.bvh"]
    assert "broken.bvh" in found.broken["broken.bvh"]
    assert found.skipped == {"table.bvh": "no left_shoulder and 11 more joints"}
    assert found.read == 4
    assert found.index == folder / ".pegbar-clips.index"


def test_the_index_gives_the_same_and_nothing_is_read_again(folder, monkeypatch):
    first = read_clips(folder)
    monkeypatch.setattr(clip_folder, "_read", lambda *_: pytest.fail("read again"))
    again = read_clips(folder)
    assert (again.read, again.broken, again.skipped, names(again)) == (0, first.broken, first.skipped, names(first))
    for a, b in zip(first.clips, again.clips, strict=True):
        np.testing.assert_array_equal(a.markers, b.markers)
        assert (a.rate, a.frame_rate, a.first, a.frames) == (b.rate, b.frame_rate, b.first, b.frames)


def test_only_what_changed_is_read_again(folder):
    read_clips(folder)
    write_bvh(folder / "dance.bvh", dance(36).clip)
    write_bvh(folder / "new.bvh", dance(20).clip)
    (folder / "below" / "again.bvh").unlink()
    found = read_clips(folder)
    assert (found.read, names(found)) == (2, ["dance.bvh", "new.bvh"])
    assert found.clips[0].frames == 36
    assert read_clips(folder).read == 0


def test_a_touched_file_with_the_same_contents_is_not_read_again(folder):
    read_clips(folder)
    later = time.time() + 100
    os.utime(folder / "dance.bvh", (later, later))
    before = (folder / clip_index.NAME).stat().st_mtime_ns
    assert read_clips(folder).read == 0
    assert (folder / clip_index.NAME).stat().st_mtime_ns != before
    # The index now knows the new time: the contents are not looked at again.
    (folder / "dance.bvh").chmod(0)
    assert read_clips(folder).read == 0


def test_a_file_of_the_same_size_and_another_content_is_read_again(folder):
    read_clips(folder)
    text = (folder / "dance.bvh").read_text()
    (folder / "dance.bvh").write_text(text.replace("Frame Time: 0.04166", "Frame Time: 0.04266"))
    os.utime(folder / "dance.bvh", (1e9, 1e9))
    found = read_clips(folder)
    assert found.read == 1
    assert found.clips[1].frame_rate < 23.5


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: b"",
        lambda data: data[:10],
        lambda data: data[: len(data) // 2],
        lambda data: data[:-1],
        lambda data: data + b"\0",
        lambda data: data + bytes(192),
        lambda data: data.replace(b'"frames"', b'"frumes"'),
        lambda data: data.replace(b"index 1", b"index 2"),
        lambda data: data[:-100] + bytes([data[-100] ^ 1]) + data[-99:],
        lambda data: data[:20] + b"\xff" * 8 + data[28:],
        lambda data: b"\x93NUMPY" + data,
    ],
)
def test_a_broken_index_is_made_anew(folder, damage):
    whole = read_clips(folder)
    place = folder / clip_index.NAME
    data = place.read_bytes()
    place.write_bytes(damage(data))
    found = read_clips(folder)
    assert (found.read, names(found)) == (4, names(whole))
    assert place.read_bytes() == data


def test_an_index_of_another_version_is_made_anew(folder, monkeypatch):
    read_clips(folder)
    monkeypatch.setattr(clip_index, "version", lambda _: "99")
    assert read_clips(folder).read == 4
    assert read_clips(folder).read == 0


def test_the_index_goes_to_the_cache_where_the_folder_cannot_be_written(folder, cache, monkeypatch):
    real = clip_index._write

    def write(place, entries):
        if place.parent == folder:
            raise PermissionError(13, "no", str(place))
        real(place, entries)

    monkeypatch.setattr(clip_index, "_write", write)
    found = read_clips(folder)
    assert found.index.parent == cache / "pegbar"
    assert read_clips(folder).read == 0
    assert read_clips(folder).index == found.index
    monkeypatch.setattr(clip_index, "_write", lambda *_: (_ for _ in ()).throw(OSError("full")))
    found.index.unlink()
    assert read_clips(folder).index is None
    assert not (folder / clip_index.NAME).exists()


def test_a_folder_marked_read_only_is_left_alone_by_anybody(folder, cache):
    folder.chmod(0o555)
    try:
        found = read_clips(folder)
        assert found.index.parent == cache / "pegbar"
        assert not (folder / clip_index.NAME).exists()
        assert read_clips(folder).read == 0
    finally:
        folder.chmod(0o755)


def test_without_an_index_nothing_is_written(folder):
    found = read_clips(folder, use_index=False)
    assert (found.read, found.index) == (4, None)
    assert not (folder / clip_index.NAME).exists()
    done = []
    read_clips(folder, use_index=False, progress=lambda *counts: done.append(counts))
    assert done == [(1, 4), (2, 4), (3, 4), (4, 4)]


def test_a_folder_that_is_none_or_empty_is_named(tmp_path):
    with pytest.raises(NotADirectoryError, match="nowhere"):
        read_clips(tmp_path / "nowhere")
    with pytest.raises(FileNotFoundError, match=r"no \.bvh, \.amc, \.c3d file"):
        read_clips(tmp_path)


def test_an_amc_is_read_again_when_a_skeleton_beside_it_changes(tmp_path, test_data):
    root = tmp_path / "clips"
    root.mkdir()
    for name in ("09_01.amc", "09.asf"):
        shutil.copy(test_data / "mocap/asfamc" / name, root / name)
    assert read_clips(root).read == 1
    assert read_clips(root).read == 0
    with open(root / "09.asf", "a") as file:
        file.write("\n# moved\n")
    assert read_clips(root).read == 1


def test_markers_are_those_of_the_motion_without_the_inserted_pose(test_data):
    motion = read_motion(test_data / "mocap/bvh/cmu_07_01.bvh")
    assert motion.rest_frame == 0
    clip = Clip.from_motion("walk", motion)
    assert (clip.first, clip.frames, clip.rate, len(clip.markers)) == (1, 317, 30, 79)
    truth = motion.markers(MARKERS)
    np.testing.assert_allclose(clip.at([1, 5, 301]), truth[[1, 5, 301]], atol=1e-5)
    between = np.arange(1.0, 310)
    # Straight lines between 30 frames a second cut corners where a foot lands.
    error = abs(clip.at(between) - truth[1:310])
    assert error.max() < 0.03
    assert error.mean() < 0.001
    np.testing.assert_allclose(clip.file_frames([0, 1, 2]), [1, 5, 9], atol=1e-3)


def test_gaps_are_bridged_up_to_a_quarter_second():
    motion = dance(48).clip
    object.__setattr__(motion, "positions", motion.positions.copy())
    hand = motion.names.index("left_hand")
    before = motion.positions[[9, 15], hand].copy()
    motion.positions[10:15, hand] = np.nan
    motion.positions[20:30, hand] = np.nan
    clip = Clip.from_motion("holes", motion, rate=24)
    place = MARKERS.index("left_hand")
    tips = motion.markers(["left_hand"])[:, 0]
    np.testing.assert_allclose(clip.markers[12, place], (tips[9] + tips[15]) / 2, atol=0.05)
    assert np.isfinite(before).all()
    assert np.isnan(clip.markers[20:30, place]).all()
    assert np.isfinite(clip.markers[:20, place]).all()
    assert np.isfinite(clip.markers[30:, place]).all()


def test_interpolation_holds_the_ends_and_leaves_missing_frames_missing():
    line = np.arange(4.0)[:, None, None] * np.ones((1, 1, 3))
    assert interpolate(line, [-1, 0.25, 3, 9])[:, 0, 0].tolist() == [0, 0.25, 3, 3]
    line[2] = np.nan
    assert np.isnan(interpolate(line, [1.5])).all()
    assert interpolate(line, [1.0, 3.0])[:, 0, 0].tolist() == [1, 3]
    assert interpolate(line[:1], [0.5])[0, 0, 0] == 0


def test_a_broken_file_is_a_format_error_elsewhere(folder):
    with pytest.raises(FormatError):
        read_motion(folder / "broken.bvh")
