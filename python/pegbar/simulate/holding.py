"""Presets of strands: a rope, balloons on strings, pom-poms in the hands, and a tuft of hair."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.simulate.elements import Bobs, Strands
from pegbar.simulate.figure import body_height, capsules_of, marker
from pegbar.simulate.materials import Color, Look, check
from pegbar.simulate.scene import Character
from pegbar.simulate.yarn import Yarn, direction, disc, exit_way, forward, hanging, held, sides, sphere

Floats = NDArray[np.float64]
#: From a balloon's middle to its knot, in radii.
KNOT = 1.14
#: How far the strands of a tuft part, and how far it sinks where it grows sideways, as shares of its direction.
SPLAY, SINKING = 0.25, 0.6
UP = np.array([0.0, 1.0, 0.0])
#: Linear RGBA: red, yellow, blue, green, violet, orange.
BALLOONS = (
    (0.75, 0.03, 0.04, 1.0),
    (0.95, 0.60, 0.02, 1.0),
    (0.03, 0.20, 0.75, 1.0),
    (0.05, 0.45, 0.10, 1.0),
    (0.40, 0.06, 0.55, 1.0),
    (0.90, 0.25, 0.02, 1.0),
)


@dataclass(frozen=True)
class Rope(Yarn):
    """A rope between the hands, or hanging from one.

    ``hands`` is "left", "right" or "both"; ``length`` in body heights, None: a quarter more than the hands are ever
    apart, from one hand 0.6. ``fineness`` is the number of links.
    """

    thickness: float = 0.012
    pattern: str = "stripes"
    pattern_size: float = 0.05
    hands: str = "both"
    length: float | None = None
    fineness: int = 40

    def build(self, name: str, character: Character, ground: float | None, seed: int) -> tuple[Strands, ...]:
        """Hang the rope as the first frame's pose holds it."""
        check(self, positive=("pattern_size",) if self.length is None else ("pattern_size", "length"))
        if not 4 <= self.fineness <= 400:
            raise ValueError(f"fineness: want 4 to 400, got {self.fineness}")
        height = body_height(character)
        tracks = [marker(character, f"{side}_hand") for side in sides(self.hands)]
        radius = self.radius(height)
        if len(tracks) == 2:
            points = self._between(tracks, height)
        else:
            length = (0.6 if self.length is None else self.length) * height
            floor = -np.inf if ground is None else ground + radius
            points = hanging(tracks[0][0], length, self.fineness, floor, -forward(character))
        ends = (0, self.fineness)[: len(tracks)]
        pins = tuple(
            held(character, f"{side}_hand", np.array([end])) for side, end in zip(sides(self.hands), ends, strict=True)
        )
        look = Look(self.color, self.second, self.pattern, self.pattern_size * height)
        length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
        made = (self.material(length, radius), look)
        return (Strands(name, points, np.array([len(points)]), np.array([radius]), pins, None, None, None, *made),)

    def _between(self, tracks: list[Floats], height: float) -> Floats:
        """Points of a rope that sags between the hands."""
        most = float(np.linalg.norm(tracks[0] - tracks[1], axis=1).max())
        length = max(1.25 * most, 0.3 * height) if self.length is None else self.length * height
        if length < most:
            raise ValueError(f"length: the hands are up to {most / height:.2f} body heights apart, got {self.length}")
        first, last = tracks[0][0], tracks[1][0]
        share = np.linspace(0, 1, 40 * self.fineness + 1)[:, None]
        low, high = 0.0, length
        for _ in range(50):
            sag = (low + high) / 2
            line = first + share * (last - first) - 4 * sag * share * (1 - share) * np.array([0.0, 1.0, 0.0])
            way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
            low, high = (sag, high) if way[-1] < length else (low, sag)
        even = np.linspace(0, way[-1], self.fineness + 1)
        return np.stack([np.interp(even, way, line[:, axis]) for axis in range(3)], axis=1)


