"""What is in front of what, frame by frame (2007 paper, s7: "triangle depths ... directly from the 3D pose").

Triangles are ordered by limb, not one by one: a limb is in front of another where they cross in the picture, and stays
there until it is clearly behind. So nothing flickers where two limbs have about the same depth.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pegbar.puppet.bone_weights import bone_distances
from pegbar.puppet.drawn_pose import LIMB_ENDS
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.puppet import Puppet

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Ints = NDArray[np.int64]
#: Share of the figure's height in the depth by which an order must be wrong before it changes.
HYSTERESIS = 0.02
#: The same by which an arm must be farther (or nearer) than a bone of the body or of a leg to go behind (or before) it
#: against the drawing: they are thick, and an arm that hangs beside them has about the depth of their middle.
BODY = 0.05
#: A change of order that is undone within so many pictures is a flicker, if it is not the two limbs' own.
BRIEF = 3
_ARM_ENDS = ("elbow", "hand", "wrist")


@dataclass(frozen=True, eq=False)
class Pieces:
    """What keeps together in depth: the triangles of one bone on one layer.

    ``of_triangle`` (T,) int is each triangle's piece; ``bones`` (P,) int and ``layers`` (P,) int are a piece's bone (-1
    none) and layer, ``radii`` (P,) how far its vertices are from the bone in pixels. ``kinds`` (P,) int is 1 for the
    body's, 2 for an arm's and 0 for other pieces.
    """

    of_triangle: Ints
    bones: Ints
    layers: Ints
    radii: Floats
    kinds: Ints

    @classmethod
    def of_puppet(cls, puppet: Puppet) -> Pieces:
        """Find the pieces of a puppet."""
        keys = np.stack([puppet.triangle_layer, puppet.triangle_bone], axis=1)
        found, of_triangle = np.unique(keys, axis=0, return_inverse=True)
        of_triangle = of_triangle.reshape(-1)
        distances, _ = bone_distances(puppet.vertices, puppet.marks, puppet.bones)
        radii, kinds = np.zeros(len(found)), np.zeros(len(found), np.int64)
        for piece, (_, bone) in enumerate(found.tolist()):
            corners = np.unique(puppet.triangles[of_triangle == piece])
            if bone >= 0:
                radii[piece] = np.percentile(distances[corners, bone], 90)
                end = puppet.drives.get(puppet.names[puppet.bones[bone, 1]], "")
                kinds[piece] = 2 if end.endswith(_ARM_ENDS) else 0 if end.endswith(LIMB_ENDS) else 1
        return cls(of_triangle, found[:, 1], found[:, 0], radii, kinds)


def piece_ranks(pieces: Pieces, bones: Ints, camera: PerspectiveCamera, poses: Floats) -> Ints:
    """Return the place (F, P) of every piece in each frame, 0 the farthest.

    Parameters
    ----------
    pieces : Pieces
    bones : (B, 2) int
    camera : PerspectiveCamera
    poses : (F, J, 3) float
        World metres.
    """
    pixels, depths = camera.project(poses), camera.depth(poses)
    size = float(np.median(np.ptp(poses[:, :, 1], axis=1))) if len(poses) else 0.0
    count = len(pieces.bones)
    # A piece without a bone keeps its place among the layers.
    first, second = np.triu_indices(count, 1)
    known = (pieces.bones[first] >= 0) & (pieces.bones[second] >= 0)
    known &= pieces.bones[first] != pieces.bones[second]
    known &= ~_hanging(pieces, bones)[first, second]
    behind, cover = _crossings(pieces, bones, pixels, depths, first[known], second[known])
    drawn = _drawn_in_front(pieces, bones)[first, second]
    front = np.broadcast_to(drawn, (len(poses), len(first))).copy()
    touching = np.ones(front.shape, bool)
    behind += BODY * size * _leaning(pieces, drawn, first, second)[known]
    front[:, known] = settle(behind, cover, HYSTERESIS * size, drawn[known])
    touching[:, known] = cover
    ranks = _all_ranks(front, touching, first, second, count)
    # Where three are in front of one another all round, one order or another is broken: but not to and fro.
    shown = calmed(ranks[:, first] > ranks[:, second], front, touching)
    return _all_ranks(shown, touching, first, second, count)


def _all_ranks(front: Flags, touching: Flags, first: Ints, second: Ints, count: int) -> Ints:
    """The place (F, P) of every piece in each frame, from which of each pair is in ``front`` (F, K)."""
    relation = np.zeros((len(front), count, count), np.int8)
    strength = np.where(front, 1, -1) * (1 + touching)
    relation[:, first, second], relation[:, second, first] = strength, -strength
    ranks = np.zeros((len(front), count), np.int64)
    for frame, related in enumerate(relation):
        ranks[frame] = _ranks(related, ranks[max(frame - 1, 0)])
    return ranks


def calmed(shown: Flags, front: Flags, touching: Flags) -> Flags:
    """Return who is ``shown`` in front (F, K) without flickers.

    A change that is undone within `BRIEF` pictures, while both are ``touching`` (F, K), is none, but where it is the
    two limbs' own: ``front`` (F, K) is who is in front of the two alone.
    """
    result = shown.copy()
    changes = shown[1:] != shown[:-1]
    for pair in np.flatnonzero(changes.sum(axis=0) > 1):
        edges = np.concatenate([[0], np.flatnonzero(changes[:, pair]) + 1, [len(shown)]])
        for start, end in itertools.pairwise(edges.tolist()):
            if start == 0 or end == len(shown) or end - start > BRIEF:
                continue
            around = slice(start - 1, end + 1)
            if touching[around, pair].all() and (shown[around, pair] != front[around, pair]).any():
                result[start:end, pair] = result[start - 1, pair]
    return result


def settle(behind: Floats, cover: Flags, margin: float, drawn: Flags) -> Flags:
    """Return who is in front (F, K) over time, with hysteresis.

    ``behind`` (F, K) is by how much the second of a pair is farther than the first, ``cover`` (F, K) whether the two
    cover each other, ``margin`` by how much an order must be wrong to change while they do, ``drawn`` (K,) the order
    where the first frame does not tell.
    """
    front = np.empty(behind.shape, bool)
    if not len(behind):
        return front
    now = np.where(np.abs(behind[0]) > margin, behind[0] > 0, drawn)
    for frame in range(len(behind)):
        free = ~cover[frame] & (np.abs(behind[frame]) > margin / 4)
        changes = free | (np.abs(behind[frame]) > margin)
        now = np.where(changes, behind[frame] > 0, now)
        front[frame] = now
    return front


def _crossings(
    pieces: Pieces, bones: Ints, pixels: Floats, depths: Floats, first: Ints, second: Ints
) -> tuple[Floats, Flags]:
    """How much farther the second of each pair is than the first where they come nearest, and whether they cover."""
    ends = [bones[pieces.bones[chosen]] for chosen in (first, second)]
    a0, a1, b0, b1 = (pixels[:, pair[:, end]] for pair in ends for end in (0, 1))
    near_a, near_b, distance = nearest_points(a0, a1 - a0, b0, b1 - b0)
    depth = [
        depths[:, pair[:, 0]] * (1 - share) + depths[:, pair[:, 1]] * share
        for pair, share in zip(ends, (near_a, near_b), strict=True)
    ]
    behind = depth[1] - depth[0]
    # Bones that meet at a joint are nearest there, at no distance: the rest of the bones tells.
    meeting = (ends[0][:, :, None] == ends[1][:, None, :]).any(axis=(1, 2))
    middles = [depths[:, pair].mean(axis=2) for pair in ends]
    behind = np.where(meeting, middles[1] - middles[0], behind)
    return behind, distance < pieces.radii[first] + pieces.radii[second]


def _leaning(pieces: Pieces, drawn: Flags, first: Ints, second: Ints) -> Floats:
    """1 where the first of an arm's piece and one of the body or a leg is drawn in front, -1 where behind, else 0."""
    arms = (pieces.kinds[np.stack([first, second])] == 2).sum(axis=0)
    return np.where(arms == 1, np.where(drawn, 1.0, -1.0), 0.0)


