"""Frame numbers as people write them: ``1-48``, ``1-10,20``, ``1-48x2``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path

#: A longer list of frames is a slip of the finger: eleven hours of film.
MAX_FRAMES = 1_000_000
_RUN = re.compile(r"(-?\d{1,9})(?:-(-?\d{1,9})(?:x(\d{1,9}))?)?")


def parse_frames(text: str) -> list[int]:
    """Return the frame numbers that ``text`` names, in its order, each once.

    Parameters
    ----------
    text : str
        Numbers and runs, ``first-last`` or ``first-lastxstep``, with commas between.

    Raises
    ------
    ValueError
        For anything else, a run that ends before it begins, and more than ``MAX_FRAMES`` frames.

    Examples
    --------
    >>> parse_frames("1-4,20")
    [1, 2, 3, 4, 20]
    >>> parse_frames("1-8x2")
    [1, 3, 5, 7]
    """
    runs, count = [], 0
    for word in text.split(","):
        match = _RUN.fullmatch(word.strip())
        if not match:
            raise ValueError(f"frames: want numbers and runs like 1-48, 1-10,20 or 1-48x2, got {text!r}")
        first, step = int(match[1]), int(match[3] or 1)
        last = first if match[2] is None else int(match[2])
        if last < first or step < 1:
            raise ValueError(f"frames: {word.strip()} runs backwards or on the spot")
        runs.append(range(first, last + 1, step))
        count += len(runs[-1])
    if count > MAX_FRAMES:
        raise ValueError(f"frames: {text} is {count} frames, more than {MAX_FRAMES}")
    return list(dict.fromkeys(number for run in runs for number in run))


def format_frames(numbers: Iterable[int]) -> str:
    """Return ``numbers`` as sorted runs, which ``parse_frames`` reads.

    Examples
    --------
    >>> format_frames([7, 12, 13, 14, 15, 20, 22, 24])
    '7, 12-15, 20-24x2'
    """
    ordered = sorted(set(numbers))
    words, place = [], 0
    while place < len(ordered):
        end = place + 1
        step = ordered[end] - ordered[place] if end < len(ordered) else 1
        while end < len(ordered) and ordered[end] - ordered[end - 1] == step:
            end += 1
        # Two numbers apart say more than a run with a step.
        if end - place < 3 and step > 1:
            end = place + 1
        first, last = ordered[place], ordered[end - 1]
        words.append(f"{first}" if first == last else f"{first}-{last}" + (f"x{step}" if step > 1 else ""))
        place = end
    return ", ".join(words)


def file_numbers(paths: Sequence[Path]) -> list[int] | None:
    """Return the numbers at the ends of the files' names; None where one has none, or they do not rise.

    Examples
    --------
    >>> file_numbers([Path("walk.0007.png"), Path("walk.0009.png")])
    [7, 9]
    """
    found = [re.search(r"(\d{1,9})$", path.stem) for path in paths]
    numbers = [int(match[1]) for match in found if match]
    rising = all(first < second for first, second in pairwise(numbers))
    return numbers if numbers and len(numbers) == len(paths) and rising else None
