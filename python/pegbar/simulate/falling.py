"""Presets of what falls round a character: snow and rain that fill the air which the camera sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.camera import PerspectiveCamera
from pegbar.simulate.elements import Element
from pegbar.simulate.figure import body_height
from pegbar.simulate.materials import Color, Look, check
from pegbar.simulate.scene import Character
from pegbar.simulate.tracks import filled
from pegbar.simulate.weather import ParticleMaterial, Particles

Floats = NDArray[np.float64]
#: Nearest that particles come to the camera, as a share of the character's distance: nearer ones would be blots.
NEAREST = 0.45
#: Of the cameras, every so manieth is looked through for what they see.
EVERY = 6


@dataclass(frozen=True)
class Snow:
    """Snow that fills the air, lies on head and shoulders for a while and melts.

    ``count`` flakes of diameter ``size`` (body heights) are in the air, and fall at ``fall_speed`` (m/s) with a
    ``flutter`` (m/s). The share ``stick`` stays lying for ``settle`` seconds. ``reach`` is how far before and behind
    the character snow falls, in body heights.
    """

    count: int = 3000
    size: float = 0.011
    fall_speed: float = 1.1
    flutter: float = 0.3
    stick: float = 0.8
    settle: float = 8.0
    reach: float = 1.5
    color: Color = (0.62, 0.78, 1.0, 1.0)

    def build(
        self,
        name: str,
        character: Character,
        ground: float | None,
        seed: int,
        cameras: Sequence[PerspectiveCamera] = (),
    ) -> tuple[Element, ...]:
        """Fill the air between the first and the last frame's view."""
        check(self, positive=("size", "fall_speed", "settle", "reach"), not_negative=("flutter", "stick"))
        if not 0 <= self.stick <= 1:
            raise ValueError(f"stick: want 0 to 1, got {self.stick}")
        height = body_height(character)
        low, high = air_box(character, ground, self.reach * height, cameras)
        material = ParticleMaterial(
            radius=self.size * height / 2,
            terminal_velocity=self.fall_speed,
            flutter=self.flutter,
            stick=self.stick,
            run_off=1 - self.stick,
            settle=self.settle,
        )
        return (Particles(name, low, high, self.count, material, Look(self.color)),)


@dataclass(frozen=True)
class Rain:
    """Rain that fills the air, splashes on the character and the ground, and runs off.

    ``count`` drops of diameter ``size`` (body heights) are in the air and fall at ``fall_speed`` (m/s). Each bursts
    into ``splash`` droplets, but for the share ``run_off`` that runs off what it falls on. ``reach`` is how far before
    and behind the character it rains, in body heights.
    """

    count: int = 1200
    size: float = 0.004
    fall_speed: float = 7.0
    splash: int = 3
    run_off: float = 0.25
    reach: float = 1.2
    color: Color = (0.25, 0.42, 0.62, 0.8)

    def build(
        self,
        name: str,
        character: Character,
        ground: float | None,
        seed: int,
        cameras: Sequence[PerspectiveCamera] = (),
    ) -> tuple[Element, ...]:
        """Fill the air between the first and the last frame's view."""
        check(self, positive=("size", "fall_speed", "reach"), not_negative=("run_off",))
        if not 0 <= self.run_off <= 1:
            raise ValueError(f"run_off: want 0 to 1, got {self.run_off}")
        height = body_height(character)
        low, high = air_box(character, ground, self.reach * height, cameras)
        material = ParticleMaterial(
            radius=self.size * height / 2,
            terminal_velocity=self.fall_speed,
            stick=0.0,
            run_off=self.run_off,
            splash=self.splash,
        )
        return (Particles(name, low, high, self.count, material, Look(self.color), "streak"),)


def air_box(
    character: Character, ground: float | None, reach: float, cameras: Sequence[PerspectiveCamera]
) -> tuple[Floats, Floats]:
    """Return the corners of the box of air that the cameras see up to ``reach`` metres round the character.

    Without cameras it is what lies within ``reach`` of the character. It begins at the ground, where there is one.
    """
    markers = filled(character.markers)
    known = markers[:, ~np.isnan(markers).any(axis=(0, 2))]
    if not known.size:
        raise ValueError(f"{character.name}: no marker is known")
    corners = [known.min(axis=(0, 1)) - reach, known.max(axis=(0, 1)) + reach]
    for index in range(0, len(cameras), EVERY):
        camera = cameras[index]
        depths = camera.depth(known[index])
        ends = max(float(depths.min()) - reach, NEAREST * float(depths.mean())), float(depths.max()) + reach
        width, height = camera.image_size
        pixels = np.array([(x, y) for x in (0, width) for y in (0, height) for _ in ends], np.float64)
        seen = camera.unproject(pixels, np.tile(ends, 4))
        corners += [seen.min(axis=0), seen.max(axis=0)]
    places = np.array(corners if not cameras else corners[2:])
    low, high = places.min(axis=0), places.max(axis=0)
    # What lies on the head has to come from above it.
    high[1] = max(high[1], float(known[..., 1].max()) + 0.3)
    if ground is not None:
        low[1] = ground
        high[1] = max(high[1], ground + 0.5)
    return low, high
