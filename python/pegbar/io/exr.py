"""Rendered passes in OpenEXR files: beauty and depth found by their channels' names, and written.

Colour in an EXR is linear light, premultiplied by alpha. Depth is planar camera z in metres, +inf where there is
nothing.
"""

from __future__ import annotations

import errno
import io
import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar.errors import FormatError
from pegbar.io import atomic, exr_channels, exr_header
from pegbar.io.exr_planes import stored_planes

Floats = NDArray[np.float32]
_Path = str | os.PathLike[str]

#: Depths from here on are background: Blender writes 1e10.
BACKGROUND_DEPTH = 1e9
_COMPRESSIONS = ("none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab")


@dataclass(frozen=True, eq=False)
class ExrImage:
    """All channels of an EXR file, (H, W) each in its own dtype, placed in the picture of ``size`` (width, height).

    In a file of several parts a channel's name begins with its part's name. Where a channel has no pixels it is 0.
    """

    channels: dict[str, NDArray[Any]]
    size: tuple[int, int]


@dataclass(frozen=True, eq=False)
class RenderedPasses:
    """What a renderer made of one frame.

    ``beauty`` (H, W, 4) float32 is linear and premultiplied, ``depth`` (H, W) float32 is in metres, +inf where there
    is nothing. What was not asked for is None.
    """

    beauty: Floats | None
    depth: Floats | None


def read_exr(path: _Path) -> ExrImage:
    """Read every channel of an EXR file of one part or several.

    Raises FormatError for what is no EXR, is cut short or damaged, deep or subsampled, or whose parts differ in size.
    """
    parts = _read_parts(path)
    size = parts[0][0].size
    channels: dict[str, NDArray[Any]] = {}
    for part, pixels in parts:
        if part.size != size:
            raise FormatError(path, f"the EXR's parts differ in size: {size} and {part.size}")
        for name, array in pixels.items():
            channels[_full_name(part, name, len(parts))] = _place(array, part, 0)
    return ExrImage(channels, size)


def read_passes(
    path: _Path, *, layer: str | None = None, want: Collection[str] = ("beauty", "depth")
) -> RenderedPasses:
    """Read the beauty and the depth pass of a frame, whatever their channels are called.

    Beauty is ``R G B A`` or those names under a layer (``ViewLayer.Combined.R``, ``beauty.R``), or ``Y`` alone, which
    is grey; without an A it is opaque. Depth is ``Z``, ``depth.Z``, ``ViewLayer.Depth.Z``, ``Depth.V`` and the like.
    Depths of ``BACKGROUND_DEPTH`` and more become +inf. Pixels outside the data window have alpha 0 and depth +inf.

    Parameters
    ----------
    path : path
        The EXR file, of one part or several, half or float.
    layer : str, optional
        The layer to take where several fit: any of the words of its channels' names, or their beginning.
    want : collection of {"beauty", "depth"}
        The passes to return; one that is wanted and not there is an error.

    Returns
    -------
    RenderedPasses

    Raises
    ------
    FormatError
        For a broken file, a pass that is missing or ambiguous (the message lists the channels), and NaN or -inf in
        the depth (the message names row and column).

    Examples
    --------
    >>> import pathlib, tempfile
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "frame.0001.exr"
    >>> write_exr(file, {"": np.ones((1, 2, 4), np.float32), "Z": np.array([[3, 1e10]], np.float32)})
    >>> read_passes(file, want=["depth"]).depth
    array([[ 3., inf]], dtype=float32)
    """
    unknown = set(want) - {"beauty", "depth"}
    if unknown:
        raise ValueError(f'want: take "beauty" and "depth", got {sorted(unknown)}')
    parts = _read_parts(path)
    found = {
        _full_name(part, name, len(parts)): (part, array) for part, pixels in parts for name, array in pixels.items()
    }
    beauty = depth = None
    if "beauty" in want:
        names = exr_channels.find_beauty(path, found, layer)
        beauty = _join(path, [found[name] for name in names])
    if "depth" in want:
        part, plane = found[exr_channels.find_depth(path, found, layer)]
        depth = _place(_clean_depth(path, _to_float(plane), part), part, np.inf)
    return RenderedPasses(beauty, depth)


def write_exr(
    path: _Path,
    channels: Mapping[str, ArrayLike],
    *,
    compression: str = "zip",
    window: tuple[int, int, int, int] | None = None,
    exact: bool = False,
) -> None:
    """Write an EXR file, complete or not at all.

    Parameters
    ----------
    path : path
        The file to make or replace.
    channels : dict of (H, W) or (H, W, 3|4) arrays
        By channel name (``Z``, ``depth.Z``); an array with three axes goes by its layer's name and becomes that
        layer's R, G, B (and A); the name "" is the file's own R, G, B, A. Colour channels (R, G, B, A, Y) are stored
        as half unless they exceed its range, everything else as float; uint32 stays uint32.
    compression : str
        none, rle, zips, zip, piz, pxr24, b44, b44a, dwaa or dwab.
    window : (left, top, right, bottom), optional
        First and last column and row of what is stored (the data window); outside there is nothing when it is read.
    exact : bool
        Store every channel in the type it has: half, float or uint32.

    Raises
    ------
    ValueError
        For channels that differ in size, are no numbers, a window outside the picture, or an unknown compression.
    OSError
        When the file cannot be written; it names ``path``.
    """
    import OpenEXR

    if compression not in _COMPRESSIONS:
        raise ValueError(f"compression: want one of {', '.join(_COMPRESSIONS)}, got {compression!r}")
    name = "NO" if compression == "none" else compression.upper()
    header = {"compression": getattr(OpenEXR, f"{name}_COMPRESSION"), "type": OpenEXR.scanlineimage}
    if window is not None:
        (height, width), channels = _cut(channels, window)
        header["dataWindow"] = np.array(window[:2], np.int32), np.array(window[2:], np.int32)
        header["displayWindow"] = np.zeros(2, np.int32), np.array([width - 1, height - 1], np.int32)
    # To memory first: the library's own file writing loses the reason of a failure.
    stream = io.BytesIO()
    try:
        with OpenEXR.File(header, stored_planes(channels, exact=exact), num_threads=0) as file:
            file.write(stream)
    except (RuntimeError, TypeError) as error:
        raise OSError(errno.EIO, f"OpenEXR cannot encode the channels: {error}", os.fspath(path)) from error
    atomic.write_bytes(path, stream.getbuffer())


