"""Numbered files as one sequence, in the notations that animators type: ``d.####.png``, ``d.%04d.png``, a folder."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from pegbar.errors import FormatError, MissingFrameError
from pegbar.io.numbers import format_frames, parse_frames

_Path = str | os.PathLike[str]
_SUFFIXES = (".png", ".tif", ".tiff", ".jpg", ".jpeg", ".exr")
# The last run of number signs or printf field; a range may stand before it if it cannot be part of a word.
_PATTERN = re.compile(
    r"(?P<prefix>.*?)"
    r"(?P<range>(?<!\d)\d+-\d+(?:x\d+)?(?:,\d+(?:-\d+(?:x\d+)?)?)*|(?<![^._])\d+(?:,\d+(?:-\d+(?:x\d+)?)?)*)?"
    r"(?P<field>#+|@+|%0?\d*d)(?P<suffix>[^#@%]*)",
    re.DOTALL,
)
_NUMBERED = re.compile(r"(?P<prefix>.*?)(?P<number>(?<![^._])-\d+|\d+)(?P<suffix>\.[^.]*)", re.DOTALL)


@dataclass(frozen=True)
class FrameSequence:
    """Files that differ in a frame number only.

    ``numbers`` are the frames named by the pattern's range, else those found on disk, in rising order. ``padding`` is
    the least number of digits.
    """

    folder: Path
    prefix: str
    suffix: str
    padding: int
    numbers: tuple[int, ...]
    _found: Mapping[int, str] = field(default_factory=dict, repr=False, compare=False)

    @classmethod
    def parse(cls, pattern: _Path) -> FrameSequence:
        """Return the sequence that ``pattern`` names; folders that do not exist yet are allowed (for output).

        Parameters
        ----------
        pattern : path
            ``d.####.png`` (four digits; one ``#`` alone: as on disk, else four), ``d.%04d.png``, ``d.@@.png``, a
            range before the field (``d.1-48#.png``, ``d.1-48x2####.png``), a folder with one sequence of pictures
            in it, or one file. ``#``, ``@`` and ``%`` in folder names are letters like others.

        Raises
        ------
        ValueError
            For a range of more than a million frames or one that runs backwards.
        FormatError
            For a folder with no sequence or several (which it lists), or a frame that stands there twice.
        FileNotFoundError
            For a name without a number field that is no file or folder.

        Examples
        --------
        >>> sequence = FrameSequence.parse("shots/a/walk.1-12x2####.png")
        >>> sequence.numbers
        (1, 3, 5, 7, 9, 11)
        >>> sequence.path(3).name
        'walk.0003.png'
        """
        path = Path(pattern)
        if path.is_dir():
            return _only_sequence(path)
        if path.is_file():
            return _single_file(path)
        match = _PATTERN.fullmatch(path.name)
        if not match:
            raise FileNotFoundError(2, "No such file, folder or pattern like name.####.png", os.fspath(pattern))
        padding = _padding(match["field"])
        found = _scan(path.parent, match["prefix"], match["suffix"], padding)
        if padding is None:
            padding = min((len(name) - len(match["prefix"] + match["suffix"]) for name in found.values()), default=4)
        numbers = sorted(parse_frames(match["range"])) if match["range"] else sorted(found)
        return cls(path.parent, match["prefix"], match["suffix"], padding, tuple(numbers), found)

    @property
    def pattern(self) -> str:
        """The sequence as one writes it: ``folder/d.####.png``."""
        return str(self.folder / f"{self.prefix}{'#' * self.padding}{self.suffix}")

    def path(self, number: int) -> Path:
        """Return the file of frame ``number``, whether it exists or not."""
        name = self._found.get(number)
        return self.folder / (name or f"{self.prefix}{_format(number, self.padding)}{self.suffix}")

    def missing(self, numbers: Iterable[int] | None = None) -> list[int]:
        """Return those of ``numbers`` (None: the sequence's own) that are not on disk now."""
        return [number for number in (self.numbers if numbers is None else numbers) if not self.path(number).is_file()]

    def require(self, numbers: Iterable[int] | None = None) -> None:
        """Raise MissingFrameError, naming every one, if any of ``numbers`` (None: its own) is not on disk now."""
        wanted = list(self.numbers if numbers is None else numbers)
        if not wanted:
            raise MissingFrameError(f"{self.pattern}: no frames")
        missing = self.missing(wanted)
        if missing:
            raise MissingFrameError(f"{self.pattern}: missing {format_frames(missing)}")


def _format(number: int, padding: int) -> str:
    return f"{number:0{padding + (number < 0)}d}"


def _padding(text: str) -> int | None:
    """Digits of a number field; None for a lone #, which takes what is there."""
    if text == "#":
        return None
    return int(text[1:-1] or 1) if text[0] == "%" else len(text)


def _scan(folder: Path, prefix: str, suffix: str, padding: int | None) -> dict[int, str]:
    """File names by number; a number is written with exactly ``padding`` digits, or with more and no leading zero."""
    sign = "-?" if not prefix or prefix[-1] in "._" else ""
    body = re.compile(f"{re.escape(prefix)}({sign}[0-9]+){re.escape(suffix)}")
    found: dict[int, str] = {}
    for name in _names(folder):
        match = body.fullmatch(name)
        if not match or (padding is not None and _format(int(match[1]), padding) != match[1]):
            continue
        _add(found, folder, int(match[1]), name)
    return found


def _add(found: dict[int, str], folder: Path, number: int, name: str) -> None:
    if number in found:
        raise FormatError(folder, f"frame {number} stands there twice: {found[number]} and {name}")
    found[number] = name


def _names(folder: Path) -> list[str]:
    try:
        with os.scandir(folder) as entries:
            return sorted(entry.name for entry in entries if not entry.name.startswith(".") and entry.is_file())
    except FileNotFoundError:
        return []


def _only_sequence(folder: Path) -> FrameSequence:
    groups: dict[tuple[str, str], dict[int, str]] = {}
    pictures = [name for name in _names(folder) if name.lower().endswith(_SUFFIXES)]
    for name in pictures:
        match = _NUMBERED.fullmatch(name)
        if match:
            _add(groups.setdefault((match["prefix"], match["suffix"]), {}), folder, int(match["number"]), name)
    sequences = [_sequence(folder, prefix, suffix, found) for (prefix, suffix), found in groups.items()]
    if len(sequences) == 1:
        return sequences[0]
    if sequences:
        names = ", ".join(f"{Path(s.pattern).name} {format_frames(s.numbers)}" for s in sequences[:8])
        more = f" and {len(sequences) - 8} more" if len(sequences) > 8 else ""
        raise FormatError(folder, f"holds several sequences, name one: {names}{more}")
    raise FormatError(folder, f"holds no numbered pictures ({', '.join(_SUFFIXES)})")


def _single_file(path: Path) -> FrameSequence:
    match = _NUMBERED.fullmatch(path.name)
    if match:
        return _sequence(path.parent, match["prefix"], match["suffix"], {int(match["number"]): path.name})
    return FrameSequence(path.parent, path.stem, path.suffix, 1, (1,), {1: path.name})


def _sequence(folder: Path, prefix: str, suffix: str, found: dict[int, str]) -> FrameSequence:
    digits = [len(name) - len(prefix + suffix) - (number < 0) for number, name in found.items()]
    return FrameSequence(folder, prefix, suffix, min(digits), tuple(sorted(found)), found)
