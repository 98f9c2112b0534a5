"""The header and the parameters of a C3D file, and whether its data is there as announced.

Layout after the C3D user guide (https://www.c3d.org): blocks of 512 bytes; a header, parameters in groups, then frame
by frame the points and the analog samples. Numbers are Intel's, DEC's or MIPS's.
"""

from __future__ import annotations

import math
import os
import struct
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from pegbar.errors import FormatError

#: Values by group and name.
Parameters = dict[tuple[str, str], list[Any]]
Order = Literal["<", ">"]
_Path = str | os.PathLike[str]
_BLOCK = 512
_KEY = 0x50
_ORDERS: dict[int, Order] = {84: "<", 85: "<", 86: ">"}
_DEC = 85
_DTYPES = {-1: "S1", 1: "u1", 2: "i2", 4: "u4"}


@dataclass(frozen=True)
class Header:
    """What a C3D file says of its data, agreed between header and parameters.

    ``parameters`` maps group and name to a list of str, int or float. ``start`` is the byte at which the data begins,
    ``stride`` the bytes of a frame, ``scale`` the unit of integers (0: the data is floats), ``order`` "<" or ">".
    """

    parameters: Parameters
    points: int
    frames: int
    rate: float
    scale: float
    start: int
    stride: int
    order: Order
    is_dec: bool

    def words(self, name: str) -> list[str]:
        """The words of a parameter of POINT that may run over several, as LABELS, LABELS2 and so on."""
        found, number = [], 1
        while (part := self.parameters.get(("POINT", name if number == 1 else f"{name}{number}"))) is not None:
            found += [str(word) for word in part]
            number += 1
        return found

    def word(self, name: str) -> str:
        """The first word of a parameter of POINT; empty where there is none."""
        return next(iter(self.words(name)), "")


def read_header(path: _Path, data: bytes) -> Header:
    """Return the header of a C3D file; FormatError with the byte where it is damaged or its data is not there."""
    if len(data) < 2 * _BLOCK or data[1] != _KEY:
        raise FormatError(path, "not a C3D file, or cut short", byte=min(len(data), 1))
    begin = (data[0] - 1) * _BLOCK
    if begin < _BLOCK or begin + 4 > len(data):
        raise FormatError(path, f"the parameters are said to begin in block {data[0]}, which is not there", byte=0)
    processor = data[begin + 3]
    if processor not in _ORDERS:
        raise FormatError(path, f"the processor type is {processor}, want 84, 85 or 86", byte=begin + 3)
    order, is_dec = _ORDERS[processor], processor == _DEC
    try:
        parameters, end = _Chain(path, data, order, is_dec).read(begin)
    except (struct.error, IndexError):
        raise FormatError(path, "the parameters are damaged or cut short", byte=begin) from None
    return _agreed(path, data, parameters, end, order, is_dec)


