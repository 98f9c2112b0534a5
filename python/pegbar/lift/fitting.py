"""A skeleton with the limbs of a drawn figure: every bone as long as the markers at its ends are usually apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.lift.attachments import Attachments, attach, parents_first
from pegbar.lift.retarget import rest_pose
from pegbar.scene.motion import Motion

Floats = NDArray[np.float64]
#: No bone is made longer or shorter than so many times.
LEAST, MOST = 0.25, 4.0
#: Markers nearer than this in the rest pose, in metres, tell no proportion.
APART = 0.01


def fit_skeleton(skeleton: Motion, markers: ArrayLike, names: Sequence[str], *, posed: Motion | None = None) -> Motion:
    """Return the rest pose of ``skeleton`` with the proportions of a figure, as one frame and as ``rest``.

    The bones between two joints with a marker are scaled by how far those markers are apart in the median of the
    frames, left and right alike; what hangs below the last marker is scaled as the whole figure.

    Parameters
    ----------
    skeleton : Motion
        Its rest pose (`Motion.rest`, else the first frame) is taken.
    markers : (F, N, 3) float
        The figure's markers, metres.
    names : sequence of N str
        Their names: canonical markers or joints of ``skeleton``. Those that it lacks are left out.
    posed : Motion, optional
        The skeleton in F frames as `joint_angles` poses it on the markers: lengths are compared pose by pose, since a
        back that bends is shorter from end to end. None compares with the rest pose.

    Raises
    ------
    ValueError
        For a wrong shape, a number that is not finite, or points without a skeleton.

    Examples
    --------
    >>> still = np.tile(np.eye(3), (1, 2, 1, 1))
    >>> leg = Motion(("left_knee", "left_foot"), (-1, 0), np.array([[[0, 0.4, 0], [0, 0, 0.0]]]), still, 24.0)
    >>> fit_skeleton(leg, [[[0, 1, 0], [0, 0.5, 0]]], ["left_knee", "left_foot"]).positions.tolist()
    [[[0.0, 0.4, 0.0], [0.0, -0.09999999999999998, 0.0]]]
    """
    drawn = arrays.floats("markers", markers, ("F", len(names), 3))
    rest = rest_pose(skeleton)
    kept = [place for place, name in enumerate(names) if name in {*rest.known_markers, *rest.names}]
    if not len(drawn) or not kept:
        return rest
    labels = [names[place] for place in kept]
    tree = attach(rest, labels)
    above = _marked_above(rest.parents, tree.own)
    anchors = tree.anchors if posed is None else posed.markers(labels)
    known = _ratios(drawn[:, kept], anchors, labels, tree.own, above)
    whole = float(np.median(list(known.values()))) if known else 1.0
    places, ratios = rest.positions[0].copy(), np.ones(len(rest.names))
    marked_below = _marked_below(rest.parents, tree.own)
    grown = _grown(drawn[:, kept], tree, above, known)
    # The marker of a head or hand lies beyond its joint: what hangs there is scaled as its bone is.
    tips = {joint: known[joint] for joint, on in enumerate(tree.on) if joint in known and on is None}
    for joint in parents_first(rest.parents):
        parent = rest.parents[joint]
        if parent < 0:
            tips.setdefault(joint, whole)
            continue
        # Of several limbs that share a bone the mean decides.
        told = [known[end] for end in marked_below[joint] if end in known]
        tips.setdefault(joint, tips.get(parent, whole))
        ratios[joint] = float(np.mean(told)) if told else tips[parent]
        step = ratios[joint] * (rest.positions[0, joint] - rest.positions[0, parent])
        places[joint] = places[parent] + grown.get(joint, step)
    ends = {name: tips.get(rest.names.index(name), whole) * np.asarray(end) for name, end in rest.ends.items()}
    return rest.changed(positions=places[None], rest=None if rest.rest is None else places, ends=ends)


def _ratios(
    drawn: Floats,
    anchors: Floats,
    labels: Sequence[str],
    own: Sequence[tuple[int, ...]],
    above: Sequence[int],
) -> dict[int, float]:
    """How many times longer the figure is between each marked joint and the next one above it; sides alike."""
    found: dict[int, float] = {}
    pairs: dict[str, list[int]] = {}
    for joint, markers in enumerate(own):
        if not markers or above[joint] < 0:
            continue
        first, second = own[above[joint]][0], markers[0]
        lengths = np.linalg.norm(anchors[:, second] - anchors[:, first], axis=1)
        if lengths.min() > APART:
            usual = np.median(np.linalg.norm(drawn[:, second] - drawn[:, first], axis=1) / lengths)
            found[joint] = float(np.clip(usual, LEAST, MOST))
            pairs.setdefault(labels[second].removeprefix("left_").removeprefix("right_"), []).append(joint)
    for joints in pairs.values():
        mean = float(np.mean([found[joint] for joint in joints]))
        found.update(dict.fromkeys(joints, mean))
    return found


def _grown(drawn: Floats, tree: Attachments, above: Sequence[int], known: dict[int, float]) -> dict[int, Floats]:
    """Bones (3,) that the skeleton has no length for and the figure has: towards the next marker below.

    CMU's neck lies in the same place as its chest.
    """
    grown = {}
    for joint, markers in enumerate(tree.own):
        if not markers or above[joint] < 0 or joint in known or not tree.below[joint]:
            continue
        first, second = tree.own[above[joint]][0], markers[0]
        onward = tree.anchors[0, tree.below[joint][0]] - tree.anchors[0, second]
        length = float(np.median(np.linalg.norm(drawn[:, second] - drawn[:, first], axis=1)))
        grown[joint] = length * onward / max(float(np.linalg.norm(onward)), 1e-9)
    return grown


def _marked_above(parents: Sequence[int], own: Sequence[tuple[int, ...]]) -> list[int]:
    """For each joint the nearest one above it that carries a marker, or -1."""
    above = []
    for joint in range(len(parents)):
        parent = parents[joint]
        while parent >= 0 and not own[parent]:
            parent = parents[parent]
        above.append(parent)
    return above


def _marked_below(parents: Sequence[int], own: Sequence[tuple[int, ...]]) -> list[list[int]]:
    """For each joint itself if it carries a marker, else the next such joints below it."""
    below: list[list[int]] = [[joint] if own[joint] else [] for joint in range(len(parents))]
    for joint in reversed(parents_first(parents)):
        parent = parents[joint]
        if parent >= 0 and not own[parent]:
            below[parent] += below[joint]
    return below
