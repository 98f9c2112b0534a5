"""Which clip a drawn sequence is like: which frames, at which times, seen from where (Jain et al. 2009, s3.2-3.3).

The camera is not known: every azimuth and some elevations are tried under parallel rays, with the marks as they are and
with left and right exchanged. The cost is equation 4 as a mean: the angle between a drawn limb and the clip's.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.align.candidates import believed, find_candidates
from pegbar.align.marks import EXCHANGED, Marks, read_marks
from pegbar.align.mixed import mixed_up
from pegbar.align.refine import Aligned, Refiner
from pegbar.align.sides import mirror, seen_from, tell_sides
from pegbar.scene.body import MARKERS
from pegbar.scene.clip import Clip
from pegbar.scene.orthographic import OrthographicCamera

Floats = NDArray[np.float64]
#: What a cost is held against, in degrees: a fixed part, and a share of the drawn movement. docs/papers.md tells how
#: often right and wrong clips stay below them.
FITS, DOUBTFUL = (4.0, 0.3), (5.0, 0.4)
# A few drawings hold no movement that could be told from another: they are only poses.
_POSES, FITS_POSE, DOUBTFUL_POSE = 3, 5.0, 8.0
_SPEED = 2.0


@dataclass(frozen=True, eq=False)
class Match:
    """A stretch of a clip that is like a drawn sequence of F frames.

    Attributes
    ----------
    clip : str
        The clip's name.
    start, stop : int
        First frame of the file, and the frame after the last, as `Motion.slice` takes them.
    times : (F,) float
        The file's frame at each drawn frame, in fractions. Never decreasing, but where a cycle begins anew.
    azimuth, elevation : float
        Where the camera stands, in degrees, as `OrthographicCamera.from_angles` takes them.
    seen_from : str
        The side of the person that the camera sees: "front", "front left", "left" and so on.
    mirrored : bool
        The clip's mirror image is meant: reflected in x = 0, left and right joints exchanged.
    swapped : bool
        The drawing's left and right marks are exchanged.
    sides : str
        The same in words.
    sides_told : bool
        Whether covered marks told which side is nearer; if not, another way to see left and right looks alike.
    cost : float
        Mean angle in degrees between a drawn limb and the clip's.
    lines : tuple of str
        The K limbs and lines compared.
    differences : (F, K) float
        Their angles in degrees, frame by frame.
    drawing_rate : float
        Film frames a second: as given, or of those tried the nearest to the clip's own pace.
    verdict : {"fits", "doubtful", "no"}
    mixed : dict of str to (n,) int
        "arms" or "legs" -> the drawn frames where these seem to be marked on the wrong sides; for matches that fit.
    """

    clip: str
    start: int
    stop: int
    times: Floats
    azimuth: float
    elevation: float
    seen_from: str
    mirrored: bool
    swapped: bool
    sides: str
    sides_told: bool
    cost: float
    lines: tuple[str, ...]
    differences: Floats
    drawing_rate: float
    verdict: str
    mixed: Mapping[str, NDArray[np.intp]]

    @property
    def camera(self) -> OrthographicCamera:
        """The view, one picture unit a metre."""
        return OrthographicCamera.from_angles(self.azimuth, self.elevation)

    def markers(self, clip: Clip) -> Floats:
        """The clip's canonical markers (F, 16, 3) at each drawn frame, as the camera is to see them.

        They are mirrored and named as the drawing's marks are, where the match says so.
        """
        markers = clip.at(self.times)
        markers = mirror(markers) if self.mirrored else markers
        return markers[:, EXCHANGED] if self.swapped else markers


@dataclass(frozen=True, eq=False)
class Matches:
    """What a search found.

    ``matches`` are the best stretches, the best first; ``movement`` is how far the drawings are from a held pose, in
    degrees; ``fits`` and ``doubtful`` are the costs up to which a match is called so. ``skipped`` says of clips why
    they were not searched.
    """

    matches: tuple[Match, ...]
    movement: float
    fits: float
    doubtful: float
    skipped: Mapping[str, str] = field(default_factory=dict)

    @property
    def found(self) -> bool:
        """Whether anything fits, or may."""
        return bool(self.matches) and self.matches[0].verdict != "no"


def match_clips(
    markers: ArrayLike,
    names: Sequence[str],
    clips: Sequence[Clip],
    *,
    visible: ArrayLike | None = None,
    frame_rate: float | None = None,
    holds: ArrayLike | None = None,
    loops: bool = False,
    top: int = 10,
    speed: float = _SPEED,
) -> Matches:
    """Find the clips, their frames, times and views that a drawn sequence is like.

    Parameters
    ----------
    markers : (F, N, 2) float
        Marked joints in pixels, y down; NaN where a marker is not known.
    names : sequence of str
        Their N names; canonical ones are compared.
    clips : sequence of Clip
        What is searched (`Clip.from_motion`).
    visible : (F, N) bool, optional
        False where another part of the body covers the marker: it counts half, and tells which side is nearer.
    frame_rate : float, optional
        Film frames a second. None: 8, 12 and 24 are tried.
    holds : (F,) float, optional
        For how many film frames each drawing is shown; one each where None.
    loops : bool
        The drawings are a cycle: any of them may be its first.
    top : int
        How many matches are returned at most.
    speed : float
        How much faster or slower than captured the clip may run.

    Returns
    -------
    Matches

    Raises
    ------
    ValueError
        For a wrong shape or dtype, too few marked limbs, or a number that is not positive.

    Examples
    --------
    >>> names = [name for name in MARKERS if name.startswith(("left_", "right_"))]
    >>> rng = np.random.default_rng(0)
    >>> pose = np.cumsum(rng.normal(size=(60, 16, 3)), axis=0).astype(np.float32)
    >>> clip = Clip("tangle.bvh", pose, 30.0, 30.0, 0, 60)
    >>> drawn = OrthographicCamera.from_angles(40, 10).project(pose[20:40])
    >>> best = match_clips(drawn, MARKERS, [clip], frame_rate=30, top=1).matches[0]
    >>> best.clip, best.start, best.stop, round(best.azimuth), best.verdict
    ('tangle.bvh', 20, 40, 40, 'fits')
    """
    marks, seen = _read(markers, names, visible, frame_rate, holds, loops)
    if not (np.isfinite(speed) and speed >= 1):
        raise ValueError(f"speed: want 1 or more, got {speed}")
    top = int(arrays.integers("top", top, (), low=1))
    skipped = {clip.name: reason for clip in clips if (reason := _unfit(clip, marks, speed))}
    searched = [clip for clip in clips if clip.name not in skipped]
    refiner = Refiner(marks, speed)
    candidates = find_candidates(searched, marks, speed, max(3 * top, 24))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        refined = list(pool.map(lambda c: (searched[c.clip], refiner.refine(searched[c.clip], c)), candidates))
    aligned = sorted(((clip, found) for clip, found in refined if found), key=_rank)
    movement = float(np.degrees(marks.movement()))
    limits = _limits(movement, len(marks.times[0]))
    kept: list[Match] = []
    for clip, found in aligned:
        match = _match(clip, found, marks, seen, limits)
        if len(kept) < top and not any(_overlap(match, other) for other in kept):
            kept.append(match)
    return Matches(tuple(kept), movement, *limits, skipped)


def _read(
    markers: ArrayLike,
    names: Sequence[str],
    visible: ArrayLike | None,
    frame_rate: float | None,
    holds: ArrayLike | None,
    loops: bool,
) -> tuple[Marks, NDArray[np.bool_]]:
    """The marks to compare, and which canonical ones are not covered (F, 16)."""
    points = arrays.floats("markers", markers, ("F", len(names), 2), allow="nan")
    if not len(points):
        raise ValueError("markers: want at least one frame")
    if frame_rate is not None and not (np.isfinite(frame_rate) and frame_rate > 0):
        raise ValueError(f"frame_rate: want frames a second above 0, got {frame_rate}")
    shape = points.shape[:2]
    flags = np.ones(shape, bool) if visible is None else arrays.flags("visible", visible, shape)
    shown = np.ones(len(points)) if holds is None else arrays.floats("holds", holds, (len(points),))
    if not (shown > 0).all():
        raise ValueError(f"holds: want positive durations, got {shown.min():g}")
    marks = read_marks(points, names, flags, frame_rate=frame_rate, holds=shown, loops=loops)
    seen = np.ones((len(points), len(MARKERS)), bool)
    for index, name in enumerate(names):
        if name in MARKERS:
            seen[:, MARKERS.index(name)] = flags[:, index]
    return marks, seen


def _unfit(clip: Clip, marks: Marks, speed: float) -> str | None:
    """Why a clip cannot be searched."""
    shortest = min(times[-1] for times in marks.times) / speed
    if clip.seconds < 0.8 * shortest:
        return f"too short: {clip.seconds:.1f} s, the drawings last {marks.times[0][-1]:.1f} s"
    return None


def _limits(movement: float, drawings: int) -> tuple[float, float]:
    if drawings < _POSES:
        return FITS_POSE, DOUBTFUL_POSE
    return FITS[0] + FITS[1] * movement, DOUBTFUL[0] + DOUBTFUL[1] * movement


def _match(clip: Clip, found: Aligned, marks: Marks, seen: NDArray[np.bool_], limits: tuple[float, float]) -> Match:
    times = clip.file_frames(found.times[marks.source])
    markers = clip.at(times)
    sides = tell_sides(markers, found.azimuth, found.elevation, bool(found.candidate.exchanged), seen)
    cost = float(np.degrees(found.cost))
    verdict = "fits" if cost <= limits[0] else "doubtful" if cost <= limits[1] else "no"
    return Match(
        clip=clip.name,
        start=int(np.rint(times.min())),
        stop=min(int(np.rint(times.max())) + 1, clip.frames),
        times=times,
        azimuth=round(sides.azimuth, 2),
        elevation=round(sides.elevation, 2),
        seen_from=seen_from(mirror(markers) if sides.mirrored else markers, sides.azimuth),
        mirrored=sides.mirrored,
        swapped=sides.swapped,
        sides=sides.words,
        sides_told=sides.told,
        cost=cost,
        lines=tuple(line.name for line in marks.lines),
        differences=np.degrees(found.differences)[marks.source],
        drawing_rate=_pace(times, clip, marks),
        verdict=verdict,
        mixed=_mixed(found, marks) if verdict == "fits" else {},
    )


def _pace(times: Floats, clip: Clip, marks: Marks) -> float:
    """The tried rate at which the clip runs the least faster or slower than it was captured."""
    # A cycle may begin anywhere: its last drawing is as far from its first as the others are apart.
    drawn = marks.periods[0] * marks.rates[0] * (1 - 1 / len(marks.source))
    seconds = float(np.ptp(times)) / clip.frame_rate
    if drawn <= 0 or seconds <= 0:
        return marks.rates[0]
    return min(marks.rates, key=lambda rate: abs(np.log(rate * seconds / drawn)))


def _rank(pair: tuple[Clip, Aligned]) -> float:
    return believed(pair[1].cost, pair[1].candidate.exchanged)


def _mixed(found: Aligned, marks: Marks) -> dict[str, NDArray[np.intp]]:
    which = found.candidate.exchanged
    drawings = mixed_up(marks.angles[which], found.angles, marks.trust[which], marks.lines)
    return {group: np.flatnonzero(np.isin(marks.source, frames)) for group, frames in drawings.items()}


def _overlap(match: Match, other: Match) -> bool:
    """Whether two matches share more than half of the shorter one's frames."""
    shared = min(match.stop, other.stop) - max(match.start, other.start)
    return match.clip == other.clip and 2 * shared > min(match.stop - match.start, other.stop - other.start)
