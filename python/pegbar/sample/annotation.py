"""What an artist would mark on the sample's drawings, with the true cameras and depths."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pegbar.sample.dancer import FRAME_RATE
from pegbar.sample.figure import LABELS, LIMBS, PALETTE, RADII, Pose
from pegbar.sample.skeleton import NAMES, Floats
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.drawing import Drawing

TRUNK = ("chest", "left_shoulder", "right_shoulder", "left_hip", "right_hip")
"""Markers that lie on the torso without being an end of it."""
_BEHIND = 0.06
"""A marker of the trunk is hidden when it is so much deeper than the torso's axis, in metres."""


def limbs_of(marker: str) -> set[str]:
    """Names of the limbs that a marker may be seen on."""
    ends = {limb.name for limb in LIMBS if marker in (limb.start, limb.end)}
    return ends | {"torso"} if marker in TRUNK else ends


def seen(pose: Pose, view: PerspectiveCamera, labels: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Which markers (N,) an artist sees: the ``labels`` (H, W, 3) show one of the marker's own limbs there."""
    owner = {color: name for name, color in LABELS.items()} | PALETTE
    pixels = np.rint(view.project(pose.markers)).astype(int)
    depths = view.depth(pose.markers)
    trunk = depths[[NAMES.index("neck"), NAMES.index("pelvis")]].mean()
    visible = np.zeros(len(NAMES), bool)
    for index, (name, (column, row)) in enumerate(zip(NAMES, pixels, strict=True)):
        if 0 <= row < labels.shape[0] and 0 <= column < labels.shape[1]:
            limb = owner.get(tuple(labels[row, column].tolist()))
            hidden = limb == "torso" and name in TRUNK and depths[index] > trunk + _BEHIND
            visible[index] = limb in limbs_of(name) and not hidden
    return visible


def annotate(
    folder: Path, drawn: Floats, cameras: tuple[PerspectiveCamera, ...], visible: NDArray[np.bool_]
) -> Drawing:
    """Annotate the drawings in ``folder``: markers ``drawn`` (F, N, 3) in metres, ``visible`` (F, N) of them."""
    numbers = range(1, len(cameras) + 1)
    frames = list(zip(cameras, drawn, strict=True))
    return Drawing(
        names=NAMES,
        markers=np.stack([view.project(points) for view, points in frames]),
        visible=visible,
        image_size=cameras[0].image_size,
        frame_rate=FRAME_RATE,
        images=tuple(folder / f"drawings/dancer.{number:04d}.png" for number in numbers),
        segmentations=tuple(folder / f"labels/labels.{number:04d}.png" for number in numbers),
        limbs=LIMBS,
        boxes=np.stack([_boxes(view, points) for view, points in frames]),
        cameras=cameras,
        depths=np.stack([view.depth(points) for view, points in frames]),
        loops=True,
    )


def _boxes(view: PerspectiveCamera, points: Floats) -> Floats:
    """Oriented limb boxes (V, 4, 2): first and last corner at the limb's first marker."""
    ends = np.array([[points[NAMES.index(name)] for name in (limb.start, limb.end)] for limb in LIMBS])
    radii = np.array([RADII[limb.name.removeprefix("left_").removeprefix("right_")] for limb in LIMBS])
    pixels, half = view.project(ends), radii * view.focal_length / view.depth(ends)
    axis = pixels[:, 1] - pixels[:, 0]
    across = np.column_stack([-axis[:, 1], axis[:, 0]]) / np.maximum(np.hypot(*axis.T), 1e-9)[:, None]
    first, second = (pixels[:, end, None] + half[:, end, None, None] * across[:, None] * [[1], [-1]] for end in (0, 1))
    return np.stack([first[:, 0], second[:, 0], second[:, 1], first[:, 1]], axis=1)
