"""Joint centres from optical markers: Plug-in-Gait and CMU sets, by the usual midpoints.

The hip joint is at 36 % of the distance between the front pelvis markers to the side of their middle, 19 % of it
behind and 30 % below (Bell, Brand and Pedersen 1989), in the pelvis' own axes. Knees, elbows and ankles are the middle
of the lateral and the medial marker, or the lateral one where it is alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pegbar.scene.joint_names import compact

Floats = NDArray[np.float64]

_FRONT = (("lasi", "rasi"), ("lasis", "rasis"), ("lfwt", "rfwt"))
_BACK = (("lpsi", "rpsi"), ("lpsis", "rpsis"), ("lbwt", "rbwt"), ("sacr",))
_WRIST = (("{}wra", "{}wrb"), ("{}rad", "{}uln"))
_MIDDLES: dict[str, tuple[tuple[str, ...], ...]] = {
    "head": (("lfhd", "rfhd", "lbhd", "rbhd"), ("lfhd", "rfhd")),
    "neck": (("c7", "clav"), ("c7",), ("clav",)),
    "chest": (("strn", "t10"), ("t10",), ("strn",)),
}
#: For one side, "{}" its letter; the first whose markers are all there.
_SIDED: dict[str, tuple[tuple[str, ...], ...]] = {
    "shoulder": (("{}sho",),),
    "elbow": (("{}elb", "{}elbm"), ("{}elb", "{}mel"), ("{}elb", "{}ieb"), ("{}elb",)),
    "wrist": (*_WRIST, ("{}wra",), ("{}wrb",)),
    "knee": (("{}kne", "{}knm"), ("{}kne", "{}kneem"), ("{}kne", "{}mkne"), ("{}kne", "{}knem"), ("{}kne",)),
    "foot": (("{}ank", "{}med"), ("{}ank", "{}ankm"), ("{}ank", "{}mank"), ("{}ank",)),
    "toe": (("{}toe",),),
}


def joint_centres(labels: Sequence[str], positions: Floats) -> dict[str, Floats]:
    """Return marker -> joint centres (F, 3) of those canonical markers that ``labels`` give; NaN where one is missing.

    ``positions`` (F, J, 3) belong to ``labels``. Empty for what is no optical marker set (no pelvis and knees).
    """
    places: dict[str, int] = {}
    for place, label in enumerate(labels):
        places.setdefault(compact(label), place)
    front, back = _first(places, _FRONT), _first(places, _BACK)
    if not front or not back or "lkne" not in places:
        return {}
    found = {marker: _first(places, several) for marker, several in _MIDDLES.items()}
    for side in ("left", "right"):
        for joint, several in _SIDED.items():
            found[f"{side}_{joint}"] = _first(places, [tuple(w.format(side[0]) for w in words) for words in several])
    centres = {marker: positions[:, where].mean(axis=1) for marker, where in found.items() if where}
    for side in ("left", "right"):
        knuckle, wrist = places.get(f"{side[0]}fin"), centres.get(f"{side}_wrist")
        if knuckle is not None and wrist is not None:
            centres[f"{side}_hand"] = (wrist + positions[:, knuckle]) / 2
        elif wrist is not None:
            centres[f"{side}_hand"] = wrist
    left, right = positions[:, front[0]], positions[:, front[1]]
    behind = positions[:, back].mean(axis=1)
    # One sacral marker weighs as much as both front ones, as two back markers do.
    centres["pelvis"] = ((left + right) / 2 + behind) / 2
    centres["left_hip"], centres["right_hip"] = _hips(left, right, behind)
    return centres


def _first(places: Mapping[str, int], several: Sequence[Sequence[str]]) -> list[int]:
    return next(([places[word] for word in words] for words in several if all(word in places for word in words)), [])


def _hips(left: Floats, right: Floats, behind: Floats) -> tuple[Floats, Floats]:
    middle, across = (left + right) / 2, left - right
    width = np.linalg.norm(across, axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        across = across / width
        back = behind - middle
        back -= (back * across).sum(axis=1, keepdims=True) * across
        back /= np.linalg.norm(back, axis=1, keepdims=True)
        down = np.cross(back, across)
        below = middle + width * (0.19 * back + 0.30 * down)
        return below + 0.36 * width * across, below - 0.36 * width * across
