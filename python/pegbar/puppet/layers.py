"""Cuts a figure into layers by limb: who lies on which, in what order, and how far each reaches behind the others.

The views' layers are those of Hornung et al. 2007, figure 3: from the front one, from the side and in half profile
four (near arm, body with near leg, far leg, far arm). A limb that is drawn over or along another part moves on a layer
of its own in every view.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.puppet.limbs import DrawnLimb
from pegbar.puppet.parts import Parts
from pegbar.puppet.view import View
from pegbar.scene.drawn_skeleton import limb_chains
from pegbar.scene.puppet_input import PuppetInput

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
BODY = "body"
#: What is thinner than so many of the limbs' half widths, and lies along a limb, is none of the trunk, and nothing that
#: is hidden is as thin.
_SLIVER = 0.4
#: The part of a sliver's rim that touches the limb whose it is.
_TOUCH = 0.3
_ROUNDS = 3
#: How much thinner a hidden limb is taken to be than the limb beside it shows.
_SLIM = 0.9


@dataclass(frozen=True, eq=False)
class Layer:
    """One layer of a figure.

    ``bones`` are drawn on it. ``drawn`` (H, W) are the pixels of the picture that show it; ``region`` (H, W) is all
    that it covers, behind other layers too. ``joint`` is the joint by which it hangs on the layer ``parent`` (indices;
    -1 for the layer that all others hang on).
    """

    name: str
    bones: tuple[int, ...]
    drawn: Flags
    region: Flags
    joint: int = -1
    parent: int = -1


@dataclass(frozen=True, eq=False)
class LayerPlan:
    """The layers of a figure front to back: ``names``, the ``bones`` drawn on each, and the ``joints`` they hang by.

    The joint of the layer that all others hang on is -1.
    """

    names: tuple[str, ...]
    bones: tuple[tuple[int, ...], ...]
    joints: tuple[int, ...]

    @property
    def bone_layer(self) -> NDArray[np.int64]:
        """The layer on which each bone is drawn (B,)."""
        owner = np.zeros(sum(map(len, self.bones)), np.int64)
        for index, bones in enumerate(self.bones):
            owner[list(bones)] = index
        return owner


def layer_limbs(limbs: Sequence[DrawnLimb], view: View) -> tuple[list[DrawnLimb], list[DrawnLimb]]:
    """The limbs that have layers of their own: those before the body and those behind it, front to back.

    ``limbs`` are nearest first.
    """
    own = [limb for limb in limbs if limb.beside]
    if view in ("half profile", "side", "half back"):
        arms = sorted((limb for limb in limbs if limb.kind == "arm"), key=lambda limb: limb.hidden)
        legs = [limb for limb in limbs if limb.kind == "leg"]
        # The near leg goes with the body, but not where it comes out from under a coat, which it would tear.
        apart = [*arms, *(leg for leg in legs if leg.covered or leg is not legs[0])]
        own = [limb for limb in limbs if limb in apart or (limb in own and limb.kind == "")]
        # The nearest of several arms lie before the body, the farther half behind; legs that have a layer lie behind.
        before = arms[: (len(arms) + 1) // 2] + [limb for limb in own if limb.kind == "" and limb.depth < 0]
        behind = [limb for limb in own if limb not in before]
        behind.sort(key=lambda limb: (limb.kind != "leg", limb.depth))
        return before, behind
    before = [limb for limb in own if not limb.hidden]
    return before, [limb for limb in own if limb.hidden]


def plan_layers(
    bone_count: int, limbs: Sequence[DrawnLimb], view: View, order: Sequence[str] | None = None
) -> LayerPlan:
    """Tell which layers a figure has, front to back, what is drawn on them and where they hang.

    Parameters
    ----------
    bone_count : int
    limbs : sequence of DrawnLimb
        Nearest first.
    view : str
        From which side the figure is seen.
    order : sequence of str, optional
        The layers' names front to back, where they are to be in another order.

    Raises
    ------
    ValueError
        For an ``order`` that has not just the layers' names.
    """
    before, behind = layer_limbs(limbs, view)
    bones = {limb.name: limb.bones for limb in (*before, *behind)}
    taken = {bone for chain in bones.values() for bone in chain}
    bones[BODY] = tuple(bone for bone in range(bone_count) if bone not in taken)
    names = [limb.name for limb in before] + [BODY] + [limb.name for limb in behind]
    if order is not None:
        if sorted(order) != sorted(names):
            raise ValueError(f"layer_order: want {', '.join(names)} in some order, got {', '.join(order)}")
        names = list(order)
    roots = {limb.name: limb.root for limb in limbs}
    return LayerPlan(tuple(names), tuple(bones[name] for name in names), tuple(roots.get(name, -1) for name in names))


def cut_layers(source: PuppetInput, mask: Flags, parts: Parts, plan: LayerPlan) -> list[Layer]:
    """Cut the figure in ``mask`` (H, W) into the layers of ``plan``, front to back."""
    layers, before_it = [], np.zeros_like(mask)
    drawn = _drawn(source, mask, parts, plan)
    for name, bones, joint, own in zip(plan.names, plan.bones, plan.joints, drawn, strict=True):
        hidden = _opened(own | (_expected(source, parts, bones, own) & before_it), _sliver(source, parts))
        hidden &= before_it & ~own
        region = _joined(own | hidden, source, bones)
        parent = -1 if joint < 0 else plan.names.index(BODY)
        layers.append(Layer(name, bones, own & region, region, joint, parent))
        before_it |= own
    return layers


def _drawn(source: PuppetInput, mask: Flags, parts: Parts, plan: LayerPlan) -> list[Flags]:
    """The pixels that show each layer; a limb's reach into the body around the joint by which it hangs."""
    drawn = [np.isin(parts.bones, np.array(own) + 1) for own in plan.bones]
    body = plan.names.index(BODY)
    if source.segmentation is None:
        _claim(source, parts, plan, drawn)
        # What is left beside a sliver that was given may be one now.
        for _ in range(_ROUNDS):
            give_slivers(drawn, body, _sliver(source, parts))
    for index, (joint, bones) in enumerate(zip(plan.joints, plan.bones, strict=True)):
        held = _capsules(source, bones, np.ones(len(source.bones)), mask)
        pieces = _joined(drawn[index] | held, source, bones)
        # What hangs on no bone of the limb is the body's.
        drawn[body] |= drawn[index] & ~pieces
        drawn[index] &= pieces
        if joint >= 0 and index < body:
            # The limb keeps its outline around the joint, so that none is left behind on the body when it moves.
            cap = _disc(mask, source.marks[joint], parts.radii[bones[0]]) & drawn[body]
            drawn[index] |= cap
            drawn[body] &= ~cap
        elif joint >= 0 and not source.visible[source.bones[list(bones), 1]].all():
            # What of a hidden limb seems to lie within the trunk is the trunk's.
            within = drawn[index] & _hull(source, parts, plan.bones[body])
            drawn[index] &= ~within
            drawn[body] |= within
    return drawn


