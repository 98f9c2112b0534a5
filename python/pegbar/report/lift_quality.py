"""How good a lifted drawing is, in numbers, and what a user should know of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.alignment import Alignment
from pegbar.scene.lifted import Lifted

Floats = NDArray[np.float64]
#: Limbs whose drawn length changes more than this, relative, do not fit rigid bones.
RIGID = 0.08
#: A skeleton that is farther from the marks than this share of the figure's height is told.
FAR = 0.05
#: Metres: a clip whose poses differ less has no movement.
_STILL = 0.02


def quality(alignment: Alignment, lifted: Lifted, numbers: Sequence[int]) -> dict[str, Any]:
    """Return what a user asks of a lifted drawing, as numbers with their units in their names.

    ``numbers`` are the drawings' as the user knows them.
    """
    names = [name for name in lifted.names if name in {*lifted.motion.known_markers, *lifted.motion.names}]
    known = [alignment.names.index(name) for name in names]
    of_lifted = [lifted.names.index(name) for name in names]
    posed, markers = lifted.motion.markers(names), lifted.markers[:, of_lifted]
    off = _picture_errors(alignment, posed, known)
    apart = np.linalg.norm(posed - markers, axis=2)
    drawing, joint = np.unravel_index(np.argmax(apart), apart.shape)
    slide = _slides(posed, lifted.planted[:, of_lifted])
    changes = limb_changes(lifted.markers, lifted.names, lifted.bones)
    return {
        "drawings": len(posed),
        "marker_reprojection_px": _rms(_picture_errors(alignment, markers, known)),
        "skeleton_reprojection_px": _rms(off),
        "limb_length_residual": _rms(np.array(list(changes.values()))),
        "limb_length_residuals": {name: round(change, 4) for name, change in changes.items()},
        "skeleton_to_markers_m": _rms(apart),
        "skeleton_to_markers_worst": {
            "m": float(apart[drawing, joint]),
            "drawing": numbers[int(drawing)],
            "joint": names[int(joint)],
        },
        "foot_slide_m_per_drawing": float(slide.mean()) if slide.size else None,
        "foot_slide_worst_m": float(slide.max()) if slide.size else None,
        "standing": _standing(lifted, numbers),
        "to_clip_m": _rms(np.linalg.norm(posed - alignment.clip[:, known], axis=2)),
        "loop_travel_m": lifted.travel.round(4).tolist(),
        "skeleton_size": lifted.size,
        "figure_height_px": alignment.figure_height,
    }


def limb_changes(points: Floats, names: Sequence[str], bones: Sequence[tuple[int, int]]) -> dict[str, float]:
    """Return by how much, relative, limbs of ``points`` (F, N, 3) change their length; limbs by their outer joint."""
    changes = {}
    for first, second in bones:
        lengths = np.linalg.norm(points[:, second] - points[:, first], axis=1)
        usual = float(np.median(lengths))
        if usual > 1e-9:
            changes[names[second]] = _rms(lengths / usual - 1)
    return changes


def notes(
    alignment: Alignment, lifted: Lifted, numbers: Sequence[int], values: dict[str, Any], stretch: bool
) -> list[str]:
    """Return what a user should know: joints left out, limbs that no rigid bone follows, a skeleton far off."""
    found = []
    if lost := [name for name in alignment.names if name not in lifted.names]:
        found.append(f"the clip has no joint for {', '.join(lost)}: left out")
    poses = alignment.clip - np.nanmean(alignment.clip, axis=1, keepdims=True)
    if len(numbers) == 1:
        found.append("one drawing is one pose: one frame is written for each that shows it")
    elif float(np.nanmax(np.ptp(poses, axis=0))) < _STILL:
        found.append("the clip stands still: all depth is that of one pose, and no foot is known to leave the ground")
    # At the clip's depth, since rigid limbs have one length whatever is drawn.
    known = [alignment.names.index(name) for name in lifted.names]
    drawn = limb_changes(alignment.positions[:, known], lifted.names, lifted.bones)
    loose = {name: change for name, change in drawn.items() if change > RIGID}
    if loose and not stretch:
        most = sorted(loose, key=lambda name: -loose[name])[:3]
        told = ", ".join(f"to {name} by {loose[name]:.0%}" for name in most)
        found.append(
            f"drawn limbs change their length ({told}), which rigid bones do not follow: stretch = true keeps it"
        )
    height = float(np.median(np.ptp(alignment.markers[..., 1], axis=1)))
    worst = values["skeleton_to_markers_worst"]
    if values["skeleton_reprojection_px"] > FAR * height and not stretch:
        found.append(
            f"the skeleton is {values['skeleton_reprojection_px']:.0f} px from the drawn marks "
            f"({values['skeleton_reprojection_px'] / height:.0%} of the figure's height), most at {worst['joint']} in "
            f"drawing {worst['drawing']}"
        )
    return found


def _standing(lifted: Lifted, numbers: Sequence[int]) -> dict[str, list[str]]:
    """In which runs of drawings each foot stands."""
    runs = {}
    for marker in np.flatnonzero(lifted.planted.any(axis=0)):
        edges = np.flatnonzero(np.diff(lifted.planted[:, marker], prepend=False, append=False)).reshape(-1, 2)
        runs[lifted.names[marker]] = [f"{numbers[start]}-{numbers[stop - 1]}" for start, stop in edges.tolist()]
    return runs


def _picture_errors(alignment: Alignment, points: Floats, known: Sequence[int]) -> Floats:
    """How far ``points`` (F, N, 3) are seen from the marks that are drawn, in pixels."""
    views = np.stack([view.project(place) for view, place in zip(alignment.cameras, points, strict=True)])
    distances = np.linalg.norm(views - alignment.markers[:, known], axis=2)
    drawn: Floats = distances[~alignment.estimated[:, known]]
    return drawn


def _slides(posed: Floats, planted: NDArray[np.bool_]) -> Floats:
    """How far standing feet move from drawing to drawing, metres."""
    both = planted[1:] & planted[:-1]
    slides: Floats = np.linalg.norm(np.diff(posed, axis=0), axis=2)[both]
    return slides


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0
