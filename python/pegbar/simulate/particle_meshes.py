"""Particles as meshes to render: discs turned to the camera and streaks along the way."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.mesh import Mesh
from pegbar.simulate.cache import State
from pegbar.simulate.particles import FREE, PHASE, SETTLED
from pegbar.simulate.weather import Particles

Floats = NDArray[np.float64]
#: Corners of a disc.
CORNERS = 6
#: A streak is at least this many pixels wide, half as much to either side, or it would flicker.
THINNEST = 1.2
#: Share of a frame for which the shutter is open.
SHUTTER = 0.5
#: In its last part of this share a flake that lies melts to nothing.
MELTING = 0.4
#: Metres before the box's sides in which particles grow from nothing: none appears or goes at once.
FADE = 0.25
#: All face the light, so that toon shading leaves their colour as it is.
LIGHT = (0.4, 0.8, 0.45)


def particle_mesh(
    element: Particles, state: State, camera: PerspectiveCamera | None, frame_rate: float, number: int
) -> Mesh:
    """Return the particles of a frame's ``state`` as one mesh with object id ``number``.

    Without a camera they are turned towards +Z.
    """
    codes = np.asarray(state["codes"])
    there = codes[:, PHASE] != FREE
    places = np.asarray(state["positions"], np.float64)[there]
    radii = np.asarray(state["sizes"], np.float64)[there, 0] * _grown(element, state, there)
    if element.shape == "streak":
        speeds = np.asarray(state["velocities"], np.float64)[there]
        corners = _streaks(places, speeds * (SHUTTER / frame_rate), radii, camera)
    else:
        corners = _discs(places, radii, camera)
    count = corners.shape[1]
    fan = np.array([(0, k, k + 1) for k in range(1, count - 1)])
    triangles = (fan + count * np.arange(len(places))[:, None, None]).reshape(-1, 3)
    vertices = corners.reshape(-1, 3)
    color = np.array(element.look.color, np.float32)
    return Mesh(vertices, triangles, color, number, np.broadcast_to(LIGHT, vertices.shape))


def _grown(element: Particles, state: State, there: NDArray[np.bool_]) -> Floats:
    """Share (n,) of its radius that a particle shows: what melts and what enters or leaves is smaller."""
    ages, phases = np.asarray(state["sizes"])[there, 1], np.asarray(state["codes"])[there, PHASE]
    settle = element.material.settle
    left = np.clip((settle - ages) / (MELTING * settle), 0, 1)
    places = np.asarray(state["positions"])[there][:, [0, 2]]
    low, high = element.low[[0, 2]], element.high[[0, 2]]
    inside = np.minimum(places - low, high - places).min(axis=1, initial=np.inf)
    # A cube root: what melts loses its volume evenly.
    melting = np.where(phases == SETTLED, np.cbrt(left), 1.0)
    grown: Floats = melting * np.clip(1 + inside / FADE, 0, 1)
    return grown


def _discs(places: Floats, radii: Floats, camera: PerspectiveCamera | None) -> Floats:
    """Corners (n, k, 3) of discs that face the camera."""
    axes = np.eye(3) if camera is None else camera.rotation
    turn = np.arange(CORNERS) * (2 * np.pi / CORNERS)
    rim = np.cos(turn)[:, None] * axes[0] + np.sin(turn)[:, None] * axes[1]
    corners: Floats = places[:, None] + radii[:, None, None] * rim
    return corners


def _streaks(places: Floats, ways: Floats, radii: Floats, camera: PerspectiveCamera | None) -> Floats:
    """Corners (n, 4, 3) of streaks from ``places`` back along ``ways``, turned to the camera."""
    view = np.array([0.0, 0.0, -1.0]) if camera is None else places - camera.position
    lengths = np.linalg.norm(ways, axis=1, keepdims=True)
    # As long as it is wide at least.
    ways = np.where(lengths < 2 * radii[:, None], 2 * radii[:, None] * np.array([0.0, -1.0, 0.0]), ways)
    across = np.cross(ways, view)
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    half = radii
    if camera is not None:
        pixel = np.maximum(camera.depth(places), 0.0) / camera.focal_length
        half = np.where(radii > 0, np.maximum(radii, THINNEST / 2 * pixel), 0.0)
    side = half[:, None] * across
    ends = places - ways
    corners: Floats = np.stack([places - side, places + side, ends + side, ends - side], axis=1)
    return corners
