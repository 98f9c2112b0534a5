"""A figure of tapered capsules about a skeleton's bones, so that a viewer shows more than axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.lift.turning import swing

Floats = NDArray[np.float64]
# Segments around a capsule and rings on each of its round ends.
_AROUND, _RINGS = 10, 3
# Radii in metres: a share of the bone's length, within what looks like a limb.
_SHARE, _THIN, _THICK = 0.14, 0.012, 0.07
_TAPER = 0.75


@dataclass(frozen=True)
class Bone:
    """A capsule from a joint towards ``child``; None: a ball at a joint without children."""

    joint: int
    child: int | None
    radius: float


@dataclass(frozen=True, eq=False)
class Figure:
    """Vertices (n, 3) metres in the bind pose, normals (n, 3), triangles (m, 3), and the bone of every vertex (n,)."""

    bones: tuple[Bone, ...]
    vertices: Floats
    normals: Floats
    triangles: NDArray[np.int64]
    bone_of: NDArray[np.int64]


def capsule_figure(parents: Sequence[int], bind: Floats) -> Figure:
    """Return capsules between the joints at ``bind`` (J, 3), and balls at those without children."""
    bones = _bones(parents, bind)
    parts = [_capsule(bind[bone.joint], bind[bone.joint if bone.child is None else bone.child], bone) for bone in bones]
    counts = [len(vertices) for vertices, _, _ in parts]
    starts = np.cumsum([0, *counts[:-1]])
    return Figure(
        tuple(bones),
        np.concatenate([vertices for vertices, _, _ in parts]),
        np.concatenate([normals for _, normals, _ in parts]),
        np.concatenate([faces + start for (_, _, faces), start in zip(parts, starts, strict=True)]),
        np.repeat(np.arange(len(bones)), counts),
    )


def _bones(parents: Sequence[int], bind: Floats) -> list[Bone]:
    bones = []
    for child, parent in enumerate(parents):
        if parent >= 0 and (length := float(np.linalg.norm(bind[child] - bind[parent]))) > 1e-3:
            bones.append(Bone(parent, child, float(np.clip(_SHARE * length, _THIN, _THICK))))
    size = float(np.ptp(bind, axis=0).max(initial=0.0))
    ball = float(np.clip(0.02 * size, _THIN, _THICK))
    return bones + [Bone(leaf, None, ball) for leaf in sorted(set(range(len(parents))) - set(parents))]


def _capsule(start: Floats, end: Floats, bone: Bone) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Vertices, normals and triangles of one capsule, thinner at its end."""
    length = float(np.linalg.norm(end - start))
    tilt, taper = np.linspace(-np.pi / 2, 0, _RINGS + 1), _TAPER if length > 0 else 1.0
    # A ball's two halves share their widest ring.
    upper = -tilt[::-1] if length > 0 else -tilt[-2::-1]
    heights = np.concatenate([np.sin(tilt) * bone.radius, length + taper * np.sin(upper) * bone.radius])
    widths = np.concatenate([np.cos(tilt) * bone.radius, taper * np.cos(upper) * bone.radius])
    slopes = np.concatenate([tilt, upper])
    turn = np.linspace(0, 2 * np.pi, _AROUND, endpoint=False)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    points = np.concatenate([_rings(ring, widths), np.repeat(heights, _AROUND)[:, None]], axis=1)
    normals = np.concatenate([_rings(ring, np.cos(slopes)), np.repeat(np.sin(slopes), _AROUND)[:, None]], axis=1)
    direction = end - start if length > 0 else np.array([0.0, 0.0, 1.0])
    frame = swing(np.array([[0.0, 0.0, 1.0]]), direction[None])[0]
    return points @ frame.T + start, normals @ frame.T, _faces(len(heights))


def _rings(ring: Floats, widths: Floats) -> Floats:
    circles: Floats = (widths[:, None, None] * ring).reshape(-1, 2)
    return circles


def _faces(rings: int) -> NDArray[np.int64]:
    """Two triangles for every field of the tube; those that the poles make flat are left out."""
    low, around = np.meshgrid(np.arange(rings - 1), np.arange(_AROUND), indexing="ij")
    a, b = low * _AROUND + around, low * _AROUND + (around + 1) % _AROUND
    upper, lower = np.stack([a, b, b + _AROUND], -1), np.stack([a, b + _AROUND, a + _AROUND], -1)
    faces: NDArray[np.int64] = np.concatenate([upper[1:].reshape(-1, 3), lower[:-1].reshape(-1, 3)])
    return faces
