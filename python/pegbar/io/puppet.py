"""Puppets and prepared figures as files: one .npz with named arrays each, and back."""

from __future__ import annotations

import json
import os
import zipfile
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from pegbar.errors import FormatError
from pegbar.io.atomic import complete_file
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.drawing import Limb
from pegbar.scene.puppet import Puppet
from pegbar.scene.puppet_input import PuppetInput

_Path = str | os.PathLike[str]
#: What is not an array: kept together as JSON.
_NOTES = "words"
_PUPPET, _FIGURE = "puppet", "figure"


def write_puppet(path: _Path, puppet: Puppet) -> None:
    """Write ``puppet`` as a .npz file, complete or not at all."""
    words: dict[str, Any] = {
        "kind": _PUPPET,
        "names": puppet.names,
        "drives": dict(puppet.drives),
        "layers": puppet.layers,
    }
    words |= {name: getattr(puppet, name) for name in ("view", "image_size", "pose_frame", "clip", "fitted", "notes")}
    arrays = _arrays(puppet) | {"camera": puppet.camera.matrix}
    arrays |= {f"texture_{index}": texture for index, texture in enumerate(puppet.textures)}
    _write(path, arrays, words)


def read_puppet(path: _Path) -> Puppet:
    """Read what `write_puppet` wrote; FormatError for a file that is broken or something else."""
    arrays, words = _read(path, _PUPPET)
    try:
        size = (int(words["image_size"][0]), int(words["image_size"][1]))
        count = len(words["layers"])
        textures = tuple(arrays.pop(f"texture_{index}") for index in range(count))
        camera = PerspectiveCamera(arrays.pop("camera"), size)
        values: dict[str, Any] = {"background": None, **arrays, **words}
        values |= {name: tuple(words[name]) for name in ("names", "layers", "notes")}
        values |= {"image_size": size, "textures": textures, "camera": camera}
        return Puppet(**values)
    except (KeyError, TypeError, ValueError) as error:
        raise FormatError(path, f"no puppet: {error}") from None


def write_figure(path: _Path, figure: PuppetInput) -> None:
    """Write a prepared figure as a .npz file, without its picture, complete or not at all."""
    words: dict[str, Any] = {
        "kind": _FIGURE,
        "names": figure.names,
        "drives": dict(figure.drives),
    }
    words |= {"notes": figure.notes, "limbs": [[limb.name, limb.start, limb.end, limb.color] for limb in figure.limbs]}
    arrays = _arrays(figure)
    del arrays["image"]
    _write(path, arrays, words)


def read_figure(path: _Path, source: PuppetInput) -> PuppetInput:
    """Read what `write_figure` wrote of the picture of ``source``; FormatError for a broken file or another's."""
    arrays, words = _read(path, _FIGURE)
    try:
        limbs = tuple(Limb(name, start, end, color and tuple(color)) for name, start, end, color in words["limbs"])
        values: dict[str, Any] = {"mask": None, **arrays, **words, "limbs": limbs}
        values |= {"image": source.image, "source": source.source}
        values |= {name: tuple(words[name]) for name in ("names", "notes")}
        figure = PuppetInput(**values)
    except (KeyError, TypeError, ValueError) as error:
        raise FormatError(path, f"no figure: {error}") from None
    if figure.mask is None or figure.mask.shape != source.image.shape[:2]:
        raise FormatError(path, f"is not of the picture {source.source}")
    return figure


def _arrays(value: Any) -> dict[str, Any]:
    """The fields of a value that are arrays."""
    held = {field.name: getattr(value, field.name) for field in fields(value)}
    return {name: array for name, array in held.items() if isinstance(array, np.ndarray)}


def _write(path: _Path, arrays: dict[str, Any], words: dict[str, Any]) -> None:
    with complete_file(path) as part, part.open("wb") as file:
        np.savez_compressed(file, **{**arrays, _NOTES: np.array(json.dumps(words))})


def _read(path: _Path, kind: str) -> tuple[dict[str, Any], dict[str, Any]]:
    try:
        with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as held:
            arrays = {name: held[name] for name in held.files}
        words = json.loads(arrays.pop(_NOTES).item())
        if words.pop("kind") != kind:
            raise KeyError(f"kind is not {kind!r}")
    except (zipfile.BadZipFile, KeyError, ValueError, EOFError, AttributeError) as error:
        raise FormatError(path, f"no {kind}: {error}") from None
    return arrays, words
