"""From a picture with joints and a clip to a puppet (Hornung et al. 2007, sections 5 and 6)."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.puppet.inpaint import Completion, Method
from pegbar.puppet.layers import Layer
from pegbar.puppet.mesh import layered_mesh, mesh_spacing
from pegbar.puppet.parts import grow_parts
from pegbar.puppet.texture import layer_textures, mask_alpha
from pegbar.puppet.view import View, seen_pose
from pegbar.scene.motion import Motion
from pegbar.scene.puppet import Puppet
from pegbar.scene.puppet_input import PuppetInput


def make_puppet(
    source: PuppetInput,
    motion: Motion,
    *,
    clip: str = "",
    view: View | None = None,
    layer_order: Sequence[str] | None = None,
    field_of_view: float | None = None,
    completion: Method | Completion = "auto",
    background: bool = True,
) -> Puppet:
    """Make a puppet of the figure in a picture: camera and pose from a clip, layers, mesh, textures.

    Parameters
    ----------
    source : PuppetInput
        Picture, joints and mask, as `read_puppet_input` reads them.
    motion : Motion
        The clip that the figure is to perform.
    clip : str
        What to call it.
    view : {"front", "half profile", "side", "half back", "back"}, optional
        From which side the figure is seen. None: found from the camera.
    layer_order : sequence of str, optional
        Layers front to back, where another order than found is wanted.
    field_of_view : float, optional
        Horizontal, radians; None finds one near the usual.
    completion : {"auto", "patch", "diffuse"} or function
        How hidden parts are filled in: see `pegbar.puppet.inpaint.complete`.
    background : bool
        Whether the picture behind the figure is completed as well.

    Raises
    ------
    ValueError
        For a wrong option, or a clip that moves too few of the joints.
    """
    seen = seen_pose(source, motion, view=view, field_of_view=field_of_view)
    mask = source.mask
    assert mask is not None
    parts = grow_parts(source, mask)
    layers = [Layer("body", tuple(range(len(source.bones))), mask, mask)]
    spacing = mesh_spacing(float(mask.sum()))
    mesh = layered_mesh(source, layers, parts.bones, spacing)
    textures = layer_textures(source.image[..., :3], figure_alpha(source), layers, completion)
    return Puppet(
        names=source.names,
        marks=source.marks,
        bones=source.bones,
        drives=source.drives,
        layers=tuple(layer.name for layer in layers),
        textures=textures,
        background=None,
        camera=seen.camera,
        pose=seen.pose,
        view=seen.view,
        image_size=source.image_size,
        pose_frame=seen.frame,
        clip=clip,
        fitted=seen.fitted,
        bone_layer=_bone_layers(layers, len(source.bones)),
        notes=(*source.notes, *seen.notes),
        **vars(mesh),
    )


def figure_alpha(source: PuppetInput) -> NDArray[np.float32]:
    """The figure's coverage (H, W) in 0..1: the picture's own alpha, else the mask's with a smooth outline."""
    assert source.mask is not None
    if source.image.shape[2] == 4 and source.image[..., 3].min() < 128:
        own = source.image[..., 3].astype(np.float32) / 255
        near = cv2.dilate(source.mask.view(np.uint8), np.ones((5, 5), np.uint8))
        return np.where(near, own, 0).astype(np.float32)
    return mask_alpha(source.mask)


def _bone_layers(layers: Sequence[Layer], count: int) -> NDArray[np.int64]:
    owner = np.zeros(count, np.int64)
    for index, layer in enumerate(layers):
        owner[list(layer.bones)] = index
    return owner
