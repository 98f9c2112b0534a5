"""Passes of a shot as another package could send them, with or without faults."""

from __future__ import annotations

import numpy as np

from pegbar import Mesh
from pegbar.export.limbs import limb_meshes
from pegbar.export.shot_scene import ShotScene
from pegbar.io.exr import write_exr
from pegbar.layer.depth_convention import ground_depth, ray_lengths
from pegbar.simulate.passes import render_passes
from tests.export.shots import FRAMES, shot

SIZE = (240, 135)


def small(**lens) -> ShotScene:
    """The shot in small pictures."""
    scene = shot(**lens)
    object.__setattr__(scene, "cameras", tuple(camera.scaled(0.25) for camera in scene.cameras))
    return scene


def truth(scene: ShotScene, row: int) -> dict[str, np.ndarray]:
    """Beauty (premultiplied), depth of an element, and depth of limbs alone, of one frame."""
    camera = scene.cameras[row]
    key = row, camera.matrix.tobytes()
    if key not in _rendered:
        corners = [[-0.6, 0.3, 0.9], [0.9, 0.5, 0.4], [0.8, 1.3, 0.4], [-0.5, 1.5, 0.9]]
        colors = np.array([[0.8, 0.3, 0.1, 1], [0.7, 0.4, 0.2, 1], [0.8, 0.3, 0.2, 1], [0.6, 0.5, 0.1, 1]])
        square = Mesh(corners, [[0, 1, 2], [0, 2, 3]], colors.astype(np.float32))
        seen = render_passes([square], camera, samples=4).resolved()
        limbs = render_passes(limb_meshes(scene.characters, row), camera)
        _rendered[key] = {"": seen.beauty, "Z": seen.depth, "check.Depth.Z": limbs.depth}
    return dict(_rendered[key])


_rendered: dict[tuple[int, bytes], dict[str, np.ndarray]] = {}


def write(folder, scene, change=None, *, check=True, number=lambda frame: frame, rows=None):
    """Write the passes into ``folder``; ``change(channels, camera, frame)`` may spoil them. Return their pattern."""
    folder.mkdir(exist_ok=True)
    for row, frame in enumerate(FRAMES):
        channels = truth(scene, row if rows is None else rows(row))
        if not check:
            del channels["check.Depth.Z"]
        if change is not None:
            channels = change(channels, scene.cameras[row], frame) or channels
        write_exr(folder / f"r.{number(frame):04d}.exr", channels, exact=True)
    return str(folder / "r.####.exr")


def depths(function):
    """A change of every depth channel: ``function(depth, camera)``."""

    def change(channels, camera, frame):
        for name in channels:
            if name.endswith("Z"):
                channels[name] = np.asarray(function(channels[name], camera), np.float32)

    return change


def with_ground(channels, camera, frame):
    """The element stands on a ground that is in its depth pass."""
    channels["Z"] = np.minimum(channels["Z"], ground_depth(camera, 0.0)).astype(np.float32)


def radial(depth, camera):
    """Depth along rays."""
    return depth * ray_lengths(camera)
