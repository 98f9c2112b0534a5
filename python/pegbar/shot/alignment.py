"""From drawn marks and a clip to cameras and 3D markers: retime, register, back-project (2010 paper, section 3.1)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pegbar.align.camera_track import CameraTrack
from pegbar.lift.backprojection import back_project
from pegbar.lift.contact import ground_depths
from pegbar.lift.hidden import fill_hidden
from pegbar.scene.alignment import MISFIT, Alignment
from pegbar.scene.contacts import FEET, ankle_heights, foot_contacts
from pegbar.scene.drawing import Drawing
from pegbar.scene.mirror import exchanged, mirrored
from pegbar.scene.motion import Motion
from pegbar.shot.registered import CameraOptions, View, register_clip
from pegbar.shot.retiming import Marks, Retiming

Floats = NDArray[np.float64]
# How high an ankle rests over the floor, in metres, where the clip does not tell.
_ANKLE = 0.08


@dataclass(frozen=True)
class AlignOptions:
    """How to align: the ``camera``, ``smoothing`` of the depths as `back_project` takes it, and the ground.

    ``ground`` takes the depth of standing feet from the floor, which is ``floor`` metres high in the clip (None: where
    its feet stand).
    """

    camera: CameraOptions = field(default_factory=CameraOptions)
    smoothing: float = 0.0
    ground: bool = False
    floor: float | None = None


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
    clip = as_drawn(motion, view.mirrored, view.swapped, options.floor)
    there = {*clip.known_markers, *clip.names}
    known = [index for index, name in enumerate(drawing.names) if name in there]
    names = tuple(drawing.names[index] for index in known)
    if len(names) < 4:
        found = ", ".join(names) or "none"
        raise ValueError(f"clip: it has {len(names)} of the drawing's markers ({found}), want 4 or more")
    rate = frame_rate / float(holds.mean())
    places = drawing.markers[:, known]
    marks = Marks(places, drawing.visible[:, known] & np.isfinite(places).all(axis=2), names, holds, drawing.image_size)
    retiming, track = register_clip(marks, clip, view, rate, options.camera)
    return _lifted(drawing, known, clip, retiming, track, rate, options), retiming


def as_drawn(motion: Motion, is_mirrored: bool, is_swapped: bool, floor: float | None) -> Motion:
    """Return a clip's mirror image, its sides exchanged, as asked, and its ``floor`` (None: as found) at height 0."""
    clip = mirrored(motion) if is_mirrored else motion
    clip = exchanged(clip) if is_swapped else clip
    if floor is None:
        floor = clip.report.floor if clip.report is not None else None
    return clip.changed(positions=clip.positions - [0.0, floor, 0.0]) if floor else clip


def _lifted(
    drawing: Drawing,
    known: list[int],
    clip: Motion,
    retiming: Retiming,
    track: CameraTrack,
    rate: float,
    options: AlignOptions,
) -> Alignment:
    """The drawn joints at the clip's depths; joints that the clip lacks are as deep as those they hang on."""
    kin = _kin(drawing, known)
    placed = np.isfinite(drawing.markers).all(axis=2)
    filled, _ = fill_hidden(drawing.markers, placed, track.project()[:, kin], limbs=drawing.limb_markers)
    depths = np.einsum("fi,fni->fn", track.matrices[:, 2, :3], track.points) + track.matrices[:, 2, 3:]
    depths, grounded = depths[:, kin], np.zeros((len(filled), len(kin)), bool)
    if options.ground:
        depths, grounded = _grounded(drawing, track, filled, depths, clip, rate)
    lost = ~np.isin(np.arange(len(kin)), known)
    return Alignment(
        names=drawing.names,
        image_size=drawing.image_size,
        times=retiming.times,
        clip=np.where(lost[:, None], np.nan, track.points[:, kin]),
        matrices=track.matrices,
        markers=filled,
        estimated=~drawing.visible,
        grounded=grounded,
        positions=back_project(filled, track.matrices, depths, smoothing=options.smoothing, names=drawing.names),
        errors=track.errors,
        mode=track.mode,
        root=track.root,
        notes=track.notes,
        warnings=tuple(_doubts(drawing, known, track)),
    )


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


def _grounded(
    drawing: Drawing, track: CameraTrack, filled: Floats, depths: Floats, clip: Motion, rate: float
) -> tuple[Floats, NDArray[np.bool_]]:
    """Depths (F, N) with standing feet on the floor, and which markers those are."""
    if not {*FEET} <= {*drawing.names} & {*clip.known_markers}:
        raise ValueError("align.ground: drawing and clip need the markers left_foot and right_foot")
    feet = clip.markers(FEET)
    heights = ankle_heights(feet, FEET, foot_contacts(feet, FEET, clip.frame_rate, 0.0))
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
    if track.error > MISFIT * height:
        doubts.append(
            f"the clip does not fit: marks are {track.error:.1f} px from it, {track.error / height:.0%} of the figure"
        )
    poor = np.flatnonzero(track.errors > max(3 * usual, MISFIT * height))
    return doubts + [
        f"drawing {frame}: the clip is {track.errors[frame]:.1f} px away (usually {usual:.1f})" for frame in poor
    ]
