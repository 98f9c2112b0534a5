"""Looks over what a puppet is to be made from before anything runs, and mends what can be mended."""

from __future__ import annotations

import dataclasses
from typing import Literal, get_args

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from pegbar.puppet.texture import mask_alpha
from pegbar.scene.puppet_input import PuppetInput

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Pieces = Literal["join", "drop"]
#: A joint may lie so far outside the figure, as part of the figure's extent, and at least so many pixels: it is then
#: taken to be at the nearest place inside.
TOLERANCE, LEAST_TOLERANCE = 0.03, 3.0
#: Joints are kept so many pixels inside the figure, where it is thick enough.
INSIDE = 1.5
#: Holes smaller than this part of the figure are specks.
SPECK = 0.0005
#: Pieces without joints smaller than this part of the figure are dirt, whatever is wanted.
_DIRT = 0.0002


def checked(source: PuppetInput, *, pieces: Pieces = "join") -> PuppetInput:
    """Return the figure with a mask in one piece that holds all its joints, its coverage, and notes of what was mended.

    Parameters
    ----------
    source : PuppetInput
        With a mask.
    pieces : {"join", "drop"}
        What is done with pieces of the mask that no bone runs through: joined with the nearest (nothing is painted
        between them) or left out. Pieces with joints are always joined, along the bone that leads there.

    Raises
    ------
    ValueError
        For every joint that lies too far outside the mask (with its distance), a mask that is empty or of another size
        than the picture, or an unknown option.
    """
    if pieces not in get_args(Pieces):
        raise ValueError(f"pieces: want join or drop, got {pieces!r}")
    if source.mask is None or not source.mask.any():
        raise ValueError(f"{source.source}: the mask is empty: nothing of the picture is the figure")
    mask, notes = _without_specks(source.mask)
    marks, problems, moved = _inside(source, mask)
    if problems:
        raise ValueError(f"{source.source}: " + "; ".join(problems))
    shown = mask
    mask, shown, more = _one_piece(dataclasses.replace(source, marks=marks), mask, shown, pieces)
    alpha = source.alpha if source.alpha is not None else _coverage(source, shown)
    notes = (*source.notes, *notes, *moved, *more)
    return dataclasses.replace(source, mask=mask, marks=marks, alpha=alpha, notes=notes)


def _coverage(source: PuppetInput, shown: Flags) -> NDArray[np.float32]:
    """The figure's coverage: the picture's own alpha, else the mask's with a smooth outline."""
    if source.image.shape[2] == 4 and source.image[..., 3].min() < 128:
        own = source.image[..., 3].astype(np.float32) / 255
        near = cv2.dilate(shown.view(np.uint8), np.ones((5, 5), np.uint8))
        return np.where(near, own, 0).astype(np.float32)
    return mask_alpha(shown)


def _without_specks(mask: Flags) -> tuple[Flags, tuple[str, ...]]:
    """The mask without tiny holes, and what there is to say about the larger ones."""
    count, holes, stats, centres = cv2.connectedComponentsWithStats((~mask).view(np.uint8), connectivity=4)
    edge = np.unique(np.concatenate([holes[0], holes[-1], holes[:, 0], holes[:, -1]]))
    inner = [hole for hole in range(1, count) if hole not in edge]
    areas = stats[:, cv2.CC_STAT_AREA]
    small = [hole for hole in inner if areas[hole] < max(SPECK * mask.sum(), 4)]
    large = [hole for hole in inner if hole not in small]
    notes = []
    if small:
        notes.append(f"{len(small)} holes of the mask are specks and were filled")
    if large:
        x, y = np.rint(centres[max(large, key=lambda hole: areas[hole])]).astype(int)
        largest = f"the largest of {areas[large].max()} pixels round ({x}, {y})"
        notes.append(f"the mask has {len(large)} hole{'s' * (len(large) > 1)}, {largest}: what is behind shows there")
    return mask | np.isin(holes, small), tuple(notes)


