"""COCO keypoints: the 17 points of a person in a photo or drawing, as canonical markers."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import FormatError
from pegbar.io import places
from pegbar.io.places import Misplaced, Place, items, number, table, text, whole
from pegbar.scene import body
from pegbar.scene.drawing import Drawing

_Path = str | os.PathLike[str]
#: The keypoints of COCO's category "person", in order.
KEYPOINTS = (
    "nose",
    *(f"{side}_{part}" for part in ("eye", "ear", "shoulder", "elbow", "wrist") for side in ("left", "right")),
    *(f"{side}_{part}" for part in ("hip", "knee", "ankle") for side in ("left", "right")),
)
_RENAMED = {"hand": "wrist", "foot": "ankle"}


def read_coco_keypoints(path: _Path, *, image: str | int | None = None, annotation: int | None = None) -> Drawing:
    """Read COCO keypoints of persons as a drawing with the canonical markers.

    Hands are the wrists, feet the ankles; pelvis and neck lie midway between the hips and the shoulders, the chest
    midway between these two; the head is midway between the ears, or the eyes, or the nose, whichever pair is there.
    A keypoint with flag 2 is visible, with flag 1 covered, with flag 0 missing (NaN); a derived marker is only as
    good as the worse of its two.

    Parameters
    ----------
    path : path
        JSON with ``images``, ``annotations`` and, where its keypoints are not COCO's 17 in their order,
        ``categories`` that name them.
    image : str or int, optional
        The picture to take, by file name or id. None: all, in the file's order, one frame each; they must be of one
        size. A picture without a person gives a frame without markers.
    annotation : int, optional
        The id of the person to take. None: the largest in each picture.

    Returns
    -------
    Drawing

    Raises
    ------
    FormatError
        For a broken file, no such picture or person, and pictures that differ in size.
    """
    try:
        content = Path(path).read_text("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError(path, "not text in UTF-8", byte=error.start) from None
    value = places.parse_json(path, content)
    try:
        return parse(path, value, image=image, annotation=annotation)
    except Misplaced as problem:
        raise problem.at(path, content) from None


def parse(path: _Path, value: Any, *, image: str | int | None = None, annotation: int | None = None) -> Drawing:
    """As ``read_coco_keypoints``, for JSON that was parsed already; raises Misplaced."""
    if not isinstance(value, dict) or not {"images", "annotations"} <= value.keys():
        raise Misplaced((), "COCO keypoints need images and annotations")
    pictures = _pictures(value, image)
    names = _keypoint_names(value)
    persons = _persons(value, annotation)
    frames = [_frame(value, persons.get(picture["id"], []), names) for picture in pictures]
    if annotation is not None and np.isnan([points for points, _ in frames]).all():
        raise Misplaced(("annotations",), f"the annotation {annotation} is not in the chosen picture")
    sizes = {(picture["width"], picture["height"]) for picture in pictures}
    if len(sizes) > 1:
        raise Misplaced(("images",), f"the pictures differ in size, name one: {sorted(sizes)}")
    return Drawing(
        names=body.MARKERS,
        markers=np.stack([points for points, _ in frames]),
        visible=np.stack([visible for _, visible in frames]),
        image_size=sizes.pop(),
        images=tuple(Path(path).parent / picture["file_name"] for picture in pictures),
        limbs=body.LIMBS,
    )


def _pictures(value: dict[str, Any], wanted: str | int | None) -> list[dict[str, Any]]:
    pictures = []
    for index, entry in enumerate(items(value["images"], ("images",))):
        place: Place = ("images", index)
        if not isinstance(entry, dict) or not {"id", "file_name", "width", "height"} <= entry.keys():
            raise Misplaced(place, "want an object with id, file_name, width and height")
        whole(entry["width"], (*place, "width"), low=1, high=1 << 20)
        whole(entry["height"], (*place, "height"), low=1, high=1 << 20)
        text(entry["file_name"], (*place, "file_name"))
        whole(entry["id"], (*place, "id"), low=-(1 << 62), high=1 << 62)
        if wanted is None or wanted in (entry["id"], entry["file_name"], Path(entry["file_name"]).name):
            pictures.append(entry)
    if not pictures:
        raise Misplaced(("images",), "no pictures" if wanted is None else f"no picture is called {wanted!r}")
    return pictures


def _keypoint_names(value: dict[str, Any]) -> dict[Any, list[str]]:
    """Keypoint names by category id."""
    names: dict[Any, list[str]] = {}
    for index, category in enumerate(items(value.get("categories", []), ("categories",))):
        place: Place = ("categories", index)
        if not isinstance(category, dict):
            raise Misplaced(place, "want an object")
        listed = items(category.get("keypoints", list(KEYPOINTS)), (*place, "keypoints"))
        names[category.get("id")] = [text(name, (*place, "keypoints", i)) for i, name in enumerate(listed)]
    return names


def _persons(value: dict[str, Any], wanted: int | None) -> dict[Any, list[int]]:
    """Indices of the annotations with keypoints, by picture id."""
    persons: dict[Any, list[int]] = {}
    for index, entry in enumerate(items(value["annotations"], ("annotations",))):
        if not isinstance(entry, dict) or "image_id" not in entry:
            raise Misplaced(("annotations", index), "want an object with image_id")
        whole(entry["image_id"], ("annotations", index, "image_id"), low=-(1 << 62), high=1 << 62)
        if "keypoints" in entry and (wanted is None or entry.get("id") == wanted):
            persons.setdefault(entry["image_id"], []).append(index)
    if not persons:
        raise Misplaced(("annotations",), "no keypoints" if wanted is None else f"no annotation has the id {wanted}")
    return persons


def _frame(
    value: dict[str, Any], persons: list[int], names: dict[Any, list[str]]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Markers (16, 2) and visibility (16,) of the largest of ``persons``, all NaN when there is none."""
    people = [_keypoints(value["annotations"][index], ("annotations", index), names) for index in persons]
    if not people:
        return np.full((len(body.MARKERS), 2), np.nan), np.zeros(len(body.MARKERS), bool)
    sizes = [_area(value["annotations"][index], ("annotations", index)) for index in persons]
    points = people[int(np.argmax(sizes))]
    markers = _markers(points)
    rows = np.stack([markers[name] for name in body.MARKERS])
    return np.where(rows[:, 2:] > 0, rows[:, :2], np.nan), rows[:, 2] == 2


