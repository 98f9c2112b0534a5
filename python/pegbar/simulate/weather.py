"""What falls: flakes and drops, as elements of a simulation."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pegbar import arrays
from pegbar.simulate.materials import Look, check

Floats = NDArray[np.float64]
SHAPES = ("flake", "streak")
#: Most particles in the air at once.
MOST = 200_000


@dataclass(frozen=True)
class ParticleMaterial:
    """How particles fall, and what they do where they touch something.

    ``radius`` is in metres and ``spread`` the share by which radii differ; ``terminal_velocity`` (m/s) is what they
    reach in calm air under 9.81 m/s^2; ``flutter`` (m/s) is how fast they sway, ``flutter_rate`` how often a second.
    ``stick`` is the share that stays lying where a surface looks up, for ``settle`` seconds, and melts; ``run_off`` the
    share that slides off. The others splash into ``splash`` droplets, which fly off with the share ``splash_speed`` of
    the impact's speed and last ``splash_life`` seconds. ``lifetime`` is how long one falls or slides, in seconds.
    """

    radius: float = 0.008
    spread: float = 0.4
    terminal_velocity: float = 1.0
    flutter: float = 0.0
    flutter_rate: float = 0.5
    stick: float = 0.0
    run_off: float = 1.0
    settle: float = 5.0
    splash: int = 0
    splash_speed: float = 0.25
    splash_life: float = 0.3
    lifetime: float = 60.0

    def __post_init__(self) -> None:
        check(
            self,
            positive=("radius", "terminal_velocity", "settle", "splash_life", "lifetime"),
            not_negative=("spread", "flutter", "flutter_rate", "stick", "run_off", "splash_speed"),
        )
        if self.spread >= 1:
            raise ValueError(f"spread: want less than 1, got {self.spread}")
        if self.stick + self.run_off > 1 + 1e-9:
            raise ValueError(f"stick: want at most 1 together with run_off, got {self.stick} and {self.run_off}")
        if not isinstance(self.splash, int) or not 0 <= self.splash <= 64:
            raise ValueError(f"splash: want 0 to 64 droplets, got {self.splash!r}")


@dataclass(frozen=True, eq=False)
class Particles:
    """Flakes or drops that fill the air of a box and fall through it.

    Parameters
    ----------
    name : str
        Unique in the scene.
    low, high : (3,) float
        Corners of the box, world metres. Particles enter by the sides that gravity and wind come from, as many as
        leave, so that the air is equally full; it is full in the first frame.
    count : int
        How many are in the air of the box. With 0 there are only those of a puddle that throws its drops up as
        these (``Puddle.drops``).
    material
        How they fall and what they do where they touch something.
    look
        Its ``color`` is theirs.
    shape : str
        "flake": discs turned to the camera, or "streak": streaks along the way that they go while the shutter is open
        (half a frame).
    """

    name: str
    low: Floats
    high: Floats
    count: int
    material: ParticleMaterial = field(default_factory=ParticleMaterial)
    look: Look = field(default_factory=Look)
    shape: str = "flake"

    def __post_init__(self) -> None:
        for what in ("low", "high"):
            object.__setattr__(self, what, arrays.floats(what, getattr(self, what), (3,)))
        if not (self.high > self.low).all():
            raise ValueError(f"high: want a corner beyond low {self.low.tolist()}, got {self.high.tolist()}")
        if not isinstance(self.count, int | np.integer) or not 0 <= self.count <= MOST:
            raise ValueError(f"count: want 0 to {MOST} particles, got {self.count!r}")
        if self.shape not in SHAPES:
            raise ValueError(f"shape: want one of {', '.join(SHAPES)}, got {self.shape!r}")

    def stream(self, gravity: Floats, wind: Floats) -> Floats:
        """Return the velocity (3,) in m/s with which they fall in a steady ``wind`` (3,) under ``gravity`` (3,)."""
        pull = float(np.linalg.norm(gravity))
        fall = gravity / pull * self.material.terminal_velocity * math.sqrt(pull / 9.81) if pull else np.zeros(3)
        together: Floats = wind + fall
        return together

    def rates(self, stream: Floats) -> Floats:
        """Return how many a second (3,) enter across the x, y and z sides so that ``count`` stay in the box."""
        size = self.high - self.low
        flux: Floats = np.abs(stream) * self.count / size
        return flux
