"""Elements of a simulation: cloth and strands with their pins, balls, boxes and props held in a hand."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pegbar import arrays
from pegbar.simulate.chains import Bobs as Bobs
from pegbar.simulate.chains import Strands as Strands
from pegbar.simulate.fields import Puddle, SnowField
from pegbar.simulate.materials import ClothMaterial, Look, RigidMaterial, positive
from pegbar.simulate.pins import Pin as Pin
from pegbar.simulate.pins import check_pins
from pegbar.simulate.weather import Particles

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Cloth:
    """A sheet of triangles.

    Parameters
    ----------
    name : str
        Unique in the scene.
    vertices : (n, 3) float
        Where the cloth is before the first frame, world metres.
    triangles : (T, 3) int
        Indices into ``vertices``.
    pins : tuple of Pin
        What holds it.
    seams : (s, 2) int
        Pairs of vertices sewn together.
    rest : (n, 3) float, optional
        The shape whose lengths and angles the cloth keeps, None: ``vertices``.
    coordinates : (n, 2) float, optional
        Texture coordinates in metres of cloth (across, along) for patterns; None: none.
    around : float, optional
        Of a closed sheet the length across after which the coordinates begin anew; None: it is open.
    material, look
        What it is made of and looks like.
    """

    name: str
    vertices: Floats
    triangles: Integers
    pins: tuple[Pin, ...] = ()
    seams: Integers = field(default_factory=lambda: np.empty((0, 2), np.int64))
    rest: Floats | None = None
    coordinates: Floats | None = None
    around: float | None = None
    material: ClothMaterial = field(default_factory=ClothMaterial)
    look: Look = field(default_factory=Look)

    def __post_init__(self) -> None:
        vertices = arrays.floats("vertices", self.vertices, ("n", 3))
        last = len(vertices) - 1
        _set(self, "vertices", vertices)
        _set(self, "triangles", arrays.integers("triangles", self.triangles, ("T", 3), low=0, high=last))
        _set(self, "seams", arrays.integers("seams", self.seams, ("s", 2), low=0, high=last))
        rest = vertices if self.rest is None else arrays.floats("rest", self.rest, vertices.shape)
        _set(self, "rest", rest)
        if self.coordinates is not None:
            _set(self, "coordinates", arrays.floats("coordinates", self.coordinates, (len(vertices), 2)))
        check_pins(self.name, self.pins, len(vertices))


@dataclass(frozen=True, eq=False)
class Balls:
    """Rigid balls: ``centers`` (n, 3) and ``velocities`` (n, 3) before the first frame, ``radii`` (n,), metres.

    Without velocities they rest. ``colors`` (n, 4) straight linear RGBA are their own colours (None: all have the
    look's).
    """

    name: str
    centers: Floats
    radii: Floats
    velocities: Floats = field(default_factory=lambda: np.empty((0, 3)))
    colors: NDArray[np.float32] | None = None
    material: RigidMaterial = field(default_factory=RigidMaterial)
    look: Look = field(default_factory=Look)

    def __post_init__(self) -> None:
        _set_rigid(self)
        _set(self, "radii", positive("radii", self.radii, (len(self.centers),)))


@dataclass(frozen=True, eq=False)
class Boxes:
    """Rigid boxes: ``centers`` (n, 3), ``sizes`` (n, 3) their edges, ``velocities`` (n, 3), world metres.

    Without velocities they rest. ``colors`` (n, 4) straight linear RGBA are their own colours (None: all have the
    look's).
    """

    name: str
    centers: Floats
    sizes: Floats
    velocities: Floats = field(default_factory=lambda: np.empty((0, 3)))
    colors: NDArray[np.float32] | None = None
    material: RigidMaterial = field(default_factory=RigidMaterial)
    look: Look = field(default_factory=Look)

    def __post_init__(self) -> None:
        _set_rigid(self)
        _set(self, "sizes", positive("sizes", self.sizes, self.centers.shape))


@dataclass(frozen=True, eq=False)
class Prop:
    """A thing held in a hand: it follows its pin and pushes what it meets, and nothing moves it.

    ``vertices`` (n, 3) is its mesh before the first frame, world metres; ``capsules`` (c, 8) are the volumes that
    push: start (3) and its radius, end (3) and its radius. ``colors`` (n, 4) straight linear RGBA are the vertices' own
    (None: all have the look's).
    """

    name: str
    vertices: Floats
    triangles: Integers
    pin: Pin
    capsules: Floats = field(default_factory=lambda: np.empty((0, 8)))
    look: Look = field(default_factory=Look)
    colors: NDArray[np.float32] | None = None

    def __post_init__(self) -> None:
        vertices = arrays.floats("vertices", self.vertices, ("n", 3))
        _set(self, "vertices", vertices)
        _set(self, "triangles", arrays.integers("triangles", self.triangles, ("T", 3), low=0, high=len(vertices) - 1))
        _set(self, "capsules", arrays.floats("capsules", self.capsules, ("c", 8)))
        if self.colors is not None:
            _set(self, "colors", arrays.floats("colors", self.colors, (len(vertices), 4), dtype=np.float32))


Element = Cloth | Strands | Balls | Boxes | Prop | Particles | SnowField | Puddle


def _set_rigid(bodies: Balls | Boxes) -> None:
    """Coerce what balls and boxes have alike: centers, velocities and colors."""
    centers = arrays.floats("centers", bodies.centers, ("n", 3))
    _set(bodies, "centers", centers)
    velocities = bodies.velocities if len(bodies.velocities) else np.zeros_like(centers)
    _set(bodies, "velocities", arrays.floats("velocities", velocities, centers.shape))
    if bodies.colors is not None:
        _set(bodies, "colors", arrays.floats("colors", bodies.colors, (len(centers), 4), dtype=np.float32))


def _set(value: object, name: str, field_value: object) -> None:
    object.__setattr__(value, name, field_value)
