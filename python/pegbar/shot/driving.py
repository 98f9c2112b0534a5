"""What drives a simulation, drawing by drawing: joints in 3D, limb boxes, collision volumes and the ground."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import DegenerateError
from pegbar.layer.box_edges import LimbEdges
from pegbar.layer.boxes import LimbBoxes, limb_boxes
from pegbar.layer.separate import separate_volumes
from pegbar.layer.volumes import collision_volumes
from pegbar.lift.backprojection import camera_rays
from pegbar.scene.camera import metric
from pegbar.scene.contacts import FEET, ankle_heights, foot_contacts
from pegbar.scene.drawing import Drawing
from pegbar.scene.driving import Driving

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
# How high an ankle rests over the floor, as a part of the shin's length, where no clip tells.
_ANKLE = 0.19
_UPSIDE_DOWN = np.diag([1.0, -1.0, -1.0, 1.0])


def drive(
    drawing: Drawing,
    numbers: Sequence[int],
    edges: Sequence[LimbEdges],
    *,
    clip: Floats | None = None,
    ground: float | None = None,
    frame_rate: float = 24.0,
    clearance: float | None = None,
) -> Driving:
    """Put a drawn character into 3D with volumes that fill its drawn limbs (2010, sections 3.1.3 and 3.2).

    Parameters
    ----------
    drawing : Drawing
        D drawings with marks, limbs, a camera each, and depths.
    numbers : sequence of D int
        What the drawings are called.
    edges : sequence of D LimbEdges
        How wide their limbs are.
    clip : (D, N, 3) float, optional
        The clip's markers for the drawings, its floor at height 0: they tell when feet stand.
    ground : float, optional
        Height of the ground in metres; None: where the feet stand, and none where none does.
    frame_rate : float
        Drawings a second.
    clearance : float, optional
        Move markers in depth until limbs that are not joined are so many metres apart; None: leave them.

    Raises
    ------
    ValueError
        For a drawing without cameras or depths.
    DegenerateError
        Naming drawing and limb, for a box that is inside out or without width, a marker behind the camera, a limb
        of no length.
    """
    if not drawing.cameras or drawing.depths is None:
        raise ValueError("drawing: want cameras and depths")
    matrices = _upright(drawing)
    markers, depths, estimated = _placed(drawing)
    limbs, limb_names = drawing.limb_markers.astype(np.int64), tuple(limb.name for limb in drawing.limbs)
    scales = _scales(drawing, depths, limbs)
    found = limb_boxes(edges, markers, limbs, given=drawing.boxes, scales=scales, names=limb_names)
    _refuse_impossible(found, matrices, _on_rays(markers, matrices, depths), limbs, numbers, limb_names)
    room, leaves = clearance or 0.0, clearance is None
    apart = separate_volumes(
        found.boxes, matrices, markers, depths, limbs, drawing.names, clearance=room, measure_only=leaves
    )
    positions = _on_rays(markers, matrices, apart.depths)
    floor, said = (ground, ()) if ground is not None else _ground(drawing, positions, clip, frame_rate)
    missing = _missing(drawing.names, limb_names, limbs, positions)
    return Driving(
        tuple(numbers),
        drawing.names,
        limb_names,
        limbs,
        drawing.image_size,
        matrices,
        markers,
        estimated,
        positions,
        found.boxes,
        found.given,
        found.repaired,
        found.measured,
        collision_volumes(found.boxes, matrices, positions, limbs),
        floor,
        np.stack([apart.before, apart.after], axis=1),
        (*missing, *_mended(found, numbers, limb_names), *said),
    )


def _upright(drawing: Drawing) -> Floats:
    """The cameras' matrices, in a world whose y points up.

    Annotations that know no world have a camera whose own axes are the world's: y points down in the picture.
    """
    matrices = metric(np.stack([camera.matrix for camera in drawing.cameras]))
    down = np.mean([camera.rotation[1, 1] for camera in drawing.cameras]) > 0
    return matrices @ _UPSIDE_DOWN if down else matrices


def _scales(drawing: Drawing, depths: Floats, limbs: NDArray[np.int64]) -> Floats:
    """Pixels a metre at each limb (D, V); 1 where a depth is not known."""
    focal = np.array([camera.focal_length for camera in drawing.cameras])
    ends = np.where(depths > 0, depths, np.nan)[:, limbs].mean(axis=2)
    scales: Floats = np.where(np.isfinite(ends), focal[:, None] / ends, 1.0)
    return scales


def _on_rays(markers: Floats, matrices: Floats, depths: Floats) -> Floats:
    centres, rays = camera_rays(markers, matrices)
    positions: Floats = centres[:, None] + depths[..., None] * rays
    return positions


def _placed(drawing: Drawing) -> tuple[Floats, Floats, Flags]:
    """Marks (D, N, 2) and depths (D, N) without gaps in time, and which of them are no drawn marks."""
    assert drawing.depths is not None
    values = np.concatenate([drawing.markers, drawing.depths[..., None]], axis=2)
    known = np.isfinite(values).all(axis=2)
    moments = np.arange(len(values))
    for marker in np.flatnonzero(known.any(axis=0)):
        there = known[:, marker]
        for axis in range(3):
            values[~there, marker, axis] = np.interp(moments[~there], moments[there], values[there, marker, axis])
    values[:, ~known.any(axis=0)] = np.nan
    return values[..., :2], values[..., 2], ~(known & drawing.visible)


def _refuse_impossible(
    found: LimbBoxes,
    matrices: Floats,
    positions: Floats,
    limbs: NDArray[np.int64],
    numbers: Sequence[int],
    names: Sequence[str],
) -> None:
    """Refuse what is impossible, naming drawing and limb."""
    try:
        collision_volumes(found.boxes, matrices, positions, limbs)
    except DegenerateError as error:
        said = str(error).removeprefix("boxes: ").split(": ", 1)
        frame, limb = (int(part.split()[1]) for part in said[0].split(", "))
        raise DegenerateError(f"drawing {numbers[frame]}, limb {names[limb]}: {said[1]}") from None


def _ground(
    drawing: Drawing, positions: Floats, clip: Floats | None, rate: float
) -> tuple[float | None, tuple[str, ...]]:
    """The floor's height under the drawn feet, in the drawings in which the clip's feet stand, else their own."""
    if not {*FEET} <= {*drawing.names}:
        return None, ("no ground: the drawing has no marks left_foot and right_foot",)
    feet = [drawing.names.index(foot) for foot in FEET]
    there = np.isfinite(positions[:, feet]).all(axis=(0, 2)).all()
    if not there:
        return None, ("no ground: a foot is marked in no drawing",)
    standing, rest = None, None
    if clip is not None and np.isfinite(clip[:, feet]).all():
        standing = foot_contacts(clip[:, feet], FEET, rate, 0.0)
        rest = ankle_heights(clip[:, feet], FEET, standing)
    if standing is None or rest is None or not standing.any():
        standing = foot_contacts(positions[:, feet], FEET, rate)
        rest = np.full(2, _ankle_height(drawing, positions))
    heights = positions[:, feet, 1] - rest
    if not standing.any():
        return float(np.nanmin(heights)), ("the ground is where the lowest foot is: none stands still",)
    return float(np.median(heights[standing])), ()


def _ankle_height(drawing: Drawing, positions: Floats) -> float:
    shins = [
        np.linalg.norm(positions[:, drawing.names.index(foot)] - positions[:, drawing.names.index(knee)], axis=1)
        for foot in FEET
        if (knee := foot.replace("foot", "knee")) in drawing.names
    ]
    return _ANKLE * float(np.nanmedian(shins)) if shins else 0.08


def _missing(names: Sequence[str], limb_names: Sequence[str], limbs: NDArray[np.int64], positions: Floats) -> list[str]:
    """Markers that no drawing shows, and the limbs that have no volume for it."""
    lost = np.isnan(positions).any(axis=2).all(axis=0)
    notes = []
    for marker in np.flatnonzero(lost).tolist():
        hang = [name for name, pair in zip(limb_names, limbs, strict=True) if marker in pair]
        without = f": {', '.join(hang)} without a volume" if hang else ""
        notes.append(f"marker {names[marker]} is missing in all drawings{without}")
    return notes


def _mended(found: LimbBoxes, numbers: Sequence[int], names: Sequence[str]) -> list[str]:
    """Limbs whose measured width was implausible, not merely covered, with the drawings."""
    notes = []
    for limb, name in enumerate(names):
        wrong = np.flatnonzero(found.repaired[:, limb] & (found.measured[:, limb] > 1.6))
        if len(wrong):
            worst = int(wrong[np.argmax(found.measured[wrong, limb])])
            notes.append(
                f"limb {name}: {len(wrong)} boxes too wide, repaired; drawing {numbers[worst]} was "
                f"{found.measured[worst, limb]:.1f} times the usual width"
            )
    return notes
