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
from pegbar.layer.segmentation import palette_labels
from pegbar.scene.drawn_skeleton import limb_chains
from pegbar.scene.puppet_input import PuppetInput

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Labels = NDArray[np.uint8]
#: How much dearer a step over the strongest borders of the picture is than one over plain colour.
BORDER_COST = 2.0
#: A limb on the trunk seems as thick as the trunk: no bone is thicker than so many times its chain's thin end.
_MOST_SWELL = 1.6
#: A limb lies over a thicker part where the outline is so many half widths away; this share of them is then its own.
_OVER, _BROAD = 1.25, 0.7


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
    inside = cv2.distanceTransform(mask.view(np.uint8), cv2.DIST_L2, 5)
    ways = [bone_way(source.marks[bone], inside) for bone in source.bones]
    radii = _radii(source, ways, inside)
    costs = np.where(mask, 1 + BORDER_COST * borders(source.image, mask), np.inf).astype(np.float32)
    seeds = _seeds(source, ways, radii, inside)
    grown, _ = _kernels.geodesic_labels(seeds, costs, 1 / radii)
    # Pieces that no bone reaches belong to the nearest region.
    grown = _kernels.grow_labels(grown, mask.view(np.uint8), None)
    return Parts(grown if source.segmentation is None else _painted(source, mask, grown, radii), radii)


def _seeds(source: PuppetInput, ways: Sequence[NDArray[np.intp]], radii: Floats, inside: NDArray[np.float32]) -> Labels:
    """Where the bones' regions begin (H, W): along the bones, and broadly where a limb lies over a thicker part.

    The trunk's bones run under such a limb and grow faster than it does.
    """
    seeds = np.zeros(inside.shape, np.uint8)
    chains = limb_chains(source.names, source.bones)
    limbs = {bone for chain in chains for bone in chain}
    for bone in range(len(source.bones)):
        if bone not in limbs:
            seeds[tuple(ways[bone].T)] = bone + 1
    for chain in chains:
        for bone in chain:
            way = ways[bone][len(ways[bone]) // 3 :] if bone == chain[0] else ways[bone]
            for row, column in way[inside[tuple(way.T)] > _OVER * radii[bone]]:
                cv2.circle(seeds, (int(column), int(row)), round(_BROAD * radii[bone]), bone + 1, -1)
    for bone in limbs:
        seeds[tuple(ways[bone].T)] = bone + 1
    seeds[inside == 0] = 0
    return seeds


def _painted(source: PuppetInput, mask: Flags, grown: Labels, radii: Floats) -> Labels:
    """The bones of a figure whose limbs are painted in colours: of each limb its own, of the trunk all others."""
    assert source.segmentation is not None
    children = {source.names[int(joint)]: bone for bone, joint in enumerate(source.bones[:, 1])}
    joints = set(source.names)
    limbs = [limb for limb in source.limbs if {limb.start, limb.end} <= joints]
    own = [children[limb.end] if limb.end in children and limb.start != "neck" else None for limb in limbs]
    own = [children["head"] if limb.end == "head" else bone for limb, bone in zip(limbs, own, strict=True)]
    others = [bone for bone in range(len(source.bones)) if bone not in own]
    colors = np.array([limb.color or (0, 0, 0) for limb in limbs], np.uint8)
    painted = palette_labels(source.segmentation, colors, np.arange(1, len(limbs) + 1), tolerance=0).labels
    painted = _kernels.grow_labels(np.where(mask, painted, 0).astype(np.uint8), mask.view(np.uint8), None)
    result = np.zeros_like(grown)
    for index, bone in enumerate(own):
        here = painted == index + 1
        if bone is not None:
            result[here] = bone + 1
        elif others:
            places = np.argwhere(here)[:, ::-1].astype(np.float64)
            distances = bone_distances(places, source.marks[source.bones[others]])[0] / radii[others]
            result[here] = np.array(others)[distances.argmin(axis=1)] + 1
    return result


def bone_way(ends: Floats, inside: NDArray[np.float32]) -> NDArray[np.intp]:
    """The pixels (K, 2), row and column, from one end of a bone to the other: straight, or bent where the figure is.

    ``inside`` (H, W) is how far it is to the figure's outline, 0 outside. A bone that leaves the figure, as that of an
    arm drawn in one curve does, goes along the middle of what joins its ends; where nothing does it is straight, as far
    as it lies on the figure.
    """
    steps = int(np.ceil(np.abs(np.diff(ends, axis=0)).max())) + 1
    line = np.rint(np.linspace(ends[0], ends[1], steps)).astype(np.intp)[:, ::-1]
    line = line.clip(0, np.array(inside.shape) - 1)
    within = inside[tuple(line.T)] > 0
    if within.all() or not (within[0] and within[-1]):
        return np.asarray(line[within], np.intp)
    seeds = np.zeros(inside.shape, np.uint8)
    seeds[tuple(line[0])] = 1
    costs = np.where(inside > 0, 1 / np.maximum(inside, 0.5), np.inf).astype(np.float32)
    _, far = _kernels.geodesic_labels(seeds, costs, np.ones(1))
    if not np.isfinite(far[tuple(line[-1])]):
        return np.asarray(line[within], np.intp)
    way = [line[-1]]
    while far[tuple(way[-1])] > 0:
        top, left = np.maximum(way[-1] - 1, 0)
        near = far[top : way[-1][0] + 2, left : way[-1][1] + 2]
        row, column = np.unravel_index(near.argmin(), near.shape)
        way.append(np.array([top + row, left + column]))
    return np.array(way)


def _radii(source: PuppetInput, ways: Sequence[NDArray[np.intp]], inside: NDArray[np.float32]) -> Floats:
    """The bones' half widths (B,) in pixels: how far it is from them to the figure's outline, 1 at least."""
    depths = [inside[tuple(way[len(way) // 6 : len(way) - len(way) // 6].T)] for way in ways]
    known = [depth if len(depth) else np.ones(1, np.float32) for depth in depths]
    radii = np.array([np.median(depth) for depth in known], np.float64)
    for chain in limb_chains(source.names, source.bones):
        thin = np.percentile(np.concatenate([known[bone] for bone in chain]), 25)
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


def bone_distances(points: Floats, ends: Floats) -> tuple[Floats, Floats]:
    """Distances (N, V) of points (N, 2) from bones (V, 2, 2), and where along a bone (0 to 1) its nearest place is."""
    start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    squared = np.maximum((along**2).sum(axis=1), 1e-12)
    fractions: Floats = (((points[:, None] - start) * along).sum(axis=2) / squared).clip(0, 1)
    distances: Floats = np.linalg.norm(points[:, None] - start - fractions[..., None] * along, axis=2)
    return distances, fractions
