"""Renders meshes by Blender, Cycles with toon bands and Freestyle's ink: the job's files, and what comes back."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pegbar import arrays
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.mesh import Mesh
from pegbar.simulate.blender.locate import Blender
from pegbar.simulate.blender.process import INSIDE, Progress, run_blender
from pegbar.simulate.passes import Ink, Passes

Floats = NDArray[np.float32]
#: Blender's depth where there is nothing is 1e10.
BACKGROUND = 1e9
#: Blender's object index is a signed 16-bit number: ids from 0xC000 on go half the range lower, and those from 0x4000
#: on, which no scene has, do not fit.
UPPER_IDS, LOWER_IDS = 0xC000, 0x4000
#: Around these and higher ids no ink is drawn (``rust/kernels/ink.rs``).
BARE = 0xFF00
#: Vertices nearer than this (metres) are one, so that no line is drawn where a mesh changes its colour.
SAME = 1e-6


@dataclass(frozen=True, eq=False)
class BlenderJob:
    """Frames to render into a folder.

    ``samples``, ``near``, ``light``, ``bands`` and ``ink`` are those of ``render_passes``; there are at most 32 bands.
    """

    samples: int = 1
    near: float = 0.01
    light: ArrayLike = (0.4, 0.8, 0.45)
    bands: ArrayLike | None = None
    ink: Ink | None = None

    def write(self, folder: Path, frames: Iterable[tuple[str, PerspectiveCamera, Sequence[Mesh]]]) -> list[Path]:
        """Write the job's files; return the EXR files that Blender will write.

        A frame is its name, camera and meshes; every camera has the same size. Raises ValueError for sizes that
        differ and object ids that Blender has no room for.
        """
        entries, sizes = [], set()
        for name, camera, meshes in frames:
            view = camera.scaled(self.samples)
            sizes.add(view.image_size)
            write_meshes(folder / f"{name}.npz", meshes, view)
            entries.append({"camera": camera_of(view), "meshes": f"{name}.npz", "output": f"{name}.exr"})
        if len(sizes) != 1:
            raise ValueError(f"frames: want cameras of one size, got {sorted(sizes)}")
        direction = arrays.floats("light", self.light, (3,))
        bands = arrays.floats("bands", () if self.bands is None else self.bands, ("B",))
        if len(bands) > 32:
            raise ValueError(f"bands: Blender takes up to 32, got {len(bands)}")
        job = {
            "size": sizes.pop(),
            "near": self.near,
            "light": (direction / np.linalg.norm(direction)).tolist(),
            "bands": bands.tolist(),
            "ink": None if self.ink is None or not self.ink.width else self._ink(self.ink),
            "frames": entries,
        }
        (folder / "render.json").write_text(json.dumps(job), encoding="utf-8")
        return [folder / str(entry["output"]) for entry in entries]

    def run(self, blender: Blender, folder: Path, outputs: Sequence[Path], progress: Progress | None = None) -> None:
        """Render what was written to ``folder``; BlenderError where that fails."""
        run_blender(blender, INSIDE / "render.py", [str(folder)], outputs=outputs, progress=progress)

    def _ink(self, ink: Ink) -> dict[str, Any]:
        return {"width": ink.width * self.samples, "color": ink.color, "crease_angle": ink.crease_angle}


def camera_of(view: PerspectiveCamera) -> dict[str, Any]:
    """Return ``view`` as Blender describes a camera, apart from what ``squared`` does.

    ``focal`` is in picture widths, ``shift`` too (x right, y up), ``matrix`` (4, 4) takes camera axes (x right, y up, z
    backward) to the world.
    """
    intrinsic, (width, height) = view.intrinsic, view.image_size
    matrix = np.eye(4)
    matrix[:3, :3] = view.rotation.T * (1.0, -1.0, -1.0)
    matrix[:3, 3] = view.position
    shift = ((width - 1) / 2 - intrinsic[0, 2]) / width, (intrinsic[1, 2] - (height - 1) / 2) / width
    return {"focal": intrinsic[0, 0] / width, "shift": shift, "matrix": matrix.tolist()}


def squared(vertices: NDArray[np.float64], view: PerspectiveCamera) -> NDArray[np.float64]:
    """Return ``vertices`` (n, 3) moved so that a camera of square pixels sees them where ``view`` sees these.

    Blender knows no skew, and writes no EXR files of pixels that are not square. Depths stay as they are.
    """
    intrinsic = view.intrinsic
    bend = np.eye(3)
    bend[0, 1], bend[1, 1] = intrinsic[0, 1] / intrinsic[0, 0], intrinsic[1, 1] / intrinsic[0, 0]
    if np.abs(bend - np.eye(3)).max() < 1e-9:
        return vertices
    moved: NDArray[np.float64] = (vertices - view.position) @ (view.rotation.T @ bend @ view.rotation).T + view.position
    return moved


def write_meshes(path: Path, meshes: Sequence[Mesh], view: PerspectiveCamera) -> None:
    """Write ``meshes`` that ``view`` sees for Blender: welded, with colours and normals at the triangles' corners."""
    parts: dict[str, NDArray[Any]] = {
        "ids": np.array([_index(mesh.object_id) for mesh in meshes], np.int32),
        "bare": np.array([mesh.object_id >= BARE for mesh in meshes], bool),
    }
    for index, mesh in enumerate(meshes):
        vertices, triangles, kept = welded(mesh)
        corners = mesh.triangles[kept]
        assert mesh.normals is not None
        # As in `rust/kernels/surface.rs` the front is where the normals look, whichever way the triangle is turned.
        against = opposed(mesh.vertices[corners], mesh.normals[corners])
        corners[against], triangles[against] = corners[against, ::-1], triangles[against, ::-1]
        parts |= {
            f"vertices_{index}": squared(vertices, view).astype(np.float32),
            f"triangles_{index}": triangles.astype(np.int32),
            f"colors_{index}": mesh.colors[corners],
            f"normals_{index}": mesh.normals[corners].astype(np.float32),
        }
    with path.open("wb") as file:
        np.savez(file, **parts)  # type: ignore[arg-type]