def nearest_points(start: Floats, along: Floats, other: Floats, across: Floats) -> tuple[Floats, Floats, Floats]:
    """Return where two segments (..., 2), given by starts and extents, come nearest: shares (...) and distance (...).

    Where they cross the distance is 0.
    """
    aa, bb = (np.maximum((part**2).sum(-1), 1e-30) for part in (along, across))
    ab = (along * across).sum(-1)
    gap = start - other
    ag, bg = (along * gap).sum(-1), (across * gap).sum(-1)
    determinant = aa * bb - ab * ab
    share = np.where(determinant > 1e-14 * aa * bb, (ab * bg - ag * bb) / np.maximum(determinant, 1e-300), 0.5)
    share = np.clip(share, 0, 1)
    partner = np.clip((ab * share + bg) / bb, 0, 1)
    share = np.clip((ab * partner - ag) / aa, 0, 1)
    apart = gap + share[..., None] * along - partner[..., None] * across
    return share, partner, np.linalg.norm(apart, axis=-1)


def _hanging(pieces: Pieces, bones: Ints) -> Flags:
    """Whether one of two pieces (P, P) is where a limb hangs on the other's layer.

    There limbs reach under what they come out from (a thigh under a coat), or over it: that stays as drawn.
    """
    leads_to = {int(child): bone for bone, child in enumerate(bones[:, 1])}
    hangs = np.zeros((len(pieces.bones),) * 2, bool)
    for piece, (bone, layer) in enumerate(zip(pieces.bones, pieces.layers, strict=True)):
        above = leads_to.get(int(bones[bone, 0])) if bone >= 0 else None
        if above is None:
            continue
        held_by = pieces.layers[pieces.bones == above]
        if len(held_by) and layer not in held_by:
            hangs[piece] = np.isin(pieces.layers, held_by)
    return hangs | hangs.T


