"""Moves strands out of limbs where Blender left them: its cloth meets surfaces, and what is behind one stays there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.simulate.elements import Prop, Strands
from pegbar.simulate.measures import free_of, to_pins
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.tracks import Volumes

Floats = NDArray[np.float64]
#: Rounds of moving points out and links back to their lengths, and the distance (metres) by which slopes are measured.
ROUNDS, STEP = 12, 1e-5


def clear_of_volumes(scene: SimulationScene, strands: Strands, positions: Floats) -> Floats:
    """Return ``positions`` (F, n, 3) with what lies in limbs and props moved to their surface, links kept in length.

    Next to a pin that lies in a volume, as in a hand, strands may lie in it as deep as the way from the pin explains.
    """
    props = [element for element in scene.elements if isinstance(element, Prop)]
    volumes = Volumes(scene, props).at(np.arange(scene.frames, dtype=float))
    if not volumes.shape[1]:
        return positions
    links, free = strands.links, free_of(strands.pins, len(strands.points))
    pins, metres = to_pins(links, strands.link_lengths[links[:, 0]], free)
    radii, cleared = strands.radii[strands.strand_of], positions.copy()
    for places, rows in zip(cleared, volumes, strict=True):
        capsules = np.ascontiguousarray(rows)
        held = radii - _distances(places[pins], capsules) - metres
        clear = radii - np.maximum(held, 0.0)
        near = free & (_distances(places, capsules) < clear)
        if not near.any():
            continue
        # Only strands that lie in something are touched.
        moved = free & np.isin(strands.strand_of, strands.strand_of[near])
        parts = links[moved[links].any(axis=1)]
        lengths = np.linalg.norm(places[parts[:, 0]] - places[parts[:, 1]], axis=1)
        for _ in range(ROUNDS):
            _keep_lengths(places, parts, lengths, moved)
            _move_out(places, parts, moved, clear, capsules)
    return cleared


def _distances(places: Floats, capsules: Floats) -> Floats:
    """Metres from ``places`` (n, 3) to the nearest of the ``capsules`` (C, 8), negative inside."""
    return np.asarray(_kernels.capsule_distances(np.ascontiguousarray(places), capsules)[0])


def _move_out(
    places: Floats, links: NDArray[np.int64], moved: NDArray[np.bool_], clear: Floats, capsules: Floats
) -> None:
    """Move those of ``moved`` that are nearer than ``clear`` (n,) away from the surface, and links by their middles."""
    index = np.flatnonzero(moved)
    places[index] += _way_out(places[index], clear[index], capsules)
    first, second = links.T
    # A link whose ends are clear may still pass through a limb.
    way = _way_out((places[first] + places[second]) / 2, np.minimum(clear[first], clear[second]) / 2, capsules)
    for end in (first, second):
        np.add.at(places, end, moved[end, None] * way)


def _way_out(places: Floats, clear: Floats, capsules: Floats) -> Floats:
    """The way (n, 3) that takes ``places`` (n, 3) to the distance ``clear`` (n,): up the slope of the distance."""
    missing = clear - _distances(places, capsules)
    way, near = np.zeros_like(places), missing > 0
    sides = [_distances(places[near] + STEP * axis, capsules) for axis in (*np.eye(3), *-np.eye(3))]
    slope = np.stack([sides[axis] - sides[axis + 3] for axis in range(3)], axis=1)
    way[near] = missing[near, None] * slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-12)
    return way


def _keep_lengths(places: Floats, links: NDArray[np.int64], lengths: Floats, moved: NDArray[np.bool_]) -> None:
    """Bring links to their ``lengths``, every second one first: no two of a half share a point."""
    for half in (0, 1):
        chosen = links[:, 0] % 2 == half
        first, second = links[chosen].T
        way = places[second] - places[first]
        size = np.linalg.norm(way, axis=1)
        weights = moved[first].astype(float), moved[second].astype(float)
        share = (size - lengths[chosen]) / np.maximum(size, 1e-12) / np.maximum(weights[0] + weights[1], 1.0)
        places[first] += (weights[0] * share)[:, None] * way
        places[second] -= (weights[1] * share)[:, None] * way