@dataclass(frozen=True)
class Balloon(Yarn):
    """A balloon on a string in the hand, or a bunch of them.

    ``hand`` is "left" or "right"; ``size`` the diameter and ``length`` the string's length in body heights; ``count``
    balloons of the ``colors`` in turn. ``balloon_density`` in kg per cubic metre: with helium about 0.5, air has 1.2.
    """

    color: Color = (0.12, 0.10, 0.10, 1.0)
    thickness: float = 0.002
    density: float = 400.0
    stiffness: float = 0.02
    hand: str = "left"
    size: float = 0.19
    length: float = 0.5
    count: int = 1
    balloon_density: float = 0.5
    colors: tuple[Color, ...] = BALLOONS
    fineness: int = 24

    def build(self, name: str, character: Character, ground: float | None, seed: int) -> tuple[Strands, ...]:
        """Let the balloons stand over the hand of the first frame's pose."""
        check(self, positive=("size", "length", "balloon_density"))
        if self.hand not in ("left", "right"):
            raise ValueError(f"hand: want left or right, got {self.hand!r}")
        if not 1 <= self.count <= 50 or not 4 <= self.fineness <= 200:
            raise ValueError(f"count: want 1 to 50 on strings of 4 to 200 links, got {self.count} of {self.fineness}")
        if not self.colors:
            raise ValueError("colors: want one or more")
        height, joint, rng = body_height(character), f"{self.hand}_hand", np.random.default_rng(seed)
        grip, radius, string = marker(character, joint)[0], self.size * height / 2, self.length * height
        ways, lengths = self._bunch(rng, string, radius)
        share = np.linspace(0, 1, self.fineness + 1)
        ends = (share * lengths[:, None], lengths[:, None] + KNOT * radius)
        points = grip + np.concatenate(ends, axis=1)[..., None] * ways[:, None]
        counts, radii = np.full(self.count, self.fineness + 2), np.full(self.count, self.radius(height))
        pin = held(character, joint, np.arange(self.count) * (self.fineness + 2))
        colors = np.array(self.colors, np.float32)[np.arange(self.count) % len(self.colors)]
        bobs = Bobs(np.full(self.count, radius), self.balloon_density, colors)
        made = (self.material(string, float(radii[0])), Look(self.color))
        return (Strands(name, points.reshape(-1, 3), counts, radii, (pin,), None, bobs, None, *made),)

    def _bunch(self, rng: np.random.Generator, string: float, radius: float) -> tuple[Floats, Floats]:
        """Unit vectors (count, 3) up to the balloons and their strings' lengths, so that none touches another.

        The first stands upright; the others lean as little as chance finds room for, on strings some of which are
        shorter, and in the end longer.
        """
        ways, lengths = [np.array([0.0, 1.0, 0.0])], [string]
        while len(ways) < self.count:
            for attempt in range(4000):
                lean, turn = rng.uniform(0, min(1.2, 0.2 + attempt / 400)), rng.uniform(0, 2 * np.pi)
                way = np.array([np.sin(lean) * np.cos(turn), np.cos(lean), np.sin(lean) * np.sin(turn)])
                length = string * rng.uniform(0.6, 1.0 + max(0, attempt - 400) / 400)
                centers = [(there + KNOT * radius) * other for other, there in zip(ways, lengths, strict=True)]
                gaps = np.linalg.norm(np.array(centers) - (length + KNOT * radius) * way, axis=1)
                if gaps.min() > 2.1 * radius:
                    break
            ways.append(way)
            lengths.append(length)
        return np.array(ways), np.array(lengths)


