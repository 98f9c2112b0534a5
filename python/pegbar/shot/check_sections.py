"""Preflight of what is not read frame by frame: colours of limbs, marks, clip, camera, lifting, secondary motion."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from pegbar.errors import describe
from pegbar.io.alignment import read_alignment
from pegbar.io.numbers import format_frames
from pegbar.scene.joints import misspelt_markers
from pegbar.shot.align_stage import AlignStage
from pegbar.shot.clip_choice import check_part, read_clip
from pegbar.shot.dots_stage import DotsStage
from pegbar.shot.lift_stage import LiftStage
from pegbar.shot.model import SecondarySection, parse_color
from pegbar.shot.plan import Shot
from pegbar.shot.problem import Problem, mend
from pegbar.shot.secondary import secondary_problems

_CLIPS = (".bvh", ".amc", ".c3d")
# A drawing that is so many times farther from the clip than the others are usually, and by this part of its height.
_ODD, _ODD_PART = 4.0, 0.1


def section_problems(shot: Shot, *, seen: frozenset[int] | None = None) -> list[Problem]:
    """Return what would stop or spoil the stages of ``shot``, which is opened without what was aligned.

    ``seen`` are the labels that the label pictures show; None: not known.
    """
    found = [
        *_held(shot),
        *_palette(shot, seen),
        *_dots(shot),
        *_marks(shot),
        *_clip(shot),
        *_camera(shot),
        *_lift(shot),
    ]
    if shot.settings.secondary is not None:
        found += _secondary(shot, shot.settings.secondary)
    return found


def _at(shot: Shot, key: str, what: str, how: str = "") -> Problem:
    """A problem of ``key``; a message that begins with a key of its own has that one."""
    own = what.partition(": ")[0]
    if own.partition(".")[0] == key.partition(".")[0] and " " not in own and own != what:
        key, what = own, what.partition(": ")[2]
    return Problem(what, how or mend(what), key, shot.place(key))


def _held(shot: Shot) -> Iterator[Problem]:
    """Drawings that are held, and of which the shot's frames show only the first."""
    hold, frames = shot.settings.drawing.hold, shot.settings.shot.frames
    if not isinstance(hold, int) or hold == 1 or frames is None:
        return
    shown = {shot.exposure.drawing(frame) for frame in shot.frames}
    if unseen := [number for number in shot.drawings.numbers if number not in shown]:
        what = f"drawings {format_frames(unseen)} are shown in no frame: each is held for {hold} of frames {frames}"
        yield replace(_at(shot, "shot.frames", what, "take shot.frames away, or name more frames"), note=True)


def _palette(shot: Shot, seen: frozenset[int] | None) -> Iterator[Problem]:
    """Limb colours that mean two things, and limbs that no label picture shows."""
    marks, drawing = shot.annotations, shot.settings.drawing
    if marks is None or shot.labels is None:
        return
    named = set(drawing.palette.values())
    for limb in marks.limbs:
        if limb.color is None and limb.name not in named:
            what = f"limb {limb.name} has no colour: no label picture can show it"
            yield _at(shot, "drawing.annotations", what, "give it a colour, or name one in [drawing.palette]")
        elif limb.color is not None and drawing.palette.get(name := _hex(limb.color), limb.name) != limb.name:
            what = f"{name} is the colour of {limb.name} in the annotations, and of {drawing.palette[name]} here"
            yield _at(shot, f"drawing.palette.{name}", what, "give every limb a colour of its own")
    for color in (*drawing.palette, *(_hex(limb.color) for limb in marks.limbs if limb.color)):
        if parse_color(color) in {parse_color(other) for other in drawing.background}:
            what = f"{color} is a limb's colour and background as well"
            yield _at(shot, "drawing.background", what, "take it out of drawing.background, or repaint the limb")
    lost = [limb.name for index, limb in enumerate(marks.limbs) if seen is not None and index + 1 not in seen]
    colored = [name for name in lost if name in named or any(b.name == name and b.color for b in marks.limbs)]
    if colored and seen:
        what = f"no label picture shows {', '.join(colored)}"
        yield _at(shot, "drawing.labels", what, "compare the pictures' colours with those of the annotations' limbs")


def _hex(color: tuple[int, int, int]) -> str:
    return "#" + bytes(color).hex()


def _dots(shot: Shot) -> Iterator[Problem]:
    """The layer of dots: its files and its table of colours."""
    if shot.settings.dots is None:
        return
    stage = DotsStage(shot.folder / Path(shot.source).name)
    try:
        stage.joints()
        stage.sequences()
    except (ValueError, OSError) as error:
        yield _at(shot, "dots", describe(error).rpartition(f"{stage.path}: ")[2])


def _marks(shot: Shot) -> Iterator[Problem]:
    """Marks of too few joints, for shots that are to be aligned."""
    if shot.settings.clip is None:
        return
    if shot.annotations is None:
        what = "a clip is aligned with joint marks: drawing.annotations is missing"
        yield _at(shot, "clip", what, "name the joint marks in drawing.annotations")
        return
    stage = AlignStage(shot)
    if not stage.numbers:
        how = "name the drawings' files in the annotations, or set drawing.first_marked"
        yield _at(shot, "drawing.annotations", "they have no marks for the shot's drawings", how)
        return
    drawing = stage.drawing()
    visible = drawing.visible & np.isfinite(drawing.markers).all(axis=2)
    for number, row in zip(stage.numbers, visible, strict=True):
        if row.sum() < 4:
            what = f"drawing {number}: fewer than four joints are marked and seen: pegbar align needs them"
            yield _at(shot, "drawing.annotations", what, "mark more joints in that drawing")


