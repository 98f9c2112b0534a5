"""Presets that a character wears: scarves at the wrists, a skirt at the waist."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from pegbar.simulate.elements import Cloth, Pin
from pegbar.simulate.figure import body_height, limb_between, marker, reaches
from pegbar.simulate.materials import ClothMaterial, Color, Look, check
from pegbar.simulate.scene import Character
from pegbar.simulate.tracks import filled, limb_frames

Floats = NDArray[np.float64]
#: Metres that the start of a cloth keeps clear of volumes, beside its thickness.
CLEAR = 0.004
#: How far round the wrist a scarf is held, in radians: like a knot, else it would have to fall to both sides of an arm
#: that turns under it.
GATHERED = 1.2
#: Where the wrist is on the way from elbow to hand.
WRIST = 0.85


@dataclass(frozen=True)
class Fabric:
    """The fields that all cloth presets have: see ``ClothMaterial`` (``stiffness`` is its ``bend``) and ``Look``."""

    color: Color = (0.75, 0.04, 0.05, 1.0)
    second: Color = (1.0, 0.75, 0.25, 1.0)
    pattern: str = "bands"
    pattern_size: float = 0.12
    density: float = 0.15
    thickness: float = 0.006
    stretch: float = 0.002
    stiffness: float = 0.1
    friction: float = 0.3
    damping: float = 0.3
    drag: float = 1.0

    def material(self) -> ClothMaterial:
        """Return what the cloth is made of."""
        threads = (self.density, self.thickness, self.stretch, self.stiffness)
        return ClothMaterial(*threads, self.friction, self.damping, self.drag)

    def look(self) -> Look:
        """Return what the cloth looks like."""
        return Look(self.color, self.second, self.pattern, self.pattern_size)


@dataclass(frozen=True)
class Scarves(Fabric):
    """A scarf at each wrist: ``length`` and ``width`` in body heights, ``hands`` "left", "right" or "both".

    ``fineness`` is the number of threads across.
    """

    length: float = 0.5
    width: float = 0.075
    hands: str = "both"
    fineness: int = 6

    def build(self, name: str, character: Character, ground: float | None, seed: int) -> tuple[Cloth, ...]:
        """Make the scarves as the first frame's pose wears them."""
        check(self, positive=("length", "width", "pattern_size"))
        if self.hands not in ("left", "right", "both"):
            raise ValueError(f"hands: want left, right or both, got {self.hands!r}")
        if not 2 <= self.fineness <= 64:
            raise ValueError(f"fineness: want 2 to 64, got {self.fineness}")
        sides = ("left", "right") if self.hands == "both" else (self.hands,)
        return tuple(self._scarf(f"{name}_{side}", character, side) for side in sides)

    def _scarf(self, name: str, character: Character, side: str) -> Cloth:
        limb = limb_between(character, f"{side}_elbow", f"{side}_hand")
        height = body_height(character)
        width, length = self.width * height, self.length * height
        columns = self.fineness
        rows = max(2, 1 + round(length / (width / (columns - 1))))
        wrist, along, radius = _wrist(character, limb, side)
        round_it = radius + self.thickness + CLEAR
        turn = np.linspace(-0.5, 0.5, columns) * min(width / round_it, GATHERED)
        fall, share = np.meshgrid(np.linspace(0, length, rows), np.linspace(-0.5, 0.5, columns), indexing="ij")
        across = share * width
        rest = np.stack([fall, across, 0 * fall], axis=-1).reshape(-1, 3)
        coordinates = np.stack([across, fall], axis=-1).reshape(-1, 2)
        down = _perpendicular(np.array([0.0, -1.0, 0.0]), along)
        over = np.cross(along, down)
        ring = wrist + round_it * (np.cos(turn)[:, None] * down + np.sin(turn)[:, None] * over)
        drop = fall[:, :1, None] * np.array([0.0, -1.0, 0.0])
        pin = Pin("limb", character.limb_names[limb], np.arange(columns), character.name)
        start = (ring[None] + drop).reshape(-1, 3)
        sheet = grid_triangles(rows, columns)
        made = (self.material(), self.look())
        return Cloth(name, start, sheet, (pin,), _NONE, rest, coordinates, None, *made)


