"""Writes a shot file for a folder of drawn frames: what each sequence is, is told by the annotations or by names."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from pegbar.errors import MissingFrameError
from pegbar.io.annotations import read_annotations
from pegbar.io.camera_cells import camera_moves
from pegbar.io.exposure import Exposure
from pegbar.io.exposure_sheet import read_exposure_sheet
from pegbar.io.frames import read_picture
from pegbar.io.numbers import format_frames
from pegbar.io.sequence import FrameSequence, find_sequences
from pegbar.layer.dots import flat_colors
from pegbar.scene.body import MARKERS, limbs_between
from pegbar.shot.record import FOLDER as RECORDS

# Which words in folder or file names say what a sequence holds; the first that fits counts, plain drawings come last.
_KINDS = {
    "holdout": r"\b(hold-?outs?|mattes?|align|overlays?)\b",
    "dots": r"\b(dots?|joints?|marks?)\b",
    "depth": r"\b(z?depth|z)\b",
    "beauty": r"\b(beauty|pass(es)?|renders?|rgba)\b",
    "labels": r"\b(labels?|seg|segmentation|masks?|limbs?|colou?rs?)\b",
}
# Pictures in which colours of dots and limbs are looked for: a joint may be hidden in some.
_LOOKED_AT = 8
_SIDED = ("shoulder", "elbow", "hand", "hip", "knee", "foot")
_EXAMPLES = {
    "labels": "labels/labels.####.png",
    "annotations": "annotation.json",
    "beauty": "passes/beauty.####.exr",
    "depth": "passes/depth.####.exr",
}


def start_shot(folder: Path, drawings: str | None = None, exposure: Path | None = None) -> str:
    """Return the text of a shot file for the drawn frames in ``folder`` and the folders below it.

    ``drawings`` names their sequence where it cannot be told, ``exposure`` is an exposure sheet. Raises
    MissingFrameError where there is no picture sequence, and ValueError where several could be the drawings.
    """
    folder = folder.absolute()
    annotations = _annotations(folder)
    named = _named_by(annotations)
    found: dict[str, list[FrameSequence]] = {"drawings": [], **{kind: [] for kind in _KINDS}}
    chosen = FrameSequence.parse(folder / drawings) if drawings else None
    for sequence in find_sequences(folder):
        if (sequence.folder / RECORDS).is_dir() or _is(sequence, chosen):
            continue
        first = sequence.path(sequence.numbers[0]).absolute()
        found[named.get(first) or _kind(sequence, folder)].append(sequence)
    if chosen is not None:
        found["drawings"] = [chosen]
    if not found["drawings"] or not found["drawings"][0].numbers:
        raise MissingFrameError(f"{folder}: no sequence of drawn frames (numbered pictures) here")
    if len(found["drawings"]) > 1:
        names = ", ".join(_relative(sequence, folder) for sequence in found["drawings"])
        raise ValueError(f"{folder}: several sequences could be the drawings: {names}; choose with --drawings")
    text = _text(folder, found["drawings"][0], found, annotations)
    return text if exposure is None else _with_sheet(text, folder, exposure, found["drawings"][0])


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


def _is(sequence: FrameSequence, chosen: FrameSequence | None) -> bool:
    return chosen is not None and sequence.path(sequence.numbers[0]) == chosen.path(sequence.numbers[0])


def _kind(sequence: FrameSequence, folder: Path) -> str:
    name = _relative(sequence, folder).lower().replace("_", " ")
    for kind, words in _KINDS.items():
        if re.search(words, name):
            return kind
    return "beauty" if name.endswith(".exr") else "drawings"


def _relative(sequence: FrameSequence, folder: Path) -> str:
    return Path(sequence.pattern).absolute().relative_to(folder).as_posix()


def _text(
    folder: Path, drawings: FrameSequence, found: dict[str, list[FrameSequence]], annotations: Path | None
) -> str:
    height, width = read_picture(drawings.path(drawings.numbers[0])).shape[:2]
    values = {kind: _relative(found[kind][0], folder) for kind in ("labels", "beauty", "depth") if found[kind]}
    if annotations is not None:
        values["annotations"] = annotations.name
    elif found["dots"]:
        values["annotations"] = "annotation.json"
    taken = {Path(value).parent.as_posix() for value in values.values()}
    own = "depth" if "depth" not in taken else "drawing_depth"
    return f"""\
[shot]
name = {_quoted(folder.name)}
frames = "{format_frames(drawings.numbers).replace(" ", "")}"
{_rate(annotations)}
size = [{width}, {height}]

