"""Strands as meshes: round tubes, and balls or balloons at their ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.mesh import Mesh
from pegbar.simulate.chains import Strands
from pegbar.simulate.wearing import grid_triangles

Floats = NDArray[np.float64]
Colors = NDArray[np.float32]
#: Rings by link, corners of a ring of strands and of thick ropes, and how thick (metres) these are.
FINER, SIDES, MANY_SIDES, THICK = 3, 5, 10, 0.006
#: Pixels of the final picture that a strand is wide at least, so that it has no gaps.
LEAST_WIDTH = 0.7
#: Around a bob and from its top to its knot.
AROUND, DOWN = 24, 14


def strand_meshes(strands: Strands, positions: Floats, number: int, camera: PerspectiveCamera | None) -> list[Mesh]:
    """Return the meshes of ``strands`` whose points are at ``positions`` (n, 3), with object id ``number``.

    A ``camera`` makes strands at least 0.7 of its pixels wide.
    """
    parts: list[_Part] = []
    starts = np.cumsum(strands.counts) - strands.counts
    shown = strands.counts - (0 if strands.bobs is None else 1)
    for count in np.unique(shown[shown > 1]):
        chosen = np.flatnonzero(shown == count)
        parts.append(_tubes(strands, chosen, positions[starts[chosen, None] + np.arange(count)], camera))
    if strands.bobs is not None:
        ends = starts + strands.counts - 1
        parts.append(_bobs(strands, positions[ends - 1], positions[ends]))
    offsets = np.cumsum([0] + [len(part.vertices) for part in parts])
    triangles = [part.triangles + offset for part, offset in zip(parts, offsets, strict=False)]
    vertices, normals = (np.concatenate([getattr(part, name) for part in parts]) for name in ("vertices", "normals"))
    return [Mesh(vertices, np.concatenate(triangles), np.concatenate([p.colors for p in parts]), number, normals)]


@dataclass(frozen=True, eq=False)
class _Part:
    vertices: Floats
    normals: Floats
    triangles: NDArray[np.int64]
    colors: Colors


def _tubes(strands: Strands, chosen: NDArray[np.int64], points: Floats, camera: PerspectiveCamera | None) -> _Part:
    """Strands (S, c, 3) of as many points each as tubes."""
    line = _rounded(points)
    rings = line.shape[1]
    radii = np.repeat(strands.radii[chosen, None], rings, axis=1)
    sides = MANY_SIDES if strands.radii[chosen].max() > THICK else SIDES
    shown = radii
    if camera is not None:
        depth = np.maximum(line @ camera.matrix[2, :3] + camera.matrix[2, 3], 0)
        shown = np.maximum(radii, LEAST_WIDTH / 2 * depth / camera.focal_length)
    along = _units(np.gradient(line, axis=1))
    first, second = _carried(along)
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)[:, None]
    normals = np.cos(turn) * first[:, :, None] + np.sin(turn) * second[:, :, None]
    # The ends are closed: all corners of the first and last ring meet.
    wide = shown.copy()
    wide[:, [0, -1]] = 0
    vertices = line[:, :, None] + wide[..., None, None] * normals
    triangles = grid_triangles(rings, sides, closed=True)[:, ::-1]
    every = triangles + (np.arange(len(line)) * rings * sides)[:, None, None]
    colors = _colors(strands, chosen, line, turn[:, 0])
    return _Part(vertices.reshape(-1, 3), normals.reshape(-1, 3), every.reshape(-1, 3), colors.reshape(-1, 4))


def _rounded(points: Floats) -> Floats:
    """Points (S, r, 3) on cubics through ``points`` (S, c, 3), the first and last of them twice."""
    ends = [2 * points[:, :1] - points[:, 1:2], points, 2 * points[:, -1:] - points[:, -2:-1]]
    padded = np.concatenate(ends, axis=1)
    slopes = (padded[:, 2:] - padded[:, :-2]) / 2
    share = (np.arange(FINER) / FINER)[:, None]
    a, b, before, behind = (
        value[:, :, None] for value in (points[:, :-1], points[:, 1:], slopes[:, :-1], slopes[:, 1:])
    )
    rest = 1 - share
    inner = rest**2 * ((1 + 2 * share) * a + share * before) + share**2 * ((3 - 2 * share) * b - rest * behind)
    line = [points[:, :1], inner.reshape(len(points), -1, 3), points[:, -1:], points[:, -1:]]
    return np.concatenate(line, axis=1)


def _units(vectors: Floats) -> Floats:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    units: Floats = np.where(lengths > 1e-12, vectors / np.maximum(lengths, 1e-12), (0.0, 1.0, 0.0))
    return units


def _carried(along: Floats) -> tuple[Floats, Floats]:
    """Two directions (S, r, 3) across ``along`` that do not twist about it from ring to ring."""
    first = np.empty_like(along)
    level = np.abs(along[:, :1, 1:2]) < 0.9
    across = np.cross(along[:, 0], np.where(level, (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))[:, 0])
    for ring in range(along.shape[1]):
        direction = along[:, ring]
        across = _units(across - np.sum(across * direction, axis=1, keepdims=True) * direction)
        first[:, ring] = across
    return first, np.cross(along, first)


def _colors(strands: Strands, chosen: NDArray[np.int64], line: Floats, turn: Floats) -> Colors:
    """Linear RGBA (S, r, k, 4): "bands" are rings, "stripes" wind around like a rope's yarns, others are plain."""
    look = strands.look
    own = np.array(look.color, np.float32) if strands.colors is None else strands.colors[chosen][:, None, None]
    shape = (*line.shape[:2], len(turn), 4)
    if look.pattern not in ("bands", "stripes"):
        return np.ascontiguousarray(np.broadcast_to(own, shape))
    steps = np.linalg.norm(np.diff(line, axis=1), axis=2)
    at = np.concatenate([np.zeros((len(line), 1)), np.cumsum(steps, axis=1)], axis=1)[..., None] / look.pattern_size
    wind = 3 * turn / (2 * np.pi) if look.pattern == "stripes" else 0 * turn
    is_second = (at + wind) % 1 >= 0.5
    return np.where(is_second[..., None], np.array(look.second, np.float32), np.broadcast_to(own, shape))