@dataclass(frozen=True)
class Skirt(Fabric):
    """A skirt at the waist, cut as a cone round trunk and legs.

    ``length`` is in body heights, ``flare`` the growth of its radius over its length, ``rise`` how far above the
    pelvis it begins, in body heights, ``fineness`` the number of threads around.
    """

    length: float = 0.26
    flare: float = 0.45
    rise: float = 0.055
    fineness: int = 72

    def build(self, name: str, character: Character, ground: float | None, seed: int) -> tuple[Cloth, ...]:
        """Make the skirt round the first frame's pose, outside all volumes that it goes round."""
        check(self, positive=("length", "pattern_size"), not_negative=("flare",))
        if not 8 <= self.fineness <= 512:
            raise ValueError(f"fineness: want 8 to 512, got {self.fineness}")
        if self.flare >= 1:
            raise ValueError(f"flare: want less than 1, got {self.flare}")
        limb = limb_between(character, "neck", "pelvis")
        height, columns = body_height(character), self.fineness
        waist, axes = _waist(character, limb, self.rise * height)
        length = self.length * height
        turn = np.linspace(0, 2 * np.pi, columns, endpoint=False)
        outward = np.cos(turn)[:, None] * axes[:, 0] + np.sin(turn)[:, None] * axes[:, 2]
        ring = self._ring(character, waist, outward)
        mean = float(ring.mean())
        rows = max(2, 1 + round(length / (2 * np.pi * (mean + self.flare * length / 2) / columns)))
        slant = np.linspace(0, length, rows)
        fall = slant * np.sqrt(1 - self.flare**2)
        radii = ring + self.flare * slant[:, None]
        down = np.stack([waist - drop * axes[:, 1] for drop in fall])
        rest = (down[:, None] + radii[..., None] * outward).reshape(-1, 3)
        start = (down[:, None] + self._outside(character, down, outward, radii)[..., None] * outward).reshape(-1, 3)
        pin = Pin("limb", character.limb_names[limb], np.arange(columns), character.name)
        middle = mean + self.flare * length / 2
        coordinates = np.stack(np.broadcast_arrays(turn * middle, slant[:, None]), -1).reshape(-1, 2)
        sheet = grid_triangles(rows, columns, closed=True)
        made = (self.material(), self.look())
        return (Cloth(name, start, sheet, (pin,), _NONE, rest, coordinates, 2 * np.pi * middle, *made),)

    def _ring(self, character: Character, waist: Floats, outward: Floats) -> Floats:
        """Radii (n,) of the waist: an even ring just outside trunk and thighs."""
        outer, _ = reaches(character, 0, np.repeat(waist[None], len(outward), axis=0), outward, _FAR)
        outer = maximum_filter1d(outer, max(3, len(outward) // 6), mode="wrap")
        smooth = np.fft.rfft(outer)
        smooth[4:] = 0
        even: Floats = np.maximum(np.fft.irfft(smooth, len(outer)), outer) + self.thickness + CLEAR
        return even

    def _outside(self, character: Character, down: Floats, outward: Floats, radii: Floats) -> Floats:
        """``radii`` (R, n) moved out of trunk and legs, and in from the arms where there is room."""
        rows, columns = radii.shape
        origins = np.repeat(down, columns, axis=0)
        outer, others = reaches(character, 0, origins, np.tile(outward, (rows, 1)), _FAR)
        reach = maximum_filter1d(outer.reshape(rows, columns), 5, axis=1, mode="wrap")
        free = minimum_filter1d(others.reshape(rows, columns), 5, axis=1, mode="wrap")
        clear = self.thickness + CLEAR
        # A leg that sticks out keeps the rows below it out as well, else the cloth would close under the foot.
        inner = np.maximum.accumulate(reach, axis=0) + clear
        placed = np.maximum(np.minimum(radii, free - clear), inner)
        placed[0] = radii[0]
        return np.asarray(placed, np.float64)


_NONE = np.empty((0, 2), np.int64)
#: Metres within which a body is looked for around its waist.
_FAR = 0.8


def grid_triangles(rows: int, columns: int, *, closed: bool = False) -> NDArray[np.int64]:
    """Return the triangles (T, 3) of a grid of vertices, row by row; ``closed`` joins the last column to the first."""
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns if closed else columns - 1), indexing="ij")
    a, b = i * columns + j, i * columns + (j + 1) % columns
    c, d = a + columns, b + columns
    # Diagonals in turn, so that the cloth is as stiff to one side as to the other.
    even = ((i + j) % 2 == 0)[..., None, None]
    split = np.where(
        even,
        np.stack([[a, d, b], [a, c, d]]).transpose(2, 3, 0, 1),
        np.stack([[a, c, b], [b, c, d]]).transpose(2, 3, 0, 1),
    )
    return np.ascontiguousarray(split.reshape(-1, 3))


def _perpendicular(vector: Floats, axis: Floats) -> Floats:
    """The unit vector across ``axis`` that is nearest to ``vector``."""
    across = vector - (vector @ axis) * axis
    if np.linalg.norm(across) < 0.2:
        across = np.cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < 0.9 else (1.0, 0.0, 0.0))
    unit: Floats = across / np.linalg.norm(across)
    return unit


def _wrist(character: Character, limb: int, side: str) -> tuple[Floats, Floats, float]:
    """The wrist's place on the forearm's axis, the direction to the hand and the radius there, in the first frame."""
    volumes, hand = character.volumes, marker(character, f"{side}_hand")[0]
    ends = [filled(axis[:, limb])[0] for axis in (volumes.start, volumes.end)]
    radii = [float(filled(radius[:, limb])[0]) for radius in (volumes.start_radius, volumes.end_radius)]
    if np.linalg.norm(ends[0] - hand) < np.linalg.norm(ends[1] - hand):
        ends, radii = ends[::-1], radii[::-1]
    axis = ends[1] - ends[0]
    length = max(float(np.linalg.norm(axis)), 1e-6)
    return ends[0] + WRIST * axis, axis / length, (1 - WRIST) * radii[0] + WRIST * radii[1]


def _waist(character: Character, limb: int, rise: float) -> tuple[Floats, Floats]:
    """The waist's middle in the first frame and the trunk's axes there as columns, the second one up."""
    _, axes, _ = limb_frames(character, character.limb_names[limb])
    pelvis = marker(character, "pelvis")[0]
    up = axes[0][:, 1] if axes[0][1, 1] > 0 else -axes[0][:, 1]
    across = _perpendicular(axes[0][:, 0], up)
    return pelvis + rise * up, np.stack([across, up, np.cross(across, up)], axis=1)