def _claim(source: PuppetInput, parts: Parts, plan: LayerPlan, drawn: list[Flags]) -> None:
    """Give limbs what of farther limbs lies around their own bones, in place: there the nearer one is seen."""
    limbs = [index for index, joint in enumerate(plan.joints) if joint >= 0]
    for place, index in enumerate(limbs):
        own = _capsules(source, plan.bones[index], _SLIM * parts.radii, np.ones(drawn[index].shape, bool))
        for farther in limbs[place + 1 :]:
            taken = drawn[farther] & own
            drawn[index] |= taken
            drawn[farther] &= ~taken


def give_slivers(drawn: list[Flags], body: int, width: float) -> None:
    """Give limbs, in place, what thin pieces of the body's layer lie along them: their outlines, and what is beside."""
    count, pieces = cv2.connectedComponents((drawn[body] & ~_opened(drawn[body], width)).view(np.uint8), connectivity=4)
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    for piece in range(1, count):
        own = pieces == piece
        rim = cv2.dilate(own.view(np.uint8), cross).astype(bool) & ~own
        touches = [0 if index == body else int((rim & other).sum()) for index, other in enumerate(drawn)]
        if max(touches) > _TOUCH * rim.sum():
            drawn[int(np.argmax(touches))] |= own
            drawn[body] &= ~own


def _sliver(source: PuppetInput, parts: Parts) -> float:
    """How thin a sliver is, in pixels."""
    limbs = [bone for chain in limb_chains(source.names, source.bones) for bone in chain]
    return _SLIVER * float(np.median(parts.radii[limbs or slice(None)]))


