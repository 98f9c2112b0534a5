import struct
import time

import numpy as np
import pytest

from pegbar import FormatError
from pegbar.io.c3d import read_c3d
from tests.io.c3d_files import make_c3d

CHANCE = np.random.default_rng(5)


def points(frames=4, count=3):
    table = CHANCE.uniform(-900, 900, (frames, count, 4)).round()
    table[..., 3] = 1
    return table


def read(tmp_path, data):
    (tmp_path / "a.c3d").write_bytes(data)
    return read_c3d(tmp_path / "a.c3d")


def refused(tmp_path, data):
    with pytest.raises(FormatError) as caught:
        read(tmp_path, data)
    assert str(tmp_path / "a.c3d") in str(caught.value)
    return caught.value


@pytest.mark.parametrize("processor", [84, 85, 86])
@pytest.mark.parametrize("scale", [-1.0, 0.5])
@pytest.mark.parametrize("analog", [0, 6])
def test_every_processor_and_number_kind_gives_the_same_points(tmp_path, processor, scale, analog):
    table = points()
    table[1, 2, 3] = -1
    table[2, 0] = [0, 0, 0, 0]
    clip = read(tmp_path, make_c3d(table, ["A", "B", "C"], processor=processor, scale=scale, analog=analog))
    wanted = table[..., :3].copy()
    wanted[1, 2] = wanted[2, 0] = np.nan
    np.testing.assert_array_equal(clip.positions, wanted)
    assert (clip.names, clip.parents, clip.frame_rate, clip.unit) == (("A", "B", "C"), (-1, -1, -1), 100, 0.001)
    assert clip.offsets is None
    np.testing.assert_array_equal(clip.rotations, np.broadcast_to(np.eye(3), (4, 3, 3, 3)))


@pytest.mark.parametrize(("unit", "metres"), [("mm", 0.001), ("m ", 1), ("CM", 0.01), ("in", 0.0254), ("parsec", None)])
def test_the_unit_is_the_files(tmp_path, unit, metres):
    assert read(tmp_path, make_c3d(points(), list("ABC"), point={"UNITS": unit})).unit == metres


@pytest.mark.parametrize(("screen", "up"), [("+Z", "z"), ("-Y", "-y"), ("X", "x"), ("up", None), (None, None)])
def test_the_up_axis_is_the_screens(tmp_path, screen, up):
    assert read(tmp_path, make_c3d(points(), list("ABC"), point={"Y_SCREEN": screen})).up == up


def test_more_than_255_labels(tmp_path):
    names = [f"P{index}" for index in range(600)]
    table = points(2, 600)
    clip = read(tmp_path, make_c3d(table, names))
    assert clip.names == tuple(names)
    np.testing.assert_array_equal(clip.positions, table[..., :3])


def test_outputs_and_unlabelled_points_are_left_out_with_a_note(tmp_path):
    labels = ["S:LHIP", "S:LHipAngles", "S:*12", "S:RHIP", "*13", "", "S:Power"]
    table = points(2, 8)
    data = make_c3d(table, labels, point={"ANGLES": ["LHipAngles"], "POWERS": ["S:Power"]})
    clip = read(tmp_path, data)
    assert clip.names == ("LHIP", "RHIP")
    np.testing.assert_array_equal(clip.positions, table[:, [0, 3], :3])
    assert [note.split()[0] for note in clip.notes] == ["2", "4", "the"]


def test_two_subjects_keep_their_names_and_labels_stand_once(tmp_path):
    assert read(tmp_path, make_c3d(points(), ["S:A", "T:A", "T:B"])).names == ("S:A", "T:A", "T:B")
    clip = read(tmp_path, make_c3d(points(), ["A", "A", "B"]))
    assert clip.names == ("A", "A_2", "B")
    assert len(clip.notes) == 1


@pytest.mark.parametrize("frames", [40000, 70000])
def test_clips_longer_than_16_bits_can_count(tmp_path, frames):
    table = np.ones((frames, 1, 4))
    trial = {
        "ACTUAL_START_FIELD": [1, 0],
        "ACTUAL_END_FIELD": [(frames & 0xFFFF) - 0x10000 * (frames & 0x8000 > 0), frames >> 16],
    }
    clip = read(tmp_path, make_c3d(table, ["A"], trial=trial))
    assert len(clip.positions) == frames
    long = make_c3d(table, ["A"], point={"LONG_FRAMES": float(frames), "FRAMES": -1})
    assert len(read(tmp_path, long).positions) == frames


def test_a_clip_may_begin_at_a_later_frame(tmp_path):
    trial = {"ACTUAL_START_FIELD": [695, 0], "ACTUAL_END_FIELD": [698, 0]}
    assert len(read(tmp_path, make_c3d(points(), list("ABC"), first=695, trial=trial)).positions) == 4


