"""The limbs of a figure as one tree from its root, so that depth can be handed from marker to marker."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Link = tuple[int, int, int]


def limb_tree(limbs: NDArray[np.int64], prior: Floats, root: int) -> list[list[Link]]:
    """Return the tree's links (parent, child, limb), those that hang equally far from ``root`` together.

    A limb that would close a ring is left out. Where ``limbs`` (V, 2) fall into parts (arms that no limb joins to the
    torso), the parts are joined by those pairs of markers whose distance in ``prior`` (F, N, 3) changes least; such a
    link has limb -1. Markers on no limb hang on the tree in the same way.
    """
    joined = [(int(first), int(second), limb) for limb, (first, second) in enumerate(limbs)]
    part = np.arange(prior.shape[1])
    links = [link for link in joined if _join(part, link)]
    while (part != part[0]).any():
        spans = (
            np.linalg.norm(prior[:, :, None] - prior[:, None], axis=-1)
            if len(prior)
            else np.zeros((1, *2 * part.shape))
        )
        change = np.where(part[:, None] == part, np.inf, spans.std(axis=0) + 1e-3 * spans.mean(axis=0))
        first, second = np.unravel_index(np.argmin(change), change.shape)
        links.append((int(first), int(second), -1))
        _join(part, links[-1])
    return _levels(links, root)


def _join(part: NDArray[np.int64], link: Link) -> bool:
    """Note in ``part`` (the part each marker belongs to) that ``link`` joins two; False where it closes a ring."""
    first, second = part[link[0]], part[link[1]]
    part[part == second] = first
    return bool(first != second)


def _levels(links: list[Link], root: int) -> list[list[Link]]:
    levels, reached = [], {root}
    while links:
        level = [
            (a, b, limb) if a in reached else (b, a, limb) for a, b, limb in links if (a in reached) != (b in reached)
        ]
        links = [link for link in links if (link[0] in reached) == (link[1] in reached)]
        reached |= {child for _, child, _ in level}
        levels.append(level)
    return levels
