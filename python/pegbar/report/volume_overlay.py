"""Collision volumes to look at: the drawing with its limb boxes and the tapered cylinders as the camera sees them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pegbar.report.canvas import Canvas
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.driving import Driving
from pegbar.scene.volumes import TaperedCylinders

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]
# Left is blue and right is red, as in `pegbar motion plot`; what has no side is green.
_COLORS = {"left": (40, 90, 220), "right": (215, 50, 40)}
_MIDDLE = (30, 140, 60)
_FAR = 15000


def volume_overlay(picture: Picture, driving: Driving, row: int) -> Picture:
    """Return a drawing, of any size, with the boxes and volumes of ``row``, (H, W, 4) uint8.

    Thin lines are limb boxes, dashed where the width is taken from other drawings; filled discs and bands are the
    volumes. The grey line is the ground under the figure.
    """
    height, width = picture.shape[:2]
    canvas = Canvas(width, height, (255, 255, 255, 255))
    canvas.paste(picture, 0, 0)
    canvas.polygon([(-1, -1), (width, -1), (width, height), (-1, height)], (255, 255, 255, 130))
    factor = width / driving.image_size[0]
    camera = PerspectiveCamera(driving.matrices[row], driving.image_size).scaled(factor)
    unit = max(height, width) / 960
    volumes = driving.volumes
    if driving.ground is not None:
        _ground(canvas, camera, driving.ground, np.nanmean(volumes.end[row], axis=0), unit)
    for limb, name in enumerate(driving.limb_names):
        color = _COLORS.get(name.split("_")[0], _MIDDLE)
        _capsule(canvas, camera, volumes, (row, limb), color)
        corners = factor * driving.boxes[row, limb] + (factor - 1) / 2
        if np.isfinite(corners).all() and np.abs(corners).max() < _FAR:
            _box(canvas, corners, 2 * unit, color, dashed=bool(driving.repaired[row, limb]))
    canvas.text((8 * unit, 30 * unit), f"drawing {driving.numbers[row]}", 20 * unit, (20, 20, 20))
    return canvas.image()


def _capsule(
    canvas: Canvas,
    camera: PerspectiveCamera,
    volumes: TaperedCylinders,
    place: tuple[int, int],
    color: tuple[int, int, int],
) -> None:
    """The outline of the two spheres and what lies between them, as wide as they are seen."""
    ends = np.stack([volumes.start[place], volumes.end[place]])
    radii = np.array([volumes.start_radius[place], volumes.end_radius[place]])
    depths = camera.depth(ends)
    if not (np.isfinite(ends).all() and (depths > 0.01).all()):
        return
    pixels, wide = camera.project(ends), radii * camera.focal_length / depths
    if np.abs(pixels).max() < _FAR and wide.max() < _FAR:
        canvas.polyline(pixels, 2 * wide, (*color, 70))


def _box(canvas: Canvas, corners: Floats, width: float, color: tuple[int, int, int], *, dashed: bool) -> None:
    if not dashed:
        canvas.polyline(corners, width, color, closed=True)
        return
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        pieces = max(2, int(np.linalg.norm(end - start) / (8 * width)))
        for piece in range(pieces):
            along = np.array([piece, piece + 0.5]) / pieces
            canvas.polyline(start + along[:, None] * (end - start), width, color)


def _ground(canvas: Canvas, camera: PerspectiveCamera, height: float, middle: Floats, unit: float) -> None:
    """Lines on the ground, half a metre apart, under the figure."""
    for offset in np.arange(-2, 2.1, 0.5):
        for axis in (0, 2):
            points = np.tile([middle[0], height, middle[2]], (41, 1))
            points[:, axis] += np.linspace(-2, 2, 41)
            points[:, 2 - axis] += offset
            points = points[camera.depth(points) > 0.1]
            pixels = camera.project(points)
            pixels = pixels[np.abs(pixels).max(axis=1, initial=0) < _FAR]
            if len(pixels) > 1:
                canvas.polyline(pixels, unit, (120, 120, 110, 150))
