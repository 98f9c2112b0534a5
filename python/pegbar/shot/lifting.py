"""From an alignment to a 3D animation: markers with rigid limbs, joint angles, and film frames (2009 paper)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pegbar.align.pace import film_times
from pegbar.align.retime import retime
from pegbar.lift.angles import joint_angles
from pegbar.lift.markers import reconstruct_markers
from pegbar.scene.alignment import Alignment
from pegbar.scene.body import bones_between
from pegbar.scene.contacts import FEET, foot_contacts
from pegbar.scene.motion import Motion

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LiftOptions:
    """How to lift.

    ``depth`` is "clip" (the drawn marks at the clip's depths) or "lengths" (limbs of constant length, whose
    foreshortening gives the depth). ``stretch`` keeps the drawing's squash and stretch. For "lengths" alone:
    ``planted`` holds feet still that the clip plants, ``flips`` are (marker at a limb's outer end, first drawing, one
    past the last) whose depth is turned by hand.
    """

    depth: Literal["clip", "lengths"] = "clip"
    stretch: bool = False
    planted: bool = True
    flips: tuple[tuple[str, int, int], ...] = ()


@dataclass(frozen=True, eq=False)
class Lifted:
    """A drawing in 3D: ``markers`` (F, N, 3) metres of ``names``, and the clip's skeleton posed on them, F drawings."""

    names: tuple[str, ...]
    bones: tuple[tuple[int, int], ...]
    markers: Floats
    planted: NDArray[np.bool_]
    motion: Motion


def lift_drawing(alignment: Alignment, clip: Motion, rate: float, options: LiftOptions) -> Lifted:
    """Rebuild 3D markers and joint angles of an aligned drawing (2009, sections 3.4-3.6).

    Parameters
    ----------
    alignment : Alignment
        What was found for F drawings.
    clip : Motion
        Its clip as drawn: mirrored and exchanged as the alignment says.
    rate : float
        Drawings a second.
    options : LiftOptions
        What the user has chosen.

    Raises
    ------
    ValueError
        For fewer than 2 drawings, a clip without a skeleton, or a flip of a marker that hangs on nothing.
    DegenerateError
        For a drawing with fewer than 4 marks.
    """
    known = np.flatnonzero(np.isfinite(alignment.clip).all(axis=(0, 2)))
    names = tuple(alignment.names[index] for index in known)
    bones = bones_between(names)
    planted = _planted(clip, alignment, names)
    if options.depth == "lengths":
        markers = _by_lengths(alignment, known, names, bones, planted, options)
    else:
        markers = alignment.positions[:, known]
    posed = retime(clip, alignment.times, frame_rate=rate)
    motion = joint_angles(markers, names, posed, stretch=options.stretch)
    return Lifted(names, bones, markers, planted, motion)


def _by_lengths(
    alignment: Alignment,
    known: NDArray[np.intp],
    names: tuple[str, ...],
    bones: tuple[tuple[int, int], ...],
    planted: NDArray[np.bool_],
    options: LiftOptions,
) -> Floats:
    """Markers of limbs of constant length, over the whole sequence at once."""
    seen = ~alignment.estimated[:, known]
    seen[seen.sum(axis=1) < 4] = True
    return reconstruct_markers(
        np.where(seen[..., None], alignment.markers[:, known], np.nan),
        alignment.clip[:, known],
        alignment,
        bones,
        None,
        refine=True,
        planted=planted if options.planted else None,
        flips=_flips(options.flips, names, bones),
        stretch=options.stretch,
        root=names.index("pelvis") if "pelvis" in names else bones[0][0],
    )


def on_film(
    lifted: Motion, holds: Sequence[int], frame_rate: float, *, stepped: bool, rate: float, loop: bool
) -> Motion:
    """Return the motion of the drawings at film frames of ``rate`` a second, where the film runs at ``frame_rate``.

    Each drawing is held for ``holds`` film frames: the pose steps, or runs on to the next drawing. ``loop`` adds the
    first frame again at the end.
    """
    places = film_times(np.arange(len(holds), dtype=float), holds, stepped=stepped)
    count = max(round(len(places) * rate / frame_rate), 1)
    moments = np.arange(count) * frame_rate / rate
    if stepped:
        times = places[np.minimum(moments.astype(int), len(places) - 1)]
    else:
        times = np.interp(moments, np.arange(len(places)), places)
    film = retime(lifted, times, frame_rate=rate)
    if not loop:
        return film
    order = [*range(len(film.positions)), 0]
    return film.changed(positions=film.positions[order], rotations=film.rotations[order])


def _planted(clip: Motion, alignment: Alignment, names: tuple[str, ...]) -> NDArray[np.bool_]:
    """Which markers (F, N) stand: ankles that the clip plants at the drawings' times."""
    planted = np.zeros((len(alignment.clip), len(names)), bool)
    if not {*FEET} <= {*names} & {*clip.known_markers, *clip.names}:
        return planted
    contacts = foot_contacts(clip.markers(FEET), FEET, clip.frame_rate)
    frames = np.clip(np.rint(alignment.times).astype(int), 0, len(contacts) - 1)
    for side, foot in enumerate(FEET):
        planted[:, names.index(foot)] = contacts[frames, side]
    return planted


def _flips(
    flips: Sequence[tuple[str, int, int]], names: tuple[str, ...], bones: Sequence[tuple[int, int]]
) -> list[tuple[int, int, int]]:
    outer = {names[child]: index for index, (_, child) in enumerate(bones)}
    rows = []
    for name, start, stop in flips:
        if name not in outer:
            raise ValueError(f"lift.flips: {name!r} hangs on no other marker; there are {', '.join(outer)}")
        rows.append((outer[name], start, stop))
    return rows
