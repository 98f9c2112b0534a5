"""The clip at the drawings' times, and the cameras that see it as drawn; each helps to find the other."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pegbar.align.camera_track import CameraTrack
from pegbar.align.descriptor import limb_trust, pose_descriptor, pose_distance
from pegbar.align.proportions import Body, Proportions, drawn_proportions, jacobians_of, own_proportions
from pegbar.align.registration import register_cameras
from pegbar.align.retime import retime, sample_markers
from pegbar.align.times import smooth_weighted
from pegbar.align.timewarp import TimeWarp, time_warp
from pegbar.scene.body import limbs_between
from pegbar.scene.motion import Motion
from pegbar.scene.orthographic import OrthographicCamera

Floats = NDArray[np.float64]
# The warp chooses among one clip pose a drawing, at most so many times faster or slower than drawn. More poses would
# make every drawing that the clip takes longer for dearer. Then each time is settled among so many poses between.
_SLOPE, _FINE = 3, 4
# How much changes of the clip's speed count against its distance from each drawing's cheapest time.
_STIFFNESS = 4.0
# Limbs are made as long as the drawn ones where that brings the clip so much closer to the marks. Another person's walk
# gave 0.7 to 1.0, the same person's 0.8 to 2, bodies with limbs 10% off 0.6 to 1, a cut-out figure and a cartoon man
# 0.5 and 0.6.
_CLOSER = 0.75


@dataclass(frozen=True)
class View:
    """Which part of a clip a drawing shows and from where: clip frames from ``start`` to before ``stop``, degrees.

    ``mirrored`` says that the clip's mirror image is meant, ``swapped`` that the drawing's left and right marks are
    exchanged. ``times`` are the clip's frames at the drawings where they are known already; else a warp finds them.
    """

    start: int
    stop: int
    azimuth: float
    elevation: float
    mirrored: bool = False
    swapped: bool = False
    times: tuple[float, ...] | None = None


@dataclass(frozen=True)
class CameraOptions:
    """``field_of_view`` in radians (None: solved), ``mode`` and ``root`` as `register_cameras` takes them.

    ``root_smoothing`` in seconds is that of `retime`, ``level`` the weight that keeps the camera level. ``proportions``
    says whether the clip's body is given limbs as long, and swings as wide, as the "drawn" ones before it is registered
    or keeps the "clip"'s; "auto" takes the drawn ones where they bring it clearly closer.
    """

    field_of_view: float | None = None
    mode: Literal["auto", "static", "pan", "free"] = "auto"
    root: Literal["auto", "travel", "in_place"] | float = "auto"
    root_smoothing: float = 0.25
    level: float = 0.0
    proportions: Literal["auto", "drawn", "clip"] = "auto"


@dataclass(frozen=True, eq=False)
class Marks:
    """A drawing's marks (F, N, 2), which are seen (F, N), their names, and the time that each drawing is shown (F,)."""

    places: Floats
    seen: NDArray[np.bool_]
    names: tuple[str, ...]
    holds: Floats
    image_size: tuple[int, int]


@dataclass(frozen=True, eq=False)
class Retiming:
    """The time warp of a drawing: ``cost`` (F, G) of its poses and the clip's at frames ``moments`` (G,).

    ``times`` (F,) is the clip's frame at each drawing, in fractions.
    """

    cost: Floats
    moments: Floats
    warp: TimeWarp
    times: Floats


