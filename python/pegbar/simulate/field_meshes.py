"""Lying snow and puddles as meshes to render, with the shadows that fall on them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar.scene.mesh import Mesh
from pegbar.simulate.cache import State
from pegbar.simulate.fields import Puddle, SnowField, places_of
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.wearing import grid_triangles

Floats = NDArray[np.float64]
#: Snow thinner than this before the first frame is not drawn, in metres.
THIN = 1e-3
#: Pressed this share of its depth, snow has the second colour.
DEEP = 0.5
#: Waves are shaded as if so many times as steep: toon shading has few steps, and a puddle's waves are flat.
STEEP = 6.0
#: Waves are drawn so much flatter than they are: seen from the side each would hide the next, with a line of ink.
FLAT = 0.35
#: Slope towards the light, after that, from which the side of a wave has the second colour, and where it is full.
GLINT = (0.25, 0.45)
LIGHT = (0.4, 0.8, 0.45)
#: Beyond a field's nodes the lines by which it is drawn are each by this share farther apart.
WIDER = 0.15
#: Nodes around a field, at most, for which shadows are looked for.
MOST_SHADED = 1000


def field_mesh(element: SnowField | Puddle, state: State, ground: float, number: int) -> Mesh:
    """Return a field in a frame as a mesh with object id ``number`` and its surface's own normals."""
    heights = np.asarray(state["heights"], np.float64)
    x, z = lines_of(element)
    if isinstance(element, Puddle):
        shown, level = element.water, ground + element.depth + FLAT * heights
        normals = _normals(STEEP * heights, x, z)
        colors = _water(element, normals)
    else:
        pressed = np.asarray(state["pressed"], np.float64)
        flat = heights[element.border].mean()
        shown, level = _framed(element, element.heights > THIN, True), ground + _framed(element, heights, flat)
        normals, colors = _normals(level, x, z), _framed(element, _snow(element, pressed), element.look.color)
    across, along = np.meshgrid(x, z)
    triangles = grid_triangles(*level.shape)
    triangles = triangles[shown.ravel()[triangles].any(axis=1)]
    vertices = np.stack([across, level, along], axis=-1).reshape(-1, 3)
    # Grid triangles turn to +y or -y; both sides are seen, the normals say which is up.
    return Mesh(vertices, triangles, colors.reshape(-1, 4), number, normals.reshape(-1, 3))


def lines_of(element: SnowField | Puddle) -> tuple[Floats, Floats]:
    """Return the world x (columns,) and z (rows,) of the lines that a field is drawn by.

    Those of its nodes, and where snow lies beyond them more, farther and farther apart, to where it ends.
    """
    shape = element.heights.shape if isinstance(element, SnowField) else element.water.shape
    x, z = places_of(element, shape)
    if isinstance(element, Puddle) or element.beyond is None:
        return x, z
    first, last = element.beyond[:2], element.beyond[2:]
    x, z = (_widened(line, first[axis], last[axis], element.spacing) for axis, line in enumerate((x, z)))
    return x, z


def _widened(line: Floats, first: float, last: float, spacing: float) -> Floats:
    """A line's places with more of them before and after, so that it reaches from ``first`` to ``last``."""
    before, after = (_steps(reach, spacing) for reach in (line[0] - first, last - line[-1]))
    return np.concatenate([line[0] - before[::-1], line, line[-1] + after])


def _steps(reach: float, spacing: float) -> Floats:
    """Distances from ``spacing`` to ``reach`` that grow by the share ``WIDER``."""
    count = math.ceil(math.log1p(WIDER * max(reach, 0.0) / spacing) / math.log1p(WIDER))
    ways = spacing * ((1 + WIDER) ** np.arange(1, count + 1) - 1) / WIDER
    within: Floats = np.minimum(ways, reach)
    return within


def _framed(element: SnowField, values: NDArray[Any], outside: Any) -> NDArray[Any]:
    """Values (rows, columns, ...) of a field's nodes, with ``outside`` at the lines beyond them."""
    shape = element.heights.shape
    values = values.reshape(*shape, *values.shape[values.ndim - np.ndim(outside) :])
    x, z = lines_of(element)
    rows, columns = (int(np.searchsorted(line, element.origin[axis] - 1e-9)) for line, axis in ((z, 1), (x, 0)))
    framed = np.empty((len(z), len(x), *values.shape[2:]), values.dtype)
    framed[...] = outside
    framed[rows : rows + shape[0], columns : columns + shape[1]] = values
    return framed


