import struct
import sys

import cv2
import numpy as np
import pytest

from pegbar.io.animation import write_animation
from pegbar.io.frames import read_image


def frames(count=7, channels=4):
    """A bar that walks over a ground with alpha."""
    for index in range(count):
        picture = np.zeros((40, 60, 4), np.uint8)
        picture[:, index * 8 : index * 8 + 8] = (200, 10 * index, 3, 255)
        picture[30:] = (0, 255, 0, 100)
        yield picture[..., :channels]


@pytest.mark.parametrize("suffix", [".png", ".apng", ".webp", "without PyAV.webp"])
@pytest.mark.parametrize("channels", [3, 4])
def test_every_frame_comes_back_exactly(suffix, channels, tmp_path, monkeypatch):
    if "PyAV" in suffix:
        monkeypatch.setitem(sys.modules, "av", None)
        monkeypatch.setattr("pegbar.io.webp.importlib.util.find_spec", lambda name: None)
    else:
        pytest.importorskip("av")
    file = tmp_path / f"walk{suffix}"
    write_animation(file, frames(channels=channels), 24)
    good, got = cv2.imreadanimation(str(file))
    assert good
    assert np.ravel(got.durations).sum() == round(7 * 1000 / 24)
    assert set(np.ravel(got.durations).tolist()) == {41, 42}
    assert got.loop_count == 0
    for frame, want in zip(got.frames, frames(channels=channels), strict=True):
        frame = cv2.cvtColor(frame, cv2.COLOR_BGRA2RGBA if frame.shape[2] == 4 else cv2.COLOR_BGR2RGB)
        seen = want[..., -1] > 0 if channels == 4 else np.ones((40, 60), bool)
        assert np.array_equal(frame[seen][:, :channels], want[seen][:, : frame.shape[2]])
        if channels == 4:
            assert np.array_equal(frame[..., 3], want[..., 3])


def test_an_apng_is_a_png_that_older_programs_show(tmp_path):
    file = tmp_path / "walk.png"
    write_animation(file, frames(), 10)
    data = file.read_bytes()
    place = data.index(b"acTL")
    assert place < data.index(b"IDAT")
    assert struct.unpack_from(">II", data, place + 4) == (7, 0)
    assert data.count(b"fcTL") == 7
    delays = [struct.unpack_from(">HH", data, at + 24) for at in range(len(data)) if data[at : at + 4] == b"fcTL"]
    assert {numerator / denominator for numerator, denominator in delays} == {0.1}
    assert np.array_equal(read_image(file)[..., 3], next(frames())[..., 3])


def test_a_webp_holds_what_changes_and_says_its_size(tmp_path):
    file, wide = tmp_path / "walk.webp", np.zeros((51, 401, 3), np.uint8)
    other = wide.copy()
    other[31, 201] = 255
    write_animation(file, [wide, other, other], 10)
    data = file.read_bytes()
    assert struct.unpack_from("<4sI4s", data) == (b"RIFF", len(data) - 8, b"WEBP")
    assert data[12:16] == b"VP8X"
    assert data[20] == 0x02
    assert [int.from_bytes(data[place : place + 3], "little") + 1 for place in (24, 27)] == [401, 51]
    places = [place + 8 for place in range(len(data)) if data[place : place + 4] == b"ANMF"]
    found = [[int.from_bytes(data[at : at + 3], "little") for at in range(place, place + 12, 3)] for place in places]
    # Halves of an even corner, then sides less one: a pixel in an odd place is in a patch of two by two.
    assert found == [[0, 0, 400, 50], [100, 15, 1, 1], [0, 0, 0, 0]]
    assert cv2.imreadanimation(str(file))[1].frames[2][31, 201].tolist()[:3] == [255, 255, 255]
    with pytest.raises(ValueError, match="16383 pixels at most"):
        write_animation(file, [np.zeros((1, 16384, 3), np.uint8)], 10)


def test_a_gif_plays_at_the_rate(tmp_path):
    file = tmp_path / "walk.gif"
    write_animation(file, frames(24), 24)
    durations = np.ravel(cv2.imreadanimation(str(file))[1].durations)
    assert durations.sum() == 1000
    assert set(durations.tolist()) == {40, 50}


@pytest.mark.parametrize(
    ("name", "pictures", "rate", "problem"),
    [
        ("a.mp4", [np.zeros((2, 2, 3), np.uint8)], 24, "path: "),
        ("a.png", [], 24, "frames: want at least one"),
        (
            "a.png",
            [np.zeros((2, 2, 3), np.uint8), np.zeros((2, 3, 3), np.uint8)],
            24,
            r"frames\[1\]: want 2 rows x 2 columns",
        ),
        ("a.png", [np.zeros((2, 2), np.uint8)], 24, r"frames\[0\]: want shape"),
        ("a.png", [np.zeros((2, 2, 3), np.uint8)], 0, "frame_rate: "),
        ("a.png", [np.zeros((2, 2, 3), np.uint8)], float("inf"), "frame_rate: "),
    ],
)
def test_what_cannot_be_written_is_named(name, pictures, rate, problem, tmp_path):
    with pytest.raises(ValueError, match=f"^{problem}"):
        write_animation(tmp_path / name, pictures, rate)
    assert list(tmp_path.iterdir()) == []