def _bobs(strands: Strands, knots: Floats, centers: Floats) -> _Part:
    """Bobs: balls, or balloons drawn out to their knots."""
    assert strands.bobs is not None
    radii, apart = strands.bobs.radii, np.linalg.norm(centers - knots, axis=1)
    up = _units(centers - knots)
    first, second = (value[:, 0] for value in _carried(up[:, None]))
    turn = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)[:, None]
    around = np.cos(turn) * first[:, None] + np.sin(turn) * second[:, None]
    vertices, normals = [], []
    for index, radius in enumerate(radii):
        wide, high = _outline(float(apart[index] / radius)).T
        slope = np.gradient(np.stack([wide, high], axis=1), axis=0)
        vertices.append(
            centers[index] + radius * (wide[:, None, None] * around[index] + high[:, None, None] * up[index])
        )
        normals.append(-slope[:, 1, None, None] * around[index] + slope[:, 0, None, None] * up[index])
    each = grid_triangles(len(wide), AROUND, closed=True)
    every = each + (np.arange(len(radii)) * len(wide) * AROUND)[:, None, None]
    own = strands.bobs.colors if strands.bobs.colors is not None else strands.colors
    own = np.tile(np.array(strands.look.color, np.float32), (len(radii), 1)) if own is None else own
    colors = np.repeat(own, len(wide) * AROUND, axis=0)
    points = np.concatenate([part.reshape(-1, 3) for part in vertices])
    return _Part(points, np.concatenate([part.reshape(-1, 3) for part in normals]), every.reshape(-1, 3), colors)


def _outline(knot: float) -> Floats:
    """From the top down, (r, 2): how wide and how high a unit bob is whose knot is ``knot`` below its middle.

    A knot on the ball leaves it a ball; beyond, the ball is drawn out to it and ends in a little flare.
    """
    if knot <= 1 + 1e-6:
        polar = np.linspace(0, np.pi, DOWN)
        return np.stack([np.sin(polar), np.cos(polar)], axis=1)
    leave = np.pi - 1.15 * np.arccos(1 / knot)
    polar = np.linspace(0, leave, DOWN - 5)
    ball = np.stack([np.sin(polar), np.cos(polar)], axis=1)
    # A cubic from the ball, along it, to the knot, straight down.
    share = np.linspace(0, 1, 5)[1:, None]
    end, start = np.array([0.03, -knot]), ball[-1]
    reach = np.linalg.norm(end - start)
    before, behind = reach * np.array([np.cos(leave), -np.sin(leave)]), reach * np.array([0.0, -0.6])
    rest = 1 - share
    neck = rest**2 * ((1 + 2 * share) * start + share * before) + share**2 * ((3 - 2 * share) * end - rest * behind)
    return np.concatenate([ball, neck, [[0.085, -knot - 0.06], [0.0, -knot - 0.05]]])
