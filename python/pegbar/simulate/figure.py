"""What presets measure on a character: limbs by their markers, its height, how far its volumes reach."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.simulate.scene import Character
from pegbar.simulate.tracks import filled

Floats = NDArray[np.float64]
#: Markers of the trunk and the legs: what a skirt goes round.
LOWER_BODY = frozenset(
    {"pelvis", "chest", "neck"} | {f"{side}_{joint}" for side in ("left", "right") for joint in ("hip", "knee", "foot")}
)


def marker(character: Character, name: str) -> Floats:
    """Return the track (F, 3) of a marker, filled over time; ValueError where the character has none or never."""
    if name not in character.marker_names:
        raise ValueError(f"{character.name}: no marker {name!r}: there are {', '.join(character.marker_names)}")
    track = filled(character.markers[:, character.marker_names.index(name)])
    if np.isnan(track).any():
        raise ValueError(f"{character.name}: marker {name!r} is missing in all frames")
    return track


def limb_between(character: Character, first: str, second: str) -> int:
    """Return the index of the limb between two markers; ValueError where there is none.

    Without the limbs' markers it is the limb whose ends are nearest to the two over time.
    """
    if character.limb_markers is not None:
        for index, ends in enumerate(character.limb_markers):
            if set(ends) == {first, second}:
                return index
        raise ValueError(f"{character.name}: no limb from {first} to {second}")
    here, there = (marker(character, name)[:, None] for name in (first, second))
    start, end = filled(character.volumes.start), filled(character.volumes.end)
    gaps = [
        np.linalg.norm(a - here, axis=2) + np.linalg.norm(b - there, axis=2) for a, b in ((start, end), (end, start))
    ]
    mean = np.minimum(*gaps).mean(axis=0)
    if not mean.size or not np.isfinite(mean).any():
        raise ValueError(f"{character.name}: no limb from {first} to {second}")
    return int(np.nanargmin(mean))


def body_height(character: Character) -> float:
    """Return the character's height in metres: the median length of its chain from foot to head, else its extent."""
    total = 0.0
    chain = (("pelvis", "neck"), ("neck", "head"), *((f"left_{a}", f"left_{b}") for a, b in _LEG))
    try:
        for first, second in chain:
            lengths = np.linalg.norm(marker(character, first) - marker(character, second), axis=1)
            total += float(np.median(lengths))
    except ValueError:
        return character.height
    # Above the head's middle and below the ankle there is about a tenth more.
    return 1.1 * total


def reaches(
    character: Character, frame: int, origins: Floats, outward: Floats, farthest: float
) -> tuple[Floats, Floats]:
    """How far the body reaches from ``origins`` (n, 3) along unit ``outward`` (n, 3), in ``frame``.

    Looked at are distances up to ``farthest``. Returned are the outermost point of trunk and legs (n,), 0 where there
    is nothing, and beyond it the nearest point of anything else (n,), ``farthest`` where there is nothing.
    """
    rows, lower = _rows(character, frame)
    steps = np.linspace(0, farthest, 161)
    points = (origins[:, None] + steps[:, None] * outward[:, None]).reshape(-1, 3)
    inside = [_inside(points, rows[chosen]).reshape(len(origins), -1) for chosen in (lower, ~lower)]
    # The first step that is clear, so that the body ends before it.
    last = len(steps) - 1 - inside[0][:, ::-1].argmax(axis=1)
    outer = np.where(inside[0].any(axis=1), steps[np.minimum(last + 1, len(steps) - 1)], 0.0)
    others = inside[1] & (steps > outer[:, None])
    return outer, np.where(others.any(axis=1), steps[others.argmax(axis=1)], farthest)


def capsules_of(character: Character, frame: int) -> Floats:
    """Return the character's capsules (C, 8) in ``frame``; limbs that are never known are left out."""
    return _rows(character, frame)[0]


def _rows(character: Character, frame: int) -> tuple[Floats, NDArray[np.bool_]]:
    volumes = character.volumes
    parts = (volumes.start, volumes.start_radius[..., None], volumes.end, volumes.end_radius[..., None])
    rows = filled(np.concatenate(parts, axis=2))[frame]
    known = ~np.isnan(rows).any(axis=1)
    lower = np.array([_is_lower(ends) for ends in _limb_ends(character)], bool)
    return np.ascontiguousarray(rows[known]), lower[known]


def _limb_ends(character: Character) -> Iterable[tuple[str, ...]]:
    if character.limb_markers is not None:
        return character.limb_markers
    words = {"torso": "pelvis", "thigh": "left_knee", "shin": "left_foot"}
    return [tuple(joint for word, joint in words.items() if word in name) for name in character.limb_names]


def _is_lower(ends: tuple[str, ...]) -> bool:
    return bool(ends) and set(ends) <= LOWER_BODY


def _inside(points: Floats, capsules: Floats) -> NDArray[np.bool_]:
    inside: NDArray[np.bool_] = _kernels.capsule_distances(np.ascontiguousarray(points), capsules)[0] < 0
    return inside


_LEG = (("hip", "knee"), ("knee", "foot"))
