"""An alignment as a file: one .npz with named arrays, and back."""

from __future__ import annotations

import os
import zipfile
from dataclasses import fields
from typing import Any

import numpy as np

from pegbar.errors import FormatError
from pegbar.io.atomic import complete_file
from pegbar.scene.alignment import Alignment

_TEXTS = ("names", "notes", "warnings")


def write_alignment(path: str | os.PathLike[str], alignment: Alignment) -> None:
    """Write ``alignment`` as a .npz file whose arrays have its attributes' names, complete or not at all."""
    values: dict[str, Any] = {field.name: np.asarray(getattr(alignment, field.name)) for field in fields(alignment)}
    values |= {name: np.asarray(getattr(alignment, name), dtype=np.str_) for name in _TEXTS}
    with complete_file(path) as part, part.open("wb") as file:
        np.savez_compressed(file, **values)


def read_alignment(path: str | os.PathLike[str]) -> Alignment:
    """Read what `write_alignment` wrote; FormatError for a file that is broken or something else."""
    try:
        with open(path, "rb") as file, np.load(file, allow_pickle=False) as held:
            lacking = {"warnings": np.array([], np.str_)} if "warnings" not in held else {}
            values: dict[str, Any] = lacking | {
                f.name: held[f.name] for f in fields(Alignment) if f.name not in lacking
            }
    except (zipfile.BadZipFile, KeyError, ValueError, EOFError) as error:
        raise FormatError(path, f"no alignment: {error}") from None
    for name in _TEXTS:
        values[name] = tuple(values[name].tolist())
    for name in ("mode", "root", "clip_path", "mirrored", "swapped"):
        values[name] = values[name].item()
    width, height = values["image_size"].tolist()
    return Alignment(**{**values, "image_size": (width, height)})
