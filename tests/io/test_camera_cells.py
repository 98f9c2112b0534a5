"""Camera moves in exposure sheets: keys between rows, there and back through CSV and XDTS, and every wrong cell."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar.io.camera_cells import camera_cells, camera_moves
from pegbar.io.exposure_sheet import ExposureSheet, read_exposure_sheet, write_exposure_sheet
from pegbar.scene.camera_moves import TRACKS, CameraKey, CameraMoves

FULL = "frame,A,pan_x,pan_y,zoom,rotate,ease\n1,1,0,,1,,ease\n5,2,40,,,,\n9,3,,,2,-90,hold\n11,4,,,4,0,\n"


def read(folder, text, name="sheet.csv"):
    (folder / name).write_text(text, encoding="utf-8")
    return read_exposure_sheet(folder / name)


def moves(folder, text):
    found, problems = camera_moves(read(folder, text).camera, "sheet.csv")
    assert not problems
    return found


def test_an_empty_cell_is_no_key_and_the_camera_goes_on_to_the_next_one(tmp_path):
    found = moves(tmp_path, FULL)
    assert found.tracks["pan_x"] == (CameraKey(1, 0.0, "ease"), CameraKey(5, 40.0))
    assert found.tracks["zoom"] == (CameraKey(1, 1.0, "ease"), CameraKey(9, 2.0, "hold"), CameraKey(11, 4.0))
    assert "pan_y" not in found.tracks
    assert found.frames == (1, 5, 9, 11)
    assert [found.at(frame)["pan_x"] for frame in (-3, 1, 2, 3, 5, 20)] == [0, 0, 6.25, 20, 40, 40]
    assert [found.at(frame)["zoom"] for frame in (1, 5, 9, 10, 11)] == [1, 1.5, 2, 2, 4]
    assert [found.at(frame)["rotate"] for frame in (1, 9, 10, 11)] == [-90, -90, -90, 0]
    assert found.at(7)["pan_y"] == 0


def test_a_track_without_ease_is_straight(tmp_path):
    found = moves(tmp_path, "frame,A,pan_x\n1,1,-1\n9,2,3\n")
    assert [found.at(frame) for frame in (3, 8)] == [
        {"pan_x": value, "pan_y": 0, "zoom": 1, "rotate": 0} for value in (0, 2.5)
    ]


numbers = st.integers(-500, 500).map(float) | st.floats(-1e4, 1e4)
keys = st.dictionaries(st.integers(1, 30), numbers, max_size=5)
eases = st.dictionaries(st.integers(1, 30), st.sampled_from(["linear", "ease", "hold"]))


@given(tracks=st.fixed_dictionaries(dict.fromkeys(("pan_x", "pan_y", "rotate"), keys)), words=eases)
def test_csv_and_xdts_give_the_moves_back(tmp_path_factory, tracks, words):
    folder = tmp_path_factory.mktemp("moves")
    made = {
        track: tuple(CameraKey(frame, values[frame], words.get(frame, "linear")) for frame in sorted(values))
        for track, values in tracks.items()
        if values
    }
    sheet = ExposureSheet({"A": (1,) * 30}, 1, camera_cells(CameraMoves(made)))
    for name in ("a.csv", "a.xdts"):
        write_exposure_sheet(folder / name, sheet)
        again = read_exposure_sheet(folder / name)
        assert again.levels == sheet.levels
        found, problems = camera_moves(again.camera, name)
        assert problems == []
        assert (found or CameraMoves({})) == CameraMoves(made)


@pytest.mark.parametrize("ease", ["linear", "ease", "hold"])
def test_a_part_of_the_film_keeps_every_frame_of_it(ease):
    whole = CameraMoves({"zoom": (CameraKey(1, 1.0, ease), CameraKey(20, 3.0))})
    part = whole.within(5, 9)
    assert part.frames == (5, 6, 7, 8, 9)
    assert [part.at(frame) for frame in range(5, 10)] == [whole.at(frame) for frame in range(5, 10)]
    assert whole.within(1, 20) is whole
    assert set(part.tracks) == {"zoom"}


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("3,2,left,,,,", "sheet.csv:3: frame 3: pan_x: want a number, got 'left'"),
        ("3,2,nan,,,,", "sheet.csv:3: frame 3: pan_x: want a number, got 'nan'"),
        ("3,2,,1e999,,,", "sheet.csv:3: frame 3: pan_y: want a number, got '1e999'"),
        ("3,2,,,0,,", "sheet.csv:3: frame 3: zoom: want a number above 0, got '0'"),
        ("3,2,,,-1.5,,", "sheet.csv:3: frame 3: zoom: want a number above 0, got '-1.5'"),
        ("3,2,,,150%,,", "sheet.csv:3: frame 3: zoom: want a number, got '150%'"),
        ("3,2,,,,90 deg,", "sheet.csv:3: frame 3: rotate: want a number, got '90 deg'"),
        ("3,2,1,,,,slow", "sheet.csv:3: frame 3: ease: want linear, ease, hold, got 'slow'"),
        ("3,2,,,,,ease", "sheet.csv:3: frame 3: ease: no pan, zoom or rotation begins there: write its value"),
    ],
)
def test_every_wrong_cell_is_named(tmp_path, row, said):
    cells = read(tmp_path, f"frame,A,pan_x,pan_y,zoom,rotate,ease\n1,1,0,0,1,0,\n{row}\n").camera
    assert camera_moves(cells, "sheet.csv") == (None, [said])


def test_all_wrong_cells_are_told_at_once(tmp_path):
    cells = read(tmp_path, "frame,A,pan_x,zoom\n1,1,x,0\n2,1,,\n3,1,-,1\n").camera
    found, problems = camera_moves(cells, "sheet.csv")
    assert found is None
    assert [problem.partition(": ")[0] for problem in problems] == ["sheet.csv:2", "sheet.csv:2", "sheet.csv:4"]


def test_a_comma_may_be_the_decimal_sign(tmp_path):
    found = moves(tmp_path, "frame;A;zoom;pan_x\n1;1;1,5;-,25\n")
    assert found.at(1) == {"pan_x": -0.25, "pan_y": 0, "zoom": 1.5, "rotate": 0}


def test_camera_work_that_is_numbers_is_taken_and_the_rest_is_told(tmp_path):
    def track(number, *values):
        frames = [{"frame": frame, "data": [{"id": 0, "values": [text]}]} for frame, text in values]
        return {"trackNo": number, "frames": frames}

    work = [
        track(0, (0, "PAN"), (2, "SYMBOL_HYPHEN"), (4, "zoom 1.5, rotate=-3"), (6, "zoom twice"), (90, "zoom 9")),
        track(1, (0, "12"), (4, "20.5"), (6, "to the left")),
        track(2, (0, "T.U")),
    ]
    table = {
        "duration": 10,
        "fields": [{"fieldId": 0, "tracks": [track(0, (0, "1"))]}, {"fieldId": 5, "tracks": work}],
        "timeTableHeaders": [{"fieldId": 0, "names": ["A"]}, {"fieldId": 5, "names": ["camera", "Pan_X"]}],
    }
    text = "exchangeDigitalTimeSheet Save Data\n" + json.dumps({"timeTables": [table]})
    sheet = read(tmp_path, text, "sheet.xdts")
    assert sheet.instructions == ("PAN", "zoom twice", "to the left", "T.U")
    found, problems = camera_moves(sheet.camera, "sheet.xdts")
    assert problems == []
    assert found == CameraMoves(
        {
            "pan_x": (CameraKey(1, 12.0), CameraKey(5, 20.5)),
            "zoom": (CameraKey(5, 1.5),),
            "rotate": (CameraKey(5, -3.0),),
        }
    )


def test_no_moves_are_no_moves(tmp_path):
    assert camera_moves(read(tmp_path, "frame,A,pan_x\n1,1,\n").camera, "s") == (None, [])
    assert CameraMoves({}).at(3) == dict(zip(TRACKS, (0, 0, 1, 0), strict=True))
