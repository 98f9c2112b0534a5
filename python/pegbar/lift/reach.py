"""Feet and hands that a posed skeleton holds in place: the two bones above them bend until they meet their targets."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.lift.pins import planted_targets
from pegbar.lift.turning import swing, unit
from pegbar.scene.motion import Motion

Floats = NDArray[np.float64]
#: The joints above each marker that can be held: where its limb begins, and where it bends.
CHAINS = {
    f"{side}_{end}": (f"{side}_{start}", f"{side}_{bend}")
    for side in ("left", "right")
    for end, start, bend in (("foot", "hip", "knee"), ("hand", "shoulder", "elbow"))
}
#: A limb stretches to this part of its length at most: quite straight, it would snap to and fro.
STRAIGHT = 0.9995


def stand_still(motion: Motion, standing: Mapping[str, ArrayLike], *, travel: ArrayLike | None = None) -> Motion:
    """Return ``motion`` with feet that do not slide while they stand.

    A foot stays where it is in the mean of each run of frames in which it stands, and is led there and away over four
    frames: thigh and shin bend for it, bones keep their lengths, the foot keeps its own rotation. Where a leg is too
    short for both its hip and that place, the body gives way.

    Parameters
    ----------
    motion : Motion
        A skeleton in motion, F frames.
    standing : dict of (F,) bool
        When "left_foot", "right_foot" (or a hand) stands.
    travel : (3,) float, optional
        The motion is a loop, which begins again so far from where it began, in metres: a foot that stands at its end
        stands on at its beginning.

    Returns
    -------
    Motion
        The same frames.

    Raises
    ------
    ValueError
        For a wrong shape, another name, or a motion without that limb.

    Examples
    --------
    >>> places = np.array([[[0.01 * f, 1, 0], [0.1 + 0.01 * f, 0.5, 0], [0.01 * f, 0, 0]] for f in range(3)])
    >>> names = ("left_hip", "left_knee", "left_foot")
    >>> leg = Motion(names, (-1, 0, 1), places, np.tile(np.eye(3), (3, 3, 1, 1)), 24.0)
    >>> stand_still(leg, {"left_foot": [True] * 3}).positions[:, 2].round(6).tolist()
    [[0.01, 0.0, 0.0], [0.01, 0.0, 0.0], [0.01, 0.0, 0.0]]
    """
    frames = len(motion.positions)
    stood = {name: arrays.flags(f"standing[{name}]", flags, (frames,)) for name, flags in standing.items()}
    stood = {name: flags for name, flags in stood.items() if flags.any()}
    if not stood:
        return motion
    shift = None if travel is None else arrays.floats("travel", travel, (3,))
    places = motion.markers(list(stood))
    flags = np.stack(list(stood.values()), axis=1)
    if shift is not None:
        # The loop before and the one after, so that runs go on over the seam.
        places = np.concatenate([places - shift, places, places + shift])
        flags = np.concatenate([flags] * 3)
    targets = planted_targets(places, flags, None)
    if shift is not None:
        targets = targets[frames : 2 * frames]
    return hold_ends(motion, dict(zip(stood, np.moveaxis(targets, 1, 0), strict=True)))


def hold_ends(motion: Motion, targets: Mapping[str, ArrayLike]) -> Motion:
    """Return ``motion`` (F frames) with feet or hands at ``targets``, (F, 3) metres each, NaN where they are free.

    Where a limb does not reach, the whole body is moved towards its target, as little as lets it reach.
    """
    frames = len(motion.positions)
    wanted = {
        name: arrays.floats(f"targets[{name}]", place, (frames, 3), allow="nan") for name, place in targets.items()
    }
    for name in wanted:
        if name not in CHAINS:
            raise ValueError(f"targets: {name!r} is none of {', '.join(CHAINS)}")
    chains = {name: _Chain.of(motion, name) for name in wanted}
    moved = motion.changed(positions=motion.positions + _giving_way(motion, chains, wanted)[:, None])
    positions, rotations = moved.positions.copy(), moved.rotations.copy()
    for name, chain in chains.items():
        there = np.isfinite(wanted[name]).all(axis=1)
        if there.any():
            end = moved.markers([name])[there, 0] - positions[there, chain.end]
            part_positions, part_rotations = positions[there], rotations[there]
            chain.bend(part_positions, part_rotations, wanted[name][there] - end)
            positions[there], rotations[there] = part_positions, part_rotations
    return moved.changed(positions=positions, rotations=rotations)


def _giving_way(motion: Motion, chains: Mapping[str, _Chain], wanted: Mapping[str, Floats]) -> Floats:
    """How far the body (F, 3) is moved so that every limb reaches its target."""
    shift = np.zeros((len(motion.positions), 3))
    for _ in range(8):
        for name, chain in chains.items():
            end = motion.markers([name])[:, 0] - motion.positions[:, chain.end]
            way = wanted[name] - end - motion.positions[:, chain.start] - shift
            distance = np.linalg.norm(way, axis=1)
            missing = distance - STRAIGHT * chain.reach(motion.positions)
            missing = np.where(np.isfinite(missing), np.maximum(missing, 0), 0)
            shift += (missing / np.where(distance > 0, distance, 1))[:, None] * np.nan_to_num(way)
    return shift


class _Chain:
    """Two bones: the joints where they start, bend and end, and which joints hang on each."""

    def __init__(self, start: int, bend: int, end: int, carried: tuple[NDArray[np.intp], ...]) -> None:
        self.start, self.middle, self.end = start, bend, end
        self.upper, self.lower, self.tail = carried

    @classmethod
    def of(cls, motion: Motion, name: str) -> _Chain:
        """The chain of the marker ``name``; ValueError where the skeleton has none."""
        joints = [motion.names.index(one) if one in motion.names else -1 for one in (*CHAINS[name], name)]
        for place, marker in enumerate((*CHAINS[name], name)):
            if joints[place] < 0:
                joint = motion.joint_map.get(marker)
                if joint is None:
                    raise ValueError(f"motion: it has no joint for {marker}, so {name} cannot be held")
                joints[place] = motion.names.index(joint)
        below = [_subtree(motion.parents, joint) for joint in joints]
        if not (joints[1] in below[0] and joints[2] in below[1]):
            raise ValueError(f"motion: {name} does not hang on {CHAINS[name][1]} and {CHAINS[name][0]}")
        upper, lower, tail = (np.array(sorted(part), dtype=np.intp) for part in _parts(below))
        return cls(joints[0], joints[1], joints[2], (upper, lower, tail))

    def reach(self, positions: Floats) -> Floats:
        """Both bones' lengths together (F,)."""
        a, b = self._bones(positions)
        length: Floats = np.linalg.norm(a, axis=1) + np.linalg.norm(b, axis=1)
        return length

    def bend(self, positions: Floats, rotations: Floats, target: Floats) -> None:
        """Bring the end joint to ``target`` (F, 3), in place; the bend stays in the plane and on the side it had."""
        first, second = self._bones(positions)
        start, knee = positions[:, self.start].copy(), positions[:, self.middle].copy()
        a, b = np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)
        way = target - start
        distance = np.clip(np.linalg.norm(way, axis=1), np.abs(a - b) + 1e-9, STRAIGHT * (a + b))
        along = unit(way)
        aside = _side(along, first, rotations[:, self.start])
        run = (a**2 - b**2 + distance**2) / (2 * distance)
        rise = np.sqrt(np.maximum(a**2 - run**2, 0))
        bent = start + run[:, None] * along + rise[:, None] * aside
        ended = start + distance[:, None] * along
        upper, lower = swing(first, bent - start), swing(second, ended - bent)
        _turn(positions, rotations, self.upper, (upper, start, start))
        _turn(positions, rotations, self.lower, (lower, knee, bent))
        positions[:, self.tail] += (ended - positions[:, self.end])[:, None]

    def _bones(self, positions: Floats) -> tuple[Floats, Floats]:
        knee = positions[:, self.middle]
        return knee - positions[:, self.start], positions[:, self.end] - knee


