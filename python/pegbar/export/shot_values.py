"""An aligned shot as plain numbers: arrays for a .npz file, and the same for JSON with names and conventions."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.export.shot_scene import ShotScene, camera_poses
from pegbar.scene.camera_moves import TRACKS
from pegbar.simulate.scene import Character

_LIMB = ("start", "end", "start_radius", "end_radius")
#: What the numbers mean, in the file itself.
CONVENTIONS = {
    "unit": "metre",
    "up": "y",
    "pixels": "centres at integers, origin top left, y down",
    "camera.matrix": "world metres to homogeneous pixels; the third row gives the planar depth in metres",
    "camera.to_world": "camera to world; the camera's axes are right, up and back",
    "exposure_sheet": "the moves over drawings of this size that are in the camera: pixels, factor, degrees clockwise",
    "null": "not known in this frame",
}


def shot_arrays(scene: ShotScene) -> dict[str, NDArray[Any]]:
    """Return the arrays of a .npz file: see the guide's page on exporting for names and shapes."""
    inner = np.stack([camera.intrinsic for camera in scene.cameras])
    arrays: dict[str, NDArray[Any]] = {
        "frames": np.array(scene.frames, np.int64),
        "drawings": np.array([-1 if number is None else number for number in scene.drawings], np.int64),
        "frame_rate": np.array(scene.frame_rate),
        "image_size": np.array(scene.image_size, np.int64),
        "ground": np.array(np.nan if scene.ground is None else scene.ground),
        "camera_matrix": np.stack([camera.matrix for camera in scene.cameras]),
        "camera_to_world": camera_poses(scene.cameras),
        "focal_length": inner[:, [0, 1], [0, 1]],
        "principal_point": inner[:, [0, 1], [2, 2]],
        "characters": np.array([character.name for character in scene.characters], np.str_),
    }
    for number, character in enumerate(scene.characters, 1):
        own = {
            "marker_names": np.array(character.marker_names, np.str_),
            "markers": character.markers,
            "limb_names": np.array(character.limb_names, np.str_),
            **{name: getattr(character.volumes, name) for name in _LIMB},
        }
        arrays |= {f"character_{number}_{name}": values for name, values in own.items()}
    return arrays


def shot_table(scene: ShotScene, folder: Path) -> dict[str, Any]:
    """Return what a JSON file in ``folder`` holds: the arrays of `shot_arrays` as lists, by name."""
    arrays = shot_arrays(scene)
    camera = {
        "matrix": arrays["camera_matrix"].tolist(),
        "to_world": arrays["camera_to_world"].tolist(),
        "focal_length": arrays["focal_length"].tolist(),
        "principal_point": arrays["principal_point"].tolist(),
    }
    return {
        "pegbar": "shot",
        "version": 1,
        "conventions": CONVENTIONS,
        "name": scene.name,
        "frame_rate": scene.frame_rate,
        "image_size": list(scene.image_size),
        "frames": list(scene.frames),
        "drawings": list(scene.drawings),
        "pictures": [None if path is None else _beside(path, folder) for path in scene.pictures],
        "ground": scene.ground,
        "camera": camera,
        **_views(scene),
        "characters": [_character(character) for character in scene.characters],
    }


def _views(scene: ShotScene) -> dict[str, Any]:
    """How the exposure sheet's camera moves over the drawings, where it does."""
    if not scene.views:
        return {}
    moves = {track: [getattr(view, track) for view in scene.views] for track in TRACKS}
    return {"exposure_sheet": {"paper": list(scene.views[0].paper), **moves}}


def _beside(path: Path, folder: Path) -> str:
    """``path`` as seen from ``folder``, with slashes; as it is where they have nothing in common."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:
        return path.as_posix()


def _character(character: Character) -> dict[str, Any]:
    ends = character.limb_markers or [("", "")] * len(character.limb_names)
    volumes = character.volumes
    limbs = {}
    for limb, (name, (first, last)) in enumerate(zip(character.limb_names, ends, strict=True)):
        tracks = {what: _known(getattr(volumes, what)[:, limb]) for what in _LIMB}
        limbs[name] = {"from": first, "to": last, **tracks}
    markers = {name: _known(character.markers[:, index]) for index, name in enumerate(character.marker_names)}
    return {"name": character.name, "markers": markers, "limbs": limbs}


def _known(track: NDArray[np.float64]) -> list[Any]:
    """A track over frames; None in frames in which it is not known."""
    known = np.asarray(np.isfinite(track.reshape(len(track), -1)).all(axis=1))
    values: list[Any] = track.tolist()
    return [value if good else None for value, good in zip(values, known, strict=True)]