def register_clip(
    marks: Marks, clip: Motion, view: View, rate: float, options: CameraOptions
) -> tuple[Retiming, CameraTrack]:
    """Return when each drawing is in ``clip`` and the cameras that see it so; ``rate`` is drawings a second.

    The clip is retimed as seen under parallel rays from the view; then, as a free camera shows that perspective turns a
    figure that walks past, once more as the cameras see it. Limb lengths are found in each of these views.
    """
    pace = clip.frame_rate / rate
    # Found times may lie a little outside what was found.
    slack = 0.0 if view.times is None else pace
    start = view.start - slack * (view.start >= slack)
    stop = min(view.stop - 1 + slack, len(clip.positions) - 1)
    moments = np.arange(start, stop + 1e-9, pace / _FINE)
    poses = sample_markers(clip.markers(marks.names), moments, rest_frame=clip.rest_frame)
    parallel = OrthographicCamera.from_angles(view.azimuth, view.elevation)
    seen = parallel.project(poses)
    drawn = _Drawn.of(marks)
    if view.times is None:
        columns = drawn.warped(seen, moments)
    else:
        columns = np.interp(view.times, moments, np.arange(len(moments)))
    times = drawn.retimed([(slice(None), seen)], moments, columns).times
    figure = _Figure(marks, clip, rate, options)
    body = figure.body(times)
    rays = np.broadcast_to(parallel.rotation[:2], (*body.points.shape[:2], 2, 3))
    track, own = figure.first_track(body, rays)
    middles = np.nanmean(track.points, axis=1)
    shapes = poses - np.nanmean(poses, axis=1, keepdims=True)
    # One at a time: all drawings' views of all poses would be gigabytes for a long shot.
    seen_by = enumerate(zip(track.cameras, middles, strict=True))
    views = ((slice(row, row + 1), camera.project(shapes + middle)) for row, (camera, middle) in seen_by)
    retiming = drawn.retimed(views, moments, np.interp(times, moments, np.arange(len(moments))))
    body = figure.body(retiming.times)
    jacobians = jacobians_of(track.matrices, track.points)
    proportions = own_proportions(body) if own else figure.proportions(body, jacobians)
    track = figure.track(body, proportions, options)
    if own:
        return retiming, track
    note = f"the clip's body gets the drawn limb lengths ({proportions.describe(body.kinds)} times as long) and swings"
    return retiming, replace(track, notes=(*track.notes, note))


@dataclass(frozen=True, eq=False)
class _Figure:
    """The clip's figure as it is drawn: at the drawings' times, with limbs as long as the drawn ones."""

    marks: Marks
    clip: Motion
    rate: float
    options: CameraOptions

    def body(self, times: Floats) -> Body:
        """The clip's markers at the drawings' ``times`` (F,)."""
        moved = retime(self.clip, times, frame_rate=self.rate, root_smoothing=self.options.root_smoothing)
        return Body(self.marks.names, moved.markers(self.marks.names), self.rate)

    def first_track(self, body: Body, rays: Floats) -> tuple[CameraTrack, bool]:
        """A free camera, and whether the clip's own body is the one to look at; ``rays`` are the view's directions."""
        free = replace(self.options, mode="free", root="travel")
        own = self.track(body, own_proportions(body), free)
        if self.options.proportions == "clip":
            return own, True
        drawn = self.track(body, self.proportions(body, rays), free)
        closer = self.options.proportions == "drawn" or drawn.error < _CLOSER * own.error
        return (drawn, False) if closer else (own, True)

    def proportions(self, body: Body, jacobians: Floats) -> Proportions:
        """How the drawn body differs from the clip's."""
        return drawn_proportions(self.marks.places, self.marks.seen, body, jacobians)

    def track(self, body: Body, proportions: Proportions, options: CameraOptions) -> CameraTrack:
        """The cameras that see the clip with these proportions as it was drawn."""
        points = body.drawn(proportions)
        return register_cameras(
            self.marks.places,
            points,
            self.marks.image_size,
            visible=self.marks.seen & np.isfinite(points).all(axis=2),
            field_of_view=options.field_of_view,
            mode=options.mode,
            root=options.root,
            weights={"level": options.level},
        )


