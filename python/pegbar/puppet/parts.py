"""Which bone every pixel of a figure belongs to: regions that grow from the bones inside the figure.

An arm that lies beside the body is far from it along the inside of the mask, however near it is across the gap; a
thick limb grows faster than a thin one, so that a belly is no arm's; and lines and borders of colours slow all of them,
so that they meet where the drawing itself parts them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.scene.drawn_skeleton import limb_chains
from pegbar.scene.puppet_input import PuppetInput

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Labels = NDArray[np.uint8]
#: How much dearer a step over the strongest borders of the picture is than one over plain colour.
BORDER_COST = 6.0
#: A limb on the trunk seems as thick as the trunk: no bone is thicker than so many times its chain's thin end.
_MOST_SWELL = 1.6


@dataclass(frozen=True, eq=False)
class Parts:
    """``bones`` (H, W) uint8: v + 1 on what belongs to bone v, 0 outside; ``radii`` (B,): half widths in pixels."""

    bones: Labels
    radii: Floats


def grow_parts(source: PuppetInput, mask: Flags) -> Parts:
    """Tell which bone each pixel of ``mask`` (H, W) belongs to.

    Raises
    ------
    ValueError
        For more than 255 bones.
    """
    if len(source.bones) > 255:
        raise ValueError(f"joints: want at most 256, got {len(source.names)}")
    radii = bone_radii(source, mask)
    costs = np.where(mask, 1 + BORDER_COST * borders(source.image, mask), np.inf).astype(np.float32)
    seeds = np.zeros(mask.shape, np.uint8)
    chains = limb_chains(source.names, source.bones)
    limbs = {bone for chain in chains for bone in chain}
    # Limbs are drawn over the trunk's bones, which have room elsewhere.
    for bone in sorted(range(len(source.bones)), key=lambda bone: bone in limbs):
        start, end = (tuple(np.rint(source.marks[joint]).astype(int).tolist()) for joint in source.bones[bone])
        cv2.line(seeds, start, end, bone + 1, 1)
    seeds[~mask] = 0
    grown, _ = _kernels.geodesic_labels(seeds, costs, 1 / radii)
    # Pieces that no bone reaches belong to the nearest region.
    return Parts(_kernels.grow_labels(grown, mask.view(np.uint8), None), radii)


def bone_radii(source: PuppetInput, mask: Flags) -> Floats:
    """The bones' half widths (B,) in pixels: how far it is from them to the figure's outline, 1 at least."""
    inside = cv2.distanceTransform(mask.view(np.uint8), cv2.DIST_L2, 5)
    depths = [_along(inside, source.marks[bone]) for bone in source.bones]
    radii = np.array([np.median(depth) for depth in depths])
    for chain in limb_chains(source.names, source.bones):
        thin = np.percentile(np.concatenate([depths[bone] for bone in chain]), 25)
        radii[chain] = np.minimum(radii[chain], max(float(thin), 1.0) * _MOST_SWELL)
    least: Floats = np.maximum(radii, 1.0)
    return least


def borders(image: NDArray[np.uint8], mask: Flags) -> Floats:
    """How much of a border there is at every pixel (H, W), 0 to 1: the gradient as part of ``mask``'s strong ones."""
    gray = cv2.GaussianBlur(cv2.cvtColor(np.ascontiguousarray(image[..., :3]), cv2.COLOR_RGB2GRAY), (0, 0), 1.0)
    across, down = (cv2.Sobel(gray, cv2.CV_32F, dx, 1 - dx, ksize=3) for dx in (1, 0))
    strength = cv2.magnitude(across, down)
    strong = float(np.percentile(strength[mask], 95)) if mask.any() else 0.0
    share: Floats = np.minimum(strength / max(strong, 1.0), 1).astype(np.float64)
    return share


def _along(depth: NDArray[np.float32], ends: Floats) -> Floats:
    """Values of a map along the middle of a bone."""
    places = ends[0] + np.linspace(0.15, 0.85, 15)[:, None] * (ends[1] - ends[0])
    columns, rows = np.rint(places).astype(int).T
    return np.asarray(depth[rows.clip(0, depth.shape[0] - 1), columns.clip(0, depth.shape[1] - 1)], np.float64)


def chain_of(chains: Sequence[Sequence[int]], count: int) -> NDArray[np.int64]:
    """The chain each of ``count`` bones is in (B,), -1 for the trunk's."""
    owner = np.full(count, -1, np.int64)
    for place, chain in enumerate(chains):
        owner[list(chain)] = place
    return owner
