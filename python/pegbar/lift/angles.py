"""Joint angles of reconstructed markers on a skeleton (2009 paper, section 3.6).

The root follows its markers by Procrustes, every bone swings onto its markers, and the twist about a bone is the
clip's: a swing is the smallest rotation, so it adds no twist.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.lift.attachments import Attachments, attach
from pegbar.lift.retarget import follow, rest_pose, shared_markers
from pegbar.lift.turning import best_rotation, steady_swing
from pegbar.scene.motion import Motion

Floats = NDArray[np.float64]
# The hips tell the pelvis's rotation, the back only what they leave open: it bends.
_BACK = 0.05


def joint_angles(
    markers: ArrayLike,
    names: Sequence[str],
    motion: Motion,
    *,
    stretch: bool = False,
    skeleton: Motion | None = None,
) -> Motion:
    """Pose the skeleton of ``motion``, or another, so that its joints come onto ``markers`` (2009, section 3.6).

    Parameters
    ----------
    markers : (F, N, 3) float
        Where the markers are to be, world metres.
    names : sequence of N str
        Their names: canonical markers or joints of ``motion``.
    motion : Motion
        F frames of the clip that gives the skeleton, the twist about every bone, and the joints without a marker.
    stretch : bool
        True: bones change their length so that every joint with a marker lies on it. False: bones keep their length,
        and markers are met within the error of the limbs' lengths.
    skeleton : Motion, optional
        Another skeleton, from whose rest pose (`Motion.rest`, else the first frame) the result is posed, at its own
        size. It turns about its bones as the clip does; the clip may then be points (C3D), which leaves the rest
        pose's twist. Markers that it lacks are left out.

    Returns
    -------
    Motion
        The skeleton's F frames. With the clip's own markers it is the clip again.

    Raises
    ------
    ValueError
        For another number of frames than the motion's, a marker that the motion lacks, a number that is not finite,
        a motion without a skeleton, or a skeleton that shares fewer than 4 canonical markers with the motion.

    Examples
    --------
    >>> import numpy as np
    >>> from pegbar import Motion
    >>> straight = np.array([[[0.0, 1.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.0]]])
    >>> leg = Motion(("hip", "knee", "foot"), (-1, 0, 1), straight, np.tile(np.eye(3), (1, 3, 1, 1)), 24.0)
    >>> bent = [[[0.0, 1.0, 0.0], [0.0, 0.5, 0.0], [0.5, 0.5, 0.0]]]
    >>> joint_angles(bent, ["hip", "knee", "foot"], leg).positions[0, 2].round(6).tolist()
    [0.5, 0.5, 0.0]
    """
    wanted = arrays.floats("markers", markers, (len(motion.positions), len(names), 3))
    if skeleton is not None:
        motion.markers(names)
        motion = _as_clip(motion, skeleton)
        kept = [place for place, name in enumerate(names) if name in {*motion.known_markers, *motion.names}]
        wanted, names = wanted[:, kept], [names[place] for place in kept]
    tree = attach(motion, names)
    turns = np.empty_like(motion.rotations)
    places = np.empty_like(motion.positions)
    for joint in tree.order:
        parent = motion.parents[joint]
        if parent < 0:
            turns[:, joint], places[:, joint] = _root(tree, joint, wanted, motion)
            continue
        offset = motion.positions[:, joint] - motion.positions[:, parent]
        places[:, joint] = places[:, parent] + _turned(turns[:, parent], offset)
        if stretch and (marker := tree.on[joint]) is not None:
            places[:, joint] = wanted[:, marker]
        turns[:, joint] = _bone(tree, joint, wanted, motion, places[:, joint], turns[:, parent])
    return motion.changed(positions=places, rotations=turns @ motion.rotations)


def _as_clip(motion: Motion, skeleton: Motion) -> Motion:
    """The ``skeleton`` in the clip's frames, posed first as the clip's rest pose (of points: its first frame) is."""
    names = shared_markers(motion, skeleton)
    points = len(motion.parents) > 1 and max(motion.parents) < 0
    clip_rest = motion.slice(0, 1) if points else rest_pose(motion)
    if not len(clip_rest.positions):
        return follow(motion, skeleton, rest_pose(skeleton).rotations[0])
    start = joint_angles(clip_rest.markers(names), names, rest_pose(skeleton))
    return follow(motion, skeleton, start.rotations[0])


def _root(tree: Attachments, joint: int, wanted: Floats, motion: Motion) -> tuple[Floats, Floats]:
    """Rotation and place of a root: its nearest markers by Procrustes, its own marker met exactly."""
    near = sorted({*tree.own[joint], *tree.below[joint]})
    still = np.broadcast_to(np.eye(3), (len(wanted), 3, 3)).copy()
    if not near:
        return still, motion.positions[:, joint].copy()
    own = tree.own[joint]
    source, target = tree.anchors[:, near], wanted[:, near]
    pivot, place = (tree.anchors[:, own[0]], wanted[:, own[0]]) if own else (source.mean(1), target.mean(1))
    weights = np.array([1.0 if tree.is_leg[marker] else _BACK for marker in near])
    turn = best_rotation(source - pivot[:, None], target - place[:, None], weights, still)
    return turn, place + _turned(turn, motion.positions[:, joint] - pivot)


def _bone(tree: Attachments, joint: int, wanted: Floats, motion: Motion, place: Floats, parent_turn: Floats) -> Floats:
    """Rotation of a joint: onto one marker by a swing, onto several with least squares; with none its parent's."""
    below, parent = tree.below[joint], motion.parents[joint]
    # Where the joint above points at the same marker already, only wrong lengths would be left to bend for.
    if not below or (len(below) == 1 and below == tree.below[parent] and motion.parents[parent] >= 0):
        return parent_turn
    source = tree.anchors[:, below] - motion.positions[:, joint][:, None]
    target = wanted[:, below] - place[:, None]
    if len(below) == 1:
        return steady_swing(_turned(parent_turn, source[:, 0]), target[:, 0], parent_turn)
    return best_rotation(source, target, np.ones(len(below)), parent_turn)


def _turned(turns: Floats, vectors: Floats) -> Floats:
    result: Floats = np.einsum("fij,fj->fi", turns, vectors)
    return result
