"""A clip's movement on another skeleton: every joint turns from its rest as the clip's joint of the same meaning does.

Rest poses differ (arms out, arms down, another facing): the skeleton is first posed as the clip's rest pose is, and
that is what the clip's turns are applied to. So the twist about every bone is the clip's, as section 3.6 of the 2009
paper asks, and joints that the clip lacks turn with the joint that they hang on.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pegbar.lift.attachments import parents_first
from pegbar.scene.body import MARKERS
from pegbar.scene.motion import Motion

Floats = NDArray[np.float64]
#: Fewer markers than this that both skeletons have do not tell how one lies in the other.
FEWEST_MARKERS = 4


def rest_pose(skeleton: Motion) -> Motion:
    """Return the rest pose of ``skeleton`` as one frame: that of its file, else its first frame.

    Raises ValueError for points without a skeleton, and for no frame.
    """
    if len(skeleton.parents) > 1 and max(skeleton.parents) < 0:
        raise ValueError("skeleton: it has only points, no joints that hang on each other")
    if skeleton.rest is not None:
        still = np.broadcast_to(np.eye(3), (1, len(skeleton.names), 3, 3)).copy()
        return skeleton.changed(positions=skeleton.rest[None], rotations=still, rest_frame=None)
    if not len(skeleton.positions):
        raise ValueError("skeleton: it has neither a rest pose nor a frame")
    first = 1 if skeleton.rest_frame == 0 and len(skeleton.positions) > 1 else 0
    return skeleton.slice(first, first + 1)


def shared_markers(motion: Motion, skeleton: Motion) -> tuple[str, ...]:
    """Return the canonical markers that both have; ValueError for fewer than four."""
    names = tuple(name for name in MARKERS if name in motion.known_markers and name in skeleton.known_markers)
    if len(names) < FEWEST_MARKERS:
        found = ", ".join(names) or "none"
        raise ValueError(
            f"skeleton: of the markers that the clip has only {found} were found among its joints "
            f"({', '.join(skeleton.names[:20])}), want {FEWEST_MARKERS} or more; a joint map says what joints mean"
        )
    return names


def follow(motion: Motion, skeleton: Motion, start: Floats) -> Motion:
    """Return ``skeleton`` in the F frames of ``motion``, at its own size; it stands where the clip does.

    ``start`` (J, 3, 3) are the rotations of the skeleton's joints that pose it as the clip's rest pose is. The clip of
    points has no rotations: then the skeleton keeps ``start``.
    """
    rest = rest_pose(skeleton)
    frames, joints = len(motion.positions), len(skeleton.names)
    sources = _sources(motion, skeleton)
    still = rest_pose(motion).rotations[0] if sources else np.empty((0, 3, 3))
    base = rest.rotations[0]
    turns, places = np.empty((frames, joints, 3, 3)), np.empty((frames, joints, 3))
    for joint in parents_first(skeleton.parents):
        parent = skeleton.parents[joint]
        if joint in sources:
            source = sources[joint]
            turns[:, joint] = motion.rotations[:, source] @ still[source].T @ start[joint]
        elif parent < 0:
            turns[:, joint] = start[joint]
        else:
            turns[:, joint] = turns[:, parent] @ start[parent].T @ start[joint]
        if parent < 0:
            places[:, joint] = motion.positions[:, sources.get(joint, 0)]
        else:
            offset = base[parent].T @ (rest.positions[0, joint] - rest.positions[0, parent])
            places[:, joint] = places[:, parent] + turns[:, parent] @ offset
    return skeleton.changed(positions=places, rotations=turns, frame_rate=motion.frame_rate, rest_frame=None)


def _sources(motion: Motion, skeleton: Motion) -> dict[int, int]:
    """The clip's joint for joints of ``skeleton``: by meaning, and by name where all names mean the same."""
    if max(motion.parents) < 0 and len(motion.parents) > 1:
        return {}
    own, clip = ({name: place for place, name in enumerate(one.names)} for one in (skeleton, motion))
    both = [marker for marker in skeleton.joint_map if marker in motion.joint_map]
    # A joint that stands for two markers follows the first, as long as the clip has one joint for both as well.
    pairs = {own[skeleton.joint_map[marker]]: clip[motion.joint_map[marker]] for marker in reversed(both)}
    if all(skeleton.joint_map[marker] == motion.joint_map[marker] for marker in both):
        pairs = {own[name]: clip[name] for name in own if name in clip} | pairs
    return pairs