@dataclass(frozen=True)
class PomPoms(Yarn):
    """A pom-pom in each hand: strands out from the grip to all sides, which shake and flatten where they touch.

    ``hands`` is "left", "right" or "both"; ``size`` the diameter in body heights, ``count`` the strands of each,
    ``spread`` the share by which their lengths differ, ``fineness`` the links of a strand. Strands have ``color`` and
    ``second`` in turn.
    """

    color: Color = (0.80, 0.05, 0.08, 1.0)
    second: Color = (0.95, 0.70, 0.10, 1.0)
    thickness: float = 0.006
    density: float = 20.0
    stiffness: float = 0.75
    damping: float = 1.0
    hands: str = "both"
    size: float = 0.24
    count: int = 250
    spread: float = 0.2
    fineness: int = 6

    def build(self, name: str, character: Character, ground: float | None, seed: int) -> tuple[Strands, ...]:
        """Make the pom-poms around the hands of the first frame's pose."""
        check(self, positive=("size",), not_negative=("spread",))
        if self.spread >= 1:
            raise ValueError(f"spread: want less than 1, got {self.spread}")
        if not 8 <= self.count <= 5000 or not 3 <= self.fineness <= 64:
            raise ValueError(f"count: want 8 to 5000 strands of 3 to 64 links, got {self.count} of {self.fineness}")
        rng = np.random.default_rng(seed)
        return tuple(self._pom_pom(f"{name}_{side}", character, f"{side}_hand", rng) for side in sides(self.hands))

    def _pom_pom(self, name: str, character: Character, joint: str, rng: np.random.Generator) -> Strands:
        height, grip = body_height(character), marker(character, joint)[0]
        length, radius, links = self.size * height / 2, self.radius(height), self.fineness
        ways = sphere(self.count, rng)
        lengths = length * (1 - self.spread * rng.uniform(0, 1, self.count))
        out = np.linspace(0, 1, links + 1) * lengths[:, None]
        points = (grip + out[..., None] * ways[:, None]).reshape(-1, 3)
        first = np.arange(self.count) * (links + 1)
        pin = held(character, joint, np.concatenate([first, first + 1]))
        colors = np.array([self.color, self.second], np.float32)[np.arange(self.count) % 2]
        counts, radii = np.full(self.count, links + 1), np.full(self.count, radius)
        made = (self.material(length, radius), Look(self.color, self.second))
        return Strands(name, points, counts, radii, (pin,), None, None, colors, *made)


@dataclass(frozen=True)
class Tuft(Yarn):
    """A tuft of hair or a tassel at a joint: by default a pony tail at the back of the head.

    ``at`` is a marker ("head", "left_hand", ...), ``side`` where it grows: "back", "front", "left", "right", "up" or
    "down"; ``length`` and ``width`` (of its root) in body heights; ``count`` strands of ``color`` and ``second`` in
    turn, whose lengths differ by the share ``spread``; ``fineness`` the links of a strand.
    """

    color: Color = (0.10, 0.035, 0.015, 1.0)
    second: Color = (0.16, 0.06, 0.025, 1.0)
    thickness: float = 0.004
    density: float = 100.0
    stiffness: float = 0.12
    damping: float = 1.0
    at: str = "head"
    side: str = "back"
    length: float = 0.22
    width: float = 0.035
    count: int = 120
    spread: float = 0.3
    fineness: int = 12

    def build(self, name: str, character: Character, ground: float | None, seed: int) -> tuple[Strands, ...]:
        """Let the strands grow out of the joint's limb in the first frame's pose."""
        check(self, positive=("length", "width"), not_negative=("spread",))
        if self.spread >= 1:
            raise ValueError(f"spread: want less than 1, got {self.spread}")
        if not 1 <= self.count <= 5000 or not 3 <= self.fineness <= 200:
            raise ValueError(f"count: want 1 to 5000 strands of 3 to 200 links, got {self.count} of {self.fineness}")
        height, rng, joint = body_height(character), np.random.default_rng(seed), marker(character, self.at)[0]
        way = direction(character, self.side)
        radius, length, links = self.radius(height), self.length * height, self.fineness
        across = np.cross(way, (0.0, 1.0, 0.0) if abs(way[1]) < 0.9 else (1.0, 0.0, 0.0))
        across /= np.linalg.norm(across)
        places = disc(self.count, rng)
        beside = places[:, :1] * across + places[:, 1:] * np.cross(way, across)
        roots = joint + self.width * height / 2 * beside
        roots += (exit_way(roots, way, capsules_of(character, 0), height) + radius)[:, None] * way
        ways = way + SPLAY * beside - (SINKING * UP if abs(way[1]) < 0.9 else 0.0)
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        lengths = length * (1 - self.spread * rng.uniform(0, 1, self.count))
        out = np.linspace(0, 1, links + 1) * lengths[:, None]
        points = (roots[:, None] + out[..., None] * ways[:, None]).reshape(-1, 3)
        first = np.arange(self.count) * (links + 1)
        pin = held(character, self.at, np.concatenate([first, first + 1]))
        colors = np.array([self.color, self.second], np.float32)[np.arange(self.count) % 2]
        counts, radii = np.full(self.count, links + 1), np.full(self.count, radius)
        made = (self.material(length, radius), Look(self.color, self.second))
        return (Strands(name, points, counts, radii, (pin,), None, None, colors, *made),)
