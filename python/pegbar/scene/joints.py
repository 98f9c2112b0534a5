"""Finds the canonical markers among a file's joints: by their names first, then by the skeleton's shape."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from pegbar import arrays
from pegbar.scene.body import MARKERS
from pegbar.scene.joint_names import MIDDLE, SIDED, SPINE, words
from pegbar.scene.topology import body_by_shape

_SIDES = ("left", "right")
#: Markers that a drawing need not have, found where a skeleton has them.
EXTRA = tuple(f"{side}_{joint}" for side in _SIDES for joint in ("collar", "wrist", "toe"))
# How like a marker's name a misspelt one is: two exchanged letters of nine, and not `left_hand_tip`.
_ALIKE = 0.85


def map_joints(
    names: Sequence[str], parents: Sequence[int] | None = None, *, rest: ArrayLike | None = None
) -> dict[str, str]:
    """Return the canonical markers that a skeleton has: marker -> the file's joint.

    Names of CMU (BVH in both namings, ASF), Mixamo, HumanIK, Rokoko, MakeHuman, ACCAD, AnimatedDrawings, VRM, Unreal,
    Blender's Rigify, 3ds Max's Biped, Xsens, SMPL and the like are known, with any prefix and in any case. A name
    stands for the joint about which its bone turns: CMU's ``lfemur`` is the hip. What has no known name is found by the
    skeleton's shape. Of optical markers (Plug-in-Gait, CMU) the nearest one is named; `Motion.markers` takes midpoints
    of several instead.

    Parameters
    ----------
    names : sequence of str
        The file's joints.
    parents : sequence of int, optional
        Each joint's parent or -1. Without, or with several roots, only names count.
    rest : (J, 3) float, optional
        Positions of the joints in a rest pose, in any unit and with any axis up: they tell left from right and limbs
        from twist bones where names do not. Without, the first limb of a pair without names is called left.

    Returns
    -------
    dict of str to str
        In the order of `pegbar.scene.body.MARKERS`, then collars, wrists and toes. What is not found is not in it.

    Raises
    ------
    ValueError
        When ``parents`` or ``rest`` do not fit ``names``.

    Examples
    --------
    >>> map_joints(["mixamorig:Hips", "mixamorig:LeftUpLeg", "mixamorig:LeftLeg", "mixamorig:LeftFoot"])
    {'pelvis': 'mixamorig:Hips', 'left_hip': 'mixamorig:LeftUpLeg', 'left_knee': 'mixamorig:LeftLeg', \
'left_foot': 'mixamorig:LeftFoot'}
    """
    names = [str(name) for name in names]
    found = _by_name(words(names), parents)
    if parents is not None:
        count = len(names)
        tree = [int(parent) for parent in arrays.integers("parents", list(parents), (count,), low=-1, high=count - 1)]
        positions = None if rest is None else arrays.floats("rest", rest, (count, 3))
        _fill(found, body_by_shape(tree, positions), tree)
    return {marker: names[found[marker]] for marker in (*MARKERS, *EXTRA) if marker in found}


def _by_name(known: Mapping[tuple[str, str], int], parents: Sequence[int] | None) -> dict[str, int]:
    """Marker -> joint by the words of each marker, the best word first."""
    found: dict[str, int] = {}
    for marker, several in MIDDLE.items():
        _first(found, marker, known, "", several)
    for side in _SIDES:
        for joint, several in SIDED.items():
            taken = {found.get(f"{side}_{other}") for other in ("shoulder", "hand", "foot")}
            free = {key: place for key, place in known.items() if place not in taken}
            _first(found, f"{side}_{joint}", free, side, several)
        _swap_lone_leg(found, side, known)
        _optical(found, side, known)
    _chest(found, known, parents)
    return found


def _first(
    found: dict[str, int], marker: str, known: Mapping[tuple[str, str], int], side: str, several: Sequence[str]
) -> None:
    for word in several:
        if (side, word) in known:
            found[marker] = known[side, word]
            return


def _swap_lone_leg(found: dict[str, int], side: str, known: Mapping[tuple[str, str], int]) -> None:
    """HumanIK's "LeftLeg" is the shin; in a skeleton without a word for the thigh it is the thigh."""
    leg = known.get((side, "leg"))
    if leg is not None and f"{side}_hip" not in found:
        found[f"{side}_hip"] = leg
        if found[f"{side}_knee"] == leg:
            del found[f"{side}_knee"]


