"""The clip at the drawings' times, and the cameras that see it as drawn; each helps to find the other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pegbar.align.camera_track import CameraTrack
from pegbar.align.proportions import Body, Proportions, drawn_proportions, jacobians_of, own_proportions
from pegbar.align.registration import register_cameras
from pegbar.align.retime import retime, sample_markers
from pegbar.scene.motion import Motion
from pegbar.scene.orthographic import OrthographicCamera
from pegbar.shot.retiming import FINE, DrawnLimbs, Marks, Retiming

Floats = NDArray[np.float64]
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
    moments = np.arange(start, stop + 1e-9, pace / FINE)
    poses = sample_markers(clip.markers(marks.names), moments, rest_frame=clip.rest_frame)
    parallel = OrthographicCamera.from_angles(view.azimuth, view.elevation)
    seen = parallel.project(poses)
    drawn = DrawnLimbs.of(marks)
    if view.times is None:
        columns = drawn.warped(seen, moments)
    else:
        columns = np.interp(view.times, moments, np.arange(len(moments)))
    times = np.interp(drawn.settled(seen, columns), np.arange(len(moments)), moments)
    figure = _Figure(marks, clip, rate, options)
    body = figure.body(times)
    rays = np.broadcast_to(parallel.rotation[:2], (*body.points.shape[:2], 2, 3))
    track, own = figure.first_track(body, rays)
    middles = np.nanmean(track.points, axis=1)
    shapes = poses - np.nanmean(poses, axis=1, keepdims=True)

    def look(row: int, which: NDArray[np.intp] | slice) -> Floats:
        return track.cameras[row].project(shapes[which] + middles[row])

    retiming = drawn.retimed(look, moments, np.interp(times, moments, np.arange(len(moments))))
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
