"""`pegbar composite` on 1080p PNG + EXR passes: what compositing adds to reading and writing the files, and jobs."""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pegbar.io.annotations_writer import write_annotations
from pegbar.io.exr import read_passes, write_exr
from pegbar.io.frames import read_picture, write_image
from pegbar.scene.drawing import Drawing, Limb
from pegbar.shot.plan import Shot, open_shot
from pegbar.shot.stages import CompositeStage

WIDTH, HEIGHT, FRAMES, LIMBS = 1920, 1080, 12, 16
SHOT = """
[shot]
frames = "1-{count}"
[drawing]
frames = "d.####.png"
labels = "l.####.png"
annotations = "a.json"
[passes]
beauty = "p.####.exr"
[output]
frames = "out/f.####.png"
"""


def run() -> Iterator[tuple[object, ...]]:
    """Yield rows: share of compositing, and the gain of two jobs."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shot = make_shot(folder, FRAMES)
        whole, files = paired(shot)
        share = whole / files - 1
        yield (
            "composite 1080p, one frame",
            f"{whole:.0f} ms",
            f"files alone {files:.0f} ms",
            f"adds {share:.0%}",
            "promise 15%",
        )
        one, two = (command(folder, jobs) for jobs in (1, 2))
        yield (
            f"pegbar composite, {FRAMES} frames",
            f"1 job {one:.1f} s",
            f"2 jobs {two:.1f} s",
            f"{one / two:.2f}x",
            "promise 1.7x",
        )


def paired(shot: Shot) -> tuple[float, float]:
    """Median ms of a whole frame, and of its reading and writing alone, in turn."""
    stage, whole, files = CompositeStage(shot, overwrite=True), [], []
    stage.prepare(list(shot.frames))
    for frame in [1, *shot.frames]:
        start = time.perf_counter()
        stage(frame)
        middle = time.perf_counter()
        final = read_picture(stage.outputs(frame)[0])
        ready = time.perf_counter()
        read_picture(shot.drawings.path(frame))
        assert shot.labels is not None
        assert shot.beauty is not None
        read_picture(shot.labels.path(frame))
        read_passes(shot.beauty.path(frame))
        write_image(stage.outputs(frame)[0], final)
        whole.append(1e3 * (middle - start))
        files.append(1e3 * (time.perf_counter() - ready))
    return statistics.median(whole[1:]), statistics.median(files[1:])


def command(folder: Path, jobs: int) -> float:
    """Seconds of the whole command with ``jobs`` workers."""
    arguments = ["composite", str(folder / "shot.toml"), "--overwrite", "--jobs", str(jobs)]
    start = time.perf_counter()
    subprocess.run([sys.executable, "-m", "pegbar", *arguments], check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start


def make_shot(folder: Path, count: int, width: int = WIDTH, height: int = HEIGHT) -> Shot:
    """Write a synthetic shot: a figure of 16 limbs with soft rims and lines, passes with a shaded disc that moves."""
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    limb = (x * 4 // width + 4 * (y * 4 // height)).astype(np.int64)
    local = np.hypot((x * 4 / width) % 1 - 0.5, (y * 4 / height) % 1 - 0.5)
    alpha = np.clip((0.31 - local) * width / 8, 0, 1)
    colors = np.stack([limb * 15, 255 - limb * 15, (limb * 83) % 256], axis=-1).astype(np.uint8)
    shade = (colors * (0.8 + 0.2 * np.sin(x / 17 + y / 29))[..., None]).astype(np.uint8)
    drawing = np.dstack([shade, np.rint(alpha * 255).astype(np.uint8)])
    labels = np.where((alpha == 1)[..., None], np.maximum(colors, 1), 0).astype(np.uint8)
    palette = [
        tuple(np.maximum(colors[np.argmax(limb == v) // width, np.argmax(limb == v) % width], 1).tolist())
        for v in range(LIMBS)
    ]
    for frame in range(1, count + 1):
        write_image(folder / f"d.{frame:04d}.png", drawing)
        write_image(folder / f"l.{frame:04d}.png", labels)
        write_passes(folder / f"p.{frame:04d}.exr", x, y, frame)
    centres = np.stack([(np.arange(LIMBS) % 4 + 0.5) * width / 4, (np.arange(LIMBS) // 4 + 0.5) * height / 4], axis=-1)
    ends = np.stack([centres - 20, centres + 20], axis=1).reshape(-1, 2)
    names = tuple(f"m{i}" for i in range(2 * LIMBS))
    limbs = tuple(Limb(f"limb{v}", names[2 * v], names[2 * v + 1], palette[v]) for v in range(LIMBS))
    marks = Drawing(
        names,
        np.repeat(ends[None], count, axis=0),
        np.ones((count, 2 * LIMBS), bool),
        (width, height),
        limbs=limbs,
        depths=np.tile(np.linspace(3, 6, 2 * LIMBS), (count, 1)),
    )
    write_annotations(folder / "a.json", marks)
    (folder / "shot.toml").write_text(SHOT.format(count=count))
    return open_shot(folder / "shot.toml")


def write_passes(path: Path, x: np.ndarray, y: np.ndarray, frame: int) -> None:
    """A shaded disc before half of the limbs and behind the others."""
    distance = np.hypot(x - 900 - 20 * frame, y - 540)
    covered = np.clip(420 - distance, 0, 1).astype(np.float32)
    light = covered * (0.6 + 0.3 * np.cos(distance / 90))
    channels = {name: (light * part).astype(np.float16) for name, part in zip("RGB", (0.9, 0.5, 0.2), strict=True)}
    depth = np.where(covered > 0, 4.5 + 0.002 * (x - 960), np.inf).astype(np.float32)
    write_exr(path, {**channels, "A": covered.astype(np.float16), "Z": depth})