[drawing]
frames = {_quoted(_relative(drawings, folder))}
{_line("labels", values)}
{_line("annotations", values)}
matte = "auto"               # auto, ink, unmix, fill or alpha
# hold = 2                   # each drawing is shown for two frames; then take the line frames = ... above away
# tolerance = 30             # limb colours that are scanned or antialiased

# [drawing.palette]          # further colours and the limbs that they belong to
# "#8a4b2a" = "head"

# [clip]                     # motion capture: pegbar align finds cameras and depths with it
# folder = "../mocap"        # clips to choose from; pegbar match --write names the best one here

{"" if "beauty" in values else "# "}[passes]
{_line("beauty", values)}
{_line("depth", values)}

[output]
frames = "final/final.####.png"
depth = "{own}/depth.####.exr"
depth_picture = "{own}/depth.####.png"
# holdout = "holdout/holdout.####.png"   # the matte that holds the render out, for Nuke or Natron

# [secondary]                # cloth and balls that collide with the drawing: pegbar secondary
# elements = ["scarves", "skirt", "balls"]
{_dots(found, folder)}"""


def _rate(annotations: Path | None) -> str:
    """The line of the frame rate: as the annotations say, or left open, for the search to find."""
    rate = None if annotations is None else read_annotations(annotations).frame_rate
    if rate is not None:
        return f"frame_rate = {rate:g}"
    return "# frame_rate = 24          # film frames a second; pegbar match --write finds it where it stands open"


def _dots(found: dict[str, list[FrameSequence]], folder: Path) -> str:
    """The sections for a layer of dots: its colours, for the user to say which joint and limb each is."""
    if not found["dots"]:
        return ""
    joints = "".join(f'# "{color}" = "?"    # {place}\n' for color, place in _colors(found["dots"][0]))
    limbs = "".join(
        f'# ? = "{color}"    # {place}\n' for labels in found["labels"][:1] for color, place in _colors(labels)
    )
    return f"""
[dots]
frames = {_quoted(_relative(found["dots"][0], folder))}

[dots.joints]                # for every colour its joint; then run: pegbar dots
# {", ".join(MARKERS[:4])}, and left_ and right_ {", ".join(_SIDED)}
{joints}
[dots.limbs]                 # for every limb its colour in the label pictures, none where there are none
# {", ".join(limb.name for limb in limbs_between(MARKERS) if not limb.name.startswith("right_"))}, and right_ ...
{limbs}"""


def _colors(sequence: FrameSequence) -> Iterator[tuple[str, str]]:
    """The colours in some pictures of ``sequence``, and where each is seen."""
    known = set()
    numbers = sequence.numbers
    for number in numbers[:: max(1, len(numbers) // _LOOKED_AT)]:
        path = sequence.path(number)
        for color, (x, y) in flat_colors(read_picture(path)).items():
            if color not in known:
                known.add(color)
                yield f"#{bytes(color).hex()}", f"at x {x}, y {y} in {path.name}"


def _with_sheet(text: str, folder: Path, exposure: Path, drawings: FrameSequence) -> str:
    """The shot file with the sheet in it, and with the sheet's frames; FormatError for one that cannot be read."""
    sheet = read_exposure_sheet(exposure)
    name = next(iter(sheet.levels)) if len(sheet.levels) > 1 else None
    for level in sheet.levels:
        if drawings.prefix.strip("._-").lower() == level.lower():
            name = level if len(sheet.levels) > 1 else None
    path = Path(os.path.relpath(exposure.absolute(), folder)).as_posix()
    lines = f"exposure = {_quoted(path)}\n"
    if name is not None:
        lines += f"level = {_quoted(name)}   # of {', '.join(sheet.levels)}\n"
    if camera_moves(sheet.camera, exposure.name)[0] is not None:
        lines += (
            'camera = "sheet"            # its moves are made; "drawn": the drawings are seen through them already\n'
        )
    frames = list(Exposure.of_cells(sheet.level(name), sheet.first_frame).frames)
    text = re.sub(r'(?m)^frames = ".*"$', f'frames = "{format_frames(frames).replace(" ", "")}"', text, count=1)
    return re.sub(r"(?m)^# hold = 2 .*\n", lambda _: lines, text)


def _line(key: str, values: dict[str, str]) -> str:
    return f"{key} = {_quoted(values[key])}" if key in values else f'# {key} = "{_EXAMPLES[key]}"'


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
