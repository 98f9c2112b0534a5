import sys

import av
import numpy as np
import pytest

from pegbar import MissingExtraError
from pegbar.io import video
from pegbar.io.film import check_film, write_film
from pegbar.io.frames import read_image


def frames(count=6, channels=4, size=(46, 62)):
    for index in range(count):
        picture = np.zeros((*size, 4), np.uint8)
        picture[5:40, 8 * index : 8 * index + 20] = (220, 40, 60, 255)
        yield picture[..., :channels]


def decoded(path, kind="rgba"):
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        if path.suffix == ".webm":
            # The native decoder leaves out VP9's alpha.
            context = av.CodecContext.create("libvpx-vp9", "r")
            pictures = [frame for packet in container.demux(stream) for frame in context.decode(packet)]
        else:
            pictures = list(container.decode(stream))
        return [picture.to_ndarray(format=kind) for picture in pictures], float(stream.average_rate), stream.codec.name


@pytest.mark.parametrize(("name", "codec"), [("a.mp4", "h264"), ("a.mov", "prores"), ("a.webm", "vp9")])
def test_a_video_has_its_frames_and_rate(name, codec, tmp_path):
    file = tmp_path / name
    write_film(file, frames(channels=3), 23.976)
    pictures, rate, found = decoded(file, "rgb24")
    assert (len(pictures), found) == (6, codec)
    assert rate == pytest.approx(23.976, abs=0.01)
    for got, want in zip(pictures, frames(channels=3), strict=True):
        assert np.abs(got.astype(int) - want).mean() < 8
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["a.mov", "a.webm"])
def test_alpha_is_kept(name, tmp_path):
    file = tmp_path / name
    write_film(file, frames(), 24, alpha=True)
    for got, want in zip(decoded(file)[0], frames(), strict=True):
        assert np.abs(got[..., 3].astype(int) - want[..., 3]).mean() < 3


def test_odd_sizes_are_made_even_where_they_must(tmp_path):
    write_film(tmp_path / "a.mp4", frames(size=(45, 61)), 24)
    assert decoded(tmp_path / "a.mp4")[0][0].shape[:2] == (46, 62)


def test_an_mp4_shows_the_colours_that_it_was_given(tmp_path):
    patches = np.random.default_rng(3).integers(0, 256, (4, 5, 3)).astype(np.uint8)
    picture = patches.repeat(32, axis=0).repeat(32, axis=1)[:-1, :-1]
    write_film(tmp_path / "a.mp4", [picture] * 3, 24)
    with av.open(str(tmp_path / "a.mp4")) as container:
        frame = list(container.decode(video=0))[1]
    # What players go by: BT.601, studio range.
    assert (frame.colorspace, frame.color_range) == (5, 1)
    got = frame.to_ndarray(format="rgb24")
    assert got.shape == (128, 160, 3)
    middles = got[16::32, 16::32].astype(int)
    assert np.abs(middles - patches).max() <= 6
    assert np.abs(got[127].astype(int) - got[126]).mean() < 2


def test_numbered_files(tmp_path):
    write_film(tmp_path / "walk.####.png", frames(), 24)
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"walk.{number:04}.png" for number in range(1, 7)]
    assert np.array_equal(read_image(tmp_path / "walk.0003.png"), list(frames())[2])


@pytest.mark.parametrize(
    ("name", "alpha", "problem"),
    [
        ("a.avi", False, "a.avi: want a suffix"),
        ("a.mp4", True, "has no transparency"),
        ("a.####.jpg", False, "for a sequence"),
        ("none/a.gif", False, "no such folder"),
    ],
)
def test_what_cannot_be_written_is_said_before_any_work(name, alpha, problem, tmp_path):
    with pytest.raises((ValueError, OSError), match=problem):
        check_film(tmp_path / name, alpha=alpha)
    with pytest.raises((ValueError, OSError), match=problem):
        write_film(tmp_path / name, (pytest.fail("asked for a frame") for _ in range(3)), 24, alpha=alpha)
    assert list(tmp_path.iterdir()) == []


def test_a_missing_codec_or_library_is_an_error(tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setitem(video.CODECS, ".mp4", (video.Codec("h264_of_mars", "yuv420p", None, {}),))
        with pytest.raises(ValueError, match="without an encoder for .mp4 .want h264_of_mars"):
            check_film(tmp_path / "a.mp4")
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(MissingExtraError, match=r"pegbar\[video\]"):
        check_film(tmp_path / "a.mp4")
    check_film(tmp_path / "a.gif")


def test_no_frames_leave_no_file(tmp_path):
    for name in ("a.mp4", "a.gif", "a.png"):
        with pytest.raises(ValueError, match="at least one"):
            write_film(tmp_path / name, [], 24)
    with pytest.raises(ValueError, match=r"frames\[1\]"):
        write_film(tmp_path / "a.webm", [np.zeros((4, 4, 3), np.uint8), np.zeros((4, 6, 3), np.uint8)], 24)
    with pytest.raises(ValueError, match="frame_rate"):
        write_film(tmp_path / "a.mov", frames(), 0)
    assert list(tmp_path.iterdir()) == []
