"""Generic shape templates of a person in layers, fitted to a picture's joints (Hornung et al. 2007, s6, figure 3)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.puppet.deform import Deformer
from pegbar.puppet.layers import Layer
from pegbar.puppet.mesh import LayeredMesh, layered_mesh
from pegbar.puppet.view import View
from pegbar.scene.body import MARKERS, bones_between
from pegbar.scene.puppet_input import PuppetInput

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
#: Template pixels a body height, and around it.
_HEIGHT, _ROOM = 480, 40
#: Where the joints of a standing person are, in heights: across (the left's; the right's is the mirror image), up.
_STANDING = {
    "pelvis": (0.0, 0.53),
    "chest": (0.0, 0.68),
    "neck": (0.0, 0.83),
    "head": (0.0, 0.92),
    "shoulder": (0.105, 0.805),
    "elbow": (0.20, 0.66),
    "hand": (0.285, 0.53),
    "hip": (0.055, 0.515),
    "knee": (0.075, 0.285),
    "foot": (0.09, 0.05),
}
#: Half widths at both ends of every bone, in heights, from the front and from the side: a dressed person's, by eye.
_WIDTHS = {
    "chest": ((0.085, 0.09), (0.065, 0.07)),
    "neck": ((0.09, 0.07), (0.07, 0.05)),
    "head": ((0.032, 0.055), (0.035, 0.065)),
    "shoulder": ((0.06, 0.042), (0.05, 0.042)),
    "elbow": ((0.036, 0.026), (0.036, 0.026)),
    "hand": ((0.026, 0.02), (0.026, 0.02)),
    "hip": ((0.08, 0.06), (0.07, 0.06)),
    "knee": ((0.058, 0.04), (0.06, 0.04)),
    "foot": ((0.038, 0.024), (0.04, 0.026)),
}
#: What goes on beyond the last joint: how far, in parts of the bone, and its half width in heights.
_TIPS = {"head": (0.55, 0.05), "hand": (0.35, 0.022), "foot": (0.14, 0.03)}
#: The share of the shoulders' and hips' distance that is seen, and how far forward a foot points, by view.
_TURNED = {"front": (1.0, 0.0), "half profile": (0.6, 0.05), "side": (0.12, 0.08)}


@dataclass(frozen=True, eq=False)
class Template:
    """A person's shape in one view: its joints' ``names`` and ``marks`` (16, 2), ``bones``, ``layers`` and ``mesh``."""

    names: tuple[str, ...]
    marks: Floats
    bones: NDArray[np.int64]
    layers: tuple[Layer, ...]
    mesh: LayeredMesh

    @property
    def handle_ends(self) -> tuple[NDArray[np.int64], Floats]:
        """The two joints of every handle's bone (h, 2), and its place between them (h,)."""
        return self.bones[self.mesh.handle_bone], self.mesh.handle_fraction


def person_template(view: View) -> Template:
    """Return the template of a view: one layer from the front, four from the side and in half profile.

    Views from behind have the layers of those from before. In half profile and from the side the left is nearer.

    Examples
    --------
    >>> [len(person_template(view).layers) for view in ("front", "half profile", "side")]
    [1, 4, 4]
    """
    seen = {"back": "front", "half back": "half profile"}.get(view, str(view))
    across, forward = _TURNED[seen]
    marks = np.array([_place(name, across) for name in MARKERS])
    bones = np.array(sorted(bones_between(MARKERS), key=lambda bone: _depth(int(bone[1]))), np.int64)
    size = (2 * _ROOM + _HEIGHT, 2 * _ROOM + _HEIGHT)
    parts = [_part(marks[bone], MARKERS[bone[1]], seen, forward, size) for bone in bones]
    groups = _groups(bones, seen)
    body = list(groups).index("body")
    layers = tuple(
        Layer(name, own, region := _union([parts[bone] for bone in own]), region, *_hangs(name, bones, own, body))
        for name, own in groups.items()
    )
    bone_map = np.zeros(size, np.uint8)
    for index, part in enumerate(parts):
        bone_map[part] = index + 1
    source = PuppetInput(
        image=np.zeros((*size, 3), np.uint8),
        mask=bone_map > 0,
        names=MARKERS,
        marks=marks,
        visible=np.ones(len(MARKERS), bool),
        bones=bones,
    )
    mesh = layered_mesh(source, layers, bone_map, spacing=_HEIGHT / 32)
    return Template(MARKERS, marks, bones, layers, mesh)


