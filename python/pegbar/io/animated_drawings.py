"""AnimatedDrawings characters: ``char_cfg.yaml`` with joints, beside ``texture.png`` and ``mask.png``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from pegbar.errors import FormatError
from pegbar.io.places import Misplaced, Place, items, table, text, whole
from pegbar.scene import body
from pegbar.scene.drawing import Drawing, Limb

_Path = str | os.PathLike[str]
# The format's torso lies between the shoulders and its neck on the face; its root and hip are one point.
_RENAMED = {"hip": "pelvis", "torso": "neck", "neck": "head"}


def read_char_config(path: _Path) -> Drawing:
    """Read a character of AnimatedDrawings as a drawing of one frame.

    Its joints become canonical markers: ``hip`` is the pelvis, ``torso`` (between the shoulders) the neck, ``neck``
    (on the face) the head; the chest is put midway between pelvis and neck; ``root``, which is the hip again, is left
    out. Joints that are not canonical (a four-legged character's) keep their names, and their limbs are those to
    their parents.

    Parameters
    ----------
    path : path
        ``char_cfg.yaml``; ``texture.png`` and ``mask.png`` beside it are taken where they are.

    Returns
    -------
    Drawing

    Raises
    ------
    FormatError
        For YAML that is broken (with its line), or a skeleton that is.
    """
    try:
        content = Path(path).read_text("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError(path, "not text in UTF-8", byte=error.start) from None
    return parse(path, content)


def parse(path: _Path, content: str) -> Drawing:
    """As ``read_char_config``, for a file whose text was read already."""
    import yaml

    try:
        value = yaml.load(content, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except yaml.MarkedYAMLError as error:
        line = None if error.problem_mark is None else error.problem_mark.line + 1
        raise FormatError(path, f"not YAML: {error.problem}", line=line) from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise FormatError(path, f"not YAML: {' '.join(str(error).split())}") from None
    try:
        return _drawing(Path(path).parent, value)
    except Misplaced as problem:
        raise problem.at(path) from None


def _drawing(folder: Path, value: Any) -> Drawing:
    if not isinstance(value, dict) or not {"width", "height", "skeleton"} <= value.keys():
        raise Misplaced((), "no annotations: want a character with width, height and skeleton, or JSON with markers")
    size = tuple(whole(value[side], (side,), low=1, high=1 << 20) for side in ("width", "height"))
    joints, parents = _joints(value["skeleton"])
    points = {_RENAMED.get(name, name): point for name, point in joints.items() if name != "root"}
    if not points:
        raise Misplaced(("skeleton",), "no joint besides the root")
    if {"pelvis", "neck"} <= points.keys():
        points["chest"] = body.midpoint(points, "pelvis", "neck")
    names = tuple(name for name in body.MARKERS if name in points)
    names += tuple(name for name in points if name not in names)
    limbs = body.limbs_between(names)
    limbs += tuple(
        Limb(name, _RENAMED.get(parent, parent) if parent != "root" else "pelvis", name)
        for name, parent in parents.items()
        if name not in body.MARKERS and name not in (*_RENAMED, "root") and parent is not None
    )
    limbs = tuple(limb for limb in limbs if limb.start in names)
    return Drawing(
        names=names,
        markers=np.stack([points[name] for name in names])[None],
        visible=np.ones((1, len(names)), bool),
        image_size=(size[0], size[1]),
        images=_beside(folder, "texture.png"),
        masks=_beside(folder, "mask.png"),
        limbs=limbs,
    )


def _joints(value: Any) -> tuple[dict[str, Any], dict[str, str | None]]:
    """Positions and parents by name; a parent stands before its children."""
    joints: dict[str, Any] = {}
    parents: dict[str, str | None] = {}
    for index, joint in enumerate(items(value, ("skeleton",))):
        place: Place = ("skeleton", index)
        if not isinstance(joint, dict) or not {"name", "loc", "parent"} <= joint.keys():
            raise Misplaced(place, "want name, loc and parent")
        name, parent = text(joint["name"], (*place, "name")), joint["parent"]
        if name in joints:
            raise Misplaced((*place, "name"), f"the joint {name!r} stands twice")
        if parent is not None and parent not in joints:
            raise Misplaced((*place, "parent"), f"no joint before it is called {parent!r}")
        joints[name], parents[name] = table(joint["loc"], (*place, "loc"), (2,)), parent
    return joints, parents


def _beside(folder: Path, name: str) -> tuple[Path, ...]:
    return (folder / name,) if (folder / name).is_file() else ()