def cast_on_fields(
    scene: SimulationScene,
    meshes: Sequence[Mesh],
    casting: Sequence[Mesh],
    *,
    light: ArrayLike = LIGHT,
    darkness: float = 0.35,
) -> list[Mesh]:
    """Return ``meshes``, those of fields darkened where ``casting`` keeps the light from them.

    The shadow is that on a level plane at the field's mean height, node by node.
    """
    fields = {scene.object_id(e.name): e for e in scene.elements if isinstance(e, SnowField | Puddle)}
    shaded = []
    for mesh in meshes:
        element = fields.get(mesh.object_id)
        if element is not None:
            dark = _shadow(element, mesh, casting, np.asarray(light, np.float64))
            colors = mesh.colors.copy()
            colors[dark.ravel(), :3] *= 1 - darkness
            mesh = replace(mesh, colors=colors)
        shaded.append(mesh)
    return shaded


def _shadow(element: SnowField | Puddle, mesh: Mesh, casting: Sequence[Mesh], light: Floats) -> NDArray[np.bool_]:
    """Which crossings (rows, columns) of the lines that a field is drawn by are in the shadow."""
    lines = lines_of(element)
    level = float(np.median(mesh.vertices[:, 1]))
    dark = np.zeros((len(lines[1]), len(lines[0])), bool)
    heights = [caster.vertices[:, 1] - level for caster in casting]
    pairs = list(zip(casting, heights, strict=True))
    fallen = [caster.vertices - height[:, None] * (light / light[1]) for caster, height in pairs]
    places = [(each[:, [0, 2]] - element.origin) / element.spacing for each in fallen]
    nodes = [np.rint((line - element.origin[axis]) / element.spacing).astype(int) for axis, line in enumerate(lines)]
    # A raster as fine as the field, as far as shadows fall and the field goes.
    every = np.concatenate([np.zeros((1, 2)), *places])
    first = [max(int(np.floor(every[:, k].min())), nodes[k][0], -MOST_SHADED) for k in (0, 1)]
    last = [min(int(np.ceil(every[:, k].max())), nodes[k][-1], len(lines[k]) + MOST_SHADED) for k in (0, 1)]
    raster = np.zeros((max(last[1] - first[1], 0) + 1, max(last[0] - first[0], 0) + 1), np.uint8)
    for (caster, height), place in zip(pairs, places, strict=True):
        pixels = np.rint((place - first) * 16).astype(np.int32)
        for corners in caster.triangles[(height[caster.triangles] >= 0).any(axis=1)]:
            cv2.fillConvexPoly(raster, pixels[corners], 1, shift=4)
    columns, rows = (np.flatnonzero((nodes[k] >= first[k]) & (nodes[k] <= last[k])) for k in (0, 1))
    dark[np.ix_(rows, columns)] = raster[np.ix_(nodes[1][rows] - first[1], nodes[0][columns] - first[0])]
    return dark


def _normals(heights: Floats, x: Floats, z: Floats) -> Floats:
    """Normals (rows, columns, 3) of a height field over ``z`` and ``x``, by central differences."""
    fall = np.gradient(heights, z, x)
    normals = np.stack([-fall[1], np.ones_like(heights), -fall[0]], axis=-1)
    unit: Floats = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    return unit


def _water(element: Puddle, normals: Floats) -> NDArray[np.float32]:
    light = np.array(LIGHT) / np.linalg.norm(LIGHT)
    towards = (normals @ light - light[1]) / (1 - light[1])
    share = np.clip((towards - GLINT[0]) / (GLINT[1] - GLINT[0]), 0, 1).reshape(-1, 1)
    return _mixed(element, share)


def _snow(element: SnowField, pressed: Floats) -> NDArray[np.float32]:
    depth = np.maximum(element.heights, THIN)
    return _mixed(element, np.clip(pressed / (DEEP * element.compaction * depth + 1e-9), 0, 1).reshape(-1, 1))


def _mixed(element: SnowField | Puddle, share: Floats) -> NDArray[np.float32]:
    colors: NDArray[np.float32] = (
        (1 - share) * np.array(element.look.color) + share * np.array(element.look.second)
    ).astype(np.float32)
    return colors
