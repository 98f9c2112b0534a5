import struct

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pegbar import FormatError
from pegbar.io.frames import read_image, read_picture, to_uint8, write_image
from tests import pictures

COLORS = [[255, 0, 0], [0, 255, 0], [0, 0, 255]]
KINDS = {
    "1-bit": (pictures.png(4, 1, 1, 0, [[0b10100000]]), [[[255], [0], [255], [0]]]),
    "2-bit": (pictures.png(4, 1, 2, 0, [[0b00011011]]), [[[0], [85], [170], [255]]]),
    "grey": (pictures.png(2, 1, 8, 0, [[1, 200]]), [[[1], [200]]]),
    "grey, one level transparent": (
        pictures.png(2, 1, 8, 0, [[1, 200]], before=pictures.png_chunk(b"tRNS", b"\0\xc8")),
        [[[1, 1, 1, 255], [200, 200, 200, 0]]],
    ),
    "2-bit, one level transparent": (
        pictures.png(4, 1, 2, 0, [[0b00011011]], before=pictures.png_chunk(b"tRNS", b"\0\2")),
        [[[0, 0, 0, 255], [85, 85, 85, 255], [170, 170, 170, 0], [255, 255, 255, 255]]],
    ),
    "grey and alpha": (pictures.png(2, 1, 8, 4, [[10, 20, 30, 40]]), [[[10, 10, 10, 20], [30, 30, 30, 40]]]),
    "rgb": (pictures.png(2, 1, 8, 2, [[1, 2, 3, 4, 5, 6]]), [[[1, 2, 3], [4, 5, 6]]]),
    "rgba": (pictures.png(1, 2, 8, 6, [[1, 2, 3, 4], [5, 6, 7, 8]]), [[[1, 2, 3, 4]], [[5, 6, 7, 8]]]),
    "palette": (pictures.png(3, 1, 8, 3, [[2, 1, 0]], before=pictures.palette(COLORS)), [COLORS[::-1]]),
    "palette with transparency": (
        pictures.png(3, 1, 2, 3, [[0b00011000]], before=pictures.palette(COLORS, [0, 128])),
        [[[255, 0, 0, 0], [0, 255, 0, 128], [0, 0, 255, 255]]],
    ),
    "grey 16": (pictures.png(2, 1, 16, 0, [[1, 2, 200, 3]]), [[[0x102], [0xC803]]]),
    "rgb 16": (pictures.png(1, 1, 16, 2, [[1, 2, 3, 4, 5, 6]]), [[[0x102, 0x304, 0x506]]]),
    "rgba 16": (pictures.png(1, 1, 16, 6, [[1, 2, 3, 4, 5, 6, 7, 8]]), [[[0x102, 0x304, 0x506, 0x708]]]),
    "tiff grey": (pictures.tiff(3, 1, 1, bytes([1, 2, 3])), [[[1], [2], [3]]]),
    "tiff rgb": (pictures.tiff(2, 1, 3, bytes([1, 2, 3, 4, 5, 6])), [[[1, 2, 3], [4, 5, 6]]]),
    "tiff 16": (pictures.tiff(1, 1, 1, struct.pack(">H", 513), bits=16, order=">"), [[[513]]]),
    "tiff float": (pictures.tiff(2, 1, 1, struct.pack("<ff", 0.5, -2), bits=32, sample_format=3), [[[0.5], [-2]]]),
}


@pytest.mark.parametrize("kind", KINDS)
def test_reads_every_kind_in_rgb_order(kind, tmp_path):
    data, want = KINDS[kind]
    # The content decides, not the suffix.
    file = tmp_path / "picture.dat"
    file.write_bytes(data)
    got = read_image(file)
    dtype = np.float32 if "float" in kind else np.uint16 if "16" in kind else np.uint8
    assert got.dtype == dtype
    assert np.array_equal(got, want)
    if dtype != np.float32:
        picture = read_picture(file)
        assert picture.dtype == np.uint8
        assert picture.shape == (*got.shape[:2], 4 if got.shape[2] == 4 else 3)
        assert np.array_equal(picture, np.rint(got / (257 if dtype == np.uint16 else 1)) + np.zeros(picture.shape[2]))


@given(
    image=st.sampled_from([np.uint8, np.uint16]).flatmap(
        lambda dtype: st.tuples(st.integers(1, 9), st.integers(1, 9), st.sampled_from([1, 3, 4])).flatmap(
            lambda shape: hnp.arrays(dtype, shape)
        )
    ),
    suffix=st.sampled_from([".png", ".tif", ".TIFF"]),
)
def test_what_is_written_is_read(image, suffix, tmp_path_factory):
    file = tmp_path_factory.getbasetemp() / f"round{suffix}"
    write_image(file, np.asfortranarray(image))
    got = read_image(file)
    assert got.dtype == image.dtype
    assert np.array_equal(got, image)
    write_image(file, image[..., 0])
    assert np.array_equal(read_image(file)[..., 0], image[..., 0])


