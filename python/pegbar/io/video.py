"""Video files through PyAV: MP4, ProRes 4444 and WebM, checked before the first picture is made."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.errors import MissingExtraError
from pegbar.io import atomic
from pegbar.io.ahead import map_ahead

Pixels = NDArray[np.uint8]
#: What is converted here, by threads ahead of the encoder's, where libswscale would take twice as long: the format, and
#: FFmpeg's numbers of its colours and their range.
_PLANAR, _BT601, _STUDIO = "yuv420p", 5, 1
#: Colour differences of the whole range in the studio's.
_STUDIO_COLORS = np.rint(128 + (np.arange(256) - 128) * 224 / 255).astype(np.uint8)


class Codec(NamedTuple):
    """An encoder, the pixels it takes with and without alpha (None: it has none), and its settings."""

    name: str
    pixels: str
    alpha_pixels: str | None
    options: dict[str, str]


#: x264 searches less than "veryfast" does: a third less time for files a sixth larger and 0.9 dB off the same picture.
_HASTE = "ref=1:subme=1:me=dia:trellis=0:weightp=0"
#: What is tried for a file's suffix, the best first.
CODECS: dict[str, tuple[Codec, ...]] = {
    ".mp4": (
        Codec("libx264", "yuv420p", None, {"crf": "18", "preset": "veryfast", "x264-params": _HASTE}),
        Codec("libopenh264", "yuv420p", None, {"b": "8000000"}),
        Codec("h264_videotoolbox", "yuv420p", None, {"b": "8000000"}),
        Codec("mpeg4", "yuv420p", None, {"qscale": "3"}),
    ),
    ".mov": (
        Codec("prores_ks", "yuv444p10le", "yuva444p10le", {"profile": "4444"}),
        Codec("qtrle", "rgb24", "argb", {}),
    ),
    ".webm": (
        Codec("libvpx-vp9", "yuv420p", "yuva420p", {"crf": "24", "b": "0", "deadline": "realtime", "cpu-used": "6"}),
        Codec("libvpx", "yuv420p", "yuva420p", {"crf": "10", "b": "4000000", "deadline": "realtime"}),
    ),
}
SUFFIXES = tuple(CODECS)


def find_codec(path: str | os.PathLike[str], *, alpha: bool = False) -> Codec:
    """Return the encoder that will write ``path``, or say why there is none.

    Parameters
    ----------
    path : path
        .mp4 (H.264), .mov (ProRes 4444) or .webm (VP9).
    alpha : bool
        Whether pictures have alpha: .mov and .webm keep it.

    Raises
    ------
    ValueError
        For another suffix, alpha in an .mp4, or a PyAV without any encoder for it.
    MissingExtraError
        Where PyAV is not installed.

    Examples
    --------
    >>> find_codec("walk.gif")
    Traceback (most recent call last):
    ValueError: path: want a suffix of .mp4, .mov, .webm, got '.gif'
    """
    suffix = Path(path).suffix.lower()
    if suffix not in CODECS:
        raise ValueError(f"path: want a suffix of {', '.join(CODECS)}, got {suffix!r}")
    codecs = [codec for codec in CODECS[suffix] if codec.alpha_pixels or not alpha]
    if not codecs:
        raise ValueError(f"path: {suffix} has no transparency: take .mov or .webm, or a background")
    available = _library().codecs_available
    found = next((codec for codec in codecs if codec.name in available), None)
    if found is None:
        names = ", ".join(codec.name for codec in codecs)
        raise ValueError(f"path: PyAV is built without an encoder for {suffix} (want {names})")
    return found


def write_video(
    path: str | os.PathLike[str], frames: Iterable[ArrayLike], frame_rate: float, *, alpha: bool = False
) -> int:
    """Write pictures as a video, complete or not at all, and return how many there were.

    Parameters
    ----------
    path : path
        .mp4, .mov or .webm, see `find_codec`.
    frames : iterable of (H, W, 3|4) uint8
        RGB or straight RGBA of one size, taken one by one. Of an odd width or height the last column or row is
        repeated where the format asks for even ones.
    frame_rate : float
        Frames a second.
    alpha : bool
        Keep the pictures' alpha; else what is transparent is black.

    Raises
    ------
    ValueError
        For no frames, frames that differ in size, or a wrong rate; and as `find_codec`.
    OSError
        When the file cannot be written; it names ``path``.
    """
    codec = find_codec(path, alpha=alpha)
    if not 0 < frame_rate < math.inf:
        raise ValueError(f"frame_rate: want frames a second above 0, got {frame_rate}")
    av = _library()
    with atomic.complete_file(path) as part:
        try:
            with av.open(str(part), "w") as container:
                count = _encode(av, container, codec, frames, frame_rate, alpha)
        except av.error.FFmpegError as error:
            raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    return count


def _encode(av: Any, container: Any, codec: Codec, frames: Iterable[ArrayLike], frame_rate: float, alpha: bool) -> int:
    stream, count = None, 0
    planar = not alpha and codec.pixels == _PLANAR
    prepared = map_ahead(partial(_prepared, alpha=alpha, planar=planar), _checked(frames))
    for shape, picture in prepared:
        if stream is None:
            stream = container.add_stream(codec.name, rate=Fraction(frame_rate).limit_denominator(10_000))
            stream.pix_fmt = codec.alpha_pixels if alpha else codec.pixels
            even = 2 if "420" in stream.pix_fmt else 1
            stream.height, stream.width = (-(-side // even) * even for side in shape)
            stream.options = codec.options
            stream.thread_type, stream.thread_count = "AUTO", 0
            if planar:
                context = stream.codec_context
                context.colorspace, context.color_range = _BT601, _STUDIO
        if not planar:
            more = (stream.height - shape[0], stream.width - shape[1])
            picture = np.pad(picture, ((0, more[0]), (0, more[1]), (0, 0)), mode="edge") if any(more) else picture
        pixels = _PLANAR if planar else "rgba" if alpha else "rgb24"
        container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, pixels)))
        count += 1
    if stream is None:
        raise ValueError("frames: want at least one")
    container.mux(stream.encode())
    return count


def _checked(frames: Iterable[ArrayLike]) -> Iterator[Pixels]:
    """The pictures, all of the first one's size."""
    shape: tuple[int, ...] | None = None
    for index, frame in enumerate(frames):
        picture = arrays.image(f"frames[{index}]", frame)
        shape = shape or picture.shape[:2]
        arrays.same_size(f"frames[{index}]", picture, "the first frame", shape)
        yield picture