def opposed(sides: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which triangles (T,) with corners ``sides`` (T, 3, 3) are turned against their corners' ``normals`` (T, 3, 3)."""
    outward = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    return np.asarray((outward * normals.sum(axis=1)).sum(axis=1) < 0)


def _index(object_id: int) -> int:
    if LOWER_IDS <= object_id < UPPER_IDS:
        raise ValueError(f"object_id: Blender takes those below {LOWER_IDS} and from {UPPER_IDS} on, got {object_id}")
    return object_id if object_id < LOWER_IDS else object_id - (UPPER_IDS - LOWER_IDS)


def welded(mesh: Mesh) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.bool_]]:
    """Return vertices of which no two are at one place, the triangles on them, and which triangles are kept (T,).

    A triangle that has become a line is left out.
    """
    _, first, inverse = np.unique(np.rint(mesh.vertices / SAME), axis=0, return_index=True, return_inverse=True)
    triangles = inverse.reshape(-1)[mesh.triangles]
    a, b, c = triangles.T
    kept = (a != b) & (b != c) & (c != a)
    return mesh.vertices[first], triangles[kept], kept


def passes_of(channels: Mapping[str, NDArray[Any]], samples: int, pen: float) -> Passes:
    """Return the passes in the ``channels`` of an EXR file that Blender wrote for a job.

    Ink, ``pen`` pixels wide at the final size, lies over the colours. A line has no depth of its own in Blender: it
    gets depth and object id of the nearest surface within its width, which is the surface that it outlines. ValueError
    where a pass is missing.
    """
    planes = {_pass_and_letter(name): plane for name, plane in channels.items()}

    def joined(what: str) -> Floats | None:
        found = [planes.get((what, letter)) for letter in "RGBA"]
        return None if any(plane is None for plane in found) else np.stack(found, axis=-1).astype(np.float32)  # type: ignore[arg-type]

    beauty, depth = joined("combined"), planes.get(("depth", "Z"), planes.get(("depth", "V")))
    number = next((planes[key] for key in planes if key[0] in ("indexob", "object index")), None)
    if beauty is None or depth is None or number is None:
        raise ValueError(f"want Blender's passes Combined, Depth and Object Index, got {', '.join(sorted(channels))}")
    depth = np.where(depth < BACKGROUND, depth, np.inf).astype(np.float32)
    index = np.where(np.isfinite(depth), np.rint(number), 0).astype(np.int64)
    object_id = np.where(index < LOWER_IDS, index, index + UPPER_IDS - LOWER_IDS).astype(np.uint16)
    lines = joined("freestyle")
    if lines is not None:
        drawn = lines[..., 3] > 0
        beauty = lines + (1 - lines[..., 3:]) * beauty
        near_depth, near_id = nearest(depth, object_id, int(np.ceil(pen * samples / 2)) + 1)
        depth = np.where(drawn, near_depth, depth)
        object_id = np.where(drawn, near_id, object_id)
    # A line that no surface is near to has no depth that compositing could use.
    beauty = np.where(np.isfinite(depth)[..., None], beauty, np.float32(0))
    return Passes(beauty, depth, np.isfinite(depth).astype(np.float32), object_id, samples)


def nearest(depth: Floats, object_id: NDArray[np.uint16], radius: int) -> tuple[Floats, NDArray[np.uint16]]:
    """Return depth and id (H, W) of the nearest surface in the square of ``radius`` pixels around every pixel."""
    import cv2

    kernel = np.ones((2 * radius + 1, 2 * radius + 1), np.uint8)
    far = np.float32(np.finfo(np.float32).max)
    least = np.asarray(cv2.erode(np.where(np.isfinite(depth), depth, far), kernel), np.float32)
    found = np.zeros_like(object_id)
    for number in np.unique(object_id[object_id > 0]):
        own = np.where(object_id == number, depth, far).astype(np.float32)
        found = np.where((np.asarray(cv2.erode(own, kernel)) == least) & (least < far), number, found)
    return np.where(least < far, least, np.float32(np.inf)).astype(np.float32), found


def _pass_and_letter(name: str) -> tuple[str, str]:
    """The last two words of a channel's name: ``ViewLayer.Combined.R`` gives combined and R."""
    before, _, letter = name.rpartition(".")
    return before.rpartition(".")[2].lower(), letter
