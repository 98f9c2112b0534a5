"""A scene to simulate: characters as moving volumes and markers, elements, wind, gravity and ground.

World metres, Y up, right-handed. Frames count from 0, the shot's first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pegbar import arrays
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.volumes import TaperedCylinders
from pegbar.simulate.elements import Cloth, Element, Pin, Prop, Strands
from pegbar.simulate.fields import Puddle, SnowField
from pegbar.simulate.materials import Wind
from pegbar.simulate.weather import Particles

Floats = NDArray[np.float64]
GRAVITY = (0.0, -9.81, 0.0)
#: No ink is drawn around objects from this id to the shadow's (``BARE`` in ``rust/kernels/ink.rs``).
BARE = 0xFF00
_AXES = ("start", "end")
_RADII = ("start_radius", "end_radius")


@dataclass(frozen=True, eq=False)
class Character:
    """What a drawn character gives to a simulation.

    Parameters
    ----------
    name : str
        Unique in the scene.
    marker_names : tuple of N str
        Canonical names and others.
    markers : (F, N, 3) float
        World metres. NaN where unknown: held and interpolated between the frames that are known.
    limb_names : tuple of V str
        The volumes' names.
    volumes : TaperedCylinders
        Axes and radii of the limbs; NaN as in ``markers``. A limb that is NaN in all frames pushes nothing.
    limb_markers : tuple of V pairs of str, optional
        The markers at the limbs' starts and ends, for the presets; None: not known.
    """

    name: str
    marker_names: tuple[str, ...]
    markers: Floats
    limb_names: tuple[str, ...]
    volumes: TaperedCylinders
    limb_markers: tuple[tuple[str, str], ...] | None = None

    def __post_init__(self) -> None:
        for what in ("marker_names", "limb_names"):
            names = tuple(getattr(self, what))
            if len(set(names)) < len(names):
                raise ValueError(f"{what}: want every name once, got {', '.join(names)}")
            object.__setattr__(self, what, names)
        markers = arrays.floats("markers", self.markers, ("F", len(self.marker_names), 3), allow="nan")
        object.__setattr__(self, "markers", markers)
        object.__setattr__(self, "volumes", _checked(self.volumes, len(markers), len(self.limb_names)))
        if self.limb_markers is not None and len(self.limb_markers) != len(self.limb_names):
            raise ValueError(f"limb_markers: want {len(self.limb_names)} pairs, got {len(self.limb_markers)}")

    @property
    def height(self) -> float:
        """The largest vertical extent of markers and volumes in any frame, in metres; 0 where nothing is known."""
        volumes = self.volumes
        ends = ((volumes.start, volumes.start_radius), (volumes.end, volumes.end_radius))
        high = np.concatenate([self.markers[..., 1], *(axis[..., 1] + radius for axis, radius in ends)], axis=1)
        low = np.concatenate([self.markers[..., 1], *(axis[..., 1] - radius for axis, radius in ends)], axis=1)
        top = np.where(np.isnan(high), -np.inf, high).max(axis=1, initial=-np.inf)
        bottom = np.where(np.isnan(low), np.inf, low).min(axis=1, initial=np.inf)
        return max(0.0, float((top - bottom).max(initial=0.0)))


@dataclass(frozen=True)
class PreRoll:
    """How the character gets in: ``frames`` before the first, in which the first pose is held and elements settle.

    The volumes' radii grow from nothing over the first ``blend`` of these frames, so that what begins inside a volume
    is pushed out gently. In the first frame, what is pinned to a character gets the speed of its pins.
    """

    frames: int = 24
    blend: int = 8

    def __post_init__(self) -> None:
        if self.frames < 0 or not 0 <= self.blend <= self.frames:
            raise ValueError(f"blend: want 0 to {self.frames} frames, got {self.blend}")


@dataclass(frozen=True, eq=False)
class SimulationScene:
    """Everything that an engine and the passes renderer need.

    Parameters
    ----------
    frame_rate : float
        Frames a second.
    frames : int
        Number of frames.
    elements : tuple of Cloth, Strands, Balls, Boxes, Prop, Particles, SnowField or Puddle
        Their places count from 1 as object ids in the passes, those of particles from 65281.
    characters : tuple of Character
        Each with ``frames`` frames.
    cameras : tuple of PerspectiveCamera
        One a frame; may be empty when nothing is rendered.
    ground : float, optional
        Height of the ground plane in metres; None: none.
    gravity : (3,) float
        m/s^2.
    wind, pre_roll, seed
        The air, the frames before the first, and what makes every choice by chance repeatable.

    Raises
    ------
    ValueError
        For numbers of frames that differ, names that are not unique, and a pin to an unknown character, marker or
        limb, or to one that is missing in all frames.
    """

    frame_rate: float
    frames: int
    elements: tuple[Element, ...]
    characters: tuple[Character, ...] = ()
    cameras: tuple[PerspectiveCamera, ...] = ()
    ground: float | None = None
    gravity: tuple[float, float, float] = GRAVITY
    wind: Wind = field(default_factory=Wind)
    pre_roll: PreRoll = field(default_factory=PreRoll)
    seed: int = 0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.frame_rate) and self.frame_rate > 0):
            raise ValueError(f"frame_rate: want a number above zero, got {self.frame_rate!r}")
        if not isinstance(self.frames, int | np.integer) or self.frames < 1:
            raise ValueError(f"frames: want a whole number of 1 or more, got {self.frames!r}")
        if self.ground is not None and not math.isfinite(self.ground):
            raise ValueError(f"ground: want a finite height, got {self.ground!r}")
        object.__setattr__(self, "gravity", tuple(arrays.floats("gravity", self.gravity, (3,)).tolist()))
        if self.cameras and len(self.cameras) != self.frames:
            raise ValueError(f"cameras: want {self.frames}, one a frame, got {len(self.cameras)}")
        for what, values in (("elements", self.elements), ("characters", self.characters)):
            names = [value.name for value in values]
            if len(set(names)) < len(names):
                raise ValueError(f"{what}: want every name once, got {', '.join(names)}")
        for character in self.characters:
            if len(character.markers) != self.frames:
                raise ValueError(
                    f"characters: {character.name}: want {self.frames} frames, got {len(character.markers)}"
                )
        for element in self.elements:
            if isinstance(element, SnowField | Puddle) and self.ground is None:
                raise ValueError(f"ground: {element.name} wants a ground to lie on")
            for pin in pins_of(element):
                self._check_pin(element.name, pin)

    def character(self, name: str | None) -> Character:
        """Return the character of that name, the first for None; ValueError where there is none."""
        found = [value for value in self.characters if name is None or value.name == name]
        if not found:
            known = ", ".join(value.name for value in self.characters) or "none"
            raise ValueError(f"no character {name or ''}: there is {known}".replace("  ", " "))
        return found[0]

    def object_id(self, element: str) -> int:
        """Return the id of ``element`` in the object pass; no ink is drawn around particles, from ``BARE`` on."""
        index = 1 + [value.name for value in self.elements].index(element)
        return index + (BARE if isinstance(self.elements[index - 1], Particles) else 0)

    def _check_pin(self, element: str, pin: Pin) -> None:
        if pin.path is not None and len(pin.path) != self.frames:
            raise ValueError(f"pins: {element}: path: want {self.frames} frames, got {len(pin.path)}")
        if pin.kind in ("world", "path"):
            return
        try:
            character = self.character(pin.character)
        except ValueError as error:
            raise ValueError(f"pins: {element}: {error}") from None
        names = character.marker_names if pin.kind == "marker" else character.limb_names
        if pin.target not in names:
            raise ValueError(f"pins: {element}: no {pin.kind} {pin.target!r}: there are {', '.join(names) or 'none'}")
        track = character.markers if pin.kind == "marker" else character.volumes.start
        if np.isnan(track[:, names.index(pin.target)]).any(axis=1).all():
            raise ValueError(f"pins: {element}: {pin.kind} {pin.target!r} is missing in all frames")


def pins_of(element: Element) -> tuple[Pin, ...]:
    """Return what holds ``element``."""
    if isinstance(element, Cloth | Strands):
        return element.pins
    return (element.pin,) if isinstance(element, Prop) else ()


def _checked(volumes: TaperedCylinders, frames: int, limbs: int) -> TaperedCylinders:
    axes = [arrays.floats(f"volumes.{name}", getattr(volumes, name), (frames, limbs, 3), allow="nan") for name in _AXES]
    radii = [arrays.floats(f"volumes.{name}", getattr(volumes, name), (frames, limbs), allow="nan") for name in _RADII]
    if any((radius < 0).any() for radius in radii):
        raise ValueError("volumes: want radii of zero or more")
    return TaperedCylinders(*axes, *radii)
