"""Lying snow and puddles as meshes to render, with the shadows that fall on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

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


def field_mesh(element: SnowField | Puddle, state: State, ground: float, number: int) -> Mesh:
    """Return a field in a frame as a mesh with object id ``number`` and its surface's own normals."""
    heights = np.asarray(state["heights"], np.float64)
    x, z = places_of(element, heights.shape)
    if isinstance(element, Puddle):
        shown, level = element.water, ground + element.depth + FLAT * heights
        normals = _normals(STEEP * heights, element.spacing)
        colors = _water(element, normals)
    else:
        shown, level = element.heights > THIN, ground + heights
        normals, colors = _normals(heights, element.spacing), _snow(element, np.asarray(state["pressed"], np.float64))
    across, along = np.meshgrid(x, z)
    triangles = grid_triangles(*heights.shape)
    triangles = triangles[shown.ravel()[triangles].any(axis=1)]
    vertices = np.stack([across, level, along], axis=-1).reshape(-1, 3)
    # Grid triangles turn to +y or -y; both sides are seen, the normals say which is up.
    return Mesh(vertices, triangles, colors, number, normals.reshape(-1, 3))


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
    """Which nodes (rows, columns) are in the shadow."""
    shape = element.heights.shape if isinstance(element, SnowField) else element.water.shape
    level = float(np.median(mesh.vertices[:, 1]))
    dark = np.zeros(shape, np.uint8)
    slope = light / light[1]
    for caster in casting:
        height = caster.vertices[:, 1] - level
        fallen = caster.vertices - height[:, None] * slope
        pixels = np.rint((fallen[:, [0, 2]] - element.origin) / element.spacing * 16).astype(np.int32)
        for corners in caster.triangles[(height[caster.triangles] >= 0).any(axis=1)]:
            cv2.fillConvexPoly(dark, pixels[corners], 1, shift=4)
    return dark.astype(bool)


def _normals(heights: Floats, spacing: float) -> Floats:
    """Normals (rows, columns, 3) of a height field, by central differences."""
    fall = np.gradient(heights, spacing)
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
