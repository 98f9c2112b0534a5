"""What elements are made of and what they look like; the wind."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays

Color = tuple[float, float, float, float]
PATTERNS = ("plain", "stripes", "bands", "checks", "dots")


@dataclass(frozen=True, eq=False)
class Look:
    """Colours and pattern of an element's surface.

    Colours are straight linear RGBA. ``pattern`` is drawn in ``second`` over ``color``: "stripes" run along the cloth,
    "bands" across it, then "checks" and "dots"; ``pattern_size`` is its period in metres. ``back`` colours the side
    that looks against the triangles' turning sense (None: as the front). ``texture`` (h, w, 4) uint8, straight sRGB,
    takes the pattern's place; it is laid once over texture coordinates from 0 to 1.
    """

    color: Color = (0.8, 0.1, 0.1, 1.0)
    second: Color = (1.0, 0.9, 0.6, 1.0)
    pattern: str = "plain"
    pattern_size: float = 0.1
    back: Color | None = None
    texture: NDArray[np.uint8] | None = None

    def __post_init__(self) -> None:
        for name in ("color", "second", "back"):
            if getattr(self, name) is not None:
                color = arrays.floats(name, getattr(self, name), (4,))
                if not 0 <= color[3] <= 1:
                    raise ValueError(f"{name}: want alpha in 0..1, got {color[3]}")
                object.__setattr__(self, name, tuple(color.tolist()))
        if self.pattern not in PATTERNS:
            raise ValueError(f"pattern: want one of {', '.join(PATTERNS)}, got {self.pattern!r}")
        check(self, positive=("pattern_size",))
        if self.texture is not None:
            object.__setattr__(self, "texture", arrays.image("texture", self.texture, (4,)))


@dataclass(frozen=True)
class ClothMaterial:
    """What a cloth is made of.

    ``density`` is in kg per square metre, ``thickness`` (metres) is kept clear of volumes, ``stretch`` is the share of
    its length by which a strip grows under a pull of 10 N per metre of width, ``bend`` how stiff it is against
    folding (0 limp silk to 1 felt), ``friction`` acts on volumes and ground, ``damping`` is the share of motion
    against its surroundings that is lost in a second, ``drag`` how strongly air holds it (0 none, 1 a plate of its
    size).
    """

    density: float = 0.15
    thickness: float = 0.006
    stretch: float = 0.002
    bend: float = 0.1
    friction: float = 0.3
    damping: float = 0.3
    drag: float = 1.0

    def __post_init__(self) -> None:
        check(self, positive=("density", "thickness"), not_negative=("stretch", "bend", "friction", "damping", "drag"))


@dataclass(frozen=True)
class StrandMaterial:
    """What strands are made of.

    ``density`` is in kg per cubic metre (cotton and hemp 600 to 1400), ``bend`` the bending stiffness E I in newton
    metre squared (a cotton string 1e-6, a rope of 1 cm 1e-3; 0: none), ``stretch`` the share of its length by which a
    strand grows under a pull of 10 N, ``friction`` acts on volumes and ground, ``damping`` is the share of motion
    against its surroundings that is lost in a second, ``drag`` how strongly air holds it (0 none, 1 a round bar and a
    ball).
    """

    density: float = 800.0
    bend: float = 0.0
    stretch: float = 0.0
    friction: float = 0.3
    damping: float = 0.3
    drag: float = 1.0

    def __post_init__(self) -> None:
        check(self, positive=("density",), not_negative=("bend", "stretch", "friction", "damping", "drag"))


@dataclass(frozen=True)
class RigidMaterial:
    """What a rigid body is made of: ``density`` in kg per cubic metre, ``friction``, ``bounce`` 0 (dead) to 1.

    ``damping`` is the share of motion that is lost in a second.
    """

    density: float = 60.0
    friction: float = 0.5
    bounce: float = 0.5
    damping: float = 0.1

    def __post_init__(self) -> None:
        check(self, positive=("density",), not_negative=("friction", "bounce", "damping"))
        if self.bounce > 1:
            raise ValueError(f"bounce: want 0 to 1, got {self.bounce}")


@dataclass(frozen=True)
class Wind:
    """Moving air: ``velocity`` in m/s, and gusts that travel with it.

    ``gusts`` is the share of the speed by which it swells and falls, ``size`` the length in metres of a gust, ``seed``
    makes its waves: the same seed gives the same air.
    """

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gusts: float = 0.5
    size: float = 1.5
    seed: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "velocity", tuple(arrays.floats("velocity", self.velocity, (3,)).tolist()))
        check(self, positive=("size",), not_negative=("gusts",))

    def waves(self) -> NDArray[np.float64]:
        """Plane waves (K, 8) of air: velocity amplitude (3), wave vector (3) in 1/m, rate in 1/s, phase.

        The air at point x and time t is ``velocity`` plus the sum of amplitude * sin(vector . x - rate * t + phase).
        """
        speed = float(np.linalg.norm(self.velocity))
        if speed == 0 or self.gusts == 0:
            return np.empty((0, 8))
        rng, along = np.random.default_rng(self.seed), np.array(self.velocity) / speed
        rows = []
        for octave in range(4):
            length = self.size * 2.0 ** (1 - octave)
            vector = along + 0.5 * rng.standard_normal(3)
            vector *= 2 * np.pi / length / np.linalg.norm(vector)
            push = along + 0.5 * rng.standard_normal(3)
            amplitude = push * (self.gusts * speed * 0.6 * 0.75**octave / np.linalg.norm(push))
            rows.append([*amplitude, *vector, float(vector @ self.velocity), rng.uniform(0, 2 * np.pi)])
        return np.array(rows)


def check(value: Any, *, positive: tuple[str, ...] = (), not_negative: tuple[str, ...] = ()) -> None:
    """Refuse fields that are no finite numbers above zero, or of zero and more; ValueError names the field."""
    known = {field.name for field in fields(value)}
    for name in (*positive, *not_negative):
        number = getattr(value, name)
        assert name in known
        if not (isinstance(number, int | float) and math.isfinite(number) and number >= 0):
            raise ValueError(f"{name}: want a finite number of zero or more, got {number!r}")
        if name in positive and number == 0:
            raise ValueError(f"{name}: want a number above zero, got {number!r}")


def positive(name: str, value: ArrayLike, shape: arrays.Shape) -> NDArray[np.float64]:
    """Return ``value`` as float64 of ``shape``, all above zero; ValueError names the argument."""
    values: NDArray[np.float64] = arrays.floats(name, value, shape)
    if values.size and values.min() <= 0:
        raise ValueError(f"{name}: want numbers above zero, got {values.min()}")
    return values
