"""The clip of a shot: the one that its file names, or the one in a folder that the drawing is like."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pegbar.align.match import Match, Matches, match_clips
from pegbar.io.clip_folder import read_clips
from pegbar.io.motion import read_motion
from pegbar.scene.clip import Clip
from pegbar.scene.drawing import Drawing
from pegbar.scene.motion import Motion
from pegbar.shot.model import ClipSection
from pegbar.shot.registered import View

# Two views less apart, in degrees, show the same poses at the same times.
_SAME_VIEW = 20.0


@dataclass(frozen=True, eq=False)
class Choice:
    """A clip, the view of it that the drawing shows, where it is, and what was assumed or looks wrong about it."""

    path: Path
    motion: Motion
    view: View
    notes: tuple[str, ...]
    warnings: tuple[str, ...] = ()


def choose_clip(
    section: ClipSection, folder: Path, drawing: Drawing, holds: NDArray[np.float64], frame_rate: float
) -> Choice:
    """Return the clip that ``section`` names, or the best of its folder, and how the drawing shows it.

    What the section does not say (view, part of the clip) is found by the search. Paths start at ``folder``.

    Raises
    ------
    ValueError
        Where no clip of the folder can be compared with the drawing, saying why.
    FormatError, OSError
        For a clip that cannot be read.
    """
    notes: list[str] = []
    if section.path is None:
        assert section.folder is not None
        clips = read_clips(folder / section.folder)
        found = _search(drawing, list(clips.clips), holds, frame_rate)
        best = _best(found, section.folder)
        path = folder / section.folder / best.clip
        motion = read_motion(path)
        notes.append(
            f"clip: {best.clip}, frames {best.start}-{best.stop - 1}, {best.cost:.1f} degrees from the drawing"
        )
        view = _view(best)
    else:
        path = folder / section.path
        motion = read_clip(section, folder, path)
        part = _searched(path.name, _named_part(motion, section))
        found = _search(drawing, [part], holds, frame_rate)
        if section.azimuth is None or section.elevation is None:
            view = _view(_best(found, path.name), section.start)
        else:
            view = _given_view(section, motion, found)
    notes += [f"{path.name}: {note}" for note in motion.report.notes] if motion.report is not None else []
    return Choice(path, motion, view, tuple(notes), tuple(_doubts(path.name, found)))


def _doubts(name: str, found: Matches) -> list[str]:
    """What a user should be warned of: no stretch of the clip has the drawn poses, however long its limbs are."""
    if not found.matches or found.found:
        return []
    cost = f"{found.matches[0].cost:.0f} degrees from the drawn ones, over {found.doubtful:.0f}"
    return [f"the clip does not fit: the limbs of {name} are {cost} (pegbar match shows other clips)"]


def read_clip(section: ClipSection, folder: Path, path: Path) -> Motion:
    """Read the clip at ``path`` as ``section`` says; see `pegbar.read_motion`."""
    return read_motion(
        path,
        skeleton=folder / section.skeleton if section.skeleton else None,
        unit=section.unit,
        up=section.up,
        frame_rate=section.frame_rate,
        joints=folder / section.joints if section.joints else None,
    )


def _searched(name: str, motion: Motion) -> Clip:
    try:
        return Clip.from_motion(name, motion)
    except ValueError as error:
        raise ValueError(
            f"clip: {name}: {error}, without which it cannot be compared; clip.joints can name it"
        ) from None


def check_part(motion: Motion, section: ClipSection) -> None:
    """Raise ValueError where ``section`` names frames that the clip does not have."""
    frames = len(motion.positions)
    for key, value, most in (("start", section.start, frames - 1), ("stop", section.stop, frames)):
        if value is not None and value > most:
            raise ValueError(f"clip.{key}: the clip has {frames} frames, from 0 to {frames - 1}; got {value}")


def _named_part(motion: Motion, section: ClipSection) -> Motion:
    check_part(motion, section)
    return motion.slice(section.start, section.stop)


def _search(drawing: Drawing, clips: list[Clip], holds: NDArray[np.float64], frame_rate: float) -> Matches:
    return match_clips(
        drawing.markers,
        drawing.names,
        clips,
        visible=drawing.visible,
        frame_rate=frame_rate,
        holds=holds,
        loops=False,
        top=1,
    )


def _best(matches: Matches, name: str) -> Match:
    if not matches.matches:
        reasons = "; ".join(f"{clip}: {reason}" for clip, reason in matches.skipped.items())
        raise ValueError(f"clip: nothing in {name} can be compared with the drawing ({reasons})")
    return matches.matches[0]


def _view(match: Match, offset: int = 0) -> View:
    times = tuple((match.times + offset).tolist())
    start, stop = match.start + offset, match.stop + offset
    return View(start, stop, match.azimuth, match.elevation, match.mirrored, match.swapped, times)


def _given_view(section: ClipSection, motion: Motion, found: Matches) -> View:
    """The view that ``section`` gives, with the times that the search found if it found about the same view."""
    assert section.azimuth is not None
    assert section.elevation is not None
    stop = section.stop or len(motion.positions)
    given = section.azimuth, section.elevation
    view = View(section.start, stop, *given, section.mirrored, section.swapped)
    for match in found.matches:
        turn = (match.azimuth - section.azimuth + 180) % 360 - 180
        same = (match.mirrored, match.swapped) == (section.mirrored, section.swapped)
        if same and max(abs(turn), abs(match.elevation - section.elevation)) < _SAME_VIEW:
            return dataclasses.replace(view, times=_view(match, section.start).times)
    return view
