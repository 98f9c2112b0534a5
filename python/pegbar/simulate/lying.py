"""Presets of what lies on the ground where a character goes: snow and a puddle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from pegbar.scene.camera import PerspectiveCamera
from pegbar.simulate.elements import Element
from pegbar.simulate.falling import Snow
from pegbar.simulate.field_meshes import LIGHT
from pegbar.simulate.fields import Puddle, SnowField
from pegbar.simulate.figure import body_height, marker
from pegbar.simulate.floor import ankle_height, seen_ground, soles
from pegbar.simulate.materials import Color, Look, check
from pegbar.simulate.scene import Character
from pegbar.simulate.weather import ParticleMaterial, Particles

Floats = NDArray[np.float64]
#: Nodes of a field at most: it gets coarser beyond.
NODES = 90_000
#: Snow is so deep, as a share of the height of ankles, and within these bounds in body heights: shoes are seen in it.
DEEP, SHALLOWEST, DEEPEST = 0.6, 0.012, 0.05
#: Around the feet's way snow can be pressed, and beyond it a figure's shadow falls finely, in body heights.
PRESSED, SHADOW = 0.35, 1.3
#: Snow ends so far from the camera, in body heights: nearly at the horizon. Without cameras it goes so far around.
HORIZON, UNSEEN = 120.0, 3.0


@dataclass(frozen=True)
class LyingSnow:
    """Snow on the ground, which feet press down and push up around them.

    ``depth`` of the snow in body heights, by default a little more than half of what the ankles are over the ground.
    By default it covers all the ground that the cameras see; with ``margin`` it is a patch that reaches so far around
    the feet's way, in body heights. ``roughness`` is the share of the depth by which it differs from place to place.
    ``softness`` is the share that gives way under a foot for good, the rest rises beside it; ``repose`` the steepest
    slope that stands, in degrees. ``spacing`` is in metres.
    """

    depth: float | None = None
    margin: float | None = None
    roughness: float = 0.2
    softness: float = 0.6
    repose: float = 50.0
    spacing: float = 0.015
    color: Color = (0.80, 0.87, 0.97, 1.0)
    second: Color = (0.32, 0.46, 0.72, 1.0)

    def build(
        self,
        name: str,
        character: Character,
        ground: float | None,
        seed: int,
        cameras: Sequence[PerspectiveCamera] = (),
    ) -> tuple[Element, ...]:
        """Lay the snow: finely where the feet go, flat beyond, or a patch that thins out towards its border."""
        given = tuple(field for field in ("depth", "margin") if getattr(self, field) is not None)
        check(self, positive=(*given, "spacing"), not_negative=("roughness", "softness"))
        if self.roughness >= 1 or self.softness > 1:
            raise ValueError(f"roughness: want less than 1, and softness 0 to 1, got {self.roughness}, {self.softness}")
        if ground is None:
            raise ValueError("snow field: want a ground for it to lie on")
        tall = body_height(character)
        depth = lying_depth(character, ground) if self.depth is None else self.depth * tall
        reach = PRESSED * tall if self.margin is None else self.margin * tall
        origin, spacing, x, z = _grid(character, reach, self.spacing, SHADOW * tall if self.margin is None else 0.0)
        share = _round(x, z)
        noise = np.random.default_rng(seed).standard_normal(share.shape)
        noise = np.sum([gaussian_filter(noise, size / spacing) * size for size in (0.05, 0.15, 0.4)], axis=0)
        noise *= self.roughness / max(float(np.abs(noise).max()), 1e-12)
        edge = np.clip(share / 0.35, 0, 1)
        edge *= edge * (3 - 2 * edge)
        # A patch thins out; what goes on beyond is as deep as the field's border and as flat.
        heights = depth * (1 + edge * noise if self.margin is None else edge * (1 + noise))
        made = (origin, spacing, np.maximum(heights, 0), self.softness, self.repose)
        beyond = _beyond(origin, (x[-1], z[-1]), cameras, ground, tall) if self.margin is None else None
        shoes = soles(character, ground, tall)
        return (SnowField(name, *made, beyond, shoes if shoes.size else None, Look(self.color, self.second)),)


@dataclass(frozen=True)
class FootPuddle:
    """A puddle where the feet go, which they splash.

    ``size`` is how far it reaches around the feet's way and ``depth`` how deep it is, in body heights; ``splash`` is
    the number of drops for a litre of water that a foot pushes away at once, ``damping`` (1/s) how fast waves die.
    ``spacing`` is in metres.
    """

    size: float = 0.35
    depth: float = 0.02
    splash: float = 60.0
    damping: float = 0.8
    spacing: float = 0.015
    color: Color = (0.16, 0.30, 0.45, 0.7)
    second: Color = (0.75, 0.88, 0.96, 0.9)

    def build(self, name: str, character: Character, ground: float | None, seed: int) -> tuple[Element, ...]:
        """Pour the puddle, with the drops that it throws up."""
        check(self, positive=("size", "depth", "spacing"), not_negative=("splash", "damping"))
        if ground is None:
            raise ValueError("puddle: want a ground for it to lie on")
        tall = body_height(character)
        origin, spacing, x, z = _grid(character, self.size * tall, self.spacing)
        rng = np.random.default_rng(seed)
        waves = gaussian_filter(rng.standard_normal((len(z), len(x))), 0.12 / spacing)
        waves /= max(float(np.abs(waves).max()), 1e-12)
        water = _round(x, z) + 0.12 * waves > 0.12
        pool = Puddle(
            name,
            origin,
            spacing,
            water,
            self.depth * tall,
            self.damping,
            f"{name}_drops",
            self.splash,
            Look(self.color, self.second),
        )
        material = ParticleMaterial(
            radius=0.004 * tall, terminal_velocity=9.0, run_off=1.0, lifetime=3.0, settle=1.0, splash_life=1.0
        )
        low = np.array([x[0] - 1, ground - 0.5, z[0] - 1])
        high = np.array([x[-1] + 1, ground + 3, z[-1] + 1])
        color = (*self.color[:3], 0.9)
        return (pool, Particles(f"{name}_drops", low, high, 0, material, Look(color), "flake"))


@dataclass(frozen=True)
class Snowfall(Snow):
    """Snow that falls, lies on head and shoulders for a while, and on the ground, where feet press it down.

    The settings of falling snow, and ``depth`` (body heights) of the snow on the ground: by default a little more than
    half of what the ankles are over it; 0: none lies there.
    """

    depth: float | None = None

    def build(
        self,
        name: str,
        character: Character,
        ground: float | None,
        seed: int,
        cameras: Sequence[PerspectiveCamera] = (),
    ) -> tuple[Element, ...]:
        """Fill the air, and lay snow on the ground."""
        check(self, not_negative=("depth",) if self.depth is not None else ())
        flakes = super().build(name, character, ground, seed, cameras)
        if self.depth == 0 or ground is None:
            return flakes
        return (*LyingSnow(depth=self.depth).build(f"{name}_field", character, ground, seed, cameras), *flakes)


def lying_depth(character: Character, ground: float) -> float:
    """Return how deep snow lies by default, in metres: a share of the height of the ankles of feet that stand."""
    tall = body_height(character)
    return float(np.clip(DEEP * ankle_height(character, ground), SHALLOWEST * tall, DEEPEST * tall))


def _beyond(
    low: Floats, high: tuple[float, float], cameras: Sequence[PerspectiveCamera], ground: float, tall: float
) -> Floats:
    """Two corners (x, z, x, z) of the rectangle of snow that lies around the grid from ``low`` to ``high``."""
    corners = [np.subtract(low, UNSEEN * tall), np.add(high, UNSEEN * tall)]
    if cameras:
        seen = seen_ground(cameras, ground, HORIZON * tall)
        corners = [np.minimum(low, seen[0]), np.maximum(high, seen[1])]
    return np.concatenate(corners)


def _grid(
    character: Character, reach: float, spacing: float, shaded: float = 0.0
) -> tuple[Floats, float, Floats, Floats]:
    """First node, metres between nodes, and the nodes' x and z, of a grid that goes ``reach`` beyond the feet's way.

    It goes ``shaded`` metres farther where shadows fall.
    """
    feet = np.concatenate([marker(character, f"{side}_foot") for side in ("left", "right")])[:, [0, 2]]
    low, high = feet.min(axis=0) - reach, feet.max(axis=0) + reach
    low = low - shaded * np.array(LIGHT)[[0, 2]]
    spacing = max(spacing, float(np.sqrt(np.prod(high - low) / NODES)))
    x, z = (np.arange(low[axis], high[axis] + spacing, spacing) for axis in (0, 1))
    return low, spacing, x, z


def _round(x: Floats, z: Floats) -> Floats:
    """How far inside an oval that fills a grid its nodes (rows, columns) are: 1 in the middle, 0 and less outside."""
    across, along = np.meshgrid(np.linspace(-1, 1, len(x)), np.linspace(-1, 1, len(z)))
    share: Floats = 1 - (across**4 + along**4) ** 0.25
    return share
