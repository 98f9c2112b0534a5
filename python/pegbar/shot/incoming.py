"""Rendered passes as they come back from another package: which files, frames, sizes and channels there are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import FormatError, describe
from pegbar.io import exr_channels, exr_header
from pegbar.io.exr import read_exr
from pegbar.io.numbers import format_frames
from pegbar.io.sequence import FrameSequence

#: The layer with limbs and ground alone, as the export's script renders it.
CHECK = "check"
Kind = Literal["ok", "mended", "guess", "problem"]


@dataclass(frozen=True)
class Finding:
    """A line of the table: ``what`` was looked at, where, what was found, and how to mend it."""

    kind: Kind
    what: str
    where: str
    found: str
    remedy: str = ""


@dataclass(frozen=True)
class Names:
    """Channels by what they are: the beauty's R, G, B, A (or fewer), the depth, and the check layer's depth."""

    beauty: tuple[str, ...]
    depth: str
    check: str | None


@dataclass(frozen=True, eq=False)
class Incoming:
    """Sequences of EXR files: the first with a beauty pass, and the first with a depth pass.

    A file's number plus ``shift`` is its film frame; ``layer`` says which layer counts where there are several.
    """

    beauty: FrameSequence
    depth: FrameSequence
    shift: int = 0
    layer: str | None = None

    @classmethod
    def find(cls, patterns: Sequence[str], shift: int, layer: str | None) -> Incoming:
        """Return the passes that ``patterns`` name; FormatError for files that have none, listing their channels."""
        sequences = [FrameSequence.parse(pattern) for pattern in patterns]
        for sequence in sequences:
            sequence.require()
            if sequence.suffix.lower() != ".exr":
                raise FormatError(sequence.pattern, "want EXR files: they alone hold depth in units of length")
        beauty = _first(sequences, layer, exr_channels.find_beauty)
        return cls(beauty, _first(sequences, layer, exr_channels.find_depth), shift, layer)

    def paths(self, frame: int) -> list[Path]:
        """The files of film ``frame``, each once."""
        number = frame - self.shift
        return list(dict.fromkeys([self.beauty.path(number), self.depth.path(number)]))

    def names(self, frame: int) -> Names:
        """Which channels of ``frame`` are what; FormatError where one is missing or there are several."""
        beauty, *rest = self.paths(frame)
        own = _channels(beauty)
        theirs = _channels(rest[0]) if rest else own
        check = [name for name in theirs if _of_check(name)]
        return Names(
            tuple(exr_channels.find_beauty(beauty, _but_check(own), self.layer)),
            exr_channels.find_depth((rest or [beauty])[0], _but_check(theirs), self.layer),
            exr_channels.find_depth(beauty, check) if any(".z" in name.lower() for name in check) else None,
        )

    def read(self, frame: int) -> tuple[dict[str, NDArray[Any]], Names]:
        """Return every channel of ``frame`` (H, W), and which is what; a name in both files is the depth file's."""
        channels: dict[str, NDArray[Any]] = {}
        for path in self.paths(frame):
            for name, plane in read_exr(path).channels.items():
                channels[f"beauty.{name}" if name in channels and name in self.names(frame).beauty else name] = plane
        return channels, self.names(frame)


def joined(channels: dict[str, NDArray[Any]], names: tuple[str, ...]) -> NDArray[np.float32]:
    """Return the beauty (H, W, 4), grey and opaque where its channels say nothing else."""
    planes = [np.asarray(channels[name], np.float32) for name in names]
    if len(planes) in (1, 3):
        planes.append(np.ones_like(planes[0]))
    return np.stack([planes[0]] * 3 + planes[1:] if len(planes) == 2 else planes, axis=-1)


