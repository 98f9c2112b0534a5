"""Limb boxes over a whole shot: what the pictures say, made plausible by their widths over time (2010, section 3.2).

The paper's routine takes the torso's edge for an arm's where they cross, and leaves the mending to the user. Here a
width that leaves what the limb has in the drawings around it is replaced by theirs, and said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.errors import DegenerateError
from pegbar.layer.box_edges import LimbEdges

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
#: A width is taken for wrong when it is so many times the usual one, or less than the inverse.
IMPLAUSIBLE = 1.6
#: The share of stations that must find an edge for certain.
CERTAIN = 0.25
#: Drawings before and after that say what is usual: squash and stretch is slower than a mistake.
WINDOW = 12
# Half the width of a limb that is never seen, as a part of its length.
_THIN = 0.12
_SIDES = (("left_", "right_"), ("right_", "left_"))


@dataclass(frozen=True, eq=False)
class LimbBoxes:
    """Boxes (F, V, 4, 2) in pixels, corners as `collision_volumes` takes them, and where they are not measured.

    ``given`` (F, V) tells boxes of the user, ``repaired`` (F, V) those whose width is taken from other drawings;
    ``measured`` (F, V) is how many times the usual width was measured there, NaN where nothing was.
    """

    boxes: Floats
    given: Flags
    repaired: Flags
    measured: Floats


def limb_boxes(
    edges: Sequence[LimbEdges],
    markers: ArrayLike,
    limbs: ArrayLike,
    *,
    given: ArrayLike | None = None,
    scales: ArrayLike | None = None,
    names: Sequence[str] | None = None,
) -> LimbBoxes:
    """Put a four-corner box round every limb of every drawing.

    Parameters
    ----------
    edges : sequence of F LimbEdges
        What `label_edges` or `ink_edges` measured in the F drawings.
    markers : (F, N, 2) float
        Markers in pixels, NaN where unknown.
    limbs : (V, 2) int
        Each limb's first and second marker.
    given : (F, V, 4, 2) float, optional
        Boxes of the user, which win; NaN where there is none.
    scales : (F, V) float, optional
        How large each limb is drawn, up to a factor (focal length over depth): widths are compared in this measure.
    names : sequence of V str, optional
        The limbs' names, for errors; one that is never seen is as wide as its twin of the other side
        (left_thigh, right_thigh).

    Returns
    -------
    LimbBoxes
        NaN where a marker is not known.

    Raises
    ------
    ValueError
        For a wrong shape or a limb that names no marker.
    DegenerateError
        For a limb whose two markers coincide in every drawing, naming it.

    Examples
    --------
    >>> edges = LimbEdges(np.full((1, 2, 2), 2.0), np.ones((1, 2)))
    >>> limb_boxes([edges], [[[0, 4], [9, 4]]], [[0, 1]]).boxes[0, 0].tolist()
    [[0.0, 2.0], [9.0, 2.0], [9.0, 6.0], [0.0, 6.0]]
    """
    marks = arrays.floats("markers", markers, (len(edges), "N", 2), allow="nan")
    pairs = arrays.integers("limbs", limbs, ("V", 2), low=0, high=marks.shape[1] - 1)
    size = (len(marks), len(pairs))
    sizes = arrays.floats("scales", np.ones(size) if scales is None else scales, size, allow="nan")
    own = np.full((*size, 4, 2), np.nan) if given is None else given
    own = arrays.floats("given", own, (*size, 4, 2), allow="nan")
    ends = marks[:, pairs]
    left, lengths = _across(ends, names)
    half = np.stack([picture.half_widths for picture in edges]).reshape(*size, 2, 2)
    trust = np.stack([picture.trust for picture in edges]).reshape(*size, 2)
    widths, repaired, measured = _plausible(half / sizes[..., None, None], trust)
    _unseen(widths, np.median(lengths / sizes, axis=0), list(names or []))
    widths = widths * sizes[..., None, None]
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    signs = (1.0, -1.0)
    boxes = np.stack([ends[:, :, e] + signs[s] * widths[:, :, e, s, None] * left for e, s in corners], axis=2)
    boxes[np.isnan(boxes).any(axis=(2, 3))] = np.nan
    mine = np.isfinite(own).all(axis=(2, 3))
    return LimbBoxes(np.where(mine[..., None, None], own, boxes), mine, repaired & ~mine, measured)


def _across(ends: Floats, names: Sequence[str] | None) -> tuple[Floats, Floats]:
    """Unit vectors (F, V, 2) to the left of each limb, and its usual length (V,) in pixels.

    A limb of no length in a drawing has the direction of the drawing next to it.
    """
    axis = ends[:, :, 1] - ends[:, :, 0]
    lengths = np.linalg.norm(axis, axis=2)
    left = np.stack([axis[..., 1], -axis[..., 0]], axis=2) / np.where(lengths > 0, lengths, np.nan)[..., None]
    moments = np.arange(len(ends))
    for limb in range(ends.shape[1]):
        known = np.flatnonzero(lengths[:, limb] > 0)
        if not len(known):
            if np.isfinite(lengths[:, limb]).any():
                name = names[limb] if names else str(limb)
                raise DegenerateError(f"limb {name}: it has no length in any drawing: its two markers coincide")
            continue
        nearest = known[np.argmin(np.abs(moments[:, None] - known), axis=1)]
        left[:, limb] = left[nearest, limb]
    return left, np.where(np.isfinite(lengths), lengths, 0.0)


def _plausible(half: Floats, trust: Floats) -> tuple[Floats, Flags, Floats]:
    """Half widths (F, V, 2, 2) without gaps and mistakes, which are repaired (F, V), and the measured share of usual.

    A limb that is never seen stays NaN.
    """
    frames, count = half.shape[:2]
    found, repaired = half.copy(), np.zeros((frames, count), bool)
    measured = np.full((frames, count), np.nan)
    for limb in range(count):
        width = half[:, limb].sum(axis=(1, 2)) / 2
        sure = np.isfinite(width) & (trust[:, limb] >= CERTAIN).all(axis=1)
        some = sure if sure.any() else np.isfinite(width)
        if not some.any():
            repaired[:, limb] = True
            continue
        usual = _usual(width, some)
        measured[:, limb] = width / usual
        good = some & (width < IMPLAUSIBLE * usual) & (width * IMPLAUSIBLE > usual)
        good = good if good.any() else some
        found[:, limb] = _filled(half[:, limb], good)
        repaired[:, limb] = ~good
    return found, repaired, measured


def _unseen(widths: Floats, lengths: Floats, names: list[str]) -> None:
    """Give limbs that are never seen their twin's half widths, or a share of their length, in place."""
    twins = {name: name.replace(*turn) for name in names for turn in _SIDES if turn[0] in name}
    for limb in np.flatnonzero(np.isnan(widths).any(axis=(0, 2, 3))):
        twin = twins.get(names[limb]) if names else None
        if twin in names and np.isfinite(widths[:, names.index(twin)]).all():
            widths[:, limb] = widths[:, names.index(twin), :, ::-1]
        else:
            widths[:, limb] = _THIN * lengths[limb]


def _usual(width: Floats, sure: Flags) -> Floats:
    """The median width (F,) of the ``sure`` drawings in a window around each; of all where there are too few."""
    places = np.flatnonzero(sure)
    everywhere = float(np.median(width[places]))
    usual = np.full(len(width), everywhere)
    for frame in range(len(width)):
        near = places[np.abs(places - frame) <= WINDOW]
        if len(near) >= 5:
            # The whole shot has a say: a limb that crosses another for half a second is wrong for half a second.
            usual[frame] = np.clip(np.median(width[near]), everywhere / 1.3, everywhere * 1.3)
    return usual


def _filled(half: Floats, good: Flags) -> Floats:
    """Half widths (F, 2, 2): as they are in ``good`` drawings, interpolated in time between them elsewhere."""
    moments, known = np.arange(len(half)), np.flatnonzero(good)
    filled = half.copy()
    for end in range(2):
        for side in range(2):
            filled[:, end, side] = np.interp(moments, known, half[known, end, side])
    filled[known] = half[known]
    return filled
