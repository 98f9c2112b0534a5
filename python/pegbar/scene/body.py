"""The canonical markers, the limbs between them, and marks derived from others for formats that lack them."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.drawing import Limb

_SIDES = ("left", "right")
#: Canonical markers in the order in which drawings are annotated.
MARKERS = (
    "pelvis",
    "chest",
    "neck",
    "head",
    *(f"{side}_{joint}" for side in _SIDES for joint in ("shoulder", "elbow", "hand")),
    *(f"{side}_{joint}" for side in _SIDES for joint in ("hip", "knee", "foot")),
)
#: The ten limbs between them, without colours.
LIMBS = (
    Limb("torso", "neck", "pelvis"),
    Limb("head", "neck", "head"),
    *(
        Limb(f"{side}_{name}", f"{side}_{start}", f"{side}_{end}")
        for start, end, name in (("shoulder", "elbow", "upper_arm"), ("elbow", "hand", "forearm"))
        for side in _SIDES
    ),
    *(
        Limb(f"{side}_{name}", f"{side}_{start}", f"{side}_{end}")
        for start, end, name in (("hip", "knee", "thigh"), ("knee", "foot", "shin"))
        for side in _SIDES
    ),
)


#: What each canonical marker hangs on.
HANGS_ON = {
    "chest": "pelvis",
    "neck": "chest",
    "head": "neck",
    **{f"{side}_shoulder": "neck" for side in _SIDES},
    **{f"{side}_hip": "pelvis" for side in _SIDES},
    **{
        f"{side}_{outer}": f"{side}_{inner}"
        for side in _SIDES
        for chain in (("shoulder", "elbow", "hand"), ("hip", "knee", "foot", "toe"))
        for inner, outer in pairwise(chain)
    },
}


def bones_between(names: tuple[str, ...]) -> tuple[tuple[int, int], ...]:
    """Pairs of places in ``names``: each marker below the pelvis, and the nearest one there that it hangs on."""
    bones = []
    for index, name in enumerate(names):
        above = HANGS_ON.get(name)
        while above is not None and above not in names:
            above = HANGS_ON.get(above)
        if above is not None:
            bones.append((names.index(above), index))
    return tuple(bones)


def limbs_between(names: tuple[str, ...]) -> tuple[Limb, ...]:
    """Those of the ten limbs whose two markers are in ``names``."""
    return tuple(limb for limb in LIMBS if limb.start in names and limb.end in names)


def midpoint(points: Mapping[str, NDArray[np.float64]], first: str, second: str) -> NDArray[np.float64]:
    """The point between two marks (2,); NaN where either is."""
    middle: NDArray[np.float64] = (points[first] + points[second]) / 2
    return middle
