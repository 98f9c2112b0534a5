"""Presets that a character holds: an umbrella."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
#: Tangent of the most that the shaft may lean.
LEAN = 0.36
WOOD: Color = (0.16, 0.08, 0.04, 1.0)


@dataclass(frozen=True)
class Umbrella:
    """An umbrella in a hand that keeps the rain off.

    ``size`` is the canopy's diameter and ``clearance`` how far its edge is above the head, in body heights; ``hand`` is
    "left", "right" or "auto", the one that is steadier beside the head. It stays upright and goes where the hand goes;
    the shaft is long enough to keep the canopy over the head in all frames, and leans towards it.
    """

    size: float = 0.85
    clearance: float = 0.06
    hand: str = "auto"
    color: Color = (0.75, 0.04, 0.05, 1.0)
    second: Color = (0.95, 0.85, 0.65, 1.0)

    def build(self, name: str, character: Character, ground: float | None, seed: int) -> tuple[Prop, ...]:
        """Put the umbrella into the hand of the first frame's pose."""
        check(self, positive=("size",), not_negative=("clearance",))
        if self.hand not in ("left", "right", "auto"):
            raise ValueError(f"hand: want left, right or auto, got {self.hand!r}")
        tall, head = body_height(character), _head(character)
        hand = marker(character, self._side(character, head))
        away = head - hand
        rise = max(float(away[:, 1].max()) + self.clearance * tall, 0.25 * tall)
        beside = (away.min(axis=0) + away.max(axis=0)) / 2 * (1, 0, 1)
        beside *= min(1.0, LEAN * rise / max(float(np.linalg.norm(beside)), 1e-9))
        axis = np.array([beside[0], rise, beside[2]])
        axis /= np.linalg.norm(axis)
        # Where it leans the edge hangs lower on one side.
        rise += self.size * tall / 2 * float(np.hypot(axis[0], axis[2]))
        edge = hand[0] + axis * (rise / axis[1])
        canopy = self._canopy(edge, axis, self.size * tall / 2)
        top = edge + axis * (self.size * tall / 2 * DEPTH + 0.03 * tall)
        shaft = _tube(hand[0] - 0.06 * tall * axis, top, 0.006 * tall)
        vertices = np.concatenate([canopy[0], shaft[0]])
        triangles = np.concatenate([canopy[1], shaft[1] + len(canopy[0])])
        colors = np.concatenate([canopy[2], np.tile(np.array(WOOD, np.float32), (len(shaft[0]), 1))])
        pin = Pin("marker", self._side(character, head), character=character.name)
        rod = np.array([[*hand[0], 0.006 * tall, *top, 0.006 * tall]])
        return (Prop(name, vertices, triangles, pin, rod, Look(self.color), colors),)

    def _side(self, character: Character, head: Floats) -> str:
        """The marker of the hand."""
        if self.hand != "auto":
            return f"{self.hand}_hand"
        sway = [np.ptp(head - marker(character, f"{side}_hand"), axis=0).sum() for side in ("right", "left")]
        return "right_hand" if sway[0] <= sway[1] else "left_hand"

    def _canopy(
        self, middle: Floats, axis: Floats, radius: float
    ) -> tuple[Floats, NDArray[np.int64], NDArray[np.float32]]:
        """Vertices, triangles and colours of the canopy: gores of a cap of a sphere whose edge is round ``middle``."""
        side = np.cross(axis, (0.0, 0.0, 1.0))
        side /= np.linalg.norm(side)
        axes = np.stack([side, axis, np.cross(side, axis)])
        sphere = (1 + DEPTH**2) / (2 * DEPTH)
        share, out = np.meshgrid(np.linspace(0, 1, ACROSS), np.linspace(0, 1, ALONG), indexing="ij")
        reach = out * (1 - SCALLOP * np.sin(np.pi * share) * out**4)
        height = np.sqrt(np.maximum(sphere**2 - reach**2, 0)) - (sphere - DEPTH)
        vertices, colors = [], []
        for gore in range(GORES):
            turn = (gore + share) * (2 * np.pi / GORES)
            places = np.stack([reach * np.cos(turn), height, reach * np.sin(turn)], axis=-1).reshape(-1, 3)
            vertices.append(middle + radius * places @ axes)
            colors.append(np.tile(np.array(self.second if gore % 2 else self.color, np.float32), (len(places), 1)))
        sheet = grid_triangles(ACROSS, ALONG)
        triangles = np.concatenate([sheet + gore * ACROSS * ALONG for gore in range(GORES)])
        return np.concatenate(vertices), triangles, np.concatenate(colors)


def _head(character: Character) -> Floats:
    """The head's highest point (F, 3), over the middle of the head."""
    place = marker(character, "head").copy()
    limb = limb_between(character, "neck", "head")
    volumes = character.volumes
    widest = filled(np.maximum(volumes.start_radius[:, limb], volumes.end_radius[:, limb]))
    place[:, 1] += np.nan_to_num(widest)
    return place


def _tube(start: Floats, end: Floats, radius: float) -> tuple[Floats, NDArray[np.int64]]:
    """A tube of eight sides."""
    along = (end - start) / np.linalg.norm(end - start)
    across = np.cross(along, (0.0, 0.0, 1.0))
    across /= np.linalg.norm(across)
    turn = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    ring = radius * (np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(across, along))
    return np.concatenate([start + ring, end + ring]), grid_triangles(2, len(turn), closed=True)
