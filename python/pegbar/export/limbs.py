"""Limbs as moving capsules: a tapered cylinder and a half sphere on each end, along +Y of an axis that does not jump.

A half sphere's points keep their directions when radii change, so a joint or hook at each end moves the mesh exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pegbar.export.rig import steady
from pegbar.lift.turning import swing, unit
from pegbar.scene.mesh import Mesh
from pegbar.simulate.scene import Character

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
#: Vertices around a capsule, and rings on each of its ends besides the pole.
AROUND, RINGS = 24, 6
_UP = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True, eq=False)
class Capsule:
    """One limb over F frames.

    ``start`` and ``end`` (F, 3) are the ends of its axis in metres, ``radii`` (F, 2) those there, ``turns``
    (F, 4) quaternions x y z w that bring +Y onto the axis. Where ``known`` (F,) is false they are those of the nearest
    frame in which the limb is known.
    """

    name: str
    start: Floats
    end: Floats
    radii: Floats
    turns: Floats
    known: NDArray[np.bool_]

    @property
    def lengths(self) -> Floats:
        """The axis's length (F,) in metres."""
        lengths: Floats = np.linalg.norm(self.end - self.start, axis=1)
        return lengths

    def vertices(self, row: int) -> Floats:
        """Return the mesh's vertices (n, 3) in frame ``row``, in the world."""
        directions, at_end = capsule_shape()[:2]
        turned = directions @ Rotation.from_quat(self.turns[row]).as_matrix().T
        radii = np.where(at_end, self.radii[row, 1], self.radii[row, 0])
        vertices: Floats = np.where(at_end[:, None], self.end[row], self.start[row]) + turned * radii[:, None]
        return vertices


def capsules(character: Character) -> tuple[Capsule, ...]:
    """Return the limbs of ``character`` that are known in some frame."""
    volumes, found = character.volumes, []
    for limb, name in enumerate(character.limb_names):
        radii = np.stack([volumes.start_radius[:, limb], volumes.end_radius[:, limb]], axis=1)
        values = np.concatenate([volumes.start[:, limb], volumes.end[:, limb], radii], axis=1)
        known = np.isfinite(values).all(axis=1)
        if known.any():
            held = values[nearest_known(known)]
            start, end = held[:, :3], held[:, 3:6]
            found.append(Capsule(name, start, end, held[:, 6:], _turns(end - start), known))
    return tuple(found)


def nearest_known(known: NDArray[np.bool_]) -> Integers:
    """Return for every frame (F,) the nearest one that is ``known``, of two the earlier."""
    places = np.flatnonzero(known)
    after = np.searchsorted(places, np.arange(len(known))).clip(max=len(places) - 1)
    before = (after - 1).clip(min=0)
    frames = np.arange(len(known))
    nearer = np.abs(places[before] - frames) <= np.abs(places[after] - frames)
    nearest: Integers = np.where(nearer, places[before], places[after])
    return nearest


def limb_meshes(characters: tuple[Character, ...], row: int) -> list[Mesh]:
    """Return the limbs that are known in frame ``row`` as meshes, each with an object id, from 1 on."""
    every = [capsule for character in characters for capsule in capsules(character)]
    triangles, gray = capsule_shape()[2], np.array([0.6, 0.6, 0.6, 1.0], np.float32)
    return [
        Mesh(capsule.vertices(row), triangles, gray, number)
        for number, capsule in enumerate(every, 1)
        if capsule.known[row]
    ]


@cache
def capsule_shape() -> tuple[Floats, NDArray[np.bool_], Integers]:
    """Return directions (n, 3) of a capsule's vertices, which are at its end (n,), and triangles, facing outwards."""
    turn = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
    tilts = np.arange(1, RINGS + 1) / RINGS * (np.pi / 2)
    low = [_ring(turn, -np.pi / 2 + tilt) for tilt in tilts]
    high = [_ring(turn, np.pi / 2 - tilt) for tilt in tilts[::-1]]
    directions = np.concatenate([-_UP[None], *low, *high, _UP[None]])
    count = 1 + RINGS * AROUND
    at_end = np.arange(len(directions)) >= count
    ring, at = np.meshgrid(np.arange(2 * RINGS - 1), np.arange(AROUND), indexing="ij")
    a, b = 1 + ring * AROUND + at, 1 + ring * AROUND + (at + 1) % AROUND
    sides = [np.stack([a, a + AROUND, b], -1), np.stack([b, a + AROUND, b + AROUND], -1)]
    spokes, last = np.arange(AROUND), len(directions) - 1
    after, rim = (spokes + 1) % AROUND, last - AROUND
    caps = [
        np.stack([np.zeros_like(spokes), 1 + spokes, 1 + after], -1),
        np.stack([np.full_like(spokes, last), rim + after, rim + spokes], -1),
    ]
    triangles = np.concatenate([part.reshape(-1, 3) for part in (*sides, *caps)]).astype(np.int64)
    for array in (directions, at_end, triangles):
        array.setflags(write=False)
    return directions, at_end, triangles


def _ring(turn: Floats, tilt: float) -> Floats:
    return np.stack([np.cos(turn) * np.cos(tilt), np.full_like(turn, np.sin(tilt)), np.sin(turn) * np.cos(tilt)], 1)


def _turns(axes: Floats) -> Floats:
    """Quaternions (F, 4) that bring +Y onto ``axes`` (F, 3), each the one before turned as little as can be."""
    directions = unit(axes)
    for row in np.flatnonzero(~directions.any(axis=1)):
        directions[row] = directions[row - 1] if row else _UP
    turn = swing(_UP[None], directions[:1])[0]
    turns = [turn]
    for step in swing(directions[:-1], directions[1:]):
        turn = step @ turn
        turns.append(turn)
    found: Floats = steady(Rotation.from_matrix(np.stack(turns)).as_quat()[:, None])[:, 0]
    return found
