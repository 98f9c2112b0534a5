"""`pegbar composite` on the sample shot at 1080p, PNG drawings and EXR passes: what it adds to the files, and jobs."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from benches.measure import Row
from pegbar.io.exr import read_passes
from pegbar.io.frames import read_image, read_picture, write_image
from pegbar.sample.shot import write_sample
from pegbar.shot.batch import run_frames
from pegbar.shot.plan import Shot, open_shot
from pegbar.shot.stages import CompositeStage

FRAMES, HOLD = 48, 4


def run() -> Iterator[Row]:
    """Yield rows: the share of compositing in a frame, and the gain of two jobs."""
    import cv2

    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as name:
        shot = make_shot(Path(name), FRAMES)
        whole, files = paired(shot)
        correct = "the bytes of the frame written alone are the same"
        yield Row(
            "pegbar composite, a frame at 1080p",
            f"{whole:.0f} ms",
            f"its files read and written {files:.0f} ms",
            f"adds {whole / files - 1:.0%}",
            "promise 15%",
            correct,
        )
        hold_longer(Path(name))
        one, two = (command(Path(name), jobs) for jobs in (1, 2))
        yield Row(
            f"pegbar composite, {FRAMES * HOLD} frames at 1080p",
            f"2 jobs {two:.1f} s",
            f"1 job {one:.1f} s",
            f"{one / two:.2f}x",
            "promise 1.7x",
            "start-up included",
        )


def make_shot(folder: Path, count: int, size: tuple[int, int] = (1920, 1080), samples: int = 1) -> Shot:
    """Write the sample shot and ask for the final frames only."""
    path = write_sample(folder, size=size, frames=count, samples=samples)
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(line for line in lines if not line.startswith("holdout")), encoding="utf-8")
    return open_shot(path)


def hold_longer(folder: Path) -> None:
    """Make the shot as many times longer: each drawing is held, the passes come again."""
    for frame in range(FRAMES + 1, FRAMES * HOLD + 1):
        first = folder / f"passes/passes.{(frame - 1) % FRAMES + 1:04d}.exr"
        os.link(first, folder / f"passes/passes.{frame:04d}.exr")
    path = folder / "shot.toml"
    text = path.read_text(encoding="utf-8").replace(f'"1-{FRAMES}"', f'"1-{FRAMES * HOLD}"')
    path.write_text(text.replace("[drawing]", f"[drawing]\nhold = {HOLD}", 1), encoding="utf-8")


def paired(shot: Shot) -> tuple[float, float]:
    """Median ms of a whole frame, and of reading and writing its files alone, frame by frame in turn."""
    stage, whole, files = CompositeStage(shot, overwrite=True), [], []
    stage.prepare(list(shot.frames))
    start = time.perf_counter()
    for result in run_frames(stage, [shot.frames[0], *shot.frames], jobs=1):
        whole.append(1e3 * (time.perf_counter() - start))
        frame = result.frame
        output = stage.outputs(frame)[0]
        final, written = read_image(output), output.read_bytes()
        start = time.perf_counter()
        files_alone(shot, frame, output, final)
        files.append(1e3 * (time.perf_counter() - start))
        assert output.read_bytes() == written
        start = time.perf_counter()
    return statistics.median(whole[1:]), statistics.median(files[1:])


def files_alone(shot: Shot, frame: int, output: Path, final: object) -> None:
    """Read a frame's inputs and write its output, nothing else."""
    assert shot.labels is not None
    assert shot.beauty is not None
    read_picture(shot.drawings.path(frame))
    read_picture(shot.labels.path(frame))
    read_passes(shot.beauty.path(frame))
    write_image(output, final)


def command(folder: Path, jobs: int) -> float:
    """Seconds of the whole command with ``jobs`` worker processes of one thread each."""
    arguments = ["composite", str(folder / "shot.toml"), "--overwrite", "--jobs", str(jobs)]
    environment = {**os.environ, "RAYON_NUM_THREADS": "1", "OPENCV_FOR_THREADS_NUM": "1"}
    start = time.perf_counter()
    subprocess.run([sys.executable, "-m", "pegbar", *arguments], check=True, stdout=subprocess.DEVNULL, env=environment)
    return time.perf_counter() - start