def _opened(region: Flags, width: float) -> Flags:
    """What of a region a disc of this width reaches (morphological opening)."""
    size = 2 * (round(width) // 2) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    return np.asarray(cv2.morphologyEx(region.view(np.uint8), cv2.MORPH_OPEN, disc), bool)


def _expected(source: PuppetInput, parts: Parts, bones: tuple[int, ...], own: Flags) -> Flags:
    """Where a layer that is drawn in ``own`` may well be, also where it is hidden: around its bones, the trunk without
    dents. An animal's trunk is wide where a leg hangs on it, but no wider there than beside the leg.
    """
    radii = _SLIM * np.minimum(parts.radii, _twins(source, parts.radii))
    limbs = {bone for chain in limb_chains(source.names, source.bones) for bone in chain}
    holds = [bone for bone in bones if bone not in limbs and not _is_trunk(source, bone) and _holds_limb(source, bone)]
    everywhere = np.ones(parts.bones.shape, bool)
    expected = _capsules(source, [bone for bone in bones if bone not in holds], radii, everywhere)
    if holds:
        expected |= _capsules(source, holds, radii, _closed(own, 2 * float(radii[holds].max())))
    return expected | _hull(source, parts, bones)


def _holds_limb(source: PuppetInput, bone: int) -> bool:
    """Whether other bones hang on a bone's end."""
    return bool((source.bones[:, 0] == source.bones[bone, 1]).any())


def _closed(region: Flags, radius: float) -> Flags:
    """A region with the dents and gaps that a disc of this radius does not reach into (morphological closing)."""
    reach = max(1, round(radius))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    padded = np.pad(region.view(np.uint8), reach)
    closed = cv2.morphologyEx(padded, cv2.MORPH_CLOSE, disc)[reach:-reach, reach:-reach]
    return np.asarray(closed, bool)


def _hull(source: PuppetInput, parts: Parts, bones: tuple[int, ...]) -> Flags:
    """The trunk without dents; nothing where ``bones`` are not the trunk's."""
    trunk = [bone for bone in bones if _is_trunk(source, bone)]
    filled = np.zeros(parts.bones.shape, np.uint8)
    corners = np.argwhere(np.isin(parts.bones, np.array(trunk) + 1))[:, ::-1].astype(np.int32)
    if len(corners) > 2:
        cv2.fillConvexPoly(filled, cv2.convexHull(corners), 1)
    return filled.astype(bool)


def _is_trunk(source: PuppetInput, bone: int) -> bool:
    """Whether a bone is a person's trunk's, but not the head's."""
    child = source.names[int(source.bones[bone, 1])]
    return child in ("chest", "neck") or child.endswith(("_shoulder", "_hip"))


def _twins(source: PuppetInput, radii: Floats) -> Floats:
    """The half width of every bone's counterpart on the other side, its own where there is none."""
    child = {source.names[int(joint)]: bone for bone, joint in enumerate(source.bones[:, 1])}
    swap = {"left": "right", "right": "left"}
    twins = radii.copy()
    for name, bone in child.items():
        words = name.split("_")
        other = "_".join(swap.get(word, word) for word in words)
        twins[bone] = radii[child.get(other, bone)]
    return twins


def _capsules(source: PuppetInput, bones: Sequence[int], radii: Floats, mask: Flags) -> Flags:
    """The pixels of ``mask`` within the half widths of bones."""
    canvas = np.zeros(mask.shape, np.uint8)
    for bone in bones:
        start, end = (tuple(np.rint(source.marks[joint] * 16).astype(int).tolist()) for joint in source.bones[bone])
        cv2.line(canvas, start, end, 1, max(1, round(2 * radii[bone])), cv2.LINE_8, 4)
    return canvas.astype(bool) & mask


def _disc(mask: Flags, centre: Floats, radius: float) -> Flags:
    rows, columns = np.ogrid[: mask.shape[0], : mask.shape[1]]
    return np.asarray((columns - centre[0]) ** 2 + (rows - centre[1]) ** 2 <= radius**2) & mask


def _joined(region: Flags, source: PuppetInput, bones: tuple[int, ...]) -> Flags:
    """Those pieces of a region that one of its bones runs through."""
    count, pieces = cv2.connectedComponents(region.view(np.uint8), connectivity=4)
    if count <= 2:
        return region
    held = np.unique(pieces[_capsules(source, bones, np.zeros(len(source.bones)), region)])
    return np.isin(pieces, held[held > 0])
