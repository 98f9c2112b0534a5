"""Finds a body in a skeleton by its shape alone: two legs from the pelvis, two arms and a neck from the chest.

Legs are two equally deep branches of one joint from which the spine rises too; arms are such a pair farther up the
spine. With rest positions a limb's upper joint is where its two longest bones begin, and left is to the left of where
the feet point; without them limbs are counted from the body outwards, and the first in the file is called left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
#: A limb has at least so many joints: hip, knee, foot; shoulder, elbow, hand.
_LIMB = 3


@dataclass(frozen=True)
class _Tree:
    """Children, heights (joints on the longest way down) and sizes of every joint, and rest positions if known."""

    children: list[list[int]]
    height: list[int]
    size: list[int]
    rest: Floats | None

    def chain(self, joint: int) -> list[int]:
        """The longest way down from ``joint``."""
        way = [joint]
        while self.children[way[-1]]:
            way.append(max(self.children[way[-1]], key=lambda child: (self.height[child], -child)))
        return way


def body_by_shape(parents: Sequence[int], rest: Floats | None = None) -> dict[str, int]:
    """Return marker -> joint as far as the tree ``parents`` shows it; empty where there is no tree with limbs.

    ``rest`` (J, 3) are the joints' positions in a rest pose, in any unit, with any axis up.
    """
    tree = _tree(parents, rest)
    if tree is None:
        return {}
    legs = _limbs(tree, parents.index(-1), beyond=True)
    if legs is None:
        return {}
    pelvis, leg_pair, rising = legs
    arms = _limbs(tree, rising, beyond=False)
    if arms is None:
        return {}
    chest, arm_pair, neck = arms
    found = {"pelvis": pelvis, "chest": chest}
    trunk = tree.chain(neck) if neck >= 0 else []
    if trunk:
        found["neck"] = trunk[0]
    if len(trunk) > 1:
        found["head"] = _head(tree, trunk)
    leg_chains = [tree.chain(joint) for joint in leg_pair]
    arm_chains = [tree.chain(joint) for joint in arm_pair]
    leg_starts = [_leg_start(tree, chain) for chain in leg_chains]
    arm_starts = [_arm_start(tree, arm_chains)] * 2
    if rest is not None:
        if _mirrored(rest, found, leg_chains, leg_starts):
            leg_chains, leg_starts = leg_chains[::-1], leg_starts[::-1]
        if _crossed(rest, leg_chains, arm_chains):
            arm_chains, arm_starts = arm_chains[::-1], arm_starts[::-1]
    for side, chain, start in zip(("left", "right"), leg_chains, leg_starts, strict=True):
        found |= _name(side, ("hip", "knee", "foot", "toe"), chain[start:])
    for side, chain, start in zip(("left", "right"), arm_chains, arm_starts, strict=True):
        found |= _name(side, ("shoulder", "elbow", "hand"), chain[start:])
        if start:
            found[f"{side}_collar"] = chain[start - 1]
    return found


def _name(side: str, joints: Sequence[str], chain: Sequence[int]) -> dict[str, int]:
    return {f"{side}_{joint}": place for joint, place in zip(joints, chain, strict=False)}


def _tree(parents: Sequence[int], rest: Floats | None) -> _Tree | None:
    """The tree, or None for a list of parents that is none (several roots, a circle)."""
    count = len(parents)
    if list(parents).count(-1) != 1 or not all(-1 <= parent < count for parent in parents):
        return None
    children: list[list[int]] = [[] for _ in range(count)]
    for joint, parent in enumerate(parents):
        if parent >= 0:
            children[parent].append(joint)
    order = [list(parents).index(-1)]
    for joint in order:
        order += children[joint]
    if len(order) < count:
        return None
    height, size = [1] * count, [1] * count
    for joint in reversed(order):
        for child in children[joint]:
            height[joint] = max(height[joint], height[child] + 1)
            size[joint] += size[child]
    return _Tree(children, height, size, rest)


def _limbs(tree: _Tree, root: int, *, beyond: bool) -> tuple[int, tuple[int, int], int] | None:
    """The first joint from ``root`` downwards with a pair of limbs: it, the pair, and its branch that goes on (or -1).

    ``beyond``: the branch that goes on has a pair of its own, as the spine has.
    """
    waiting = [root]
    for joint in waiting:
        branches = [child for child in tree.children[joint] if tree.height[child] >= _LIMB]
        for pair in _pairs(tree, branches):
            others = [child for child in tree.children[joint] if child not in pair]
            if beyond:
                others = [child for child in others if _limbs(tree, child, beyond=False) is not None]
            if others:
                return joint, pair, max(others, key=lambda child: (tree.size[child], -child))
            if not beyond:
                return joint, pair, -1
        waiting += tree.children[joint]
    return None


def _pairs(tree: _Tree, branches: Sequence[int]) -> list[tuple[int, int]]:
    """Pairs of ``branches`` of equal height, those of the most alike sizes first, then the larger."""
    pairs = [
        (first, second)
        for place, first in enumerate(branches)
        for second in branches[place + 1 :]
        if tree.height[first] == tree.height[second]
    ]

    def unlike(pair: tuple[int, int]) -> tuple[int, int]:
        first, second = tree.size[pair[0]], tree.size[pair[1]]
        return abs(first - second), -first - second

    return sorted(pairs, key=unlike)


def _leg_start(tree: _Tree, chain: Sequence[int]) -> int:
    """Where in ``chain`` the hip is: at its two longest bones, or below a joint that five in a row can spare."""
    if tree.rest is None:
        return 1 if len(chain) == 5 else 0
    bones = np.linalg.norm(np.diff(tree.rest[list(chain)], axis=0), axis=1)
    pairs = bones[:-1] + bones[1:]
    return int(np.argmax(pairs > 0.999 * pairs.max()))


def _arm_start(tree: _Tree, chains: Sequence[Sequence[int]]) -> int:
    """Where in both chains the shoulder is: shoulders stand about an upper arm apart, collar bones begin together."""
    last = min(map(len, chains)) - _LIMB
    if tree.rest is not None:
        first, second = (tree.rest[list(chain[: last + _LIMB])] for chain in chains)
        gaps, bones = np.linalg.norm(first - second, axis=1)[:-1], np.linalg.norm(np.diff(first, axis=0), axis=1)
        wide = np.flatnonzero((gaps > 0.8 * bones) & (bones > 0))
        if wide.size:
            return min(int(wide[0]), last)
    return min(1, last)


def _head(tree: _Tree, trunk: Sequence[int]) -> int:
    """The head of a neck's chain: its last joint that is followed by another or by none, but not the skull's top."""
    if tree.rest is not None:
        lengths = np.linalg.norm(np.diff(tree.rest[list(trunk)], axis=0), axis=1)
        moved = [trunk[0], *(joint for joint, length in zip(trunk[1:], lengths, strict=True) if length > 0)]
        trunk = moved if len(moved) > 1 else trunk
    return trunk[min(2, len(trunk) - 1)]


def _mirrored(rest: Floats, found: dict[str, int], legs: list[list[int]], starts: list[int]) -> bool:
    """Whether the first leg is the right one, by where the feet point in the rest pose."""
    left, right = (rest[chain[start]] for chain, start in zip(legs, starts, strict=True))
    ankles = [chain[start + 2] for chain, start in zip(legs, starts, strict=True)]
    up = rest[found["chest"]] - rest[ankles].mean(axis=0)
    forward = np.mean([rest[chain[-1]] - rest[ankle] for chain, ankle in zip(legs, ankles, strict=True)], axis=0)
    return bool((left - right) @ np.cross(up, forward) < 0)


def _crossed(rest: Floats, legs: list[list[int]], arms: list[list[int]]) -> bool:
    """Whether the first arm is on the second leg's side."""
    leg, arm = (np.diff([rest[chain].mean(axis=0) for chain in pair], axis=0)[0] for pair in (legs, arms))
    return bool(leg @ arm < 0)
