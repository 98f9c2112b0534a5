"""How far points in space are from the dancer: her limbs as tapered capsules, the skirt and the pony tail as well."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pegbar.sample.figure import LIMBS, RADII, Pose, skirt_axis
from pegbar.sample.skeleton import Floats


class Capsules(NamedTuple):
    """Tapered capsules: two ends (n, 3) and the radius at each (n,), metres."""

    starts: Floats
    ends: Floats
    start_radii: Floats
    end_radii: Floats


def capsules(pose: Pose) -> Capsules:
    """The body as drawn."""
    rows = []
    for limb in LIMBS:
        kind = limb.name.removeprefix("left_").removeprefix("right_")
        rows.append((pose.at(limb.start), pose.at(limb.end), *RADII[kind]))
    rows.append((*skirt_axis(pose), 0.11, 0.25))
    rows += [(pose.at(f"{side}_shoulder"), pose.at("chest"), 0.05, 0.13) for side in ("left", "right")]
    rows += [(a, b, 0.05, 0.05) for a, b in zip(pose.tail, pose.tail[1:], strict=False)]
    starts, ends, first, last = zip(*rows, strict=True)
    return Capsules(np.array(starts), np.array(ends), np.array(first), np.array(last))


def distance(points: Floats, body: Capsules) -> tuple[Floats, Floats]:
    """Return the distances (n,) of ``points`` (n, 3) from the body's surface, and the directions (n, 3) away from it.

    Measured from the nearest point of each axis with the radius there; negative inside.
    """
    axis = body.ends - body.starts
    place = np.einsum("nmk,mk->nm", points[:, None] - body.starts, axis) / np.maximum((axis**2).sum(axis=1), 1e-12)
    place = np.clip(place, 0, 1)
    away = points[:, None] - (body.starts + place[..., None] * axis)
    length = np.linalg.norm(away, axis=2)
    gaps = length - (body.start_radii + place * (body.end_radii - body.start_radii))
    nearest = gaps.argmin(axis=1)
    rows = np.arange(len(points))
    directions = away[rows, nearest] / np.maximum(length[rows, nearest], 1e-9)[:, None]
    return gaps[rows, nearest], directions
