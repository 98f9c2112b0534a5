"""What presets of strands have alike: their material, and where strands begin and are held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.simulate.elements import Pin
from pegbar.simulate.figure import limb_between, marker
from pegbar.simulate.materials import Color, StrandMaterial, check
from pegbar.simulate.scene import Character

Floats = NDArray[np.float64]
#: What the stiffness of the presets is measured in.
EARTH = 9.81
#: The joint before each marker that strands can be held at: the limb between the two holds them.
BEFORE = {"head": "neck", "neck": "pelvis", "chest": "pelvis", "pelvis": "neck"}
BEFORE |= {f"{s}_{a}": f"{s}_{b}" for s in ("left", "right") for a, b in (("hand", "elbow"), ("elbow", "shoulder"))}
BEFORE |= {f"{s}_{a}": f"{s}_{b}" for s in ("left", "right") for a, b in (("foot", "knee"), ("knee", "hip"))}


@dataclass(frozen=True)
class Yarn:
    """The fields that all presets of strands have: see ``StrandMaterial`` and ``Look``.

    ``thickness`` is the diameter in body heights. ``stiffness`` is how much of a strand's length stands out nearly
    level by itself: 0 limp, 1 all of it.
    """

    color: Color = (0.55, 0.36, 0.16, 1.0)
    second: Color = (0.80, 0.62, 0.36, 1.0)
    thickness: float = 0.004
    density: float = 800.0
    stiffness: float = 0.08
    stretch: float = 0.0
    friction: float = 0.4
    damping: float = 0.3
    drag: float = 1.0

    def material(self, length: float, radius: float) -> StrandMaterial:
        """Return the material of strands of ``length`` and ``radius`` metres.

        A level rod of weight q per metre droops by an eighth of its length where that is the cube root of E I / q.
        """
        check(self, positive=("thickness", "density"), not_negative=("stiffness", "stretch"))
        weight = self.density * np.pi * radius**2 * EARTH
        bend = float(weight * (self.stiffness * length) ** 3)
        return StrandMaterial(self.density, bend, self.stretch, self.friction, self.damping, self.drag)

    def radius(self, height: float) -> float:
        """Return the strands' radius in metres for a body ``height``."""
        return self.thickness * height / 2


def sides(hands: str) -> tuple[str, ...]:
    """Return the sides that ``hands`` ("left", "right" or "both") means."""
    if hands not in ("left", "right", "both"):
        raise ValueError(f"hands: want left, right or both, got {hands!r}")
    return ("left", "right") if hands == "both" else (hands,)


def held(character: Character, joint: str, vertices: NDArray[np.int64]) -> Pin:
    """A pin to the limb that ends at ``joint``, or to the marker where there is no such limb."""
    try:
        limb = limb_between(character, joint, BEFORE[joint])
    except (KeyError, ValueError):
        return Pin("marker", joint, vertices, character.name)
    return Pin("limb", character.limb_names[limb], vertices, character.name)


def hanging(top: Floats, length: float, links: int, floor: float, aside: Floats) -> Floats:
    """Points (links + 1, 3) straight down from ``top`` to the ``floor`` and there on to the side ``aside``."""
    way = np.linspace(0, length, links + 1)
    fall = np.minimum(way, max(top[1] - floor, 0.0))
    return np.asarray(top - fall[:, None] * np.array([0.0, 1.0, 0.0]) + (way - fall)[:, None] * aside)


def forward(character: Character) -> Floats:
    """The level direction in which the hips face in the first frame."""
    hips = marker(character, "left_hip")[0] - marker(character, "right_hip")[0]
    ahead = np.cross(hips, (0.0, 1.0, 0.0))
    size = float(np.linalg.norm(ahead))
    return np.asarray(ahead / size) if size > 1e-9 else np.array([0.0, 0.0, 1.0])


def direction(character: Character, side: str) -> Floats:
    """Return the unit vector to a ``side`` of the character in the first frame: "back", "up" and so on."""
    ahead = forward(character)
    left, up = np.cross((0.0, 1.0, 0.0), ahead), np.array([0.0, 1.0, 0.0])
    ways = {"back": -ahead, "front": ahead, "left": left, "right": -left, "up": up, "down": -up}
    if side not in ways:
        raise ValueError(f"side: want one of {', '.join(ways)}, got {side!r}")
    return np.asarray(ways[side])


def exit_way(points: Floats, way: Floats, capsules: Floats, farthest: float) -> Floats:
    """How far along ``way`` each of ``points`` (n, 3) comes out of the capsules that hold it."""
    steps = np.linspace(0, farthest, 401)
    places = (points[:, None] + steps[:, None] * way).reshape(-1, 3)
    outside = _kernels.capsule_distances(np.ascontiguousarray(places), capsules)[0].reshape(len(points), -1) > 0
    out: Floats = steps[outside.argmax(axis=1)]
    return out


def disc(count: int, rng: np.random.Generator) -> Floats:
    """Points (count, 2) evenly over a unit disc, on a sunflower's spiral that begins anywhere."""
    index = np.arange(count) + 0.5
    turn = index * np.pi * (3 - np.sqrt(5)) + rng.uniform(0, 2 * np.pi)
    return np.asarray(np.sqrt(index / count)[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1))


def sphere(count: int, rng: np.random.Generator) -> Floats:
    """Unit vectors (count, 3) evenly to all sides, each a little astray."""
    index = np.arange(count) + 0.5
    high, turn = 1 - 2 * index / count, index * np.pi * (3 - np.sqrt(5)) + rng.uniform(0, 2 * np.pi)
    wide = np.sqrt(1 - high**2)
    ways = np.stack([wide * np.cos(turn), high, wide * np.sin(turn)], axis=1)
    ways += rng.normal(0, 0.6 / np.sqrt(count), ways.shape)
    return np.asarray(ways / np.linalg.norm(ways, axis=1, keepdims=True))
