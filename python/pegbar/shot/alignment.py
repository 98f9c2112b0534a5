"""From drawn marks and a clip to cameras and 3D markers: retime, register, back-project (2010 paper, section 3.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pegbar.align.camera_track import CameraTrack
from pegbar.align.descriptor import limb_trust, pose_descriptor, pose_distance
from pegbar.align.registration import register_cameras
from pegbar.align.retime import retime, sample_markers
from pegbar.align.timewarp import TimeWarp, time_warp
from pegbar.lift.backprojection import back_project
from pegbar.lift.contact import ground_depths
from pegbar.lift.hidden import fill_hidden
from pegbar.scene.alignment import Alignment
from pegbar.scene.body import limbs_between
from pegbar.scene.contacts import FEET, ankle_heights, foot_contacts
from pegbar.scene.drawing import Drawing
from pegbar.scene.mirror import exchanged, mirrored
from pegbar.scene.motion import Motion
from pegbar.scene.orthographic import OrthographicCamera

Floats = NDArray[np.float64]
# Clip poses for each drawing that the warp chooses among, and how much faster or slower than drawn the clip may run.
_DENSITY, _SLOPE = 2, 6
# Marks that are farther from the clip than this share of the figure's height are told to the user.
_MISFIT = 0.1
# How high an ankle rests over the floor, in metres, where the clip does not tell.
_ANKLE = 0.08


@dataclass(frozen=True)
class View:
    """Which part of a clip a drawing shows and from where: clip frames from ``start`` to before ``stop``, degrees.

    ``mirrored`` says that the clip's mirror image is meant, ``swapped`` that the drawing's left and right marks are
    exchanged.
    """

    start: int
    stop: int
    azimuth: float
    elevation: float
    mirrored: bool = False
    swapped: bool = False


@dataclass(frozen=True)
class AlignOptions:
    """How to align.

    ``field_of_view`` is in radians (None: solved), ``mode`` and ``root`` those of `register_cameras`, ``smoothing``
    that of `back_project`, ``root_smoothing`` in seconds that of `retime`; ``ground`` takes the depth of standing feet
    from the floor, which is ``floor`` metres high in the clip (None: where its feet stand).
    """

    field_of_view: float | None = None
    mode: Literal["auto", "static", "pan", "free"] = "auto"
    root: Literal["auto", "travel", "in_place"] | float = "auto"
    smoothing: float = 0.0
    root_smoothing: float = 0.25
    ground: bool = False
    floor: float | None = None


@dataclass(frozen=True, eq=False)
class Retiming:
    """The time warp of a drawing: ``cost`` (F, G) of its poses and the clip's at frames ``moments`` (G,)."""

    cost: Floats
    moments: Floats
    warp: TimeWarp

    @property
    def times(self) -> Floats:
        """The clip's frame at each drawing (F,), in fractions."""
        times: Floats = np.interp(self.warp.times, np.arange(len(self.moments)), self.moments)
        return times


def align_drawing(
    drawing: Drawing, motion: Motion, view: View, holds: Floats, frame_rate: float, options: AlignOptions
) -> tuple[Alignment, Retiming]:
    """Register ``motion`` with ``drawing`` and put the drawn joints into 3D (2010, equations 1-8).

    Parameters
    ----------
    drawing : Drawing
        F drawings with marks.
    motion : Motion
        The clip.
    view : View
        Where in the clip and from where to look, as the search finds it.
    holds : (F,) float
        For how many film frames each drawing is shown.
    frame_rate : float
        Film frames a second.
    options : AlignOptions
        What the user has chosen.

    Raises
    ------
    ValueError
        For a clip that has too few of the drawing's markers.
    DegenerateError
        For frames with fewer than four marks, joints on one line and the like, naming frame and joint.
    """
    clip = mirrored(motion) if view.mirrored else motion
    clip = exchanged(clip) if view.swapped else clip
    there = {*clip.known_markers, *clip.names}
    known = [index for index, name in enumerate(drawing.names) if name in there]
    names = [drawing.names[index] for index in known]
    if len(names) < 4:
        raise ValueError(f"clip: it has {len(names)} of the drawing's markers ({', '.join(names)}), want 4 or more")
    rate = frame_rate / float(holds.mean())
    drawn = drawing.markers[:, known]
    visible = drawing.visible[:, known] & np.isfinite(drawn).all(axis=2)
    pace = clip.frame_rate / rate
    retimed = _retimed(np.where(visible[..., None], drawn, np.nan), clip, names, view, holds, pace)
    moved = retime(clip, retimed.times, frame_rate=rate, root_smoothing=options.root_smoothing)
    floor = np.array([0.0, _floor(clip, options), 0.0])
    points = moved.markers(names) - floor
    track = register_cameras(
        drawn,
        points,
        drawing.image_size,
        visible=visible & np.isfinite(points).all(axis=2),
        field_of_view=options.field_of_view,
        mode=options.mode,
        root=options.root,
    )
    kin = _kin(drawing, known)
    seen_from = track.project()[:, kin]
    filled, _ = fill_hidden(
        drawing.markers, np.isfinite(drawing.markers).all(axis=2), seen_from, limbs=drawing.limb_markers
    )
    depths = _depths(track)[:, kin]
    grounded = np.zeros(depths.shape, bool)
    if options.ground:
        depths, grounded = _grounded(drawing, track, filled, depths, clip.markers(FEET) - floor, clip.frame_rate, rate)
    alignment = Alignment(
        drawing.names,
        drawing.image_size,
        retimed.times,
        np.where(np.isin(np.arange(len(drawing.names)), known)[:, None], track.points[:, kin], np.nan),
        track.matrices,
        filled,
        ~drawing.visible,
        grounded,
        back_project(filled, track.matrices, depths, smoothing=options.smoothing, names=drawing.names),
        track.errors,
        track.mode,
        track.root,
        view.mirrored,
        (*track.notes, *_doubts(drawing, known, track)),
    )
    return alignment, retimed


