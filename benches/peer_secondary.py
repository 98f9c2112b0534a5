"""`pegbar secondary` on the sample shot at 1080p, a skirt: what render, depth, matte and composite take a frame."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benches.measure import Row
from pegbar.io.frames import read_picture
from pegbar.sample.shot import write_sample

FRAMES, JOBS = 48, 2


def run() -> Iterator[Row]:
    """Yield a row with EXR passes written and one without."""
    with tempfile.TemporaryDirectory() as name:
        shot = write_sample(Path(name), size=(1920, 1080), frames=FRAMES, samples=1)
        plain = re.sub("elements = .*", 'elements = ["skirt"]', shot.read_text(encoding="utf-8"))
        finals = []
        for passes, least in ((True, "0.4 s"), (False, "0.2 s")):
            shot.write_text(
                plain.replace("[secondary]", f"[secondary]\npasses = {str(passes).lower()}"), encoding="utf-8"
            )
            seconds = command(shot)
            finals.append([read_picture(path) for path in sorted((shot.parent / "secondary/final").glob("*.png"))])
            each = seconds.pop("render and composite") / FRAMES
            rest = ", ".join(f"{stage} {value:.1f} s" for stage, value in seconds.items())
            what = f"pegbar secondary at 1080p, a frame, {JOBS} jobs, EXR passes {'' if passes else 'not '}written"
            yield Row(what, f"{each:.2f} s; {rest}", "", "", f"promise {least}", alike(finals))


def command(shot: Path) -> dict[str, float]:
    """The seconds of each stage of the whole command, everything made anew."""
    environment = {**os.environ, "RAYON_NUM_THREADS": "1", "OPENCV_FOR_THREADS_NUM": "1"}
    arguments = ["secondary", str(shot), "--overwrite", "--jobs", str(JOBS)]
    subprocess.run([sys.executable, "-m", "pegbar", *arguments], check=True, stdout=subprocess.DEVNULL, env=environment)
    report = json.loads((shot.parent / "secondary/report.json").read_text(encoding="utf-8"))
    seconds: dict[str, float] = report["seconds"]
    return seconds


def alike(finals: list[list[np.ndarray]]) -> str:
    """How far the frames are from those of the first run."""
    first, last = finals[0], finals[-1]
    if len(first) != FRAMES:
        raise AssertionError(f"{len(first)} frames, want {FRAMES}")
    apart = [np.abs(a.astype(np.int16) - b).max(axis=-1) > 2 for a, b in zip(first, last, strict=True)]
    differ = float(np.mean([pixels.mean() for pixels in apart]))
    return f"{len(last)} frames, {differ:.2%} of the pixels differ from those of the first run"
