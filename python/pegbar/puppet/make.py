"""From a picture with joints and a clip to a puppet (Hornung et al. 2007, sections 5 and 6).

Three steps, so that what a picture needs once is not done for every clip: `prepare_figure` finds where the figure and
its bones are; `plan_figure` what a clip makes of it (camera, pose, layers); `build_puppet` cuts, meshes and paints the
layers.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.puppet.alpha import Matting, figure_alpha
from pegbar.puppet.check import Pieces, checked
from pegbar.puppet.inpaint import Completion, Method, complete
from pegbar.puppet.layers import LayerPlan, cut_layers, plan_layers
from pegbar.puppet.limb_ends import unsure_notes
from pegbar.puppet.limbs import drawn_limbs
from pegbar.puppet.mesh import layered_mesh, mesh_spacing
from pegbar.puppet.parts import Parts, grow_parts
from pegbar.puppet.silhouette import find_silhouette
from pegbar.puppet.texture import layer_textures
from pegbar.puppet.view import SeenPose, View, seen_pose
from pegbar.scene.drawn_skeleton import limb_chains
from pegbar.scene.motion import Motion
from pegbar.scene.puppet import Puppet
from pegbar.scene.puppet_input import PuppetInput

#: The share of a limb's half width that outlines may take.
_RIM = 0.3
#: So many half widths of a limb around the figure the background is completed too: shadows and soft edges.
_MARGIN = 0.35
#: At feet, so many half widths around the joint, it is completed farther: they throw shadows, and soles are lost.
_FOOT, _SHADOW = 4.0, 1.2


@dataclass(frozen=True, eq=False)
class FigurePlan:
    """What a clip makes of a figure: how it is ``seen``, and its ``layers``."""

    seen: SeenPose
    layers: LayerPlan


def make_puppet(
    source: PuppetInput,
    motion: Motion,
    *,
    clip: str = "",
    view: View | None = None,
    layer_order: Sequence[str] | None = None,
    field_of_view: float | None = None,
    completion: Method | Completion = "auto",
    background: bool = False,
    pieces: Pieces = "join",
    matting: Matting = "auto",
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
    completion : {"auto", "patch", "diffuse", "flat"} or function
        How hidden parts are filled in: see `pegbar.puppet.inpaint.complete`.
    background : bool
        Whether the picture behind the figure is completed as well; it takes seconds. Nothing is behind a figure whose
        picture is transparent round it.
    pieces : {"join", "drop"}
        What is done with pieces of the mask that no bone runs through.
    matting : {"auto", "closed form", "guided", "mask"}
        How soft edges are found: see `pegbar.puppet.alpha.figure_alpha`. "auto" is "mask" where a mask is given or the
        figure is drawn on paper.

    Returns
    -------
    Puppet

    Raises
    ------
    ValueError
        For a wrong option, joints outside the mask, or a clip that moves too few of the joints.
    """
    figure = prepare_figure(source, view=view, pieces=pieces, matting=matting)
    plan = plan_figure(figure, motion, view=view, layer_order=layer_order, field_of_view=field_of_view)
    return build_puppet(figure, plan, clip=clip, completion=completion, background=background)


def prepare_figure(
    source: PuppetInput, *, view: View | None = None, pieces: Pieces = "join", matting: Matting = "auto"
) -> PuppetInput:
    """Return the figure with what does not depend on a clip: its mask and coverage, and where its bones are.

    Parameters and errors are those of `make_puppet`; a figure that is prepared already is returned as it is.
    """
    if source.bone_map is not None:
        return source
    image = np.ascontiguousarray(source.image[..., :3])
    soft, photo = matting != "auto", False
    if source.mask is None:
        mask, on_paper = find_silhouette(source, view)
        source, photo = dataclasses.replace(source, mask=mask), not on_paper
    figure = checked(source, pieces=pieces)
    whole = figure.mask
    assert whole is not None
    if soft or photo:
        figure = dataclasses.replace(figure, alpha=figure_alpha(image, whole, matting))
    parts = grow_parts(figure, whole)
    if photo:
        figure = dataclasses.replace(figure, notes=(*figure.notes, *unsure_notes(figure, parts)))
    return dataclasses.replace(figure, bone_map=parts.bones, radii=parts.radii)


