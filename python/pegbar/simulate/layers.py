"""Rendered layers of a simulation: elements, the shadow that they cast on the ground, and both for an EXR file."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.mesh import Mesh
from pegbar.simulate.passes import Passes, render_passes

#: Object id of the shadow in the passes; the renderer draws no ink around it (``BARE`` in ``rust/kernels/ink.rs``).
SHADOW_ID = 0xFFFE


def render_shadow(
    meshes: Iterable[Mesh],
    camera: PerspectiveCamera,
    ground: float,
    *,
    samples: int = 1,
    light: ArrayLike = (0.4, 0.8, 0.45),
    darkness: float = 0.35,
    near: float = 0.01,
) -> Passes:
    """Render what ``meshes`` take from the light on the ground plane: black with alpha, at the ground's depth.

    Parameters
    ----------
    meshes : iterable of Mesh
        What casts shadows. What lies under the ground casts none.
    camera : PerspectiveCamera
        Its ``image_size`` is the final picture's.
    ground : float
        Height of the plane in metres.
    samples : int
        Pictures are so many times larger on both sides.
    light : (3,) float
        World direction towards the light, as in ``render_passes``; it comes from above.
    darkness : float
        The shadow's alpha, 0 to 1.
    near : float
        As in ``render_passes``.

    Returns
    -------
    Passes
        Object id 65534. ``under`` lays them under the elements' passes.

    Raises
    ------
    ValueError
        For a light from below or beside, a darkness outside 0..1, a ground that is not finite.

    Examples
    --------
    >>> camera = PerspectiveCamera.look_at((0, 2, 4), (0, 0, 0), (8, 6), 1.0)
    >>> roof = Mesh([[-1, 1, -1], [1, 1, -1], [1, 1, 1], [-1, 1, 1]], [[0, 1, 2], [0, 2, 3]], (1, 0, 0, 1))
    >>> shadow = render_shadow([roof], camera, 0.0, light=(0, 1, 0), darkness=0.5)
    >>> shadow.beauty[3, 4].tolist()
    [0.0, 0.0, 0.0, 0.5]
    """
    return render_passes(
        shadow_meshes(meshes, ground, light=light, darkness=darkness), camera, samples=samples, near=near
    )


def shadow_meshes(
    meshes: Iterable[Mesh], ground: float, *, light: ArrayLike = (0.4, 0.8, 0.45), darkness: float = 0.35
) -> list[Mesh]:
    """Return the shadows of ``meshes`` on the ground plane as meshes, to be rendered with the elements in one go.

    They are flat and black with alpha ``darkness``, and no ink lines are drawn around them. Parameters and errors are
    those of ``render_shadow``.

    Examples
    --------
    >>> roof = Mesh([[-1, 1, -1], [1, 1, -1], [1, 1, 1]], [[0, 1, 2]], (1, 0, 0, 1))
    >>> shadow_meshes([roof], 0.0, light=(1, 1, 0))[0].vertices.tolist()
    [[-2.0, 0.0, -1.0], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]
    """
    direction = arrays.floats("light", light, (3,))
    if not direction[1] > 0:
        raise ValueError(f"light: want a direction from above the ground, got {direction.tolist()}")
    if not 0 <= darkness <= 1:
        raise ValueError(f"darkness: want 0 to 1, got {darkness}")
    if not math.isfinite(ground):
        raise ValueError(f"ground: want a finite height, got {ground}")
    slope = direction / direction[1]
    color = np.array([0.0, 0.0, 0.0, darkness], np.float32)
    flat = []
    for mesh in meshes:
        height = mesh.vertices[:, 1] - ground
        above = (height[mesh.triangles] >= 0).any(axis=1)
        fallen = mesh.vertices - np.maximum(height, 0)[:, None] * slope
        fallen[:, 1] = ground
        up = np.broadcast_to((0.0, 1.0, 0.0), fallen.shape)
        flat.append(Mesh(fallen, mesh.triangles[above], color, SHADOW_ID, up))
    return flat


def under(passes: Passes, shadow: Passes) -> Passes:
    """Lay a ``shadow`` under the elements' ``passes``: it shows where no element is, or one that is farther away.

    Both have the same camera and samples. Nothing blends: a sample is an element's or the shadow's.
    """
    if passes.depth.shape != shadow.depth.shape or passes.samples != shadow.samples:
        raise ValueError(f"shadow: want pictures of {passes.depth.shape}, got {shadow.depth.shape}")
    shown = (passes.coverage == 0) & (shadow.coverage > 0)
    return replace(
        passes,
        beauty=np.where(shown[..., None], shadow.beauty, passes.beauty),
        depth=np.where(shown, shadow.depth, passes.depth),
        coverage=np.where(shown, shadow.coverage, passes.coverage),
        object_id=np.where(shown, shadow.object_id, passes.object_id),
    )


def exr_channels(passes: Passes, shadow: Passes | None = None) -> dict[str, NDArray[Any]]:
    """Return the channels of a multilayer EXR file, for ``write_exr``.

    They are R G B A (premultiplied linear), ``Z`` (planar metres), ``coverage.Y``, ``object.ID``, and with a
    ``shadow`` its ``shadow.A`` and ``shadow.Z``.
    """
    channels: dict[str, NDArray[Any]] = {
        "": passes.beauty,
        "Z": passes.depth,
        "coverage.Y": passes.coverage,
        "object.ID": passes.object_id.astype(np.uint32),
    }
    if shadow is not None:
        channels |= {"shadow.A": np.ascontiguousarray(shadow.beauty[..., 3]), "shadow.Z": shadow.depth}
    return channels