def _optical(found: dict[str, int], side: str, known: Mapping[tuple[str, str], int]) -> None:
    """The nearest single marker of an optical set, for what it has only several of."""
    for marker, word in (("head", "fhd"), ("pelvis", "psi"), ("pelvis", "bwt")):
        if marker not in found and (side, word) in known:
            found[marker] = known[side, word]


def _chest(found: dict[str, int], known: Mapping[tuple[str, str], int], parents: Sequence[int] | None) -> None:
    """The chest is where arms and neck leave the spine; by names alone the uppermost joint of the spine."""
    spine = [
        place
        for word in SPINE
        for number in (*range(9, -1, -1), "")
        for digits in (f"{number:02}" if number != "" else "", str(number))
        if (place := known.get(("", f"{word}{digits}"))) is not None
    ]
    if ("left", "upperarm01") in known or ("right", "upperarm01") in known:
        spine = spine[::-1]  # MakeHuman counts its spine from the neck downwards
    _rigify(found, known)
    if "chest" not in found and spine:
        found["chest"] = spine[0]
    tops = [found[name] for name in ("neck", "left_shoulder", "right_shoulder") if name in found]
    if parents is None or len(tops) < 3:
        return
    shared = [joint for joint in _ancestors(tops[0], parents) if all(joint in _ancestors(top, parents) for top in tops)]
    if shared and shared[0] not in (found.get("pelvis"), *tops) and parents[shared[0]] >= 0:
        found["chest"] = shared[0]


def _rigify(found: dict[str, int], known: Mapping[tuple[str, str], int]) -> None:
    """Blender's Rigify calls everything from the hips to the skull "spine"."""
    if ("", "spine006") in known:
        for marker, word in (("pelvis", "spine"), ("chest", "spine003"), ("neck", "spine004"), ("head", "spine006")):
            if marker not in found and ("", word) in known:
                found[marker] = known["", word]


def _ancestors(joint: int, parents: Sequence[int]) -> list[int]:
    """``joint`` and what it hangs from, upwards; a circle is walked once."""
    way: list[int] = []
    while joint >= 0 and joint not in way and joint < len(parents):
        way.append(joint)
        joint = parents[joint]
    return way


def _fill(found: dict[str, int], shape: Mapping[str, int], parents: Sequence[int]) -> None:
    """Add to ``found`` what only the skeleton's shape tells, on the sides that names have told."""
    sides = np.array([[_votes(found, shape, parents, own, other) for other in _SIDES] for own in _SIDES])
    swapped = sides[0, 0] + sides[1, 1] < sides[0, 1] + sides[1, 0]
    for marker, joint in shape.items():
        side, _, rest = marker.partition("_")
        name = f"{_SIDES[1 - _SIDES.index(side)]}_{rest}" if rest and swapped else marker
        if name not in found and joint not in found.values():
            found[name] = joint


def _votes(found: Mapping[str, int], shape: Mapping[str, int], parents: Sequence[int], own: str, other: str) -> int:
    """How many joints that are called ``own`` by name hang on the limbs that the shape calls ``other``."""
    tops = {shape.get(f"{other}_hip", -1), shape.get(f"{other}_shoulder", -1)} - {-1}
    named = [joint for marker, joint in found.items() if marker.startswith(own)]
    return sum(bool(tops & set(_ancestors(joint, parents))) for joint in named)


def misspelt_markers(names: Sequence[str], known: Iterable[str] = ()) -> dict[str, str]:
    """Return those of ``names`` that seem to be misspelt markers, each with the marker that it is nearest to.

    ``known`` are further names that are right, like a clip's own joints; markers that are named already are not meant.
    """
    right = {*MARKERS, *EXTRA, *known}
    free = [marker for marker in MARKERS if marker not in names]
    found = {}
    for name in names:
        if name not in right and (near := difflib.get_close_matches(name.lower(), free, 1, _ALIKE)):
            found[name] = near[0]
    return found