def structure(incoming: Incoming, frames: Sequence[int], size: tuple[int, int]) -> list[Finding]:
    """Return what is found of frame numbers, files, sizes and channels, ``size`` being the drawings'."""
    found = [_numbers(incoming, frames)]
    there = [frame for frame in frames if all(path.is_file() for path in incoming.paths(frame))]
    sizes: dict[tuple[int, int], list[int]] = {}
    layouts: dict[Names, list[int]] = {}
    for frame in there:
        try:
            for path in incoming.paths(frame):
                for part in exr_header.read_header(path):
                    sizes.setdefault(part.size, []).append(frame)
            layouts.setdefault(incoming.names(frame), []).append(frame)
        except (FormatError, OSError) as error:
            found.append(Finding("problem", "file", f"frame {frame}", describe(error), "render it again"))
    found += [_size(one, held, size) for one, held in sizes.items()]
    if len(sizes) > 1:
        most = max(sizes, key=lambda one: len(sizes[one]))
        odd = sorted({frame for one, held in sizes.items() if one != most for frame in held})
        found.append(Finding("problem", "size", _frames(odd), f"not {most[0]} x {most[1]} as the others"))
    if layouts:
        first, *others = sorted(layouts, key=lambda names: -len(layouts[names]))
        check = f", to check by: {first.check}" if first.check else ""
        shown = f"colour {_short(first.beauty)}; depth {first.depth}{check}"
        found.append(Finding("ok", "channels", _frames(layouts[first]), shown))
        found += [
            Finding("problem", "channels", _frames(layouts[other]), f"colour {_short(other.beauty)}; depth "
                    f"{other.depth}", "render all frames with the same layers")
            for other in others
        ]  # fmt: skip
    return found


def _short(names: Sequence[str]) -> str:
    """``ViewLayer.Combined.RGBA`` for the four channels of a layer."""
    layer = names[0].rpartition(".")[0]
    letters = "".join(name.rpartition(".")[2] for name in names)
    return f"{layer}.{letters}" if layer else letters


def _numbers(incoming: Incoming, frames: Sequence[int]) -> Finding:
    there = set(incoming.beauty.numbers) & set(incoming.depth.numbers)
    numbers = sorted(number + incoming.shift for number in there)
    missing = sorted(set(frames) - set(numbers))
    if not missing:
        spare = sorted(set(numbers) - set(frames))
        more = f"; {_frames(spare)} not used" if spare else ""
        return Finding("ok", "frames", _frames(frames), f"all there{more}")
    if not numbers:
        return Finding("problem", "frames", _frames(frames), "no file has both colour and depth")
    if len(numbers) == len(frames) and numbers[-1] - numbers[0] == frames[-1] - frames[0]:
        shift = frames[0] - numbers[0] + incoming.shift
        remedy = f"--shift {shift}, if they are the same pictures"
        return Finding("problem", "frames", _frames(frames), f"numbered {_frames(numbers)}", remedy)
    return Finding("problem", "frames", _frames(missing), "missing", "render them, or name others with --frames")


def _size(found: tuple[int, int], held: Sequence[int], size: tuple[int, int]) -> Finding:
    factor, where, text = found[0] // size[0], _frames(sorted(set(held))), f"{found[0]} x {found[1]} pixels"
    if factor >= 1 and found == (size[0] * factor, size[1] * factor):
        return Finding("ok", "size", where, text if factor == 1 else f"{text}: {factor} times the drawing's")
    share = found[0] / size[0]
    whole = found[0] * size[1] == found[1] * size[0]
    remedy = f"render {size[0]} x {size[1]} pixels" + (f": this is {share:.0%} of it" if whole else "")
    return Finding("problem", "size", where, f"{text}, the drawing has {size[0]} x {size[1]}", remedy)


def _first(sequences: Sequence[FrameSequence], layer: str | None, find: Any) -> FrameSequence:
    """The first sequence whose first file has what ``find`` looks for; its error where none has."""
    errors = []
    for sequence in sequences:
        path = sequence.path(sequence.numbers[0])
        try:
            find(path, _but_check(_channels(path)), layer)
        except FormatError as error:
            errors.append(error)
        else:
            return sequence
    raise errors[0]


def _channels(path: Path) -> list[str]:
    """All channels' names, as `read_exr` gives them."""
    parts = exr_header.read_header(path)
    return [
        name if len(parts) == 1 or not part.name or name.startswith(f"{part.name}.") else f"{part.name}.{name}"
        for part in parts
        for name in part.channels
    ]


def _but_check(names: Sequence[str]) -> list[str]:
    return [name for name in names if not _of_check(name)]


def _of_check(name: str) -> bool:
    return CHECK in name.lower().split(".")[:-1]


def _frames(numbers: Sequence[int]) -> str:
    return ("frame " if len(numbers) == 1 else "frames ") + format_frames(list(numbers))
