"""Presets that stand in the world around a character: coloured balls on the floor, a clothesline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.scene.camera import PerspectiveCamera
from pegbar.simulate.elements import Balls, Cloth, Element, Pin, Prop
from pegbar.simulate.figure import body_height, capsules_of, marker
from pegbar.simulate.materials import Color, Look, RigidMaterial, check
from pegbar.simulate.scene import Character
from pegbar.simulate.wearing import Fabric, grid_triangles

Floats = NDArray[np.float64]
#: Linear RGBA: red, yellow, blue, green, violet, orange.
BALL_COLORS = (
    (0.80, 0.03, 0.03, 1.0),
    (0.95, 0.60, 0.02, 1.0),
    (0.03, 0.16, 0.70, 1.0),
    (0.05, 0.45, 0.10, 1.0),
    (0.35, 0.05, 0.55, 1.0),
    (0.90, 0.22, 0.02, 1.0),
)
#: Cosine between line and view from which on a line is seen too much from its end.
ENDWISE = 0.8
#: How far, in body heights, a hand must reach to brush a line behind the character.
REACH = 0.12
LAUNDRY = ((0.85, 0.85, 0.80, 1.0), (0.10, 0.35, 0.65, 1.0), (0.80, 0.20, 0.20, 1.0), (0.90, 0.70, 0.15, 1.0))


@dataclass(frozen=True)
class FloorBalls:
    """Coloured balls on the floor where the feet go.

    ``count`` of them, ``size`` the diameter in body heights and ``spread`` the share by which sizes differ; ``margin``
    is how far, in body heights, they lie around the feet's way. ``bounce``, ``density`` (kg per cubic metre) and
    ``friction`` are their material's.
    """

    count: int = 16
    size: float = 0.09
    spread: float = 0.3
    margin: float = 0.25
    density: float = 40.0
    friction: float = 0.5
    bounce: float = 0.5
    damping: float = 0.3
    colors: tuple[Color, ...] = BALL_COLORS

    def build(self, name: str, character: Character, ground: float | None, seed: int) -> tuple[Balls, ...]:
        """Scatter the balls, free of each other and of the first frame's pose."""
        check(self, positive=("size",), not_negative=("spread", "margin"))
        if ground is None:
            raise ValueError("balls: want a ground for them to lie on")
        if not 1 <= self.count <= 2000:
            raise ValueError(f"count: want 1 to 2000, got {self.count}")
        if self.spread >= 1:
            raise ValueError(f"spread: want less than 1, got {self.spread}")
        height, rng = body_height(character), np.random.default_rng(seed)
        feet = np.concatenate([marker(character, f"{side}_foot") for side in ("left", "right")])[:, [0, 2]]
        radii = self.size * height / 2 * rng.uniform(1 - self.spread, 1 + self.spread, self.count)
        capsules = capsules_of(character, 0)
        placed: list[Floats] = []
        for radius in radii:
            placed.append(self._place(rng, feet, float(radius), height, ground, placed, radii, capsules))
        colors = np.array(self.colors, np.float32)[np.arange(self.count) % len(self.colors)]
        material = RigidMaterial(self.density, self.friction, self.bounce, self.damping)
        look = Look(self.colors[0])
        return (Balls(name, np.array(placed), radii, colors=colors, material=material, look=look),)

    def _place(
        self,
        rng: np.random.Generator,
        feet: Floats,
        radius: float,
        height: float,
        ground: float,
        placed: list[Floats],
        radii: Floats,
        capsules: Floats,
    ) -> Floats:
        """A place on the ground near the feet's way; ever farther out, and in the end on top of the others."""
        center: Floats = np.zeros(3)
        for attempt in range(200):
            reach = self.margin * height * (1 + attempt / 20) + radius
            on_way = feet[rng.integers(len(feet))] + rng.uniform(-reach, reach, 2)
            center = np.array([on_way[0], ground + radius, on_way[1]])
            others = np.array(placed).reshape(-1, 3)
            gaps = np.linalg.norm(others - center, axis=1) - radii[: len(others)] - radius
            body = float(_kernels.capsule_distances(center[None], capsules)[0][0]) - radius
            if body > 0 and (gaps > 0).all():
                return center
        center[1] += 2 * radius * (1 + len(placed))
        return center


