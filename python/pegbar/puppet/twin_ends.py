"""Hands and feet in a photo beside those of the other side: what one has more, and is of the colours behind it, goes.

A graph cut that takes a dark shoe for the figure takes some of a dark floor as well. The other foot has the same shape,
mirrored or not, and hardly the same floor beside it.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pegbar.scene.drawn_skeleton import limb_chains
from pegbar.scene.puppet_input import PuppetInput

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
_OTHER = {"left": "right", "right": "left"}
#: Two ends are alike if so much of both is common (intersection over union); a fist is not compared with a spread hand.
_ALIKE = 0.55
#: By so much more of it: mirror images are usual, and an end with a piece of floor may be as like the other unmirrored.
_MIRRORED = 0.1
#: How far, in lengths of the trunk, an end may go beyond its twin.
_BEYOND = 0.03
#: Colours are smoothed over so many lengths of the trunk: a floor is woven, a photo has noise. The nearest few pixels
#: of a kind may be strays; this one counts.
_SMOOTH, _NEAREST = 0.007, 5


def even_ends(source: PuppetInput, mask: Flags, trunk: float, window: float) -> Flags:
    """Return ``mask`` (H, W) without what one end of a limb has more than its twin and looks like what is behind it.

    Parameters
    ----------
    source : PuppetInput
        Picture, marks and bones.
    mask : (H, W) bool
        The figure as found.
    trunk, window : float
        The trunk's length, and how far around an end is looked, in pixels.
    """
    result = mask.copy()
    ends = {source.names[source.bones[chain[-1], 1]]: chain[-1] for chain in limb_chains(source.names, source.bones)}
    soft = cv2.GaussianBlur(source.image[..., :3].astype(np.float32) / 255, (0, 0), max(_SMOOTH * trunk, 0.3))
    colors = cv2.cvtColor(soft, cv2.COLOR_RGB2LAB)
    for name, bone in ends.items():
        side, _, rest = name.partition("_")
        other = ends.get(f"{_OTHER.get(side, '')}_{rest}")
        if other is None:
            continue
        bones = source.marks[source.bones[[bone, other]]]
        near = _round(mask.shape, bones[0, 1], window)
        more = _more(mask, bones, near, _BEYOND * trunk)
        if more.any():
            result &= ~_behind(colors, mask, more, near)
    return result


def _more(mask: Flags, bones: Floats, near: Flags, beyond: float) -> Flags:
    """What of the mask (H, W) ``near`` the first bone's end its twin has not; nothing where the two are not alike.

    ``bones`` (2, 2, 2) are the two last bones, the ends last.
    """
    best, share = mask, _ALIKE
    for mirrored in (True, False):
        move = _movement(bones[1], bones[0], mirrored)
        twin = cv2.warpAffine(mask.view(np.uint8), move, mask.shape[::-1], flags=cv2.INTER_NEAREST).astype(bool)
        common = float((twin & mask & near).sum() / max(1, ((twin | mask) & near).sum()))
        if common > share + (0.0 if mirrored else _MIRRORED):
            best, share = twin, common
    reach = 2 * max(1, round(beyond)) + 1
    wide = cv2.dilate(best.view(np.uint8), cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach)))
    more: Flags = mask & near & (wide == 0)
    return more


def _movement(start: Floats, target: Floats, mirrored: bool) -> Floats:
    """The affine map (2, 3) that takes the end of bone ``start`` (2, 2) onto that of ``target``, with its direction."""
    turn = _frame(target, 1.0) @ _frame(start, -1.0 if mirrored else 1.0).T
    moved: Floats = np.column_stack([turn, target[1] - turn @ start[1]])
    return moved


def _frame(bone: Floats, side: float) -> Floats:
    """Unit vectors along a bone (2, 2) and square to it, as columns."""
    x, y = (bone[1] - bone[0]) / max(float(np.linalg.norm(bone[1] - bone[0])), 1e-9)
    return np.array([[x, -side * y], [y, side * x]])


def _behind(colors: NDArray[np.float32], mask: Flags, more: Flags, near: Flags) -> Flags:
    """What of ``more`` (H, W) is rather of the colours around the figure than of its own."""
    # The outline itself is a blend of both.
    narrow = np.ones((5, 5), np.uint8)
    own = colors[cv2.erode(mask.view(np.uint8), narrow).astype(bool) & near & ~more]
    around = colors[near & ~cv2.dilate(mask.view(np.uint8), narrow).astype(bool)]
    gone = np.zeros(mask.shape, np.uint8)
    if len(own) < _NEAREST or len(around) < _NEAREST:
        return gone.astype(bool)
    inside, outside = (cKDTree(points).query(colors[more], k=[_NEAREST])[0] for points in (own, around))
    gone[more] = np.ravel(outside < inside)
    # Single pixels are noise, and what is left over as a thread goes too.
    kept = cv2.morphologyEx((mask & ~cv2.medianBlur(gone, 5).astype(bool)).view(np.uint8), cv2.MORPH_OPEN, narrow)
    pieces = cv2.connectedComponents((kept.astype(bool) | (mask & ~more)).view(np.uint8), connectivity=4)[1]
    held = np.unique(pieces[mask & ~more])
    return more & ~np.isin(pieces, held[held > 0])


def _round(shape: tuple[int, ...], centre: Floats, radius: float) -> Flags:
    rows, columns = np.ogrid[: shape[0], : shape[1]]
    return np.asarray((columns - centre[0]) ** 2 + (rows - centre[1]) ** 2 < radius**2)