def dec_floats(words: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """DEC's F floats, read as little-endian uint32, as float32: their halves stand swapped, their exponent 2 higher."""
    swapped = (words << np.uint32(16)) | (words >> np.uint32(16))
    with np.errstate(invalid="ignore", over="ignore"):
        floats: np.ndarray[Any, Any] = swapped.astype("<u4").view("<f4") * np.float32(0.25)
    return np.where(swapped & np.uint32(0x7F800000), floats, np.float32(0))


class _Chain:
    """Walks the chain of groups and parameters."""

    def __init__(self, path: _Path, data: bytes, order: Order, is_dec: bool) -> None:
        self.path, self.data, self.order, self.is_dec = path, data, order, is_dec
        self.left = len(data)

    def read(self, begin: int) -> tuple[Parameters, int]:
        """All parameters by group and name, and the byte at which the chain ends."""
        groups: dict[int, str] = {}
        found: list[tuple[int, str, list[Any]]] = []
        place = begin + 4
        while True:
            length, group = struct.unpack_from("bb", self.data, place)
            if length == 0 or group == 0:
                break
            length = abs(length)
            name = self.data[place + 2 : place + 2 + length].decode("latin-1").strip().upper()
            step = place + 2 + length
            (offset,) = struct.unpack_from(f"{self.order}H", self.data, step)
            if group < 0:
                groups[-group] = name
            else:
                found.append((group, name, self._values(step + 2)))
            if offset == 0:
                break
            if offset < 2:
                raise FormatError(self.path, "the chain of parameters is broken", byte=step)
            place = step + offset
        return {(groups.get(group, ""), name): values for group, name, values in found}, place

    def _values(self, place: int) -> list[Any]:
        kind, count = struct.unpack_from("bB", self.data, place)
        sizes = list(self.data[place + 2 : place + 2 + count])
        start, total = place + 2 + count, math.prod(sizes)
        if kind not in _DTYPES:
            raise FormatError(self.path, f"a parameter has type {kind}, which does not exist", byte=place)
        self.left -= total * abs(kind)
        if start + total * abs(kind) > len(self.data) or self.left < 0:
            raise FormatError(self.path, "the parameters are longer than the file", byte=place)
        if kind == -1:
            width = sizes[0] if sizes else 1
            raw = self.data[start : start + total]
            return [raw[at : at + width].decode("latin-1").strip(" \0") for at in range(0, total, max(width, 1))]
        dtype = np.dtype(_DTYPES[kind]).newbyteorder(self.order)
        values = np.frombuffer(self.data, dtype, total, start)
        if kind == 4:
            values = dec_floats(values) if self.is_dec else values.view(np.dtype("f4").newbyteorder(self.order))
        return list(values.tolist())


def _agreed(path: _Path, data: bytes, parameters: Parameters, end: int, order: Order, is_dec: bool) -> Header:
    points, analog, first, last = struct.unpack_from(f"{order}HHHH", data, 2)
    block, _ = struct.unpack_from(f"{order}HH", data, 16)
    scale, rate = (_float(data, place, order, is_dec) for place in (12, 20))
    scale, rate = (_first(parameters, name, value) for name, value in (("SCALE", scale), ("RATE", rate)))
    used = int(_first(parameters, "USED", points)) & 0xFFFF
    if used != points or not points:
        raise FormatError(path, f"the header says {points} points, POINT:USED {used}", byte=2)
    if not math.isfinite(scale) or scale == 0:
        raise FormatError(path, f"POINT:SCALE is {scale}", byte=12)
    if not 1e-3 <= rate <= 1e5:
        raise FormatError(path, f"the frame rate is {rate}", byte=20)
    frames = _frames(path, parameters, first, last)
    stride = (4 * points + analog) * (4 if scale < 0 else 2)
    starts = {block, int(_first(parameters, "DATA_START", block)) & 0xFFFF}
    fitting = [start for start in starts if _fits(len(data), (start - 1) * _BLOCK, end, frames * stride, stride)]
    if len(fitting) != 1:
        start = max(0, (block - 1) * _BLOCK)
        there = max(0, len(data) - start) // stride
        problem = f"the header announces {frames} frames of {points} points, the file holds {there}"
        raise FormatError(path, problem, byte=min(len(data), start + frames * stride))
    start = (fitting[0] - 1) * _BLOCK
    return Header(parameters, points, frames, rate, max(scale, 0.0), start, stride, order, is_dec)


def _fits(size: int, start: int, end: int, length: int, stride: int) -> bool:
    """Whether data of ``length`` bytes lies behind the parameters and nothing but the last block's rest behind it."""
    behind = size - start - length
    return start >= end and 0 <= behind < max(_BLOCK, min(stride, 2 * _BLOCK))


def _float(data: bytes, place: int, order: Order, is_dec: bool) -> float:
    words = np.frombuffer(data, np.dtype("u4").newbyteorder(order), 1, place)
    return float((dec_floats(words) if is_dec else words.view(np.dtype("f4").newbyteorder(order)))[0])


def _first(parameters: Parameters, name: str, otherwise: float) -> float:
    """A number of POINT, or ``otherwise`` where it is missing or no finite number."""
    value = next(iter(parameters.get(("POINT", name), [])), otherwise)
    return value if isinstance(value, int | float) and math.isfinite(value) else otherwise


def _frames(path: _Path, parameters: Parameters, first: int, last: int) -> int:
    """How many frames are announced: header, POINT:FRAMES and TRIAL must agree, as far as each can count."""
    said = {"the header": last - first + 1}
    for name in ("FRAMES", "LONG_FRAMES"):
        if ("POINT", name) in parameters:
            said[f"POINT:{name}"] = int(_first(parameters, name, 0))
    ends = [parameters.get(("TRIAL", f"ACTUAL_{which}_FIELD"), []) for which in ("START", "END")]
    if all(len(end) == 2 and isinstance(end[0], int) for end in ends):
        begin, finish = ((end[0] & 0xFFFF) + ((end[1] & 0xFFFF) << 16) for end in ends)
        said["TRIAL"] = finish - begin + 1
    most = max(said.values())
    for who, count in said.items():
        # In a longer clip a count of 16 bits is cut off or stands at its limit.
        is_short = most > 0x7FFF and ((most - count) % 0x10000 == 0 or count & 0xFFFF in (0x7FFF, 0xFFFF))
        if count != most and not is_short and (who, last) != ("the header", 0xFFFF):
            listed = ", ".join(f"{name} {number}" for name, number in said.items())
            raise FormatError(path, f"the counts of frames disagree: {listed}", byte=6)
    if most < 1:
        raise FormatError(path, "the file says it has no frames", byte=6)
    return most
