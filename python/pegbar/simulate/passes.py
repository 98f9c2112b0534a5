"""Renders meshes to the passes that compositing takes: beauty, depth, coverage and object id."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import _kernels, arrays
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.mesh import Mesh


@dataclass(frozen=True)
class Ink:
    """How ink lines are drawn.

    ``width`` is in pixels of the final picture, ``color`` straight linear RGBA. An outline is drawn where the object
    changes or where depth jumps by more than the part ``depth_jump`` of the depth; it grows out from the nearer
    surface over the farther one and has the nearer one's depth and object id. A crease is drawn, half to either side,
    where neighbouring triangles' normals differ by at least ``crease_angle`` radians (None: no creases), and where two
    objects cut each other; it has the depth of the surface that it lies on. A line never covers anything nearer than
    itself.
    """

    width: float = 1.5
    color: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    crease_angle: float | None = math.pi / 3
    depth_jump: float = 0.01

    def __post_init__(self) -> None:
        for name in ("width", "depth_jump") + (() if self.crease_angle is None else ("crease_angle",)):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise ValueError(f"{name}: want a finite number of zero or more, got {getattr(self, name)!r}")
        color = arrays.floats("color", self.color, (4,))
        if not 0 <= color[3] <= 1:
            raise ValueError(f"color: want alpha in 0..1, got {color[3]}")
        object.__setattr__(self, "color", tuple(color.tolist()))


@dataclass(frozen=True, eq=False)
class Passes:
    """Rendered pictures of one size, ``samples`` times larger on both sides than the final picture.

    ``beauty`` (kH, kW, 4) float32 is premultiplied linear RGBA, ``depth`` (kH, kW) float32 planar depth in metres with
    +inf where nothing is, ``coverage`` (kH, kW) float32 1 on a surface and 0 elsewhere (whatever its alpha),
    ``object_id`` (kH, kW) uint16 the nearest surface's id and 0 in the background.
    """

    beauty: NDArray[np.float32]
    depth: NDArray[np.float32]
    coverage: NDArray[np.float32]
    object_id: NDArray[np.uint16]
    samples: int = 1

    def resolved(self) -> Passes:
        """Return the passes at the final size: beauty and coverage averaged, depth and id of the nearest sample.

        Of equally near samples the first in reading order counts. A picture whose sides are not multiples of
        ``samples``, pictures of different sizes, and a depth that is NaN are ValueErrors.
        """
        depth = arrays.floats("depth", self.depth, ("H", "W"), dtype=np.float32, allow="any")
        if self.samples < 1 or depth.shape[0] % self.samples or depth.shape[1] % self.samples:
            raise ValueError(f"samples: want a divisor of the picture's sides {depth.shape}, got {self.samples}")
        beauty = arrays.floats("beauty", self.beauty, (*depth.shape, 4), dtype=np.float32, allow="any")
        coverage = arrays.floats("coverage", self.coverage, depth.shape, dtype=np.float32, allow="any")
        object_id = arrays.integers("object_id", self.object_id, depth.shape, dtype=np.uint16)
        return Passes(*_kernels.resolve_passes(beauty, depth, coverage, object_id, self.samples))


def render_passes(
    meshes: Iterable[Mesh],
    camera: PerspectiveCamera,
    *,
    samples: int = 1,
    near: float = 0.01,
    light: ArrayLike = (0.4, 0.8, 0.45),
    bands: ArrayLike | None = None,
    ink: Ink | None = None,
) -> Passes:
    """Render ``meshes`` as ``camera`` sees them, with one sample a pixel of a ``samples`` times larger picture.

    The nearest surface wins at every sample; of equally near ones the one given first. Its alpha is kept in the
    beauty pass but nothing behind it is seen: translucent surfaces do not blend with each other. A sample belongs to a
    triangle by the top-left rule on corners snapped to 1/256 pixel, so neighbours leave no cracks; its depth is the
    exact depth of the triangle's plane at the sample's centre. The result has the same bits for any number of
    threads.

    Parameters
    ----------
    meshes : iterable of Mesh
        May be empty: the passes are then background.
    camera : PerspectiveCamera
        Its ``image_size`` is the final picture's.
    samples : int
        k: pictures are k times larger on both sides (k x k samples a pixel).
    near : float
        Surfaces nearer than this planar depth in metres are cut off.
    light : (3,) float
        World direction towards the light, any length; used with ``bands``.
    bands : (B,) float, optional
        Toon shading: factors on the colour, from the side turned away from the light to the side turned towards it.
        They divide the cosine between light and normal (two-sided: the normal of the side that is seen) evenly, so
        two bands meet where the light grazes. None: colours as they are.
    ink : Ink, optional
        Draws ink lines. None: no lines.

    Returns
    -------
    Passes
        At k times the final size; ``.resolved()`` gives the final size.

    Raises
    ------
    ValueError
        For a wrong shape or value, named, and for vertices too far away to be projected.

    Examples
    --------
    >>> camera = PerspectiveCamera.look_at((0, 0, 3), (0, 0, 0), (4, 3), 1.0)
    >>> square = Mesh([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], [[0, 1, 2], [0, 2, 3]], (1, 0, 0, 1))
    >>> passes = render_passes([square], camera, samples=2)
    >>> passes.depth.shape, float(passes.resolved().depth[1, 2])
    ((6, 8), 3.0)
    """
    if not isinstance(samples, int | np.integer) or samples < 1:
        raise ValueError(f"samples: want a whole number of 1 or more, got {samples!r}")
    if not (math.isfinite(near) and near > 0):
        raise ValueError(f"near: want a finite depth above zero, got {near!r}")
    direction = arrays.floats("light", light, (3,))
    factors = arrays.floats("bands", () if bands is None else bands, ("B",), dtype=np.float32)
    if bands is not None and not (factors.size and factors.min() >= 0):
        raise ValueError("bands: want at least one factor, all of them zero or more")
    view = camera.scaled(int(samples))
    pictures = _kernels.render_passes(
        _join(list(meshes), with_normals=bands is not None),
        (view.matrix.tolist(), *view.image_size),
        float(near),
        (tuple(direction.tolist()), factors),
        _pen(ink, int(samples)),
    )
    return Passes(*pictures, samples=int(samples))


def _join(meshes: list[Mesh], *, with_normals: bool) -> _Geometry:
    """Put the meshes behind each other in one list of vertices."""
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    triangles = [mesh.triangles + offset for mesh, offset in zip(meshes, offsets, strict=False)]
    normals = [mesh.normals for mesh in meshes if with_normals and mesh.normals is not None]
    return (
        np.concatenate([np.empty((0, 3)), *(mesh.vertices for mesh in meshes)]),
        np.concatenate([np.empty((0, 3), np.int64), *triangles]).astype(np.uint32),
        np.concatenate([np.empty((0, 4), np.float32), *(mesh.colors for mesh in meshes)]),
        np.concatenate([np.empty((0, 3)), *normals]),
        np.repeat([mesh.object_id for mesh in meshes], [len(mesh.triangles) for mesh in meshes]).astype(np.uint16),
    )


_Geometry = tuple[NDArray[np.float64], NDArray[np.uint32], NDArray[np.float32], NDArray[np.float64], NDArray[np.uint16]]


def _pen(ink: Ink | None, samples: int) -> tuple[float, tuple[float, float, float, float], float, float]:
    """The lines in samples; no lines have no width, and no crease angle is one that no fold reaches."""
    if ink is None:
        return 0.0, (0.0, 0.0, 0.0, 0.0), 0.0, 0.0
    crease = 2 * math.pi if ink.crease_angle is None else ink.crease_angle
    return ink.width * samples, ink.color, crease, ink.depth_jump