def plan_figure(
    figure: PuppetInput,
    motion: Motion,
    *,
    view: View | None = None,
    layer_order: Sequence[str] | None = None,
    field_of_view: float | None = None,
) -> FigurePlan:
    """Return how a prepared figure is seen in a clip, and the layers that this makes; as `make_puppet`."""
    seen = seen_pose(figure, motion, view=view, field_of_view=field_of_view)
    limbs = drawn_limbs(figure, _parts(figure), seen)
    return FigurePlan(seen, plan_layers(len(figure.bones), limbs, seen.view, layer_order))


def build_puppet(
    figure: PuppetInput,
    plan: FigurePlan,
    *,
    clip: str = "",
    completion: Method | Completion = "auto",
    background: bool = False,
) -> Puppet:
    """Return the puppet of a prepared figure and a plan: layers cut, meshed and painted; as `make_puppet`."""
    assert figure.mask is not None
    assert figure.alpha is not None
    parts, image = _parts(figure), np.ascontiguousarray(figure.image[..., :3])
    layers = cut_layers(figure, figure.mask, parts, plan.layers)
    mesh = layered_mesh(figure, layers, parts.bones, mesh_spacing(float(figure.mask.sum())))
    thick = _limb_radius(figure, parts)
    behind = None
    if background and (figure.image.shape[2] == 3 or figure.image[..., 3].min() >= 128):
        hole = _hole(figure, thick)
        behind = complete(image, hole, completion) if not hole.all() else None
    return Puppet(
        names=figure.names,
        marks=figure.marks,
        bones=figure.bones,
        drives=figure.drives,
        layers=tuple(layer.name for layer in layers),
        textures=layer_textures(image, figure.alpha, layers, completion, rim=_RIM * thick),
        background=behind,
        bone_layer=plan.layers.bone_layer,
        notes=(),
        camera=plan.seen.camera,
        pose=plan.seen.pose,
        view=plan.seen.view,
        image_size=figure.image_size,
        **vars(mesh),
    ).changed(**_seen_fields(figure, plan, clip))


def pose_again(puppet: Puppet, figure: PuppetInput, plan: FigurePlan, *, clip: str = "") -> Puppet:
    """Return ``puppet`` as another clip shows it, whose plan has the same layers."""
    return puppet.changed(**_seen_fields(figure, plan, clip))


def _seen_fields(figure: PuppetInput, plan: FigurePlan, clip: str) -> dict[str, object]:
    seen = plan.seen
    return {
        "camera": seen.camera,
        "pose": seen.pose,
        "view": seen.view,
        "pose_frame": seen.frame,
        "fitted": seen.fitted,
        "drives": figure.drives,
        "clip": clip,
        "notes": (*figure.notes, *seen.notes),
    }


def _parts(figure: PuppetInput) -> Parts:
    assert figure.bone_map is not None
    assert figure.radii is not None
    return Parts(figure.bone_map, figure.radii)


def _hole(figure: PuppetInput, thick: float) -> NDArray[np.bool_]:
    """What of the picture (H, W) is completed where the figure is taken out: a margin more, at the feet a wide one."""
    assert figure.alpha is not None
    figures = (figure.alpha > 0).astype(np.uint8)
    feet = np.zeros_like(figures)
    for name, mark in zip(figure.names, figure.marks, strict=True):
        if figure.drives.get(name, "").endswith("_foot"):
            cv2.circle(feet, np.rint(mark).astype(int).tolist(), round(_FOOT * thick), 1, -1)
    size, wide = (2 * max(1, round(margin * thick)) + 1 for margin in (_MARGIN, _SHADOW))
    hole = cv2.dilate(figures, np.ones((size, size), np.uint8))
    hole |= cv2.dilate(figures & feet, np.ones((wide, wide), np.uint8))
    return np.asarray(hole, bool)


def _limb_radius(figure: PuppetInput, parts: Parts) -> float:
    """How thick the figure's limbs are: half their usual width, in pixels."""
    limbs = [bone for chain in limb_chains(figure.names, figure.bones) for bone in chain]
    return float(np.median(parts.radii[limbs or slice(None)]))
