"""Broken picture files: each must be an error that names the file, never a half-grey picture, and never a crash."""

import struct

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pegbar import FormatError
from pegbar.io import structure
from pegbar.io.frames import read_image
from tests import pictures


def _small_files(test_data):
    kenney = test_data / "drawings" / "kenney"
    yield from sorted(kenney.rglob("*walk?.png"))[:6]
    yield test_data / "annotated" / "morevna_side_walk" / "frames" / "000.png"
    yield test_data / "annotated" / "morevna_side_walk" / "seg" / "000.png"
    yield test_data / "drawings" / "animated_drawings" / "char1" / "mask.png"
    yield test_data / "photos" / "yogait_t5.jpg"


def test_a_real_picture_cut_anywhere_is_refused(test_data, tmp_path, capfd):
    cut = tmp_path / "cut.png"
    for file in _small_files(test_data):
        data = file.read_bytes()
        for length in [*(len(data) * twentieth // 20 for twentieth in range(20)), len(data) - 1, len(data) - 12]:
            cut.write_bytes(data[:length])
            with pytest.raises(FormatError, match=r"cut\.png( at byte \d+)?: ") as error:
                read_image(cut)
            assert "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("channels", [1, 3, 4])
@pytest.mark.parametrize("suffix", [".tif", ".jpg"])
def test_a_cut_tiff_or_jpeg_is_refused(suffix, channels, tmp_path, capfd):
    if suffix == ".jpg" and channels == 4:
        channels = 3
    image = np.random.default_rng(0).integers(0, 255, (40, 30, channels), dtype=np.uint8)
    data = cv2.imencode(suffix, image)[1].tobytes()
    file = tmp_path / "cut"
    for length in range(0, len(data) - (0 if suffix == ".jpg" else 1), 61):
        file.write_bytes(data[:length])
        with pytest.raises(FormatError, match="cut"):
            read_image(file)
    file.write_bytes(data)
    assert read_image(file).shape == (40, 30, channels)
    assert capfd.readouterr() == ("", "")


def test_a_flipped_bit_in_a_real_png_is_found(test_data, tmp_path, capfd):
    data = (test_data / "drawings" / "kenney" / "male_person" / "malePerson_walk0.png").read_bytes()
    file = tmp_path / "flipped.png"
    for place in range(0, len(data), 3):
        broken = bytearray(data)
        broken[place] ^= 1 << place % 8
        file.write_bytes(broken)
        with pytest.raises(FormatError, match="flipped"):
            read_image(file)
    assert capfd.readouterr() == ("", "")


@settings(max_examples=150)
@given(seed=st.integers(0, 2**32), suffix=st.sampled_from([".tif", ".jpg", ".png"]), changes=st.integers(1, 8))
def test_random_damage_is_an_error_or_a_picture(seed, suffix, changes, tmp_path_factory):
    random = np.random.default_rng(seed)
    image = random.integers(0, 255, (9, 7, 3), dtype=np.uint8)
    data = bytearray(cv2.imencode(suffix, image)[1].tobytes())
    for place in random.integers(0, len(data), changes):
        data[place] = random.integers(256)
    file = tmp_path_factory.getbasetemp() / "damaged"
    file.write_bytes(data)
    try:
        got = read_image(file)
    except FormatError as error:
        assert "damaged" in str(error)  # noqa: PT017
    else:
        assert got.dtype in (np.uint8, np.uint16, np.float32)


@given(data=st.binary(max_size=200))
def test_garbage_is_refused(data, tmp_path_factory):
    file = tmp_path_factory.getbasetemp() / "garbage.png"
    for start in (b"", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"II*\0", b"MM\0+", b"\x76\x2f\x31\x01"):
        file.write_bytes(start + data)
        with pytest.raises(FormatError, match="garbage"):
            read_image(file)


ABSURD = {
    "png": pictures.png(60000, 60000, 8, 6, [[1, 2, 3]]),
    "png with little data": pictures.png(9000, 9000, 8, 6, [[1, 2, 3]]),
    "tiff": pictures.tiff(60000, 60000, 3, bytes(100)),
    "jpeg": cv2.imencode(".jpg", np.zeros((8, 8), np.uint8))[1]
    .tobytes()
    .replace(b"\xff\xc0\0\x0b\x08\0\x08\0\x08", b"\xff\xc0\0\x0b\x08\xea\x60\xea\x60"),
}


@pytest.mark.parametrize("kind", ABSURD)
def test_an_absurd_size_is_refused_before_memory_is_reserved(kind, tmp_path, monkeypatch):
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("decoded"))
    file = tmp_path / "absurd.png"
    file.write_bytes(ABSURD[kind])
    with pytest.raises(FormatError, match=r"absurd\.png.*(60000x60000|9000x9000)"):
        read_image(file)


def test_a_tiled_tiff_is_checked_as_well(tmp_path):
    # One tile: the tags for strips give way to those for tiles.
    data = bytearray(pictures.tiff(16, 16, 1, bytes(range(256))))
    for old, new in ((273, 324), (279, 325), (278, 323), (259, 259)):
        place = data.index(struct.pack("<HH", old, 3 if old == 259 else 4), 8)
        data[place : place + 2] = struct.pack("<H", new)
    file = tmp_path / "tile.tif"
    file.write_bytes(data)
    structure.check_tiff(file, bytes(data))
    with pytest.raises(FormatError, match=r"tile\.tif.*cut short"):
        structure.check_tiff(file, bytes(data[:-1]))


def test_every_kind_of_jpeg_frame_is_found(tmp_path):
    image = np.random.default_rng(0).integers(0, 255, (40, 30, 3), dtype=np.uint8)
    data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_PROGRESSIVE, 1, cv2.IMWRITE_JPEG_RST_INTERVAL, 1])[1].tobytes()
    assert b"\xff\xc2" in data
    file = tmp_path / "progressive.jpg"
    # Fill bytes may stand before a marker, and anything after the end.
    file.write_bytes(data[:2] + b"\xff\xff" + data[2:] + b"a camera's own notes")
    assert read_image(file).shape == (40, 30, 3)
    file.write_bytes(data[:2] + b"\0" + data[2:])
    with pytest.raises(FormatError, match="at byte 2|not a PNG"):
        read_image(file)


