"""What the user says of a lift by hand: ranges of drawings in which feet stand, markers are held and limbs turned."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pegbar.lift.markers import drawn_lengths
from pegbar.scene.alignment import Alignment
from pegbar.scene.contacts import FEET, LAST, foot_contacts
from pegbar.scene.motion import Motion

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
#: A range of drawings by place: first and one past the last.
Range = tuple[int, int]


@dataclass(frozen=True)
class Hold:
    """A marker that stays at one place over a range of drawings: ``place`` (3,) metres, or its mean there."""

    marker: str
    range: Range
    place: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class LiftOptions:
    """How to lift.

    ``depth`` is "clip" (the drawn marks at the clip's depths) or "lengths" (limbs of constant length, whose
    foreshortening gives the depth). ``stretch`` keeps the drawing's squash and stretch as bones that change their
    length. ``lengths`` for "lengths": "found" in the drawings, the "clip"'s, or metres by the marker at a limb's outer
    end (the rest is found). ``planted``: feet that stand do not slide; True finds them in the clip, a dict gives their
    ranges. ``held`` markers stay where they are, ``flips`` are (marker at a limb's outer end, range) whose depth is
    turned by hand. ``skeleton`` is posed in place of the clip's; ``fitted``: its bones take the drawn figure's
    proportions. ``loop`` closes the motion into a loop.
    """

    depth: Literal["clip", "lengths"] = "clip"
    stretch: bool = False
    lengths: Literal["found", "clip"] | Mapping[str, float] = "found"
    planted: bool | Mapping[str, Sequence[Range]] = True
    held: tuple[Hold, ...] = ()
    flips: tuple[tuple[str, Range], ...] = ()
    skeleton: Motion | None = None
    fitted: bool = True
    loop: bool = False


def fixed_places(holds: Sequence[Hold], markers: Floats, names: Sequence[str]) -> Floats:
    """Return where held markers are, (F, N, 3), NaN where they are free; ValueError for a name that is no marker."""
    fixed = np.full(markers.shape, np.nan)
    for hold in holds:
        place, (start, stop) = _place("held", hold.marker, names), hold.range
        mean = markers[start:stop, place].mean(axis=0)
        fixed[start:stop, place] = mean if hold.place is None else hold.place
    return fixed


def standing_markers(
    clip: Motion,
    alignment: Alignment,
    known: NDArray[np.intp],
    names: tuple[str, ...],
    rate: float,
    wanted: bool | Mapping[str, Sequence[Range]],
) -> Flags:
    """Return which markers (F, N) stand: in the ranges given, or ankles that the clip plants at the drawings' times.

    Of the latter those are left out that slide over the ground in the drawing: of a figure that walks on the spot.
    """
    planted = np.zeros((len(alignment.clip), len(names)), bool)
    if isinstance(wanted, Mapping):
        for foot, ranges in wanted.items():
            for start, stop in ranges:
                planted[start:stop, _place("planted", foot, names)] = True
        return planted
    if not wanted or not {*FEET} <= {*names} & {*clip.known_markers, *clip.names}:
        return planted
    contacts = foot_contacts(clip.markers(FEET), FEET, clip.frame_rate)
    frames = np.clip(np.rint(alignment.times).astype(int), 0, len(contacts) - 1)
    for side, foot in enumerate(FEET):
        track = alignment.positions[:, known[names.index(foot)]]
        planted[:, names.index(foot)] = _resting(track, contacts[frames, side], rate)
    return planted


def _resting(track: Floats, standing: Flags, rate: float) -> Flags:
    """Those runs of ``standing`` (F,) in which ``track`` (F, 3) comes no farther than slow feet do."""
    rests = standing.copy()
    edges = np.flatnonzero(np.diff(standing, prepend=False, append=False)).reshape(-1, 2)
    for first, stop in edges:
        way = float(np.linalg.norm(track[stop - 1] - track[first]))
        if way > LAST[0] * max(stop - 1 - first, 1) / rate:
            rests[first:stop] = False
    return rests


def _place(key: str, name: str, names: Sequence[str]) -> int:
    if name not in names:
        raise ValueError(f"lift.{key}: {name!r} is not marked, or not in the clip; there are {', '.join(names)}")
    return list(names).index(name)


def _outer_ends(
    key: str, wanted: Iterable[str], names: Sequence[str], bones: Sequence[tuple[int, int]]
) -> dict[str, int]:
    """The limb that ends at each marker; ValueError where one of ``wanted`` hangs on nothing."""
    outer = {names[child]: index for index, (_, child) in enumerate(bones)}
    for name in wanted:
        if name not in outer:
            raise ValueError(f"lift.{key}: {name!r} hangs on no other marker; there are {', '.join(outer)}")
    return outer


def flip_rows(
    flips: Sequence[tuple[str, Range]], names: Sequence[str], bones: Sequence[tuple[int, int]]
) -> list[tuple[int, int, int]]:
    """Return ``flips`` as (bone, first, one past the last); ValueError for a marker that hangs on nothing."""
    outer = _outer_ends("flips", [name for name, _ in flips], names, bones)
    return [(outer[name], start, stop) for name, (start, stop) in flips]


def limb_lengths(
    drawn: Floats,
    clip: Floats,
    alignment: Alignment,
    names: tuple[str, ...],
    bones: tuple[tuple[int, int], ...],
    wanted: Literal["found", "clip"] | Mapping[str, float],
) -> Floats | None:
    """Return the limbs' lengths in metres as far as they are told, the others found; None where all are to be found."""
    if wanted == "found" or not wanted:
        return None
    if wanted == "clip":
        ends = np.array(bones)
        usual: Floats = np.median(np.linalg.norm(clip[:, ends[:, 1]] - clip[:, ends[:, 0]], axis=2), axis=0)
        return usual
    outer = _outer_ends("lengths", wanted, names, bones)
    lengths = drawn_lengths(drawn, clip, alignment, bones)
    for marker, metres in wanted.items():
        lengths[outer[marker]] = metres
    return lengths
