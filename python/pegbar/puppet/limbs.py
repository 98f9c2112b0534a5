"""The limbs of a figure in a picture: their names, which lie before the body, and which must move apart from it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.puppet.parts import Parts, bone_distances
from pegbar.puppet.view import SeenPose
from pegbar.scene.drawn_skeleton import limb_chains
from pegbar.scene.puppet_input import PuppetInput

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
#: A limb that touches another part of the figure beyond its first bone is drawn beside or over it; nearer to the trunk
#: they belong together (an upper arm and a sleeve, a thigh and a skirt). A limb of one bone: from here along it.
APART_FROM = 0.6
#: A limb that is drawn only from here along its first bone on comes out from under something.
COVERED_TO = 0.2
#: A limb's touch that is shorter than so many of its half widths is no touch.
LEAST_TOUCH = 0.8
_KINDS = {"shoulder": "arm", "elbow": "arm", "hand": "arm", "hip": "leg", "knee": "leg", "foot": "leg"}


@dataclass(frozen=True)
class DrawnLimb:
    """A limb: its ``bones`` from the trunk outwards, the joint ``root`` by which it hangs, and what ``kind`` it is.

    ``kind`` is "arm" or "leg" by what moves it, "" for others. ``depth`` is how much farther away than the trunk it is,
    in metres; ``beside`` whether it is drawn over or along another part, ``hidden`` whether one of its joints is, and
    ``covered`` whether what is drawn of it begins well beyond its first joint: under a coat or skirt.
    """

    name: str
    bones: tuple[int, ...]
    root: int
    kind: str
    depth: float
    beside: bool
    hidden: bool
    covered: bool = False


def drawn_limbs(source: PuppetInput, parts: Parts, seen: SeenPose) -> list[DrawnLimb]:
    """The limbs of the figure, nearest first."""
    chains = limb_chains(source.names, source.bones)
    depths = seen.camera.depth(seen.pose)
    trunk = [joint for joint, name in enumerate(source.names) if name in ("pelvis", "chest", "neck")]
    limbs = []
    for chain in chains:
        root = int(source.bones[chain[0], 0])
        ends = source.bones[chain, 1]
        marker = source.drives.get(source.names[root], source.drives.get(source.names[int(ends[0])], ""))
        kind = _KINDS.get(marker.split("_")[-1], "")
        limbs.append(
            DrawnLimb(
                name=_name(source.names[root], source.names[int(ends[0])], kind),
                bones=tuple(chain),
                root=root,
                kind=kind,
                depth=float(depths[[root, *ends]].mean() - depths[trunk].mean()),
                beside=_is_beside(source, parts, chain, chains if kind == "leg" else None),
                hidden=not bool(source.visible[ends].all()),
                covered=_is_covered(source, parts, chain[0]),
            )
        )
    return sorted(limbs, key=lambda limb: limb.depth)


def _name(root: str, first: str, kind: str) -> str:
    """What to call a limb: "left arm" for a person's, else by the joint that it begins with."""
    side, _, joint = root.partition("_")
    if side in ("left", "right") and joint in ("shoulder", "hip"):
        return f"{side} {kind}"
    return (root if kind else first).replace("_", " ")


def _is_covered(source: PuppetInput, parts: Parts, bone: int) -> bool:
    """Whether a limb's first bone is drawn from well beyond its beginning on."""
    places = np.argwhere(parts.bones == bone + 1)[:, ::-1].astype(np.float64)
    if not len(places):
        return True
    fractions = bone_distances(places, source.marks[source.bones[[bone]]])[1]
    return bool(np.percentile(fractions, 2) > COVERED_TO)


def _is_beside(source: PuppetInput, parts: Parts, chain: list[int], limbs: list[list[int]] | None) -> bool:
    """Whether a limb touches another part of the figure away from where it hangs on it.

    ``limbs`` are the only parts that count where they are given: a skirt or coat goes with the legs that it touches.
    """
    own = np.isin(parts.bones, np.array(chain) + 1)
    others = (parts.bones > 0) & ~own
    if limbs is not None:
        others &= np.isin(parts.bones, np.concatenate(limbs) + 1)
    touching = own & cv2.dilate(others.view(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    places = np.argwhere(touching)[:, ::-1].astype(np.float64)
    if not len(places):
        return False
    ends = source.marks[source.bones[chain]]
    distances, fractions = bone_distances(places, ends)
    nearest = distances.argmin(axis=1)
    along = nearest + np.take_along_axis(fractions, nearest[:, None], axis=1)[:, 0]
    apart = along > (1.0 if len(chain) > 1 else APART_FROM)
    return bool(apart.sum() > LEAST_TOUCH * parts.radii[chain].mean() + 2)
