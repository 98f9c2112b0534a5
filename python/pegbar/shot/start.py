"""Writes a shot file for a folder of drawn frames, guessing from names what each sequence is."""

from __future__ import annotations

import re
from pathlib import Path

from pegbar.errors import MissingFrameError
from pegbar.io.frames import read_picture
from pegbar.io.numbers import format_frames
from pegbar.io.sequence import FrameSequence, find_sequences

# Which folder or file names say what a sequence holds; the first that fits counts, plain drawings come last.
_KINDS = {
    "beauty": r"beauty|passes|render|rgba",
    "depth": r"depth|zdepth|_z\b",
    "labels": r"label|seg|mask|limb|colou?r",
}


def start_shot(folder: Path) -> str:
    """Return the text of a shot file for the drawn frames in ``folder``.

    Looks into ``folder`` and the folders below it. Raises MissingFrameError where there is no picture sequence, and
    ValueError where several could be the drawings.
    """
    found: dict[str, list[FrameSequence]] = {"drawings": [], **{kind: [] for kind in _KINDS}}
    for sequence in find_sequences(folder):
        found[_kind(sequence, folder)].append(sequence)
    if not found["drawings"]:
        raise MissingFrameError(f"{folder}: no sequence of drawn frames (numbered pictures) here")
    if len(found["drawings"]) > 1:
        names = ", ".join(_relative(sequence, folder) for sequence in found["drawings"])
        raise ValueError(f"{folder}: several sequences could be the drawings: {names}; name one of them instead")
    return _text(folder, found["drawings"][0], found)


def _kind(sequence: FrameSequence, folder: Path) -> str:
    name = _relative(sequence, folder).lower()
    for kind, words in _KINDS.items():
        if re.search(words, name):
            return kind
    return "beauty" if name.endswith(".exr") else "drawings"


def _relative(sequence: FrameSequence, folder: Path) -> str:
    return Path(sequence.pattern).absolute().relative_to(folder.absolute()).as_posix()


def _text(folder: Path, drawings: FrameSequence, found: dict[str, list[FrameSequence]]) -> str:
    height, width = read_picture(drawings.path(drawings.numbers[0])).shape[:2]
    lines = ["[shot]", f"name = {_quoted(folder.absolute().name)}"]
    lines += [f'frames = "{format_frames(drawings.numbers)}"', "frame_rate = 24", f"size = [{width}, {height}]", ""]
    lines += ["[drawing]", f"frames = {_quoted(_relative(drawings, folder))}"]
    labels, annotations = found["labels"], sorted(folder.glob("*.json"))
    lines.append(_line("labels", _relative(labels[0], folder) if labels else None, "labels/labels.####.png"))
    lines.append(_line("annotations", annotations[0].name if annotations else None, "annotation.json"))
    lines += ['matte = "auto"             # auto, ink, unmix, fill or alpha', ""]
    beauty, depth = found["beauty"], found["depth"]
    lines += ["[passes]"] if beauty else ["# [passes]"]
    lines.append(_line("beauty", _relative(beauty[0], folder) if beauty else None, "passes/beauty.####.exr"))
    lines.append(_line("depth", _relative(depth[0], folder) if depth else None, "passes/depth.####.exr"))
    lines += ["", "[output]", 'frames = "final/final.####.png"', 'depth = "depth/depth.####.exr"', ""]
    return "\n".join(lines)


def _line(key: str, value: str | None, example: str) -> str:
    return f"{key} = {_quoted(value)}" if value else f'# {key} = "{example}"'


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
