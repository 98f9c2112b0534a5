"""Where a figure is in a picture without a mask: paper flooded from its edge, or a template snapped to the silhouette.

Hornung et al. (2007, section 6) snap the fitted template's outline to the silhouette with snakes. Here the template
says which pixels are surely, probably and surely not the figure's, and a graph cut between colour models of the two
finds the border (Rother, Kolmogorov, Blake 2004): a snake stops at folds and patterns and does not reach into gaps.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from pegbar.errors import DegenerateError
from pegbar.puppet.limb_ends import WINDOW, cut_ends
from pegbar.puppet.parts import bone_distances
from pegbar.puppet.template import covered, fit_template, person_template
from pegbar.puppet.twin_ends import even_ends
from pegbar.puppet.view import View, drawn_view
from pegbar.scene.puppet_input import PuppetInput

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Labels = NDArray[np.uint8]
#: The share of the way from the bones to the template's outline that is surely the figure.
_SURE = 0.4
#: How far beyond the template's outline the figure may reach, in lengths of the trunk: hair, clothes, shoes.
_REACH = 0.16
_ROUNDS = 6
#: Paper: how much its brightness usually varies along the picture's border, beside a smooth change of light.
_PAPER_SPREAD = 4.5


def find_silhouette(source: PuppetInput, view: View | None = None) -> tuple[Flags, bool]:
    """Return where the figure is (H, W), and whether it is drawn on paper.

    A drawing on plain paper is what cannot be reached from the picture's edge without crossing a line; else the figure
    is a person's, found from where the template of ``view`` lies. None tells the view from the shoulders' distance.

    Raises
    ------
    ValueError
        For a figure that is neither, with what to do.
    """
    image = np.ascontiguousarray(source.image[..., :3])
    drawn = paper_mask(image)
    if drawn is not None and _holds(drawn, source.marks):
        return drawn, True
    return person_mask(source, view), False


def paper_mask(image: NDArray[np.uint8]) -> Flags | None:
    """What lines enclose on plain paper (H, W), without what hangs nowhere; None for a picture that is not on paper."""
    gray = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    light = cv2.GaussianBlur(cv2.medianBlur(gray, 5), (0, 0), max(8.0, 0.05 * min(gray.shape)))
    flat = gray.astype(np.float32) - light
    edge = np.concatenate([flat[:3].ravel(), flat[-3:].ravel(), flat[:, :3].ravel(), flat[:, -3:].ravel()])
    if np.median(np.abs(edge)) > _PAPER_SPREAD:
        return None
    reach = max(3, round(min(gray.shape) * 0.15) | 1)
    ink = cv2.adaptiveThreshold(gray, 255, cv2.ADAPTIVE_THRESH_GAUSSIAN_C, cv2.THRESH_BINARY_INV, reach, 8)
    size = max(3, round(min(gray.shape) * 0.015) | 1)
    joined = cv2.morphologyEx(ink, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)))
    room = np.pad(joined, 1)
    cv2.floodFill(room, None, (0, 0), 128)
    inside = (room != 128)[1:-1, 1:-1].astype(np.uint8)
    inside = cv2.morphologyEx(inside, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    count, pieces, stats, _ = cv2.connectedComponentsWithStats(inside)
    if count < 2:
        return None
    largest = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    kept = stats[:, cv2.CC_STAT_AREA] > 0.02 * stats[largest, cv2.CC_STAT_AREA]
    kept[0] = False
    return np.asarray(kept[pieces])


def person_mask(source: PuppetInput, view: View | None = None) -> Flags:
    """Where a person is whose joints are marked (H, W): the template of ``view``, snapped to the silhouette.

    Raises
    ------
    ValueError
        For a figure that is no person, or one that the colours do not tell from what is behind it.
    """
    trunk = float(np.linalg.norm(source.marks[source.names.index("neck")] - source.marks[source.names.index("pelvis")]))
    try:
        template = person_template(view or drawn_view(source))
        shape = fit_template(template, source.names, source.marks)
    except (ValueError, DegenerateError) as error:
        raise ValueError(
            f"{source.source}: no mask, and no person's outline can be found: give a mask ({error})"
        ) from None
    if set(source.names) - set(template.names):
        raise ValueError(f"{source.source}: no mask, and the figure has limbs that a person has not: give a mask")
    likely = covered(shape, template.mesh.triangles, source.image_size)
    seeds = _seeds(source, likely, trunk)
    rows, columns = np.nonzero(seeds != cv2.GC_BGD)
    pad = round(0.2 * trunk) + 2
    window = (
        slice(max(int(rows.min()) - pad, 0), int(rows.max()) + pad),
        slice(max(int(columns.min()) - pad, 0), int(columns.max()) + pad),
    )
    part = np.ascontiguousarray(source.image[window][..., :3])
    labels = np.ascontiguousarray(seeds[window])
    models = (np.zeros((1, 65)), np.zeros((1, 65)))
    cv2.setRNGSeed(0)
    cv2.grabCut(part, labels, None, *models, _ROUNDS, cv2.GC_INIT_WITH_MASK)
    mask = np.zeros(seeds.shape, bool)
    mask[window] = np.isin(labels, (cv2.GC_FGD, cv2.GC_PR_FGD))
    mask = cut_ends(source, _tidied(mask, source, trunk), seeds, likely, trunk, _REACH * trunk)
    return even_ends(source, mask, trunk, WINDOW * trunk)


def _seeds(source: PuppetInput, likely: Flags, trunk: float) -> Labels:
    """What is surely, probably and surely not the figure, in cv2's numbers."""
    seeds = np.full(likely.shape, cv2.GC_BGD, np.uint8)
    size = 2 * round(_REACH * trunk) + 1
    around = cv2.dilate(likely.view(np.uint8), cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))).astype(bool)
    seeds[around] = cv2.GC_PR_BGD
    seeds[likely] = cv2.GC_PR_FGD
    depth = cv2.distanceTransform(likely.view(np.uint8), cv2.DIST_L2, 5)
    places = np.argwhere(likely)[:, ::-1].astype(np.float64)
    away = bone_distances(places, source.marks[source.bones])[0].min(axis=1)
    sure = away < _SURE / (1 - _SURE) * depth[likely]
    rows, columns = np.nonzero(likely)
    seeds[rows[sure], columns[sure]] = cv2.GC_FGD
    return seeds


