"""Limbs whose depth is turned the other way by hand: what is drawn stays, what hangs on the limb moves along."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import DegenerateError

Floats = NDArray[np.float64]


def turn_limbs(
    markers: Floats,
    matrices: Floats,
    bones: Sequence[tuple[int, int]],
    flips: Sequence[tuple[int, int, int]],
    names: Sequence[str] | None = None,
) -> Floats:
    """Return ``markers`` (F, N, 3) with limbs pointing as far towards the camera as they pointed away, or back.

    Every marker stays on its ray of sight under ``matrices`` (F, 3, 4), whose third rows have length 1 as in
    `back_project`. ``bones`` are pairs (parent, child), ``flips`` (bone, first frame, one past the last).
    DegenerateError, with ``names``, where a marker would come behind the camera.
    """
    if not flips:
        return markers
    axes, centres = matrices[:, 2, :3], -np.linalg.solve(matrices[:, :, :3], matrices[:, :, 3:])[..., 0]
    depths = np.einsum("fi,fni->fn", axes, markers) + matrices[:, 2, 3:]
    turned = depths.copy()
    for bone, start, stop in flips:
        parent, child = bones[bone]
        part = slice(start, stop)
        step = -2 * (turned[part, child] - turned[part, parent])
        turned[part, _below(bones, child)] += step[:, None]
    behind = np.argwhere(turned <= 0)
    if len(behind):
        frame, marker = behind[0].tolist()
        label = names[marker] if names is not None else f"marker {marker}"
        raise DegenerateError(f"flips: drawing {frame + 1} of the sequence: {label} would come behind the camera")
    places: Floats = centres[:, None] + (turned / depths)[..., None] * (markers - centres[:, None])
    return places


def _below(bones: Sequence[tuple[int, int]], top: int) -> list[int]:
    found = [top]
    for marker in found:
        found += [child for parent, child in bones if parent == marker and child not in found]
    return found
