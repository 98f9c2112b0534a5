"""Pictures: PNG, TIFF, JPEG and EXR files to arrays and back, RGB(A) order, complete or an error that names the file.

What is broken is found in a file's structure before its decoder sees it and reported as FormatError; OpenCV's own
warnings are therefore switched off when this module is imported, unless OPENCV_LOG_LEVEL is set.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar.errors import FormatError
from pegbar.io import atomic, exr, structure

Image = NDArray[Any]
_Path = str | os.PathLike[str]

if "OPENCV_LOG_LEVEL" not in os.environ:
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)

#: The suffixes of what can be read and written.
PICTURE_SUFFIXES = (".png", ".tif", ".tiff", ".jpg", ".jpeg", ".exr")
_DTYPES: dict[str, tuple[str, ...]] = {
    ".png": ("uint8", "uint16"),
    ".tif": ("uint8", "uint16", "float32"),
    ".tiff": ("uint8", "uint16", "float32"),
    ".jpg": ("uint8",),
    ".jpeg": ("uint8",),
    ".exr": ("float32",),
}
_TO_RGB = {3: cv2.COLOR_BGR2RGB, 4: cv2.COLOR_BGRA2RGBA}


def png_size(path: _Path) -> tuple[int, int] | None:
    """Return width and height as the header of a PNG says, None for other files; OSError where it cannot be opened."""
    with open(path, "rb") as file:
        head = file.read(24)
    if len(head) < 24 or not head.startswith(b"\x89PNG\r\n\x1a\n"):
        return None
    return int.from_bytes(head[16:20], "big"), int.from_bytes(head[20:24], "big")


def read_image(path: _Path) -> Image:
    """Read a PNG, TIFF, JPEG or EXR file as it is stored.

    The file's content decides what it is, not its suffix. A palette becomes its colours, one to four bits become
    eight, grey with alpha becomes RGBA. A JPEG is turned upright by its orientation mark, as paint programs show it.
    An EXR gives its beauty pass: linear, premultiplied RGBA.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    (H, W, C) uint8, uint16 or float32
        C is 1 (grey), 3 (RGB) or 4 (RGBA). Alpha is straight except in an EXR.

    Raises
    ------
    FileNotFoundError, OSError
        When the file cannot be opened.
    FormatError
        For a file that is none of these, is empty, cut short or damaged, or has more than
        ``structure.MAX_PIXELS`` pixels.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "dot.png"
    >>> write_image(file, np.full((2, 3, 4), 9, np.uint8))
    >>> read_image(file).shape
    (2, 3, 4)
    """
    with open(path, "rb") as file:
        if file.read(4) == b"\x76\x2f\x31\x01":
            return exr.read_passes(path, want=("beauty",)).beauty  # type: ignore[return-value]
        file.seek(0)
        data = file.read()
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        return _read_png(path, data)
    if data.startswith(b"\xff\xd8\xff"):
        structure.check_jpeg(path, data)
        return _decode(path, data, "JPEG", cv2.IMREAD_ANYCOLOR)
    if data[:4] in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
        structure.check_tiff(path, data)
        return _decode(path, data, "TIFF", cv2.IMREAD_UNCHANGED)
    raise FormatError(path, "the file is empty" if not data else "not a PNG, TIFF, JPEG or EXR file", byte=0)


def read_picture(path: _Path) -> NDArray[np.uint8]:
    """Read a drawing or a segmentation: (H, W, 3 or 4) uint8, RGB or straight RGBA in display space.

    As ``read_image``; sixteen bits are rounded to eight, grey is spread to RGB. An EXR is linear and premultiplied,
    so it is no drawing and is refused.
    """
    image = read_image(path)
    if image.dtype == np.float32 and Path(path).suffix.lower() not in (".tif", ".tiff"):
        raise FormatError(path, "an EXR is linear light, not a drawing: save drawings as PNG, TIFF or JPEG")
    try:
        pixels = to_uint8(image)
    except ValueError as error:
        raise FormatError(path, str(error).removeprefix("image: ")) from None
    if pixels.shape[2] == 1:
        pixels = np.asarray(cv2.cvtColor(pixels, cv2.COLOR_GRAY2RGB), np.uint8)
    return np.asarray(pixels, np.uint8)


def to_uint8(image: ArrayLike) -> NDArray[np.uint8]:
    """Round a picture (..., C) to eight bits: uint16 from 0..65535, floats from 0..1 (what is outside is clipped)."""
    array = np.asarray(image)
    if array.dtype == np.uint8:
        return np.ascontiguousarray(array, np.uint8)
    if array.dtype == np.uint16:
        # x / 257 is never halfway between two whole numbers, so how ties are rounded does not matter.
        rounded: NDArray[np.uint8] = np.asarray(cv2.convertScaleAbs(array, alpha=1 / 257), np.uint8)
        return rounded.reshape(array.shape)
    if array.dtype.kind != "f":
        raise ValueError(f"image: want uint8, uint16 or float, got dtype {array.dtype}")
    if np.isnan(np.min(array, initial=0)):
        raise ValueError(f"image: NaN at {np.argwhere(np.isnan(array))[0].tolist()}")
    return np.asarray(np.rint(np.clip(array, 0, 1) * 255), np.uint8)


def write_image(path: _Path, image: ArrayLike) -> None:
    """Write a picture in the format of ``path``'s suffix, complete or not at all.

    Parameters
    ----------
    path : path
        .png (uint8, uint16), .tif or .tiff (uint8, uint16, float32), .jpg or .jpeg (uint8, no alpha) or .exr
        (float32: linear, premultiplied; stored as half).
    image : (H, W) or (H, W, C)
        C is 1 (grey), 3 (RGB) or 4 (RGBA).

    Raises
    ------
    ValueError
        For a suffix, a shape or a dtype that the format does not take.
    OSError
        When the file cannot be written; it names ``path``.
    """
    array = _writable(Path(path).suffix.lower(), np.asarray(image))
    suffix = Path(path).suffix.lower()
    if suffix == ".exr":
        exr.write_exr(path, {"Y": array[..., 0]} if array.shape[2] == 1 else {"": array})
        return
    if array.shape[2] > 1:
        array = cv2.cvtColor(array, _TO_RGB[array.shape[2]])
    good, encoded = cv2.imencode(suffix, array)
    if not good:
        raise ValueError(f"image: OpenCV cannot write {array.dtype} {array.shape} as {suffix}")
    atomic.write_bytes(path, encoded.data)


def _writable(suffix: str, array: Image) -> Image:
    if suffix not in _DTYPES:
        raise ValueError(f"path: want a suffix of {', '.join(_DTYPES)}, got {suffix!r}")
    if array.dtype.name not in _DTYPES[suffix]:
        raise ValueError(f"image: {suffix} holds {' or '.join(_DTYPES[suffix])}, got {array.dtype}")
    if array.ndim == 2:
        array = array[..., None]
    channels = (1, 3) if suffix in (".jpg", ".jpeg") else (1, 3, 4)
    if array.ndim != 3 or array.shape[2] not in channels or not array.size:
        raise ValueError(f"image: {suffix} holds (H, W, {'|'.join(map(str, channels))}), got {array.shape}")
    return np.ascontiguousarray(array)


def _read_png(path: _Path, data: bytes) -> Image:
    header = structure.check_png(path, data)
    image = _decode(path, data, "PNG", cv2.IMREAD_UNCHANGED)
    if header.transparent_grey is None or image.shape[2] != 1:
        return image
    # OpenCV knows a transparent colour in RGB and palette files only.
    most = int(np.iinfo(image.dtype).max)
    key = header.transparent_grey * most // ((1 << header.bits) - 1)
    alpha = np.where(image == key, 0, most).astype(image.dtype)
    return np.concatenate([image, image, image, alpha], axis=2)


def _decode(path: _Path, data: bytes, kind: str, flags: int) -> Image:
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    except cv2.error:
        image = None
    if image is None:
        raise FormatError(path, f"the {kind} is damaged or of a kind that OpenCV cannot decode")
    if image.dtype not in (np.uint8, np.uint16, np.float32):
        raise FormatError(path, f"the {kind} holds {image.dtype} values; want uint8, uint16 or float32")
    if image.ndim == 2:
        return np.asarray(image[..., None])
    if image.shape[2] not in _TO_RGB:
        raise FormatError(path, f"the {kind} has {image.shape[2]} channels; want 1, 3 or 4")
    return np.asarray(cv2.cvtColor(image, _TO_RGB[image.shape[2]]))