def _tidied(mask: Flags, source: PuppetInput, trunk: float) -> Flags:
    """The figure's piece of a cut, without bars and threads that hang on it, and without specks."""
    size = 2 * max(1, round(0.02 * trunk)) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    opened = cv2.morphologyEx(mask.view(np.uint8), cv2.MORPH_OPEN, disc)
    closed = cv2.morphologyEx(opened, cv2.MORPH_CLOSE, disc)
    canvas = closed.copy()
    for start, end in np.rint(source.marks[source.bones]).astype(int).tolist():
        cv2.line(canvas, start, end, 1, size)
    _, pieces = cv2.connectedComponents(canvas, connectivity=4)
    columns, rows = np.rint(source.marks).astype(int).T
    inside = (columns >= 0) & (rows >= 0) & (columns < mask.shape[1]) & (rows < mask.shape[0])
    held = np.unique(pieces[rows[inside], columns[inside]])
    kept = np.isin(pieces, held[held > 0]) & (closed > 0)
    _, holes, stats, _ = cv2.connectedComponentsWithStats((~kept).view(np.uint8), connectivity=4)
    return np.asarray(kept | (stats[:, cv2.CC_STAT_AREA] < (0.06 * trunk) ** 2)[holes])


def _holds(mask: Flags, marks: Floats) -> bool:
    """Whether nearly all marks lie on a mask or close to it."""
    near = cv2.dilate(mask.view(np.uint8), np.ones((9, 9), np.uint8))
    columns, rows = np.rint(marks).astype(int).T
    inside = (columns >= 0) & (rows >= 0) & (columns < mask.shape[1]) & (rows < mask.shape[0])
    return bool(inside.all() and near[rows, columns].mean() > 0.9)
