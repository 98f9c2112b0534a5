"""A shot to export: two walkers, one of them gone for two frames, and a camera that moves, zooms and is off centre."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from pegbar import PerspectiveCamera
from pegbar.export.shot_scene import ShotScene
from pegbar.scene.volumes import TaperedCylinders
from tests.walkers import walker

FRAMES = tuple(range(101, 109))
GONE = (3, 4)


def camera(row: int, *, zoom: float = 0.0, shift: tuple[float, float] = (0.0, 0.0)) -> PerspectiveCamera:
    """A camera that walks along, high up, so that nothing is parallel to an axis."""
    plain = PerspectiveCamera.look_at((2.5 + 0.1 * row, 1.9, 3.5), (0, 0.9, 0.05 * row), (960, 540), 0.9)
    lens = np.diag([1 + zoom * row, 1 + zoom * row, 1.0])
    middle = np.array([[1.0, 0, 479.5], [0, 1, 269.5], [0, 0, 1]])
    moved = np.array([[1.0, 0, shift[0]], [0, 1, shift[1]], [0, 0, 1]])
    return PerspectiveCamera(moved @ middle @ lens @ np.linalg.inv(middle) @ plain.matrix, (960, 540))


def shot(**lens) -> ShotScene:
    """Eight frames from 101 on; the second character is unknown in rows `GONE`, and its left hand in all."""
    first = walker(len(FRAMES), name="Anna & Bo")
    second = walker(len(FRAMES), name="1")
    markers, volumes = second.markers + np.array([1.0, 0, 0]), second.volumes
    markers[list(GONE)] = np.nan
    markers[:, second.marker_names.index("left_hand")] = np.nan
    tracks = [track.copy() for track in dataclasses.astuple(volumes)]
    for track in tracks:
        track[list(GONE)] = np.nan
    for track in tracks[:2]:
        track += np.array([1.0, 0, 0])
    gone = dataclasses.replace(second, markers=markers, volumes=TaperedCylinders(*tracks))
    return ShotScene(
        "walk",
        FRAMES,
        12.0,
        (1, 1, 2, 2, 3, 3, None, None),
        tuple(camera(row, **lens) for row in range(len(FRAMES))),
        (first, gone),
        0.0,
        tuple(Path(f"/shots/walk/d.{number:04d}.png") if number else None for number in (1, 1, 2, 2, 3, 3, 0, 0)),
    )
