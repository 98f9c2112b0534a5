"""What a drawn character gives to a simulation: joints in 3D, limb boxes and collision volumes, drawing by drawing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.volumes import TaperedCylinders

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Driving:
    """A drawn character in 3D for D drawings ``numbers``, N markers ``names`` and V limbs.

    ``markers`` (D, N, 2) in pixels are guessed where ``estimated`` (D, N); ``positions`` (D, N, 3) world metres, y up,
    project onto them under ``matrices`` (D, 3, 4). ``boxes``, ``given``, ``repaired`` and ``measured`` are those of
    `LimbBoxes`; ``ground`` is the floor's height or None; ``overlaps`` (D, 2) is how deep volumes of limbs that are not
    joined run into each other, before and after they were moved apart; ``notes`` say what a user should know.
    """

    numbers: tuple[int, ...]
    names: tuple[str, ...]
    limb_names: tuple[str, ...]
    limb_markers: NDArray[np.int64]
    image_size: tuple[int, int]
    matrices: Floats
    markers: Floats
    estimated: Flags
    positions: Floats
    boxes: Floats
    given: Flags
    repaired: Flags
    measured: Floats
    volumes: TaperedCylinders
    ground: float | None
    overlaps: Floats
    notes: tuple[str, ...] = ()