def _drawn_in_front(pieces: Pieces, bones: Ints) -> Flags:
    """Whether piece i is drawn in front of piece j (P, P): the nearer layer, on one layer what is farther out."""
    steps = np.zeros(len(bones) + 1)
    at_joint: dict[int, float] = {}
    for bone, (parent, child) in enumerate(bones.tolist()):
        steps[bone] = at_joint.get(parent, 0.0) + 1
        at_joint[child] = steps[bone]
    score = -pieces.layers * (len(bones) + 2.0) + steps[pieces.bones]
    return score[:, None] > score[None, :]


def _ranks(relation: NDArray[np.int8], before: Ints) -> Ints:
    """Places (P,), 0 the farthest, from who is in front: ``relation[i, j]`` > 0 where i is in front of j, 2 surely.

    The farthest of what is left is what is in front of nothing that is surely before it; where there is a circle, what
    is in front of the fewest. Of several it is what was farthest ``before`` (P,), in the last frame: circles would be
    broken elsewhere as soon as something changes that covers none of them.
    """
    count = len(relation)
    ranks, left = np.empty(count, np.int64), np.ones(count, bool)
    sure, weak = relation > 1, relation > 0
    over, loosely = sure.sum(axis=1), weak.sum(axis=1)
    for place in range(count):
        candidates = np.flatnonzero(left)
        lowest = candidates[np.lexsort((candidates, loosely[candidates], before[candidates], over[candidates]))[0]]
        ranks[lowest], left[lowest] = place, False
        over, loosely = over - sure[:, lowest], loosely - weak[:, lowest]
    return ranks