@dataclass(frozen=True)
class Clothesline(Fabric):
    """A line with washing on it, which the character walks by and brushes with a hand.

    ``count`` pieces of ``size`` (width, drop) in body heights hang at ``height``. The line is parallel to the way that
    the character goes; for one on the spot, and one that comes towards the camera, it hangs across the picture.
    ``side`` is "left" or "right" of the way, or of one that goes to the right in the picture: so "left" is behind the
    character there. None: behind it where a hand reaches there, else before it. ``distance`` is in body heights; None:
    where a hand on that side reaches.
    """

    pattern: str = "plain"
    density: float = 0.2
    stiffness: float = 0.2
    count: int = 4
    size: tuple[float, float] = (0.3, 0.4)
    gap: float = 0.05
    height: float = 0.85
    side: str | None = None
    distance: float | None = None
    fineness: int = 16
    colors: tuple[Color, ...] = LAUNDRY

    def build(
        self,
        name: str,
        character: Character,
        ground: float | None,
        seed: int,
        cameras: Sequence[PerspectiveCamera] = (),
    ) -> tuple[Element, ...]:
        """Hang the pieces and the line so that the first of ``cameras`` sees them."""
        check(self, positive=("height",), not_negative=("gap",))
        if self.side not in ("left", "right", None):
            raise ValueError(f"side: want left or right, got {self.side!r}")
        if not 1 <= self.count <= 50 or not 2 <= self.fineness <= 128:
            raise ValueError(f"count: want 1 to 50 pieces of 2 to 128 threads, got {self.count} of {self.fineness}")
        tall = body_height(character)
        center, along, out = self._way(character, tall, cameras)
        floor = float(center[1]) if ground is None else ground
        away = self._distance(character, center, out) if self.distance is None else self.distance * tall
        middle = np.array([center[0], floor + self.height * tall, center[2]]) + away * out
        wide, drop, gap = self.size[0] * tall, self.size[1] * tall, self.gap * tall
        step = wide + gap
        pieces = []
        for index in range(self.count):
            corner = middle + ((index - self.count / 2) * step + gap / 2) * along
            pieces.append(self._piece(f"{name}_{index + 1}", corner, along, wide, drop, index))
        reach = (self.count / 2 * step + gap) * along
        return (_line(name, middle - reach, middle + reach, 0.004 * tall), *pieces)

    def _way(
        self, character: Character, tall: float, cameras: Sequence[PerspectiveCamera]
    ) -> tuple[Floats, Floats, Floats]:
        """The middle of the way, the level direction of the line, and the level direction from the one to the other."""
        pelvis = marker(character, "pelvis")
        center = (pelvis.min(axis=0) + pelvis.max(axis=0)) / 2
        walked = pelvis[-1] - pelvis[0]
        goes = np.hypot(walked[0], walked[2]) >= 0.5
        along = _level(walked) if goes else _level(marker(character, "left_hip")[0] - marker(character, "right_hip")[0])
        if cameras:
            # The third row of a camera's matrix looks into the picture.
            seen_from = _level(-cameras[0].matrix[2, :3])
            if not goes or abs(along @ seen_from) > ENDWISE:
                along = np.cross((0.0, 1.0, 0.0), seen_from)
        left = np.cross((0.0, 1.0, 0.0), along)
        if self.side is not None:
            return center, along, left if self.side == "left" else -left
        # Behind the character in the picture, so that it is not hidden.
        behind = -left if cameras and left @ cameras[0].matrix[2, :3] < 0 else left
        return center, along, behind if self._distance(character, center, behind) >= REACH * tall else -behind

    def _distance(self, character: Character, center: Floats, out: Floats) -> float:
        """How far a hand reaches out to the line's side, less a little, so that it brushes the washing."""
        ways = [(marker(character, f"{side}_hand") - center) @ out for side in ("left", "right")]
        return float(0.9 * np.max(ways))

    def _piece(self, name: str, corner: Floats, along: Floats, wide: float, drop: float, index: int) -> Cloth:
        columns, rows = self.fineness, max(2, round(self.fineness * drop / wide))
        fall, across = np.meshgrid(np.linspace(0, drop, rows), np.linspace(0, wide, columns), indexing="ij")
        vertices = corner + across[..., None] * along - fall[..., None] * np.array([0.0, 1.0, 0.0])
        look = Look(self.colors[index % len(self.colors)], self.second, self.pattern, self.pattern_size)
        pin = Pin("world", vertices=np.arange(columns))
        coordinates = np.stack([across, fall], axis=-1).reshape(-1, 2)
        sheet, none = grid_triangles(rows, columns), np.empty((0, 2), np.int64)
        return Cloth(name, vertices.reshape(-1, 3), sheet, (pin,), none, None, coordinates, None, self.material(), look)


def _level(vector: Floats) -> Floats:
    """The unit vector of what is level in ``vector`` (3,); along X where nothing is."""
    flat = np.array([vector[0], 0.0, vector[2]])
    size = float(np.linalg.norm(flat))
    return np.asarray(flat / size) if size > 1e-9 else np.array([1.0, 0.0, 0.0])


def _line(name: str, start: Floats, end: Floats, radius: float) -> Prop:
    """The line itself: a thin tube from ``start`` to ``end``."""
    along = (end - start) / np.linalg.norm(end - start)
    across = np.cross(along, (0.0, 1.0, 0.0))
    turn = np.linspace(0, 2 * np.pi, 6, endpoint=False)
    ring = radius * (np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(across, along))
    # Triangles of a grid that is closed along the ring.
    triangles = grid_triangles(2, len(turn), closed=True)
    return Prop(
        name, np.concatenate([start + ring, end + ring]), triangles, Pin("world"), look=Look((0.3, 0.3, 0.3, 1.0))
    )