def fit_template(template: Template, names: tuple[str, ...], marks: Floats) -> Floats:
    """The template's vertices (n, 2) when its joints are at the ``marks`` (J, 2) of the joints ``names``.

    As-rigid-as-possible from the template at the figure's size (section 6). Joints that the figure lacks follow.

    Raises
    ------
    ValueError
        For a figure without a whole bone of a person.
    """
    known = {name: mark for name, mark in zip(names, marks, strict=True) if name in template.names}
    target = np.array([known.get(name, np.full(2, np.nan)) for name in template.names])
    spans = np.linalg.norm(np.diff(target[template.bones], axis=1)[:, 0], axis=1)
    own = np.linalg.norm(np.diff(template.marks[template.bones], axis=1)[:, 0], axis=1)
    whole = np.isfinite(spans) & (own > 1)
    if not whole.any():
        raise ValueError("joints: want both ends of one of a person's bones or more")
    scale = float(np.median(spans[whole] / own[whole]))
    ends, part = template.handle_ends
    places = target[ends[:, 0]] + part[:, None] * (target[ends[:, 1]] - target[ends[:, 0]])
    placed = np.isfinite(places).all(axis=1)
    deformer = Deformer(template.mesh.vertices * scale, template.mesh.triangles, template.mesh.handles[placed])
    return deformer.deform(places[placed], iterations=4)


def covered(vertices: Floats, triangles: NDArray[np.int64], size: tuple[int, int]) -> Flags:
    """The pixels (H, W) that a mesh covers in a picture of ``size`` (width, height)."""
    canvas = np.zeros((size[1], size[0]), np.uint8)
    for corners in np.rint(vertices[triangles] * 16).astype(np.int32):
        cv2.fillConvexPoly(canvas, corners, 1, cv2.LINE_8, 4)
    return canvas.astype(bool)


def _place(name: str, across: float) -> tuple[float, float]:
    side, _, joint = name.rpartition("_")
    x, up = _STANDING[joint]
    sign = {"left": 1.0, "right": -1.0, "": 0.0}[side]
    # A turned figure's arms still hang beside it: one a little before the trunk, one behind.
    wide = across if joint in ("shoulder", "hip") else max(across, 0.45)
    return _ROOM + _HEIGHT * (0.5 + sign * wide * x), _ROOM + _HEIGHT * (1 - up)


def _depth(joint: int) -> int:
    """How many bones lead to a marker from the pelvis."""
    kinds = ("pelvis", "chest", "neck", "head")
    name = MARKERS[joint].rpartition("_")[2]
    chain = {"shoulder": 3, "elbow": 4, "hand": 5, "hip": 1, "knee": 2, "foot": 3}
    return kinds.index(name) if name in kinds else chain[name]


def _part(ends: Floats, child: str, view: str, forward: float, size: tuple[int, int]) -> Flags:
    """The pixels of one bone's part of the template."""
    joint = child.rpartition("_")[2]
    first, last = (_HEIGHT * width for width in _WIDTHS[joint][view == "side"])
    along = ends[1] - ends[0]
    reach, tip = _TIPS.get(joint, (0.0, 0.0))
    places = [(ends[0] + t * along, first + t * (last - first)) for t in np.linspace(0, 1, 40)]
    if reach:
        toe = np.array([forward * _HEIGHT, 0.0]) if joint == "foot" else np.zeros(2)
        beyond = [ends[1] + t * (reach * along + toe) for t in np.linspace(0, 1, 20)]
        places += [
            (place, last + t * (tip * _HEIGHT - last)) for place, t in zip(beyond, np.linspace(0, 1, 20), strict=True)
        ]
    canvas = np.zeros(size, np.uint8)
    for place, radius in places:
        cv2.circle(canvas, tuple(np.rint(place * 16).astype(int).tolist()), round(radius * 16), 1, -1, cv2.LINE_8, 4)
    return canvas.astype(bool)


def _groups(bones: NDArray[np.int64], view: str) -> dict[str, tuple[int, ...]]:
    """The bones of each layer, front to back."""
    limbs: dict[str, tuple[int, ...]] = {"left arm": (), "body": (), "right leg": (), "right arm": ()}
    for index, joint in enumerate(bones[:, 1]):
        side, _, kind = MARKERS[joint].rpartition("_")
        limb = {"elbow": "arm", "hand": "arm", "knee": "leg", "foot": "leg"}.get(kind, "")
        name = f"{side} {limb}"
        name = name if view != "front" and name in limbs else "body"
        limbs[name] += (index,)
    return {name: own for name, own in limbs.items() if own}


def _hangs(name: str, bones: NDArray[np.int64], own: tuple[int, ...], body: int) -> tuple[int, int]:
    return (-1, -1) if name == "body" else (int(bones[own[0], 0]), body)


def _union(parts: list[Flags]) -> Flags:
    return np.asarray(np.any(parts, axis=0))
