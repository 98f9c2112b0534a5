"""A picture ready to be moved: a layered mesh with its skeleton, its textures, and the pose a camera sees in it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar import arrays
from pegbar.scene.camera import PerspectiveCamera

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]
Pixels = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Puppet:
    """A drawn or photographed figure as Hornung, Dekkers and Kobbelt (2007, section 6) prepare it for animation.

    All points are pixels of the picture: x right, y down, pixel centres at integers. Arrays are read-only.

    Parameters
    ----------
    names : tuple of J str
        Joints: canonical markers where they are such, any other name for further limbs.
    marks : (J, 2) float
        Where the joints are in the picture.
    bones : (B, 2) int
        Parent and child joint of every bone: a tree from its root outwards, so that a bone's parent joint is the root
        or the child of an earlier bone.
    drives : dict of str to str
        Joint -> the clip's marker that moves it: its own name for people; arms move the front legs of an animal.
    vertices : (n, 2) float
    triangles : (T, 3) int
        One mesh of all layers. Where layers meet they share vertices, so an edge may have more than two triangles.
    triangle_layer : (T,) int
        Index into ``layers``.
    layers : tuple of str
        Front to back as drawn.
    triangle_bone : (T,) int
        The bone a triangle hangs on; -1 for none.
    handles : (h,) int
        The vertices along the bones that the pose moves.
    handle_bone : (h,) int
    handle_fraction : (h,) float
        Where on which bone a handle is: 0 at its parent joint, 1 at its child.
    joint_handles : (J,) int
        Index into ``handles`` of the handle at a joint; -1 for a joint without one.
    boundary : (n,) bool
        Vertices on a layer's outline: inflation is 0 there.
    textures : tuple of (H, W, 4) uint8
        One a layer, straight alpha, in the picture's coordinates (texture coordinate = vertex). Colour is bled under
        alpha.
    background : (H, W, 3) uint8, optional
        The picture with the figure taken out and completed.
    camera : PerspectiveCamera
    pose : (J, 3) float
        World metres: the joints of the clip's pose in which ``camera`` sees the figure about as it is drawn.
    view : str
        Where the camera stands: "front", "half profile", "side", "back" or "half back".
    image_size : (width, height)
    pose_frame : int
        The clip's frame of ``pose``.
    clip : str
        The clip's name.
    fitted : bool
        Whether ``pose`` is the clip's. False for a figure that no pose is like (an animal's): ``pose`` is then the
        drawing itself, put upright before the camera, and the clip's bones turn its bones from there.
    bone_layer : (B,) int
        The layer on which a bone's own part of the figure is drawn.
    notes : tuple of str
        What a user should know.

    Raises
    ------
    ValueError
        For a wrong shape or dtype, a number that is not finite, or an index without what it points at.
    """

    names: tuple[str, ...]
    marks: Floats
    bones: Ints
    drives: Mapping[str, str]
    vertices: Floats
    triangles: Ints
    triangle_layer: Ints
    layers: tuple[str, ...]
    triangle_bone: Ints
    handles: Ints
    handle_bone: Ints
    handle_fraction: Floats
    joint_handles: Ints
    boundary: Flags
    textures: tuple[Pixels, ...]
    background: Pixels | None
    camera: PerspectiveCamera
    pose: Floats
    view: str
    image_size: tuple[int, int]
    pose_frame: int = 0
    clip: str = ""
    fitted: bool = True
    bone_layer: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        joints, bones, layers, corners = len(self.names), len(self.bones), len(self.layers), len(self.vertices)
        if not len(self.bone_layer):
            object.__setattr__(self, "bone_layer", np.zeros(bones, np.int64))
        self._floats("marks", (joints, 2))
        self._floats("vertices", ("n", 2))
        self._floats("handle_fraction", (len(self.handles),))
        self._floats("pose", (joints, 3))
        count = len(self.triangles)
        self._integers("bones", ("B", 2), 0, joints)
        self._integers("triangles", ("T", 3), 0, corners)
        self._integers("triangle_layer", (count,), 0, layers)
        self._integers("triangle_bone", (count,), -1, bones)
        self._integers("handles", ("h",), 0, corners)
        self._integers("handle_bone", (len(self.handles),), 0, bones)
        self._integers("joint_handles", (joints,), -1, len(self.handles))
        self._integers("bone_layer", (bones,), 0, layers)
        self._set("boundary", arrays.flags("boundary", self.boundary, (corners,)))
        if len(self.textures) != layers:
            raise ValueError(f"textures: want one for each of {layers} layers, got {len(self.textures)}")
        width, height = self.image_size
        pictures = tuple(arrays.image("textures", texture, (4,)) for texture in self.textures)
        for picture in pictures:
            arrays.same_size("textures", picture, "image_size", (height, width))
        object.__setattr__(self, "textures", tuple(_read_only(picture) for picture in pictures))
        if self.background is not None:
            self._set("background", arrays.image("background", self.background, (3,)))
            arrays.same_size("background", self.background, "image_size", (height, width))

    @property
    def parents(self) -> Ints:
        """Each joint's parent joint (J,), -1 for the root."""
        parents = np.full(len(self.names), -1, np.int64)
        parents[self.bones[:, 1]] = self.bones[:, 0]
        return parents

    def changed(self, **fields: Any) -> Puppet:
        """Return the puppet with other ``fields``."""
        return dataclasses.replace(self, **fields)

    def _floats(self, name: str, shape: arrays.Shape) -> None:
        self._set(name, arrays.floats(name, getattr(self, name), shape))

    def _integers(self, name: str, shape: arrays.Shape, low: int, count: int) -> None:
        self._set(name, arrays.integers(name, getattr(self, name), shape, low=low, high=count - 1))

    def _set(self, name: str, array: NDArray[Any]) -> None:
        object.__setattr__(self, name, _read_only(array))


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    """A view of ``array`` that cannot be written through."""
    view = array.view()
    view.flags.writeable = False
    return view
