"""Presets that a character holds: an umbrella."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, maximum_filter1d, uniform_filter1d

from pegbar.simulate.elements import Pin, Prop
from pegbar.simulate.figure import body_height, limb_between, marker
from pegbar.simulate.materials import Color, Look, check
from pegbar.simulate.scene import Character
from pegbar.simulate.tracks import filled
from pegbar.simulate.wearing import grid_triangles

Floats = NDArray[np.float64]
#: Gores of the canopy, and points across and along each.
GORES, ACROSS, ALONG = 8, 5, 8
#: How deep the canopy is, how far its edge is cut in between the ribs, as shares of its radius.
DEPTH, SCALLOP = 0.42, 0.06
#: The shaft's radius, the handle under the lowest grip and the tip over the canopy, in body heights.
SHAFT, HANDLE, TIP = 0.006, 0.06, 0.03
#: Between the head and the shaft beside it, and the least between a raised hand and the canopy, in body heights.
BESIDE, ROOM = 0.03, 0.15
#: Frames over which the canopy lags behind the head: half of those that are looked at, as air and arm hold it.
LAG = 6
WOOD: Color = (0.16, 0.08, 0.04, 1.0)


@dataclass(frozen=True)
class Umbrella:
    """An umbrella in a hand that keeps the rain off.

    ``size`` is the canopy's diameter and ``clearance`` how far its edge is above the head, in body heights; ``hand`` is
    "left", "right" or "auto", the one that is steadier beside the head. It is held as people do: the canopy stays over
    the head while the hand swings, the shaft goes through the hand and past the head and leans by ``tilt`` degrees at
    most; the hand slides along the shaft where it goes up and down.
    """

    size: float = 0.7
    clearance: float = 0.02
    hand: str = "auto"
    tilt: float = 20.0
    color: Color = (0.75, 0.04, 0.05, 1.0)
    second: Color = (0.95, 0.85, 0.65, 1.0)

    def build(self, name: str, character: Character, ground: float | None, seed: int) -> tuple[Prop, ...]:
        """Put the umbrella into the hand, and lead it through all frames."""
        check(self, positive=("size",), not_negative=("clearance", "tilt"))
        if self.hand not in ("left", "right", "auto"):
            raise ValueError(f"hand: want left, right or auto, got {self.hand!r}")
        if self.tilt > 60:
            raise ValueError(f"tilt: want 0 to 60 degrees, got {self.tilt}")
        tall, radius = body_height(character), self.size * body_height(character) / 2
        hand, edge = self._held(character, tall)
        axes, ways = _axes(edge - hand), np.linalg.norm(edge - hand, axis=1)
        top, low = radius * DEPTH + TIP * tall, -float(ways.max()) - HANDLE * tall
        canopy = self._canopy(radius)
        shaft = _tube(low, top, SHAFT * tall)
        vertices = np.concatenate([canopy[0], shaft[0]]) @ axes[0].T + edge[0]
        triangles = np.concatenate([canopy[1], shaft[1] + len(canopy[0])])
        colors = np.concatenate([canopy[2], np.tile(np.array(WOOD, np.float32), (len(shaft[0]), 1))])
        turns = axes @ axes[0].T
        path = np.concatenate([turns, (edge - turns @ edge[0])[..., None]], axis=2)
        ends = [edge[0] + height * axes[0][:, 1] for height in (low, top)]
        rod = np.array([[*ends[0], SHAFT * tall, *ends[1], SHAFT * tall]])
        return (Prop(name, vertices, triangles, Pin("path", path=path), rod, Look(self.color), colors),)

    def _held(self, character: Character, tall: float) -> tuple[Floats, Floats]:
        """The hand (F, 3), and the middle of the canopy's edge (F, 3), over the head as far as ``tilt`` lets it."""
        center = marker(character, "head")
        thick = _thickness(character)
        hand = marker(character, self._side(character, center))
        steepest, radius = math.tan(math.radians(self.tilt)), self.size * tall / 2
        # Where it leans the edge hangs lower on one side.
        above = center[:, 1] + thick + self.clearance * tall + radius * math.sin(math.radians(self.tilt)) / 2
        height = _over(np.maximum(above, hand[:, 1] + ROOM * tall))
        # The shaft goes past the head on the hand's side.
        beside = gaussian_filter1d((hand - center)[:, [0, 2]], LAG, axis=0, mode="nearest")
        beside /= np.maximum(np.linalg.norm(beside, axis=1, keepdims=True), 1e-9)
        passing = center[:, [0, 2]] + (thick + (BESIDE + SHAFT) * tall)[:, None] * beside
        rise = np.maximum(center[:, 1] - hand[:, 1], ROOM * tall)[:, None]
        lean = _within((passing - hand[:, [0, 2]]) / rise, steepest)
        reach = (height - hand[:, 1])[:, None]
        middle = gaussian_filter1d(hand[:, [0, 2]] + lean * reach, LAG / 2, axis=0, mode="nearest")
        lean = _within((middle - hand[:, [0, 2]]) / reach, steepest)
        middle = hand[:, [0, 2]] + lean * reach
        return hand, np.stack([middle[:, 0], height, middle[:, 1]], axis=1)

    def _side(self, character: Character, head: Floats) -> str:
        """The marker of the hand."""
        if self.hand != "auto":
            return f"{self.hand}_hand"
        sway = [np.ptp(head - marker(character, f"{side}_hand"), axis=0).sum() for side in ("right", "left")]
        return "right_hand" if sway[0] <= sway[1] else "left_hand"

    def _canopy(self, radius: float) -> tuple[Floats, NDArray[np.int64], NDArray[np.float32]]:
        """Vertices, triangles and colours of the upright canopy: gores of a cap of a sphere whose edge is at 0."""
        sphere = (1 + DEPTH**2) / (2 * DEPTH)
        share, out = np.meshgrid(np.linspace(0, 1, ACROSS), np.linspace(0, 1, ALONG), indexing="ij")
        reach = out * (1 - SCALLOP * np.sin(np.pi * share) * out**4)
        height = np.sqrt(np.maximum(sphere**2 - reach**2, 0)) - (sphere - DEPTH)
        vertices, colors = [], []
        for gore in range(GORES):
            turn = (gore + share) * (2 * np.pi / GORES)
            places = np.stack([reach * np.cos(turn), height, reach * np.sin(turn)], axis=-1).reshape(-1, 3)
            vertices.append(radius * places)
            colors.append(np.tile(np.array(self.second if gore % 2 else self.color, np.float32), (len(places), 1)))
        sheet = grid_triangles(ACROSS, ALONG)
        triangles = np.concatenate([sheet + gore * ACROSS * ALONG for gore in range(GORES)])
        return np.concatenate(vertices), triangles, np.concatenate(colors)


