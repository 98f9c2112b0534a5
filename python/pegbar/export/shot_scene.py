"""An aligned shot as other packages get it: cameras and characters for every film frame, and lenses as stored."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.camera_moves import CameraMoves
from pegbar.scene.film_view import FilmView
from pegbar.simulate.scene import Character

Floats = NDArray[np.float64]
# What cameras are sold with, in millimetres, and how far from it the width may be for the sake of exact ratios.
_SENSOR, _NEAR_SENSOR = 36.0, 0.002
# Skew that moves no point of the picture by more than so many pixels is rounding.
_SKEW = 1e-3


@dataclass(frozen=True, eq=False)
class ShotScene:
    """An aligned shot.

    ``frames`` (F) are film frame numbers, one after the other; ``drawings`` (F) the drawing that each shows, None
    where it shows none. ``cameras`` (F) see the ``characters``, whose tracks have F frames and NaN where nothing is
    known. ``ground`` is the floor's height or None, ``pictures`` (F) the drawings' files. World metres, y up.

    Where the ``moves`` of an exposure sheet's camera are in the cameras, ``views`` (F) are what it sees of drawings.
    """

    name: str
    frames: tuple[int, ...]
    frame_rate: float
    drawings: tuple[int | None, ...]
    cameras: tuple[PerspectiveCamera, ...]
    characters: tuple[Character, ...]
    ground: float | None = None
    pictures: tuple[Path | None, ...] = ()
    moves: CameraMoves | None = None
    views: tuple[FilmView, ...] = ()

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height of the pictures in pixels."""
        return self.cameras[0].image_size


@dataclass(frozen=True)
class Lens:
    """A camera's lens in millimetres: focal length, the film's width and height, and how far it lies right and up."""

    focal_length: float
    width: float
    height: float
    right: float
    up: float


def lenses(scene: ShotScene) -> tuple[Lens, ...]:
    """Return the lens of every frame; ValueError, naming the frame, for a camera with skew, which no lens has.

    All numbers are held by 32 bit floats. The film is nearly 36 mm wide: of the widths near it the one is taken with
    which rounding moves the picture least, since ratios alone decide what is seen.
    """
    found: list[Lens] = []
    for index, (frame, camera) in enumerate(zip(scene.frames, scene.cameras, strict=True)):
        inner = camera.intrinsic
        if index and np.array_equal(inner, scene.cameras[index - 1].intrinsic):
            found.append(found[-1])
            continue
        if abs(inner[0, 1]) * camera.image_size[1] > _SKEW * inner[1, 1]:
            raise ValueError(f"frame {frame}: its camera has skew {inner[0, 1]:.3g}, which other packages do not know")
        found.append(_lens(inner, camera.image_size))
    return tuple(found)


def _lens(inner: Floats, size: tuple[int, int]) -> Lens:
    (width, height), focal = size, float(inner[0, 0])
    common = math.gcd(width, height)
    # Width, height and focal length in pixels times the same power of two over `steps` are whole numbers below 2^24.
    ratio = focal / width
    power = 2.0 ** math.floor(math.log2(2**23 / (_SENSOR * max(1.0, ratio, height / width))))
    middle = _SENSOR * power * common / width
    steps = np.arange(math.floor(middle * (1 - _NEAR_SENSOR)), math.ceil(middle * (1 + _NEAR_SENSOR)) + 1)
    exact = steps * (width // common) * ratio
    best = int(np.argmin(np.abs(exact - np.rint(exact)) / exact))
    wide = float(steps[best]) * (width // common) / power
    unit = wide / width
    square = float(inner[0, 0] / inner[1, 1])
    # A camera sees from half a pixel before the first centre to half a pixel after the last one.
    right, up = width / 2 - 0.5 - inner[0, 2], (inner[1, 2] + 0.5 - height / 2) * square
    values = exact[best] / power, wide, unit * height * _one(square), unit * right, unit * up
    return Lens(*(float(np.float32(value)) for value in values))


def _one(ratio: float) -> float:
    """Pixels that differ from squares by rounding alone are squares."""
    return 1.0 if abs(ratio - 1) < 1e-12 else ratio


def filmed(scene: ShotScene, moves: CameraMoves | None, size: tuple[int, int] | None) -> ShotScene:
    """Return ``scene``, whose cameras see whole drawings, as the sheet's camera sees it: frames of ``size``.

    A pan moves the film behind the lens, a zoom lengthens the lens, and a turn rolls the camera: in perspective the
    picture moves just as the paper does. What is seen as it is stays so.
    """
    paper = scene.image_size
    places = [{} if moves is None else moves.at(frame) for frame in scene.frames]
    views = tuple(FilmView(paper, size or paper, **place) for place in places)
    if all(view.is_whole for view in views):
        return replace(scene, moves=moves)
    cameras = tuple(view.camera(camera) for view, camera in zip(views, scene.cameras, strict=True))
    # A picture of the whole drawing fits no frame of a camera that moves over it.
    return replace(scene, cameras=cameras, moves=moves, views=views, pictures=(None,) * len(views))


def camera_poses(cameras: tuple[PerspectiveCamera, ...]) -> Floats:
    """Return (F, 4, 4) camera-to-world matrices with axes right, up and back, as USD, glTF and Blender have them."""
    poses = np.tile(np.eye(4), (len(cameras), 1, 1))
    for pose, camera in zip(poses, cameras, strict=True):
        pose[:3, :3] = (camera.rotation * np.array([[1.0], [-1.0], [-1.0]])).T
        pose[:3, 3] = camera.position
    return poses
