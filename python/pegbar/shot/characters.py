"""Drawn characters over film frames: each drawing held as the shot shows it, all under the first one's cameras."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pegbar.layer.volumes import collision_volumes
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.driving import Driving
from pegbar.scene.volumes import TaperedCylinders
from pegbar.shot.plan import Shot
from pegbar.simulate.scene import Character

Floats = NDArray[np.float64]


def drawn_rows(shot: Shot, driving: Driving, frames: Sequence[int]) -> NDArray[np.int64]:
    """For each of ``frames`` the place of its drawing in ``driving``, -1 where the frame has none with marks."""
    order = {number: row for row, number in enumerate(driving.numbers)}
    rows = []
    for frame in frames:
        try:
            rows.append(order.get(shot.exposure.drawing(frame), -1))
        except ValueError:
            rows.append(-1)
    return np.array(rows, np.int64)


def film_cameras(driving: Driving, rows: NDArray[np.int64]) -> tuple[PerspectiveCamera, ...]:
    """Return a camera for every film frame; a frame without a drawing has that of the nearest one before or after."""
    known = np.flatnonzero(rows >= 0)
    if not len(known):
        raise ValueError("no frame of the shot shows a drawing with marks")
    places = np.arange(len(rows))
    behind = np.searchsorted(known, places).clip(max=len(known) - 1)
    before, after = known[np.maximum(behind - 1, 0)], known[behind]
    nearest = np.where(np.abs(places - before) <= np.abs(after - places), before, after)
    return tuple(PerspectiveCamera(driving.matrices[rows[place]], driving.image_size) for place in nearest)


def film_character(name: str, driving: Driving, rows: NDArray[np.int64]) -> Character:
    """Return the character over film frames; NaN in frames without a drawing."""
    volumes = driving.volumes
    taken = TaperedCylinders(
        *(_taken(track, rows) for track in (volumes.start, volumes.end, volumes.start_radius, volumes.end_radius))
    )
    ends = tuple((driving.names[start], driving.names[end]) for start, end in driving.limb_markers)
    return Character(name, driving.names, _taken(driving.positions, rows), driving.limb_names, taken, ends)


def seen_by(
    driving: Driving, rows: NDArray[np.int64], cameras: Sequence[PerspectiveCamera]
) -> tuple[Driving, NDArray[np.int64]]:
    """Return a second character as ``cameras`` (one a film frame) see it, with a drawing a film frame.

    Its marks and boxes stay where they are drawn. Depths are those that its own cameras found, times the ratio of the
    focal lengths, so that it keeps its size.
    """
    own = [PerspectiveCamera(driving.matrices[row], driving.image_size) for row in rows]
    positions = np.full((len(rows), *driving.positions.shape[1:]), np.nan)
    for frame, (row, camera) in enumerate(zip(rows, cameras, strict=True)):
        if row >= 0:
            depths = own[frame].depth(driving.positions[row]) * camera.focal_length / own[frame].focal_length
            positions[frame] = camera.unproject(driving.markers[row], depths)
    matrices, boxes = np.stack([camera.matrix for camera in cameras]), _taken(driving.boxes, rows)
    moved = Driving(
        tuple(range(len(rows))),
        driving.names,
        driving.limb_names,
        driving.limb_markers,
        driving.image_size,
        matrices,
        _taken(driving.markers, rows),
        driving.estimated[rows],
        positions,
        boxes,
        driving.given[rows],
        driving.repaired[rows],
        driving.measured[rows],
        collision_volumes(boxes, matrices, positions, driving.limb_markers),
        None,
        driving.overlaps[rows],
        driving.notes,
    )
    return moved, np.where(rows >= 0, np.arange(len(rows)), -1)


def _taken(track: Floats, rows: NDArray[np.int64]) -> Floats:
    """Rows of ``track``, NaN for -1."""
    taken = track[rows].copy()
    taken[rows < 0] = np.nan
    return taken