def _side(along: Floats, first: Floats, turns: Floats) -> Floats:
    """Units (F, 3) square to ``along`` in which the limb bends; a straight one as it bends in the nearest frame."""
    aside = first - np.sum(first * along, axis=1, keepdims=True) * along
    bent = np.linalg.norm(aside, axis=1) > 1e-4 * np.linalg.norm(first, axis=1)
    if bent.any() and not bent.all():
        frames = np.arange(len(bent))
        nearest = frames[bent][np.abs(frames[:, None] - frames[bent]).argmin(axis=1)]
        local = np.einsum("fji,fj->fi", turns[nearest], aside[nearest])
        carried = np.einsum("fij,fj->fi", turns, local)
        carried -= np.sum(carried * along, axis=1, keepdims=True) * along
        aside = np.where(bent[:, None], aside, carried)
    elif not bent.any():
        least = np.eye(3)[np.argmin(np.abs(along), axis=1)]
        aside = np.cross(along, least)
    return unit(aside)


def _turn(positions: Floats, rotations: Floats, joints: NDArray[np.intp], move: tuple[Floats, Floats, Floats]) -> None:
    """Turn ``joints`` by (F, 3, 3) about their old centre (F, 3), which comes to a new place."""
    turns, centre, place = move
    apart = positions[:, joints] - centre[:, None]
    positions[:, joints] = place[:, None] + np.einsum("fij,fnj->fni", turns, apart)
    rotations[:, joints] = turns[:, None] @ rotations[:, joints]


def _subtree(parents: tuple[int, ...], top: int) -> set[int]:
    below = {top}
    while more := {joint for joint, parent in enumerate(parents) if parent in below} - below:
        below |= more
    return below


def _parts(below: list[set[int]]) -> tuple[set[int], set[int], set[int]]:
    return below[0] - below[1], below[1] - below[2], below[2]