def _inside(source: PuppetInput, mask: Flags) -> tuple[Floats, list[str], tuple[str, ...]]:
    """The marks inside the mask, what cannot be put there, and what was moved far enough to tell."""
    apart = cv2.distanceTransform((~mask).view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    depth = cv2.distanceTransform(np.pad(mask.view(np.uint8), 1), cv2.DIST_L2, 5)[1:-1, 1:-1]
    most = max(LEAST_TOLERANCE, TOLERANCE * float(np.linalg.norm(np.ptp(np.argwhere(mask), axis=0))))
    deep = np.argwhere(depth > INSIDE)[:, ::-1]
    any_place = np.argwhere(mask)[:, ::-1]
    marks, problems, notes = source.marks.copy(), [], []
    for index, (name, mark) in enumerate(zip(source.names, source.marks, strict=True)):
        x, y = np.rint(mark).astype(int)
        within = 0 <= x < mask.shape[1] and 0 <= y < mask.shape[0]
        if within and depth[y, x] > INSIDE:
            continue
        nearest = any_place[np.argmin(((any_place - mark) ** 2).sum(axis=1))]
        off = float(np.linalg.norm(nearest - mark)) if not within or apart[y, x] > 0 else 0.0
        if off > most:
            problems.append(f"{name} lies {off:.0f} px outside the mask (nearest: {nearest[0]}, {nearest[1]})")
            continue
        if off > 1.5:
            notes.append(f"{name} lay {off:.0f} px outside the mask and was put inside")
        if len(deep):
            place = deep[np.argmin(((deep - mark) ** 2).sum(axis=1))]
            marks[index] = place if np.linalg.norm(place - mark) <= most else nearest
        else:
            marks[index] = nearest
    return marks, problems, tuple(notes)


def _one_piece(source: PuppetInput, mask: Flags, shown: Flags, pieces: Pieces) -> tuple[Flags, Flags, list[str]]:
    """The mask with its pieces joined or dropped, what of it is painted, and what was done."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8), connectivity=4)
    if count == 2:
        return mask, shown, []
    whole, area = mask.copy(), stats[:, cv2.CC_STAT_AREA]
    columns, rows = np.rint(source.marks).astype(int).T
    held = {int(label) for label in labels[rows, columns] if label}
    main = max(range(1, count), key=lambda label: (label in held, area[label]))
    loose = [label for label in range(1, count) if label not in held and label != main]
    dropped = [label for label in loose if pieces == "drop" or area[label] < _DIRT * mask.sum()]
    gone = np.isin(labels, dropped)
    whole, shown = whole & ~gone, shown & ~gone
    notes = []
    width = max(3, round(0.01 * float(np.linalg.norm(np.ptp(np.argwhere(mask), axis=0)))))
    if len(held) > 1:
        _bridge_bones(source, whole, labels, width)
        notes.append(f"{len(held)} pieces of the mask with joints were joined along their bones")
    joined = [label for label in loose if label not in dropped]
    for label in joined:
        _bridge(whole, labels == label, whole & (labels != label), width)
    if joined:
        notes.append(f"{len(joined)} pieces of the mask without joints were joined with the nearest")
    if dropped:
        notes.append(f"{len(dropped)} pieces of the mask without joints were left out ({gone.sum()} pixels)")
    return whole, shown, notes


def _bridge_bones(source: PuppetInput, mask: Flags, labels: NDArray[np.int32], width: int) -> None:
    """Join pieces along the bones that run from one to another, in place."""
    canvas = mask.view(np.uint8)
    for start, end in np.rint(source.marks[source.bones]).astype(int).tolist():
        if labels[start[1], start[0]] != labels[end[1], end[0]]:
            cv2.line(canvas, start, end, 1, width)


def _bridge(mask: Flags, piece: Flags, others: Flags, width: int) -> None:
    """Join a piece with the nearest of the others by a straight bar, in place."""
    _, (rows, columns) = distance_transform_edt(~others, return_indices=True)
    places = np.argwhere(piece)
    ends = np.stack([rows[piece], columns[piece]], axis=1)
    nearest = int(((places - ends) ** 2).sum(axis=1).argmin())
    start, end = (tuple(place[nearest][::-1].tolist()) for place in (places, ends))
    cv2.line(mask.view(np.uint8), start, end, 1, width)
