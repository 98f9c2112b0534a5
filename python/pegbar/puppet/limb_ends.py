"""Hands and feet in a photo: a second cut around each, with colours of its own place (after Rother et al. 2004).

A graph cut over the whole figure knows a shoe from the wall, but not a dark shoe from a dark floor: the colours of the
rest outweigh theirs. Around one end of a limb there are few colours; they are spread over the whole range, and how far
a pixel is from the limb counts as a colour does.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.puppet.parts import Parts
from pegbar.scene.drawn_skeleton import limb_chains
from pegbar.scene.puppet_input import PuppetInput

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Labels = NDArray[np.uint8]
#: The window around an end reaches so far, in lengths of the trunk, and what lies around its mark is surely the figure.
WINDOW, _SURE = 0.4, 0.06
#: So many grey levels the distance from the limb counts at the farthest that the figure may reach.
_FAR = 45.0
_ROUNDS = 5
#: Colours (CIELAB) on both sides of an outline that are nearer than this do not tell the figure from what is behind it.
_ALIKE = 9.0
#: The share of a limb's outline that may be so before a user should hear of it.
_UNSURE = 0.3


def cut_ends(source: PuppetInput, mask: Flags, seeds: Labels, likely: Flags, trunk: float, reach: float) -> Flags:
    """Return ``mask`` (H, W) with the ends of limbs found again, each by its own colours.

    Parameters
    ----------
    source : PuppetInput
        Picture, marks and bones.
    mask : (H, W) bool
        The figure by one cut over all of it.
    seeds : (H, W) uint8
        What is surely, probably and surely not the figure, in cv2's numbers.
    likely : (H, W) bool
        The template's place.
    trunk, reach : float
        The trunk's length, and how far beyond the template the figure may reach, in pixels.
    """
    result = mask.copy()
    outside = cv2.distanceTransform((~likely).view(np.uint8), cv2.DIST_L2, 5)
    away = outside - cv2.distanceTransform(likely.view(np.uint8), cv2.DIST_L2, 5)
    for chain in limb_chains(source.names, source.bones):
        end = source.marks[source.bones[chain[-1], 1]]
        low = np.maximum(np.floor(end - WINDOW * trunk).astype(int), 0)
        high = np.minimum(np.ceil(end + WINDOW * trunk).astype(int) + 1, source.image_size)
        if (high - low < 8).any():
            continue
        window = slice(low[1], high[1]), slice(low[0], high[0])
        near = np.abs(away[window]) < reach
        if not near.any():
            continue
        labels = np.ascontiguousarray(seeds[window])
        cv2.circle(labels, np.rint(end - low).astype(int).tolist(), max(1, round(_SURE * trunk)), cv2.GC_FGD, -1)
        found = _cut(_spread(source.image[window], away[window] / reach, near), labels)
        own = _round(labels.shape, end - low, WINDOW * trunk)
        result[window] = np.where(own, _hanging(found, labels), result[window])
    return result


def unsure_notes(figure: PuppetInput, parts: Parts) -> tuple[str, ...]:
    """What to say of limbs whose found outline (``figure.mask``) the picture hardly shows."""
    assert figure.mask is not None
    inside, outside = _beside(figure.image, figure.mask)
    unsure = np.linalg.norm(inside - outside, axis=2) < _ALIKE
    line = figure.mask & ~cv2.erode(figure.mask.view(np.uint8), np.ones((3, 3), np.uint8), borderValue=1).astype(bool)
    doubtful = []
    for chain in limb_chains(figure.names, figure.bones):
        bone = chain[-1]
        end = figure.marks[figure.bones[bone, 1]]
        here = line & _round(line.shape, end, 3 * float(parts.radii[bone])) & np.isin(parts.bones, np.array(chain) + 1)
        if here.any() and unsure[here].mean() > _UNSURE:
            doubtful.append(figure.names[int(figure.bones[bone, 1])])
    if not doubtful:
        return ()
    return (
        f"the picture hardly tells the figure from what is behind it at {', '.join(doubtful)}: if the outline is wrong "
        "there, give a mask",
    )


def _spread(image: NDArray[np.uint8], away: Floats, near: Flags) -> Labels:
    """The two colours (of 3 channels) that differ most ``near`` the limb, and how far it is ``away``: (h, w, 3)."""
    # Roots, since differences of dark colours are seen as larger than their numbers say.
    colors = np.sqrt(image[..., :3].astype(np.float64))
    low, high = np.percentile(colors[near], [2, 98])
    colors = np.clip((colors - low) / max(high - low, 1e-9), 0, 1) * 255
    middle = colors[near].mean(axis=0)
    axes = np.linalg.svd(colors[near] - middle, full_matrices=False)[2][:2]
    channels = np.dstack([(colors - middle) @ axes.T, _FAR * np.clip(away, -2, 2)])
    return np.ascontiguousarray(np.clip(128 + channels, 0, 255).astype(np.uint8))


def _cut(image: Labels, labels: Labels) -> Flags:
    if len(np.unique(labels % 2)) < 2:
        return np.asarray(labels % 2 == 1)
    cv2.setRNGSeed(0)
    cv2.grabCut(image, labels, None, np.zeros((1, 65)), np.zeros((1, 65)), _ROUNDS, cv2.GC_INIT_WITH_MASK)
    return np.isin(labels, (cv2.GC_FGD, cv2.GC_PR_FGD))


def _hanging(found: Flags, labels: Labels) -> Flags:
    """The pieces that hang on what is surely the figure, without threads one or two pixels wide."""
    sure = labels == cv2.GC_FGD
    opened = cv2.morphologyEx(found.view(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)).astype(bool) | sure
    pieces = cv2.connectedComponents(opened.view(np.uint8), connectivity=4)[1]
    return np.isin(pieces, np.unique(pieces[sure]))


def _round(shape: tuple[int, ...], centre: Floats, radius: float) -> Flags:
    rows, columns = np.ogrid[: shape[0], : shape[1]]
    return np.asarray((columns - centre[0]) ** 2 + (rows - centre[1]) ** 2 < radius**2)


def _beside(image: NDArray[np.uint8], mask: Flags) -> tuple[Floats, Floats]:
    """The mean colours (H, W, 3) of the figure and of what is behind it around each pixel, in CIELAB."""
    colors = cv2.cvtColor(np.ascontiguousarray(image[..., :3]).astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    # The outline itself is a blend of both.
    narrow = np.ones((3, 3), np.uint8)
    sides = cv2.erode(mask.view(np.uint8), narrow), cv2.erode((~mask).view(np.uint8), narrow)
    means = []
    for side in sides:
        weight = cv2.blur(side.astype(np.float32), (9, 9))
        means.append(cv2.blur(colors * side[..., None], (9, 9)) / np.maximum(weight, 1e-6)[..., None])
    return np.asarray(means[0], np.float64), np.asarray(means[1], np.float64)