def changed(data, place, form, *values):
    data = bytearray(data)
    struct.pack_into(form, data, place, *values)
    return bytes(data)


def test_counts_that_are_wrong_are_refused(tmp_path):
    whole = make_c3d(points(200, 3), list("ABC"))
    for frames in (1, 100, 199, 201, 400):
        assert "disagree" in refused(tmp_path, changed(whole, 8, "<H", frames)).problem
        # Both counts wrong alike: the data is what disagrees, beyond what may fill the last block.
        both = make_c3d(points(200, 3), list("ABC"), point={"FRAMES": frames})
        both = changed(both, 8, "<H", frames)
        if frames not in (199, 201):
            assert f"announces {frames} frames" in refused(tmp_path, both).problem
    assert refused(tmp_path, changed(whole, 2, "<H", 4)).byte == 2
    assert refused(tmp_path, whole[: len(whole) // 2]).byte == len(whole) // 2
    trial = {"ACTUAL_START_FIELD": [1, 0], "ACTUAL_END_FIELD": [4, 15000]}
    assert "announces 983" in refused(tmp_path, make_c3d(points(), list("ABC"), trial=trial)).problem


@pytest.mark.parametrize(
    ("point", "said"),
    [
        ({"SCALE": 0.0}, "SCALE"),
        ({"SCALE": float("nan")}, "points"),
        ({"RATE": 0.0}, "rate"),
        ({"RATE": -5.0}, "rate"),
        ({"USED": 2}, "points"),
        ({"LABELS": None}, "labelled"),
        ({"DATA_START": 900}, None),
    ],
)
def test_parameters_that_are_wrong(tmp_path, point, said):
    scale = point.get("SCALE", -1.0)
    data = make_c3d(points(), list("ABC"), point=point, scale=scale)
    if said is None:
        assert len(read(tmp_path, data).positions) == 4
    else:
        assert refused(tmp_path, data).byte is not None


def test_places_that_are_none(tmp_path):
    table = points()
    table[2, 1, 0] = np.nan
    assert np.isnan(read(tmp_path, make_c3d(table, list("ABC"))).positions[2, 1]).all()
    for value in (np.inf, -np.inf, 3e38):
        table[2, 1, 0] = value
        error = refused(tmp_path, make_c3d(table, list("ABC")))
        assert "point 1 of frame 2" in error.problem
        assert error.byte == len(make_c3d(table, list("ABC"))) - 512 + 2 * 48 + 16


def test_what_is_no_c3d_is_refused(tmp_path):
    whole = make_c3d(points(), list("ABC"))
    for data in (b"", b"\2", b"\2\x50", b"\0" * 4096, b"HIERARCHY\n" * 200, whole[:512], whole[:700]):
        assert refused(tmp_path, data).byte is not None or not data
    for place, value in ((0, 0), (0, 200), (1, 0x51), (515, 83), (515, 0), (516, 0), (523, 255)):
        assert refused(tmp_path, changed(whole, place, "B", value)).byte is not None


def test_a_chain_of_parameters_over_each_other_is_refused(tmp_path):
    record = struct.pack("<bb1sHbBBBB", 1, 1, b"A", 3, 1, 3, 255, 255, 8)
    chain = struct.pack("4B", 1, 0x50, 255, 84) + (record[:5] + b"\1") * 80000
    data = make_c3d(points(), list("ABC"))[:512] + chain + b"\0" * 600000
    begin = time.process_time()
    assert refused(tmp_path, data).byte is not None
    assert time.process_time() - begin < 1


def test_real_files_are_as_ezc3d_reads_them(test_data):
    ezc3d = pytest.importorskip("ezc3d")
    for name, count, missing in (("cmu_05_13", 330, 0), ("ktk_tennis_serve", 39, 0), ("pycgm_movement_trial", 117, 0)):
        path = test_data / "mocap" / "c3d" / f"{name}.c3d"
        clip, peer = read_c3d(path), ezc3d.c3d(str(path))
        named = peer["parameters"]["POINT"]
        labels = named["LABELS"]["value"] + (named["LABELS2"]["value"] if "LABELS2" in named else [])
        columns = [labels.index(next(label for label in labels if label.split(":")[-1] == name)) for name in clip.names]
        assert len(columns) == count
        assert np.isnan(clip.positions).sum() == missing
        np.testing.assert_array_equal(clip.positions, peer["data"]["points"][:3].transpose(2, 1, 0)[:, columns])
        assert clip.frame_rate == named["RATE"]["value"][0]
