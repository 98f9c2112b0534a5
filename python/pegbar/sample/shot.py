"""Writes the sample shot: drawings, labels, annotations, passes, the clip, the truth, and the shot file."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pegbar import arrays
from pegbar.io import atomic
from pegbar.io.annotations_writer import write_annotations
from pegbar.io.bvh import write_bvh
from pegbar.io.exr import write_exr
from pegbar.io.frames import write_image
from pegbar.sample import drawing as painter
from pegbar.sample.annotation import annotate, seen
from pegbar.sample.camera import camera
from pegbar.sample.dancer import FRAME_RATE, FRAMES, Dance, dance
from pegbar.sample.dots import dots_layer, dots_shot
from pegbar.sample.elements import hoop, ribbon
from pegbar.sample.figure import PALETTE, Pose
from pegbar.sample.skeleton import NAMES
from pegbar.scene.camera import PerspectiveCamera
from pegbar.simulate.passes import Ink, Passes, render_passes

BANDS = (0.42, 0.75, 1.0)
INK = Ink(1.8, (0.03, 0.012, 0.028, 1.0), None)

_SHOT = """\
[shot]
name = "sample"
frames = "1-{frames}"
frame_rate = {rate:g}
size = [{width}, {height}]

[drawing]
frames = "drawings/dancer.####.png"
labels = "labels/labels.####.png"
annotations = "annotation.json"
matte = "auto"

[drawing.palette]            # colours beyond the annotation's limb colours
{palette}

[clip]
path = "clip.bvh"

[passes]
beauty = "passes/passes.####.exr"
depth = "passes/passes.####.exr"

[secondary]
elements = ["scarves", "skirt", "balls"]

[output]
frames = "final/final.####.png"
depth = "depth/depth.####.exr"
holdout = "holdout/holdout.####.png"
"""


@dataclass(frozen=True)
class Scene:
    """Everything that the frames are made from: the dance and a camera for every frame."""

    dance: Dance
    cameras: tuple[PerspectiveCamera, ...]
    size: tuple[int, int]

    def time(self, index: int) -> float:
        """Time of frame ``index`` (from 0) in frames of the 48-frame loop."""
        return index * FRAMES / len(self.cameras)

    def pose(self, index: int) -> Pose:
        """The dancer of frame ``index`` (from 0) as drawn."""
        return Pose(self.dance.drawn[index], self.dance.clip.rotations[index], self.dance.tails[index])


class Frame(NamedTuple):
    """The pictures of one frame: drawing (H, W, 4), labels (H, W, 3), passes, and which markers are seen (N,)."""

    drawing: NDArray[np.uint8]
    labels: NDArray[np.uint8]
    passes: Passes
    visible: NDArray[np.bool_]


def make_scene(size: tuple[int, int] = (960, 540), frames: int = FRAMES) -> Scene:
    """Return the sample's dance and cameras for pictures of ``size`` (width, height)."""
    cameras = tuple(camera(index / frames, size) for index in range(frames))
    return Scene(dance(frames), cameras, size)


def make_frame(index: int, scene: Scene, samples: int = 2) -> Frame:
    """Draw and render frame ``index`` (from 0); the same arguments give the same bits."""
    view, pose = scene.cameras[index], scene.pose(index)
    figure = painter.parts(pose, view, index)
    labels = painter.labels(figure, scene.size)
    meshes = [hoop(scene.time(index)), ribbon(scene.time(index), pose.tail)]
    passes = render_passes(meshes, view, samples=samples, bands=BANDS, ink=_ink(scene.size))
    return Frame(painter.drawing(figure, scene.size), labels, passes, seen(pose, view, labels))


def write_sample(
    folder: str | os.PathLike[str],
    *,
    size: tuple[int, int] = (960, 540),
    frames: int = FRAMES,
    samples: int = 2,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Make the sample shot in ``folder`` and return the path of its shot file.

    Written are ``drawings/``, ``labels/`` and ``passes/`` (numbered from 1), ``annotation.json`` (markers, limbs,
    boxes, cameras and depths), ``clip.bvh`` (the dance with bones of constant length), ``truth.npz`` and ``shot.toml``;
    and ``dots/`` with ``dots.toml``, the same joints as a layer of coloured dots. ``truth.npz`` holds ``names`` (N,),
    ``clip`` and ``drawn`` (F, N, 3) world metres without and with squash and stretch, ``matrices`` (F, 3, 4) and
    ``image_size`` (2,).

    Parameters
    ----------
    folder : path
        Made where it is missing; files of the same names are replaced.
    size : (width, height)
        Of the drawings, in pixels; the figure keeps its share of the picture's width.
    frames : int
        The dance takes two seconds; it is spread over so many frames.
    samples : int
        The passes are so many times larger than the drawings on both sides.
    workers : int, optional
        Threads; None takes as many as there are processors. The files do not depend on it.
    progress : callable, optional
        Called with the number of finished frames and of all frames.

    Raises
    ------
    ValueError
        For a size, a number of frames or of samples that is not a whole number of one or more.
    OSError
        When a file cannot be written.
    """
    width, height = arrays.integers("size", size, (2,), low=1, high=16384).tolist()
    for name, value in (("frames", frames), ("samples", samples)):
        arrays.integers(name, value, (), low=1, high=9999)
    target = Path(folder)
    scene = make_scene((width, height), frames)
    for name in ("drawings", "labels", "dots", "passes"):
        (target / name).mkdir(parents=True, exist_ok=True)
    visible = np.empty((frames, len(NAMES)), bool)
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        done = pool.map(lambda index: _write_frame(target, index, scene, samples), range(frames))
        for index, row in enumerate(done):
            visible[index] = row
            if progress is not None:
                progress(index + 1, frames)
    drawn = annotate(target, scene.dance.drawn, scene.cameras, visible)
    write_annotations(target / "annotation.json", drawn)
    write_bvh(target / "clip.bvh", scene.dance.clip)
    _write_truth(target / "truth.npz", scene)
    palette = "\n".join(f'"#{red:02x}{green:02x}{blue:02x}" = "{limb}"' for (red, green, blue), limb in PALETTE.items())
    text = _SHOT.format(frames=frames, rate=FRAME_RATE, width=width, height=height, palette=palette)
    atomic.write_bytes(target / "shot.toml", text.encode())
    atomic.write_bytes(target / "dots.toml", dots_shot(frames, FRAME_RATE, (width, height)).encode())
    return target / "shot.toml"


def _ink(size: tuple[int, int]) -> Ink:
    """The elements' outline, as wide as the pen of the drawing."""
    return Ink(INK.width * size[0] / 960, INK.color, INK.crease_angle)


def _write_frame(folder: Path, index: int, scene: Scene, samples: int) -> NDArray[np.bool_]:
    frame, number = make_frame(index, scene, samples), f"{index + 1:04d}"
    write_image(folder / f"drawings/dancer.{number}.png", frame.drawing)
    write_image(folder / f"labels/labels.{number}.png", frame.labels)
    marks = scene.cameras[index].project(scene.pose(index).markers)
    write_image(folder / f"dots/dots.{number}.png", dots_layer(marks, frame.visible, scene.size))
    write_exr(folder / f"passes/passes.{number}.exr", {"": frame.passes.beauty, "Z": frame.passes.depth})
    return frame.visible


def _write_truth(path: Path, scene: Scene) -> None:
    with atomic.complete_file(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(
            file,
            names=np.array(NAMES),
            clip=scene.dance.clip.positions,
            drawn=scene.dance.drawn,
            matrices=np.stack([view.matrix for view in scene.cameras]),
            image_size=np.array(scene.size),
        )