def test_the_size_limit_counts_pixels():
    assert structure.MAX_PIXELS == 16384 * 16384
    structure.check_size("a", structure.MAX_PIXELS, 1)
    for size in ((structure.MAX_PIXELS + 1, 1), (0, 5), (5, 0), (-1, -1)):
        with pytest.raises(FormatError, match=f"{size[0]}x{size[1]}"):
            structure.check_size("a", *size)


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        (b"", "empty"),
        (b"GIF89a", "not a PNG, TIFF, JPEG or EXR"),
        (b"\x89PNG\r\n\x1a\n" + pictures.png_chunk(b"IEND", b""), "does not begin with a header"),
        (pictures.png(2, 2, 8, 5, [[0]]), "colour type 5"),
        (pictures.png(2, 2, 8, 2, [], data=b"nonsense and more nonsense"), "cannot decode"),
        (
            pictures.tiff(2, 2, 1, bytes(4)).replace(struct.pack("<HHI", 279, 4, 1), struct.pack("<HHI", 999, 4, 1)),
            "where",
        ),
        (
            pictures.tiff(2, 2, 1, bytes(4)).replace(struct.pack("<HHI", 256, 4, 1), struct.pack("<HHI", 999, 4, 1)),
            "size",
        ),
    ],
)
def test_the_problem_is_said(data, problem, tmp_path):
    file = tmp_path / "bad.png"
    file.write_bytes(data)
    with pytest.raises(FormatError, match=rf"bad\.png.*{problem}") as error:
        read_image(file)
    assert error.value.path == str(file)


def test_what_cannot_be_opened_is_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.png"):
        read_image(tmp_path / "none.png")
    with pytest.raises(IsADirectoryError, match=tmp_path.name):
        read_image(tmp_path)