def _floor(clip: Motion, options: AlignOptions) -> float:
    """Height of the clip's floor, which becomes the world's zero."""
    if options.floor is not None:
        return options.floor
    return clip.report.floor or 0.0 if clip.report is not None else 0.0


def _retimed(drawn: Floats, clip: Motion, names: list[str], view: View, holds: Floats, pace: float) -> Retiming:
    """The clip warped to the drawings; ``pace`` is clip frames a drawing (2009, section 3.3)."""
    limbs = [(names.index(limb.start), names.index(limb.end)) for limb in limbs_between(tuple(names))]
    moments = np.arange(view.start, view.stop - 1 + 1e-9, pace / _DENSITY)
    poses = sample_markers(clip.markers(names), moments, rest_frame=clip.rest_frame)
    seen = OrthographicCamera.from_angles(view.azimuth, view.elevation).project(poses)
    cost = pose_distance(
        pose_descriptor(drawn, limbs),
        pose_descriptor(seen, limbs),
        a_trust=limb_trust(drawn, limbs),
        b_trust=limb_trust(seen, limbs),
    )
    return Retiming(cost, moments, time_warp(cost, open_begin=True, open_end=True, slope_limit=_SLOPE, holds=holds))


def _kin(drawing: Drawing, known: list[int]) -> NDArray[np.intp]:
    """For each of the drawing's markers the place in ``known`` of itself, or of a marker that a limb joins it to."""
    place = {marker: index for index, marker in enumerate(known)}
    kin = np.array([place.get(marker, -1) for marker in range(len(drawing.names))])
    pairs = np.concatenate([drawing.limb_markers, drawing.limb_markers[:, ::-1]])
    for _ in drawing.names:
        for lost, other in pairs:
            if kin[lost] < 0 <= kin[other]:
                kin[lost] = kin[other]
    root = drawing.names.index("pelvis") if "pelvis" in drawing.names else known[0]
    kin[kin < 0] = place.get(root, 0)
    return kin


def _depths(track: CameraTrack) -> Floats:
    depths: Floats = np.einsum("fi,fni->fn", track.matrices[:, 2, :3], track.points) + track.matrices[:, 2, 3:]
    return depths


def _grounded(
    drawing: Drawing, track: CameraTrack, filled: Floats, depths: Floats, feet: Floats, clip_rate: float, rate: float
) -> tuple[Floats, NDArray[np.bool_]]:
    """Depths (F, N) with standing feet on the floor, and which markers those are; ``feet`` are the clip's ankles."""
    heights = ankle_heights(feet, FEET, foot_contacts(feet, FEET, clip_rate, 0.0))
    heights = np.where(np.isfinite(heights), heights, _ANKLE)
    found = ground_depths(filled, track.matrices, depths, drawing.names, rate, ankle_height=heights)
    flags = np.zeros(depths.shape, bool)
    for side, foot in enumerate(FEET):
        flags[:, drawing.names.index(foot)] = found.standing[:, side]
    return found.depths, flags


def _doubts(drawing: Drawing, known: list[int], track: CameraTrack) -> list[str]:
    """What the user should look at: a clip that does not fit, or frames where it fits much worse than elsewhere."""
    marks = np.where(drawing.visible[:, known, None], drawing.markers[:, known], np.nan)
    sizes = np.nanmax(marks[..., 1], axis=1) - np.nanmin(marks[..., 1], axis=1)
    height, usual = float(np.median(sizes)), float(np.median(track.errors))
    doubts = []
    if track.error > _MISFIT * height:
        doubts.append(
            f"the clip does not fit: marks are {track.error:.1f} px from it, {track.error / height:.0%} of the figure"
        )
    poor = np.flatnonzero(track.errors > max(3 * usual, _MISFIT * height))
    return doubts + [
        f"drawing {frame}: the clip is {track.errors[frame]:.1f} px away (usually {usual:.1f})" for frame in poor
    ]