def _thickness(character: Character) -> Floats:
    """The head's largest radius (F,)."""
    limb = limb_between(character, "neck", "head")
    volumes = character.volumes
    widest = filled(np.maximum(volumes.start_radius[:, limb], volumes.end_radius[:, limb]))
    return np.nan_to_num(widest)


def _over(heights: Floats) -> Floats:
    """A smooth track (F,) that is nowhere under ``heights``."""
    highest = maximum_filter1d(heights, 2 * LAG + 1, mode="nearest")
    smooth: Floats = uniform_filter1d(highest, 2 * LAG + 1, mode="nearest")
    return np.maximum(smooth, heights)


def _within(leans: Floats, most: float) -> Floats:
    """Vectors (F, 2), none longer than ``most``."""
    lengths = np.linalg.norm(leans, axis=1, keepdims=True)
    kept: Floats = leans * np.minimum(1.0, most / np.maximum(lengths, 1e-9))
    return kept


def _axes(ways: Floats) -> Floats:
    """Rotations (F, 3, 3) that turn up to ``ways`` (F, 3) without twist: the smallest there are."""
    along = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    x, y, z = along.T
    share = 1 / (1 + y)
    columns = [[1 - x * x * share, x, -x * z * share], [-x, y, -z], [-x * z * share, z, 1 - z * z * share]]
    turns: Floats = np.moveaxis(np.array(columns), 2, 0)
    return turns


def _tube(low: float, high: float, radius: float) -> tuple[Floats, NDArray[np.int64]]:
    """An upright tube of eight sides."""
    turn = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    ring = radius * np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=1)
    ends = [ring + np.array([0.0, height, 0.0]) for height in (low, high)]
    return np.concatenate(ends), grid_triangles(2, len(turn), closed=True)