def _clip(shot: Shot) -> Iterator[Problem]:
    section = shot.settings.clip
    if section is None:
        yield from _misspelt(shot, ())
        return
    if section.path is None:
        yield from _misspelt(shot, ())
        assert section.folder is not None
        folder = shot.folder / section.folder
        if not folder.is_dir():
            yield _at(shot, "clip.folder", f"{folder}: no such folder")
        elif not any(path.suffix.lower() in _CLIPS for path in folder.rglob("*")):
            yield _at(shot, "clip.folder", f"{folder}: no {', '.join(_CLIPS)} file in it", "put clips there")
        return
    try:
        motion = read_clip(section, shot.folder, shot.folder / section.path)
        check_part(motion, section)
    except (ValueError, OSError) as error:
        text = describe(error)
        yield _at(shot, "clip.path", text, mend(text) or "correct the value, or see pegbar motion info")
        return
    if shot.annotations is None:
        return
    there = {*motion.known_markers, *motion.names}
    yield from _misspelt(shot, there)
    wrong = misspelt_markers(shot.annotations.names, there)
    lost = [name for name in shot.annotations.names if name not in (*there, *wrong)]
    how = "map them with clip.joints (pegbar motion info shows the clip's joints)"
    if len(shot.annotations.names) - len(lost) - len(wrong) < 4:
        yield _at(shot, "clip.path", f"{section.path} has fewer than four of the drawing's joints", how)
    elif lost:
        yield _at(shot, "clip.path", f"{section.path} has no joint for {', '.join(lost)}", how)


def _misspelt(shot: Shot, known: Iterable[str]) -> Iterator[Problem]:
    """Names in the annotations that are neither markers nor ``known``, and nearly markers."""
    marks = shot.annotations
    for name, near in misspelt_markers(() if marks is None else marks.names, known).items():
        what = f"{shot.settings.drawing.annotations}: no marker is called {name!r} (did you mean {near!r}?)"
        yield _at(shot, "drawing.annotations", what, "correct the name there, in markers and in limbs")


def _camera(shot: Shot) -> Iterator[Problem]:
    """How far the clip is from the marks under the cameras that were found; nothing where none were yet."""
    if shot.settings.clip is None or shot.annotations is None:
        return
    stage = AlignStage(shot)
    values = stage.outputs()[0]
    if not values.is_file():
        return
    try:
        alignment = read_alignment(values)
    except (ValueError, OSError) as error:
        yield _at(shot, "align.output", describe(error), "pegbar align --overwrite")
        return
    if not stage.is_done():
        # Stages that need it align again by themselves.
        what = f"{values} is out of date: marks, clip, settings or their place have changed"
        yield replace(_at(shot, "align", what, "pegbar align"), note=True)
        return
    height, usual = alignment.figure_height, float(np.median(alignment.errors))
    for warning in alignment.warnings:
        yield _at(shot, "clip", warning, "another clip, or another part of it: pegbar match")
    for number, apart in zip(stage.numbers, alignment.errors.tolist(), strict=True):
        if apart > max(_ODD * usual, _ODD_PART * height):
            what = f"drawing {number}: camera error {apart:.0f} px, {apart / height:.0%} of the figure's height"
            yield _at(shot, "drawing.annotations", what, "look at its marks: left and right, misplaced joints")
    misfit = shot.settings.secondary.misfit if shot.settings.secondary is not None else 0.25
    if usual > misfit * height:
        what = f"camera error {usual:.0f} px, {usual / height:.0%} of the figure's height: the clip does not fit"
        yield _at(shot, "clip", what, "another clip, or another part of it: pegbar match")


def _lift(shot: Shot) -> Iterator[Problem]:
    section = shot.settings.lift
    if "usd" in section.formats and importlib.util.find_spec("pxr") is None:
        yield _at(shot, "lift.formats", "USD needs a library that is not installed", 'pip install "pegbar[usd]"')
    if shot.annotations is None:
        return
    try:
        options = LiftStage(AlignStage(shot)).options()
    except (ValueError, OSError) as error:
        text = describe(error)
        yield _at(shot, "lift.skeleton", text, mend(text) or "name drawings that have marks")
        return
    if options.skeleton is not None and len(options.skeleton.known_markers) < 4:
        what = f"{section.skeleton} has fewer than four joints that pegbar knows"
        yield _at(shot, "lift.skeleton", what, "map them with lift.skeleton_joints")
    named = {"held": [hold.marker for hold in options.held], "flips": [name for name, _ in options.flips]}
    named["lengths"] = [] if isinstance(section.lengths, str) else list(section.lengths)
    for key, joints in named.items():
        for joint in dict.fromkeys(joints):
            if joint not in shot.annotations.names:
                how = f"there are {', '.join(shot.annotations.names)}"
                yield _at(shot, f"lift.{key}", f"{joint!r} is not marked", how)


def _secondary(shot: Shot, section: SecondarySection) -> Iterator[Problem]:
    for line in secondary_problems(section, shot.folder):
        yield _at(shot, "secondary", line, mend(line) or "take one of those that there are")
    for name in section.characters:
        if not (shot.folder / name).is_file():
            what = f"{shot.folder / name}: no such shot file"
            yield _at(shot, "secondary.characters", what, "correct the path: it begins at the shot's folder")
    marks = shot.annotations
    if marks is not None and not marks.limbs:
        what = "the marks have no limbs: there is nothing to collide with"
        yield _at(shot, "drawing.annotations", what, "add limbs to the annotations")
    if marks is not None and shot.settings.clip is None and (marks.depths is None or not marks.cameras):
        what = "the marks have no cameras and depths, and there is no clip to find them with"
        yield _at(shot, "secondary", what, "name a clip in [clip]: pegbar match --write does")