def _cut(channels: Mapping[str, ArrayLike], window: tuple[int, int, int, int]) -> tuple[Any, dict[str, NDArray[Any]]]:
    """Height and width of the whole picture, and the part of every channel that is in ``window``."""
    sizes = {np.shape(value)[:2] for value in channels.values()}
    if len(sizes) != 1 or len(min(sizes)) < 2:
        raise ValueError(f"channels: want one size for all, got {sorted(sizes)}")
    (left, top, right, bottom), (height, width) = window, min(sizes)
    if not (0 <= left <= right < width and 0 <= top <= bottom < height):
        raise ValueError(f"window: want a part of {width} x {height} pixels, got {window}")
    return min(sizes), {n: np.asarray(value)[top : bottom + 1, left : right + 1] for n, value in channels.items()}


def _read_parts(path: _Path) -> list[tuple[exr_header.Part, dict[str, NDArray[Any]]]]:
    """The parts with their channels as they are stored, over the data window."""
    import OpenEXR

    parts = exr_header.read_header(path)
    try:
        with OpenEXR.File(os.fspath(path), separate_channels=True, num_threads=0) as file:
            read = [{name: channel.pixels for name, channel in part.channels.items()} for part in file.parts]
    except (RuntimeError, ValueError, MemoryError) as error:
        raise FormatError(path, f"the EXR is damaged: {error}") from None
    if len(read) != len(parts):
        raise FormatError(path, "the EXR is damaged: its pixels cannot be decoded")
    for part, pixels in zip(parts, read, strict=True):
        left, top, right, bottom = part.data_window
        if any(array is None or array.shape != (bottom - top + 1, right - left + 1) for array in pixels.values()):
            raise FormatError(path, "the EXR is damaged: a channel's size is not the header's")
    return list(zip(parts, read, strict=True))


def _full_name(part: exr_header.Part, name: str, parts: int) -> str:
    if parts == 1 or not part.name or name.startswith(f"{part.name}."):
        return name
    return f"{part.name}.{name}"


def _to_float(plane: NDArray[Any]) -> Floats:
    if plane.dtype != np.float16:
        return np.ascontiguousarray(plane, np.float32)
    import cv2

    # Six times faster than astype.
    return np.asarray(cv2.convertFp16(np.ascontiguousarray(plane).view(np.int16)), np.float32).reshape(plane.shape)


def _join(path: _Path, planes: list[tuple[exr_header.Part, NDArray[Any]]]) -> Floats:
    """Grey, grey and alpha, RGB or RGBA planes as one (H, W, 4) picture, opaque where they say nothing of alpha."""
    import cv2

    if len(planes) in (1, 3):
        part, plane = planes[0]
        planes = [*planes, (part, np.ones_like(plane))]
    placed = [_place(plane, part, 0) for part, plane in planes]
    if len({plane.shape for plane in placed}) > 1:
        raise FormatError(path, "the EXR's beauty channels differ in size")
    if len(placed) == 2:
        placed = [placed[0], placed[0], *placed]
    # Halves are joined as they are: half the bytes to move.
    if all(plane.dtype == np.float16 for plane in placed):
        return _to_float(np.asarray(cv2.merge([plane.view(np.int16) for plane in placed])).view(np.float16))
    return np.asarray(cv2.merge([_to_float(plane) for plane in placed]), np.float32)


def _clean_depth(path: _Path, depth: Floats, part: exr_header.Part) -> Floats:
    if not depth.min() > -np.inf:
        row, column = np.argwhere(~(depth > -np.inf))[0].tolist()
        value = depth[row, column]
        row, column = row + part.data_window[1] - part.display_window[1], column + part.data_window[0]
        raise FormatError(path, f"depth is {value} at row {row}, column {column - part.display_window[0]}")
    background = depth >= BACKGROUND_DEPTH
    return np.where(background, np.float32(np.inf), depth)


def _place(plane: NDArray[Any], part: exr_header.Part, fill: float) -> NDArray[Any]:
    """``plane``, which covers the data window, over the display window."""
    if part.data_window == part.display_window:
        return plane
    width, height = part.size
    left, top = (part.data_window[i] - part.display_window[i] for i in (0, 1))
    placed = np.full((height, width), fill, plane.dtype)
    rows = slice(max(top, 0), min(top + plane.shape[0], height))
    columns = slice(max(left, 0), min(left + plane.shape[1], width))
    if rows.start < rows.stop and columns.start < columns.stop:
        source = plane[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
        placed[rows, columns] = source
    return placed