def test_float_pictures_go_through_tiff_and_exr(tmp_path):
    image = np.linspace(-1, 2, 24, dtype=np.float32).reshape(2, 3, 4)
    write_image(tmp_path / "a.tif", image)
    assert np.array_equal(read_image(tmp_path / "a.tif"), image)
    write_image(tmp_path / "a.exr", image)
    np.testing.assert_allclose(read_image(tmp_path / "a.exr"), image, rtol=1e-3)
    write_image(tmp_path / "grey.exr", image[..., 0])
    assert np.array_equal(read_image(tmp_path / "grey.exr")[..., 3], np.ones((2, 3)))
    with pytest.raises(FormatError, match=r"a\.exr: an EXR is linear"):
        read_picture(tmp_path / "a.exr")


def test_jpeg_is_upright_and_close(tmp_path, test_data):
    photo = test_data / "photos" / "yogait_t5.jpg"
    assert read_picture(photo).shape == (720, 1080, 3)
    ramp = np.repeat(np.arange(0, 250, 5, dtype=np.uint8)[:, None], 30, axis=1)
    image = np.dstack([ramp, ramp // 2, ramp // 4])
    write_image(tmp_path / "a.jpg", image)
    assert np.abs(read_image(tmp_path / "a.jpg").astype(int) - image).max() < 12
    plain = (tmp_path / "a.jpg").read_bytes()
    # Orientation 6: the camera was held so that the picture must be turned by a quarter to the right.
    exif = b"Exif\0\0MM\0*\0\0\0\x08\0\1\1\x12\0\3\0\0\0\1\0\6\0\0\0\0\0\0"
    (tmp_path / "b.jpg").write_bytes(plain[:2] + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + plain[2:])
    assert np.array_equal(read_image(tmp_path / "b.jpg"), np.rot90(read_image(tmp_path / "a.jpg"), -1))


def test_a_photo_under_a_wrong_suffix_is_read_upright(test_data):
    photo = test_data / "drawings" / "animated_drawings" / "garlic.png"
    assert photo.read_bytes().startswith(b"\xff\xd8")
    assert read_picture(photo).shape == (4032, 3024, 3)


def test_real_drawings_equal_opencv_and_keep_their_colours(test_data):
    files = sorted((test_data / "drawings" / "kenney").rglob("*.png"))
    files += sorted((test_data / "drawings" / "animated_drawings").glob("char*/*.png"))
    for file in files:
        got, want = read_image(file), cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
        want = want if want.ndim == 3 else want[..., None]
        assert np.array_equal(got[..., 0], want[..., 2 if want.shape[2] > 1 else 0]), file
        assert np.array_equal(got[..., -1], want[..., 3] if want.shape[2] == 4 else want[..., 0]), file
    labels = read_picture(test_data / "annotated" / "morevna_side_walk" / "seg" / "000.png")
    assert {tuple(color) for color in np.unique(labels.reshape(-1, 3), axis=0).tolist()} >= {
        (255, 128, 0),
        (0, 128, 255),
    }


def test_sixteen_bits_round_to_the_nearest_eight():
    every = np.arange(65536, dtype=np.uint16)
    assert np.array_equal(to_uint8(every), np.round(every / 257).astype(np.uint8))


def test_floats_clip_and_round():
    assert to_uint8([[-1, 0, 0.5 / 255 + 1e-6, 1, np.inf]]).tolist() == [[0, 0, 1, 255, 255]]
    with pytest.raises(ValueError, match=r"^image: NaN at \[0, 1\]"):
        to_uint8([[0.5, np.nan]])
    with pytest.raises(ValueError, match="int64"):
        to_uint8([[1, 2]])


@pytest.mark.parametrize(
    ("name", "image", "problem"),
    [
        ("a.bmp", np.zeros((2, 2, 3), np.uint8), "^path: .*'.bmp'"),
        ("a.png", np.zeros((2, 2, 3), np.float32), "^image: .png holds uint8 or uint16, got float32"),
        ("a.jpg", np.zeros((2, 2, 4), np.uint8), r"^image: .jpg holds \(H, W, 1\|3\), got \(2, 2, 4\)"),
        ("a.png", np.zeros((2, 2, 2), np.uint8), "^image: "),
        ("a.png", np.zeros((0, 2, 3), np.uint8), "^image: "),
        ("a.png", np.zeros(4, np.uint8), "^image: "),
        ("a.exr", np.zeros((2, 2, 3), np.uint8), "^image: .exr holds float32"),
    ],
)
def test_what_a_format_cannot_hold_is_refused(name, image, problem, tmp_path):
    with pytest.raises(ValueError, match=problem):
        write_image(tmp_path / name, image)
    assert list(tmp_path.iterdir()) == []
