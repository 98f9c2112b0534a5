"""Writes an aligned shot for other packages: USD, glTF, npz and JSON, and a script that opens it in Blender."""

from __future__ import annotations

import importlib.util
import io
import json
from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path
from typing import Literal

import numpy as np

from pegbar.errors import MissingExtraError
from pegbar.export.shot_gltf import gltf_notes, shot_glb
from pegbar.export.shot_scene import ShotScene
from pegbar.export.shot_usd import shot_usd
from pegbar.export.shot_values import shot_arrays, shot_table
from pegbar.io import atomic
from pegbar.io.camera_cells import camera_cells
from pegbar.io.exposure_sheet import ExposureSheet, csv_text, xdts_text

Format = Literal["usd", "gltf", "npz", "blender", "exposure"]
#: Every format with the files that it writes.
FILES: dict[Format, tuple[str, ...]] = {
    "usd": ("shot.usdc",),
    "gltf": ("shot.glb",),
    "npz": ("shot.npz", "shot.json"),
    "blender": ("shot.json", "open_in_blender.py"),
    "exposure": ("exposure.csv", "exposure.xdts"),
}


def parse_formats(text: str) -> list[Format]:
    """Return the formats that ``text`` names, with commas between them; ValueError for one that there is not."""
    known = {str(kind): kind for kind in FILES}
    names = [name.strip() for name in text.split(",") if name.strip()]
    if unknown := [name for name in names if name not in known]:
        raise ValueError(f"--formats: no format {', '.join(unknown)}: there is {', '.join(known)}")
    if not names:
        raise ValueError(f"--formats: want at least one of {', '.join(known)}")
    return [known[name] for name in dict.fromkeys(names)]


def usable_formats(wanted: Sequence[Format]) -> tuple[list[Format], list[str]]:
    """Return those of ``wanted`` whose libraries are there, and for the others how to install them."""
    found, lacking = [], []
    for kind in wanted:
        if kind == "usd" and importlib.util.find_spec("pxr") is None:
            lacking.append(str(MissingExtraError("USD", "usd")))
        else:
            found.append(kind)
    return found, lacking


def write_shot(folder: Path, scene: ShotScene, formats: Sequence[Format]) -> list[Path]:
    """Write ``scene`` in ``formats``, each file complete or not at all; return the files.

    Raises ValueError for a camera that no format can hold.
    """
    contents: dict[str, Callable[[], bytes]] = {
        "shot.usdc": lambda: b"",
        "shot.glb": lambda: shot_glb(scene),
        "shot.npz": lambda: _npz(scene),
        "shot.json": lambda: json.dumps(shot_table(scene, folder)).encode(),
        "exposure.csv": lambda: csv_text(_sheet(scene)).encode(),
        "exposure.xdts": lambda: xdts_text(_sheet(scene), scene.name).encode(),
        "open_in_blender.py": lambda: resources.files("pegbar.export").joinpath("open_in_blender.py").read_bytes(),
    }
    # All is made before anything is written, so that what cannot be made leaves the old files whole and alike.
    names = list(dict.fromkeys(name for kind in formats for name in FILES[kind]))
    made = {name: contents[name]() for name in names}
    layer = shot_usd(scene) if "shot.usdc" in names else None
    folder.mkdir(parents=True, exist_ok=True)
    atomic.clean_leftovers(folder)
    for name, data in made.items():
        if name == "shot.usdc" and layer is not None:
            with atomic.complete_file(folder / name) as part:
                if not layer.Export(str(part)):
                    raise OSError(f"{folder / name}: could not be written")
        else:
            atomic.write_bytes(folder / name, data)
    return [folder / name for name in names]


def export_notes(scene: ShotScene, formats: Sequence[Format]) -> list[str]:
    """Return what of ``scene`` the formats cannot hold."""
    return gltf_notes(scene) if "gltf" in formats else []


def _sheet(scene: ShotScene) -> ExposureSheet:
    moves = scene.moves and scene.moves.within(scene.frames[0], scene.frames[-1])
    return ExposureSheet({"drawing": scene.drawings}, scene.frames[0], camera_cells(moves) if moves else ())


def _npz(scene: ShotScene) -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, **shot_arrays(scene))  # type: ignore[arg-type]
    return file.getvalue()
