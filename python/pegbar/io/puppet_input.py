"""Reads what a puppet is made from: a picture, its joints in any known format, and a mask where there is one."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import FormatError
from pegbar.io.annotations import read_annotations
from pegbar.io.frames import read_picture
from pegbar.scene.drawing import Drawing
from pegbar.scene.drawn_skeleton import DrawnSkeleton, drawn_skeleton
from pegbar.scene.puppet_input import PuppetInput

_Path = str | os.PathLike[str]
#: The files that are looked for beside a picture, after one of the picture's own name.
BESIDE = ("char_cfg.yaml", "annotation.json")


def find_joints(picture: _Path) -> Path | None:
    """Return the file beside ``picture`` that marks its joints: ``NAME.json``, ``NAME.yaml`` or one of `BESIDE`."""
    picture = Path(picture)
    own = [picture.with_suffix(suffix) for suffix in (".json", ".yaml")]
    return next((path for path in (*own, *(picture.parent / name for name in BESIDE)) if path.is_file()), None)


def read_puppet_input(
    picture: _Path,
    *,
    joints: _Path | None = None,
    mask: _Path | None = None,
    frame: int | None = None,
    map: Mapping[str, str] | None = None,
) -> PuppetInput:
    """Read a picture with its joints, and its mask where there is one.

    Parameters
    ----------
    picture : path
        The picture, or the file that marks its joints and names it.
    joints : path, optional
        Joint marks: annotations of our own, COCO keypoints or AnimatedDrawings' ``char_cfg.yaml``. None: looked for
        beside the picture (`find_joints`).
    mask : path, optional
        Where the figure is: a picture that is light there, or opaque if it has an alpha channel. None: the mask that
        ``joints`` names, else the picture's own alpha.
    frame : int, optional
        Which of the annotated pictures it is, from 0. None: the one of the picture's name, else the first.
    map : dict of str to str, optional
        Joint -> canonical marker that moves it, where another than found is wanted; "" for none.

    Raises
    ------
    FormatError
        For a broken file, a mask of another size, or joints that make no figure.
    FileNotFoundError
        For a file that is not there, or no joints beside the picture.
    ValueError
        For a wrong ``map`` or ``frame``.
    """
    picture = Path(picture)
    if picture.suffix.lower() in (".json", ".yaml", ".yml"):
        joints, given = picture, None
    else:
        given = picture
        joints = Path(joints) if joints is not None else find_joints(picture)
    if given is not None and not given.exists():
        raise FileNotFoundError(2, "no such file or directory", str(given))
    if joints is None:
        names = f"{picture.stem}.json, {picture.stem}.yaml, {', '.join(BESIDE)}"
        raise FileNotFoundError(
            2, f"no joints are marked beside the picture (looked for {names}; --joints names another)", str(picture)
        )
    drawing = read_annotations(joints)
    place = _frame(drawing, given, frame)
    if given is None and not drawing.images:
        raise FormatError(joints, "names no picture: give the picture as well")
    given = given if given is not None else drawing.images[place]
    image = read_picture(given)
    masks = [Path(mask)] if mask is not None else list(drawing.masks[place : place + 1])
    silhouette = _mask(masks[0], image, given) if masks else _own_alpha(image)
    if drawing.image_size != (image.shape[1], image.shape[0]):
        wanted = f"{drawing.image_size[0]} x {drawing.image_size[1]}"
        raise FormatError(given, f"is {image.shape[1]} x {image.shape[0]} pixels; its joints are of {wanted}")
    skeleton = _skeleton(Path(joints), drawing, place, map)
    return PuppetInput(
        image=image,
        mask=silhouette,
        names=skeleton.names,
        marks=skeleton.marks,
        visible=skeleton.visible,
        bones=skeleton.bones,
        drives=skeleton.drives,
        source=str(given),
        notes=skeleton.notes,
        segmentation=_segmentation(drawing, place, image),
        limbs=tuple(limb for limb in drawing.limbs if limb.color is not None),
        files=(given, Path(joints), *masks, *drawing.segmentations[place : place + 1]),
    )


def _frame(drawing: Drawing, picture: Path | None, frame: int | None) -> int:
    if frame is not None:
        if not 0 <= frame < len(drawing.markers):
            raise ValueError(f"frame: want 0 to {len(drawing.markers) - 1}, got {frame}")
        return frame
    names = [path.name for path in drawing.images]
    return names.index(picture.name) if picture is not None and picture.name in names else 0


def _skeleton(joints: Path, drawing: Drawing, place: int, map: Mapping[str, str] | None) -> DrawnSkeleton:
    parents = {limb.end: limb.start for limb in drawing.limbs}
    try:
        return drawn_skeleton(drawing.names, drawing.markers[place], drawing.visible[place], parents, map)
    except ValueError as error:
        if str(error).startswith("map:"):
            raise
        raise FormatError(joints, str(error)) from None


def _segmentation(drawing: Drawing, place: int, image: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
    """The picture painted in the limbs' colours, where there is one of the picture's size."""
    if len(drawing.segmentations) <= place or not any(limb.color for limb in drawing.limbs):
        return None
    painted = read_picture(drawing.segmentations[place])
    if painted.shape[:2] != image.shape[:2]:
        wanted = f"{image.shape[1]} x {image.shape[0]}"
        raise FormatError(drawing.segmentations[place], f"is {painted.shape[1]} x {painted.shape[0]}; want {wanted}")
    return np.ascontiguousarray(painted[..., :3])


def _mask(path: Path, image: NDArray[np.uint8], picture: Path) -> NDArray[np.bool_]:
    pixels = read_picture(path)
    if pixels.shape[:2] != image.shape[:2]:
        wanted = f"{image.shape[1]} x {image.shape[0]} as {picture.name}"
        raise FormatError(path, f"the mask is {pixels.shape[1]} x {pixels.shape[0]} pixels; want {wanted}")
    own = _own_alpha(pixels)
    return own if own is not None else np.asarray(pixels[..., :3].max(axis=2) >= 128)


def _own_alpha(image: NDArray[np.uint8]) -> NDArray[np.bool_] | None:
    """Where the picture is opaque; None for one without alpha, or without anything transparent."""
    if image.shape[2] == 3 or image[..., 3].min() >= 128:
        return None
    return np.asarray(image[..., 3] >= 128)
