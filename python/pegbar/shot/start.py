"""Writes a shot file for a folder of drawn frames: what each sequence is, is told by the annotations or by names."""

from __future__ import annotations

import re
from pathlib import Path

from pegbar.errors import MissingFrameError
from pegbar.io.annotations import read_annotations
from pegbar.io.frames import read_picture
from pegbar.io.numbers import format_frames
from pegbar.io.sequence import FrameSequence, find_sequences

# Which folder or file names say what a sequence holds; the first that fits counts, plain drawings come last.
_KINDS = {
    "made by pegbar": r"(^|/)(final|holdout)(/|\.)|^depth/depth\.",
    "beauty": r"beauty|passes|render|rgba",
    "depth": r"depth|(^|/)z\.",
    "labels": r"label|(^|/)seg|mask|limb|colou?r",
}
_EXAMPLES = {
    "labels": "labels/labels.####.png",
    "annotations": "annotation.json",
    "beauty": "passes/beauty.####.exr",
    "depth": "passes/depth.####.exr",
}


def start_shot(folder: Path) -> str:
    """Return the text of a shot file for the drawn frames in ``folder`` and the folders below it.

    Raises MissingFrameError where there is no picture sequence, and ValueError where several could be the drawings.
    """
    annotations = _annotations(folder)
    named = _named_by(annotations)
    found: dict[str, list[FrameSequence]] = {"drawings": [], **{kind: [] for kind in _KINDS}}
    for sequence in find_sequences(folder):
        first = sequence.path(sequence.numbers[0]).absolute()
        found[named.get(first) or _kind(sequence, folder)].append(sequence)
    if not found["drawings"]:
        raise MissingFrameError(f"{folder}: no sequence of drawn frames (numbered pictures) here")
    if len(found["drawings"]) > 1:
        names = ", ".join(_relative(sequence, folder) for sequence in found["drawings"])
        raise ValueError(f"{folder}: several sequences could be the drawings: {names}; move the others or rename them")
    return _text(folder, found["drawings"][0], found, annotations)


def _annotations(folder: Path) -> Path | None:
    """The first JSON file here that is an annotation."""
    for path in sorted(folder.glob("*.json")):
        try:
            read_annotations(path)
        except (ValueError, OSError):
            continue
        return path
    return None


def _named_by(annotations: Path | None) -> dict[Path, str]:
    """What the annotations say of picture files."""
    if annotations is None:
        return {}
    marks = read_annotations(annotations)
    return {
        **{path.absolute(): "labels" for path in marks.segmentations},
        **{path.absolute(): "drawings" for path in marks.images},
    }


def _kind(sequence: FrameSequence, folder: Path) -> str:
    name = _relative(sequence, folder).lower()
    for kind, words in _KINDS.items():
        if re.search(words, name):
            return kind
    return "beauty" if name.endswith(".exr") else "drawings"


def _relative(sequence: FrameSequence, folder: Path) -> str:
    return Path(sequence.pattern).absolute().relative_to(folder.absolute()).as_posix()


def _text(
    folder: Path, drawings: FrameSequence, found: dict[str, list[FrameSequence]], annotations: Path | None
) -> str:
    height, width = read_picture(drawings.path(drawings.numbers[0])).shape[:2]
    values = {kind: _relative(found[kind][0], folder) for kind in ("labels", "beauty", "depth") if found[kind]}
    if annotations is not None:
        values["annotations"] = annotations.name
    return f"""\
[shot]
name = {_quoted(folder.absolute().name)}
frames = "{format_frames(drawings.numbers).replace(" ", "")}"
frame_rate = 24
size = [{width}, {height}]

[drawing]
frames = {_quoted(_relative(drawings, folder))}
{_line("labels", values)}
{_line("annotations", values)}
matte = "auto"               # auto, ink, unmix, fill or alpha

{"" if "beauty" in values else "# "}[passes]
{_line("beauty", values)}
{_line("depth", values)}

[output]
frames = "final/final.####.png"
depth = "depth/depth.####.exr"
"""


def _line(key: str, values: dict[str, str]) -> str:
    return f"{key} = {_quoted(values[key])}" if key in values else f'# {key} = "{_EXAMPLES[key]}"'


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
