"""Damaged motion files for minutes: every kind of damage to every real clip, and to small files thousands of times."""

import pytest

from pegbar.io.recording_file import read_recording
from tests.io.damage import check, cuts, flips, seeded, spoiled_words, swapped_pieces
from tests.io.test_acclaim import AMC, ASF
from tests.io.test_bvh_reader import SMALL
from tests.io.test_motion_files import small_c3d


def test_every_real_clip(test_data, tmp_path):
    for source in sorted((test_data / "mocap").glob("*/*.*")):
        if source.suffix == ".asf":
            continue
        data, path, chance = source.read_bytes(), tmp_path / f"a{source.suffix}", seeded(source.name)
        skeletons = [] if source.suffix != ".amc" else [read_skeleton_beside(source)]
        frames = len(read_recording(source).positions)
        assert not check(path, cuts(data), *skeletons), source
        for result in check(path, flips(data, chance, 300), *skeletons):
            assert len(result.positions) == frames, source
        if source.suffix != ".c3d":
            for result in check(path, spoiled_words(data, chance, 300), *skeletons):
                assert len(result.positions) == frames, source
        check(path, swapped_pieces(data, chance, 100), *skeletons)


def read_skeleton_beside(source):
    subject = source.stem.partition("_")[0]
    return min(source.parent.glob(f"{subject}*.asf"), key=lambda path: len(path.name))


@pytest.mark.parametrize("suffix", [".bvh", ".amc", ".asf", ".c3d"])
def test_small_files_many_times(tmp_path, suffix):
    (tmp_path / "a.asf").write_text(ASF)
    data = {".bvh": SMALL.encode(), ".amc": AMC.encode(), ".asf": ASF.encode(), ".c3d": small_c3d()}[suffix]
    chance = seeded(suffix)
    for way in (flips, spoiled_words, swapped_pieces):
        for variant in way(data, chance, 10_000):
            if suffix == ".asf":
                (tmp_path / "b.asf").write_bytes(variant)
                check(tmp_path / "b.amc", [AMC.encode()], tmp_path / "b.asf")
            else:
                check(tmp_path / f"a{suffix}", [variant])