@dataclass(frozen=True, eq=False)
class _Drawn:
    """The drawn limbs (K, 2) as marks, their angles and how far these are to be trusted (F, K), and the holds (F,)."""

    limbs: list[tuple[int, int]]
    angles: Floats
    trust: Floats
    holds: Floats

    @classmethod
    def of(cls, marks: Marks) -> _Drawn:
        """The limbs of ``marks``, as far as these are seen."""
        limbs = [(marks.names.index(limb.start), marks.names.index(limb.end)) for limb in limbs_between(marks.names)]
        drawn = np.where(marks.seen[..., None], marks.places, np.nan)
        return cls(limbs, pose_descriptor(drawn, limbs), limb_trust(drawn, limbs), marks.holds)

    def warped(self, seen: Floats, moments: Floats) -> Floats:
        """The columns (F,) of ``moments`` that a time warp finds for poses (G, N, 2) as all drawings see them."""
        cost = self._costs(slice(None), seen[::_FINE], limb_trust(seen, self.limbs)[::_FINE])
        if cost.shape[1] * _SLOPE < len(cost):
            shown = f"{moments[0]:.0f} to {moments[-1]:.0f}"
            raise ValueError(f"clip.start, clip.stop: frames {shown} are too few for {len(cost)} drawings")
        warp = time_warp(cost, open_begin=True, open_end=True, slope_limit=_SLOPE, holds=self.holds)
        return warp.times * _FINE

    def retimed(self, views: Iterable[tuple[slice, Floats]], moments: Floats, columns: Floats) -> Retiming:
        """The clip retimed to the drawings, near ``columns`` (F,) of ``moments``.

        ``views`` are the clip's poses (G, N, 2) as some of the drawings see them, one after the other. All of the
        poses but few are compared about each drawing's time only.
        """
        first, width = _near(columns, len(moments))
        cost, near = np.empty((len(columns), -(-len(moments) // _FINE))), np.empty((len(columns), width))
        for part, seen in views:
            trust = limb_trust(seen, self.limbs)
            cost[part] = self._costs(part, seen[::_FINE], trust[::_FINE])
            for row in range(len(columns))[part]:
                here = slice(first[row], first[row] + width)
                near[row] = self._costs(slice(row, row + 1), seen[here], trust[here])
        columns = _settled(near, first, len(moments) - 1, columns, self.holds)
        times = np.interp(columns, np.arange(len(moments)), moments)
        return Retiming(cost, moments[::_FINE], _as_warp(cost, columns / _FINE), times)

    def _costs(self, part: slice, seen: Floats, trust: Floats) -> Floats:
        angles = pose_descriptor(seen, self.limbs)
        return pose_distance(self.angles[part], angles, a_trust=self.trust[part], b_trust=trust)


def _near(columns: Floats, count: int) -> tuple[NDArray[np.intp], int]:
    """The first (F,) of the columns that `_settled` looks at for each drawing, and how many they are."""
    width = min(2 * _FINE + 3, count)
    return np.clip(np.rint(columns) - _FINE - 1, 0, count - width).astype(np.intp), width


def _as_warp(cost: Floats, columns: Floats) -> TimeWarp:
    """The times that were settled on, as a warp to look at."""
    frames = np.rint(columns).astype(np.int64).clip(0, cost.shape[1] - 1)
    path = np.stack([np.arange(len(cost)), frames], axis=1)
    return TimeWarp(path, float(cost[path[:, 0], path[:, 1]].sum()), frames, columns)


def _settled(cost: Floats, first: NDArray[np.intp], last: int, times: Floats, holds: Floats) -> Floats:
    """Times (F,) near ``times``, in columns up to ``last``, that are cheap and run smoothly.

    ``cost`` has each drawing's columns from ``first`` (F,) on. It is taken for a parabola about the cheapest column
    near by; where it is flat, neighbours decide.
    """
    if last < 2:
        return times
    rows = np.arange(len(cost))
    near = np.clip(np.rint(times)[:, None] + np.arange(-_FINE, _FINE + 1), 1, last - 1).astype(np.intp)
    best = near[rows, np.argmin(cost[rows[:, None], near - first[:, None]], axis=1)]
    before, here, after = (cost[rows, best - first + step] for step in (-1, 0, 1))
    bend = np.maximum(before - 2 * here + after, 1e-6)
    lowest = best + np.clip((before - after) / (2 * bend), -1, 1)
    return smooth_weighted(lowest, bend, holds[:-1], _STIFFNESS).clip(0, last)