def _prepared(picture: Pixels, *, alpha: bool, planar: bool) -> tuple[tuple[int, int], Pixels]:
    """A picture's height and width, and its pixels with the stream's channels or as planes."""
    height, width = picture.shape[:2]
    if picture.shape[2] == 3 and alpha:
        picture = np.dstack([picture, np.full((height, width), 255, np.uint8)])
    elif picture.shape[2] == 4 and not alpha:
        picture = picture[..., :3]
    picture = np.ascontiguousarray(picture)
    return (height, width), _planes(picture) if planar else picture


def _planes(picture: Pixels) -> Pixels:
    """A picture (H, W, 3) as planes in an array's rows, luma and, half as large, both colours; sides made even."""
    height, width = (side + side % 2 for side in picture.shape[:2])
    if picture.shape[:2] != (height, width):
        more = [(0, height - picture.shape[0]), (0, width - picture.shape[1]), (0, 0)]
        picture = np.ascontiguousarray(np.pad(picture, more, mode="edge"))
    planes = np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2YUV_I420), np.uint8)
    # OpenCV takes the colour of one pixel in four, which frays coloured outlines.
    half = cv2.resize(picture, (width // 2, height // 2), interpolation=cv2.INTER_AREA)
    _, red, blue = cv2.split(cv2.LUT(cv2.cvtColor(half, cv2.COLOR_RGB2YCrCb), _STUDIO_COLORS))
    planes[height:].reshape(2, *blue.shape)[:] = blue, red
    return planes


def _library() -> Any:
    try:
        import av
    except ImportError:
        raise MissingExtraError("writing video", "video") from None
    return av