def _area(entry: dict[str, Any], place: Place) -> float:
    """The size of a person: its area, else its box, else the span of its keypoints."""
    if "area" in entry:
        return number(entry["area"], (*place, "area"))
    if "bbox" in entry:
        return float(np.prod(table(entry["bbox"], (*place, "bbox"), (4,))[2:]))
    points = np.reshape(entry["keypoints"], (-1, 3))
    labelled = points[points[:, 2] > 0, :2]
    return float(np.prod(np.ptp(labelled, axis=0))) if len(labelled) else 0.0


def _keypoints(entry: dict[str, Any], place: Place, names: dict[Any, list[str]]) -> dict[str, NDArray[np.float64]]:
    """Rows (x, y, flag) by keypoint name; one without flag is NaN."""
    listed = names.get(entry.get("category_id"), list(KEYPOINTS))
    rows = table(entry["keypoints"], (*place, "keypoints"), (3 * len(listed),)).reshape(-1, 3)
    for index, flag in enumerate(rows[:, 2]):
        if flag not in (0, 1, 2):
            raise Misplaced((*place, "keypoints", 3 * index + 2), f"want a flag 0, 1 or 2, got {flag:g}")
    missing = set(KEYPOINTS[5:]) - set(listed)
    if missing:
        raise Misplaced((*place, "keypoints"), f"the category lacks the keypoints {', '.join(sorted(missing))}")
    return dict(zip(listed, rows, strict=True))


def _markers(points: dict[str, NDArray[np.float64]]) -> dict[str, NDArray[np.float64]]:
    markers = {}
    for name in body.MARKERS[4:]:
        side, _, joint = name.partition("_")
        markers[name] = points[f"{side}_{_RENAMED.get(joint, joint)}"]
    markers["neck"] = _between(markers["left_shoulder"], markers["right_shoulder"])
    markers["pelvis"] = _between(markers["left_hip"], markers["right_hip"])
    markers["chest"] = _between(markers["neck"], markers["pelvis"])
    nothing = np.zeros(3)
    pairs = [
        _between(points.get(f"left_{part}", nothing), points.get(f"right_{part}", nothing)) for part in ("ear", "eye")
    ]
    heads = [*pairs, points.get("nose", nothing)]
    markers["head"] = next((head for head in heads if head[2] > 0), nothing)
    return markers


def _between(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """The point midway, with the lesser flag."""
    x, y = ((first + second) / 2)[:2]
    return np.array([x, y, min(first[2], second[2])])
