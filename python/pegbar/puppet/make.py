"""From a picture with joints and a clip to a puppet (Hornung et al. 2007, sections 5 and 6)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pegbar.puppet.check import Pieces, checked
from pegbar.puppet.inpaint import Completion, Method
from pegbar.puppet.layers import Layer, cut_layers
from pegbar.puppet.limbs import drawn_limbs
from pegbar.puppet.mesh import layered_mesh, mesh_spacing
from pegbar.puppet.parts import Parts, grow_parts
from pegbar.puppet.texture import layer_textures
from pegbar.puppet.view import View, seen_pose
from pegbar.scene.drawn_skeleton import limb_chains
from pegbar.scene.motion import Motion
from pegbar.scene.puppet import Puppet
from pegbar.scene.puppet_input import PuppetInput

#: The share of a limb's half width that outlines may take.
_RIM = 0.3


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
    pieces: Pieces = "join",
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
    pieces : {"join", "drop"}
        What is done with pieces of the mask that no bone runs through.

    Raises
    ------
    ValueError
        For a wrong option, joints outside the mask, or a clip that moves too few of the joints.
    """
    source = checked(source, pieces=pieces)
    seen = seen_pose(source, motion, view=view, field_of_view=field_of_view)
    assert source.mask is not None
    assert source.alpha is not None
    mask = source.mask
    parts = grow_parts(source, mask)
    layers = cut_layers(source, mask, parts, drawn_limbs(source, parts, seen), seen.view, layer_order)
    spacing = mesh_spacing(float(mask.sum()))
    mesh = layered_mesh(source, layers, parts.bones, spacing)
    textures = layer_textures(
        source.image[..., :3], source.alpha, layers, completion, rim=_RIM * _limb_radius(source, parts)
    )
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


def _limb_radius(source: PuppetInput, parts: Parts) -> float:
    """How thick the figure's limbs are: half their usual width, in pixels."""
    limbs = [bone for chain in limb_chains(source.names, source.bones) for bone in chain]
    return float(np.median(parts.radii[limbs or slice(None)]))


def _bone_layers(layers: Sequence[Layer], count: int) -> NDArray[np.int64]:
    owner = np.zeros(count, np.int64)
    for index, layer in enumerate(layers):
        owner[list(layer.bones)] = index
    return owner
