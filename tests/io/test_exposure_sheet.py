"""Exposure sheets: CSV and XDTS, there and back, and what is wrong with a broken one."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import FormatError
from pegbar.io.exposure import Exposure
from pegbar.io.exposure_sheet import ExposureSheet, csv_text, read_exposure_sheet, write_exposure_sheet, xdts_text

CAMERA_WORK = {"frame": 0, "data": [{"id": 0, "values": ["PAN"]}]}
# As Clip Studio Paint writes it: ticks between drawings, a cell before the first frame, camera work, an unused level.
CLIP_STUDIO = {
    "header": {"cut": "12", "scene": "3"},
    "timeTables": [
        {
            "duration": 10,
            "fields": [
                {
                    "fieldId": 0,
                    "tracks": [
                        {
                            "trackNo": 1,
                            "frames": [
                                {"frame": 4, "data": [{"id": 0, "values": ["2"]}]},
                                {"frame": 0, "data": [{"id": 0, "values": ["1"]}]},
                                {"frame": 2, "data": [{"id": 0, "values": ["SYMBOL_TICK_1"]}]},
                                {"frame": 6, "data": [{"id": 0, "values": ["SYMBOL_HYPHEN"]}]},
                                {"frame": 8, "data": [{"id": 0, "values": ["SYMBOL_NULL_CELL"]}]},
                            ],
                        },
                        {"trackNo": 0, "frames": [{"frame": -3, "data": [{"id": 0, "values": ["7"]}]}]},
                    ],
                },
                {"fieldId": 5, "tracks": [{"trackNo": 0, "frames": [CAMERA_WORK]}]},
            ],
            "name": "sheet1",
            "timeTableHeaders": [{"fieldId": 0, "names": ["BG", "A"]}, {"fieldId": 5, "names": ["camera"]}],
        }
    ],
    "version": 5,
}


def written(folder, text, name="sheet.csv"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def xdts(folder, content):
    return written(folder, "exchangeDigitalTimeSheet Save Data\n" + json.dumps(content), "sheet.xdts")


cells = st.lists(st.none() | st.integers(0, 999), min_size=1, max_size=40).filter(lambda c: c[-1] is not None)


@given(first=cells, second=cells, start=st.integers(-5, 2000))
def test_csv_and_xdts_give_the_sheet_back(tmp_path_factory, first, second, start):
    folder = tmp_path_factory.mktemp("sheet")
    sheet = ExposureSheet({"A": tuple(first), "B, b": tuple(second)}, start)
    assert read_exposure_sheet(written(folder, csv_text(sheet))) == sheet
    again = read_exposure_sheet(written(folder, xdts_text(sheet, "s"), "s.xdts"))
    assert again == ExposureSheet(sheet.levels, 1)


def test_a_suffix_decides_what_is_written(tmp_path):
    sheet = ExposureSheet({"A": (1, 1, None, 2)})
    for name in ("a.csv", "a.xdts"):
        write_exposure_sheet(tmp_path / name, sheet)
        assert read_exposure_sheet(tmp_path / name) == sheet
    table = json.loads((tmp_path / "a.xdts").read_text().partition("\n")[2])["timeTables"][0]
    frames = table["fields"][0]["tracks"][0]["frames"]
    assert [(f["frame"], f["data"][0]["values"]) for f in frames] == [
        (0, ["1"]),
        (2, ["SYMBOL_NULL_CELL"]),
        (3, ["2"]),
        (4, ["SYMBOL_NULL_CELL"]),
    ]
    assert (table["duration"], table["timeTableHeaders"][0]["names"]) == (4, ["A"])


def test_clip_studio_s_ticks_hold_and_negative_frames_begin(tmp_path):
    sheet = read_exposure_sheet(xdts(tmp_path, CLIP_STUDIO))
    assert sheet.level("A") == (1, 1, 1, 1, 2, 2, 2, 2)
    assert sheet.level("BG") == (7,) * 10
    assert (sheet.camera, sheet.instructions) == ((), ("PAN",))
    with pytest.raises(ValueError, match="several levels, name one: A, BG"):
        sheet.level()
    with pytest.raises(ValueError, match="no level 'C'"):
        sheet.level("C")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("frame,drawing\n1,1\n4,2\n6,x\n", (1, 1, 1, 2, 2)),
        ("frame;drawing\r\n1;A1\r\n2;\r\n3;dancer.0012.png\r\n", (1, 1, 12)),
        ("\ufeffframe\tdrawing\tpan_x\n1\tx\t0\n2\t-\t5\n3\t9\t10\n", (None, None, 9)),
        ("Frame,drawing\n1,5\n\n2,x\n3,\n4,5\n", (5, None, None, 5)),
    ],
)
def test_hand_written_sheets(tmp_path, text, expected):
    sheet = read_exposure_sheet(written(tmp_path, text))
    assert sheet.level() == expected
    assert sheet.first_frame == 1
    assert [(cell.frame, cell.column, cell.text) for cell in sheet.camera] == (
        [(1, "pan_x", "0"), (2, "pan_x", "5"), (3, "pan_x", "10")] if "pan_x" in text else []
    )


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("", 1, "first line like"),
        ("drawing,frame\n1,1\n", 1, "first line like"),
        ("frame\n1\n", 1, "a name for every level"),
        ("frame,pan_x\n1,2\n", 1, "a name for every level"),
        ("frame,A,A\n1,1,1\n", 1, "each once"),
        ("frame,A\n", 1, "no frames"),
        ("frame,A\n1,1\none,2\n", 3, "want a frame number, got 'one'"),
        ("frame,A\n2,1\n2,2\n", 3, "does not come after"),
        ("frame,A\n1,1\n99999999,2\n", 3, "does not come after"),
        ("frame,A\n1,key\n", 2, "'key' names no drawing"),
        ("frame,A\n1,x\n", None, "shows no drawing"),
    ],
)
def test_wrong_csv_names_its_line(tmp_path, text, line, said):
    with pytest.raises(FormatError, match=said) as error:
        read_exposure_sheet(written(tmp_path, text))
    assert error.value.line == line


@pytest.mark.parametrize("key", ["timeTables", "fields", "tracks", "frames", "data", "timeTableHeaders", "duration"])
@pytest.mark.parametrize("value", [None, 5, [], "x", [5]])
def test_damaged_xdts_is_a_format_error(tmp_path, key, value):
    text = json.dumps(CLIP_STUDIO)

    def spoil(item):
        if isinstance(item, dict):
            return {k: value if k == key else spoil(v) for k, v in item.items()}
        return [spoil(part) for part in item] if isinstance(item, list) else item

    path = xdts(tmp_path, spoil(json.loads(text)))
    try:
        sheet = read_exposure_sheet(path)
    except FormatError:
        return
    assert sheet.levels


def test_text_that_is_no_sheet(tmp_path):
    path = tmp_path / "sheet.xdts"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FormatError, match="UTF-8"):
        read_exposure_sheet(path)
    path.write_text("exchangeDigitalTimeSheet Save Data\n{broken")
    with pytest.raises(FormatError, match="the XDTS is damaged"):
        read_exposure_sheet(path)


def test_an_exposure_of_cells_has_no_frames_where_nothing_is_shown():
    exposure = Exposure.of_cells([4, 4, None, 2], 11)
    assert list(exposure.frames) == [11, 12, 14]
    assert [exposure.drawing(frame) for frame in exposure.frames] == [4, 4, 2]
    with pytest.raises(ValueError, match="frame 13: the exposure sheet shows no drawing"):
        exposure.drawing(13)
    with pytest.raises(ValueError, match="frame 15: has no drawing"):
        exposure.drawing(15)
    with pytest.raises(ValueError, match="at least one"):
        Exposure.of_cells([None])
