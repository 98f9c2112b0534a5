"""`pegbar animate` from end to end beside AnimatedDrawings: a picture and a clip in, an animation out; kept puppets.

AnimatedDrawings is in no package index: what it took for the same picture, clip and size on two such cores was measured
once by hand and is given. Ours works on all cores, as users run it.
"""

from __future__ import annotations

import importlib.util
import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benches.measure import Row
from pegbar import read_motion
from pegbar.puppet.staging import Setting
from pegbar.shot.animating import Casting, Outcome, Part, animate_parts
from pegbar.shot.puppet import kept_puppet

DATA = Path(os.environ.get("PEGBAR_TEST_DATA", Path(__file__).parents[2] / "shared" / "data"))
FIGURES = DATA / "drawings" / "animated_drawings"
CLIP, OTHER = (DATA / "mocap" / "bvh" / f"ad_fair1_{name}.bvh" for name in ("dab", "wave_hello"))
#: Seconds that AnimatedDrawings took for the GIF, 12 of them before the first picture.
PEER = 33.6
ROUNDS = 3


def run() -> Iterator[Row]:
    """Yield a row for each kind of animation and run, then for kept puppets."""
    if not CLIP.is_file():
        yield Row.left_out("pegbar animate", f"no {CLIP}")
        return
    for suffix in ("gif", "mp4"):
        if suffix == "mp4" and importlib.util.find_spec("av") is None:
            yield Row.left_out("pegbar animate, MP4", "PyAV is not installed")
            continue
        yield from animations(suffix)
    for name in ("char1", "char6"):
        yield kept(name)


def animations(suffix: str) -> Iterator[Row]:
    """Yield rows: from nothing, with the puppet kept, and another clip on it; the best of some rounds."""
    taken: dict[str, list[Outcome]] = {"cold": [], "puppet kept": [], "another clip on it": []}
    same = True
    for _ in range(ROUNDS):
        with tempfile.TemporaryDirectory() as folder:
            outputs = []
            for found, clip in zip(taken.values(), (CLIP, CLIP, OTHER), strict=True):
                output = Path(folder) / f"{len(outputs)}.{suffix}"
                part = Part(FIGURES / "char1" / "texture.png", (clip,))
                keep = Casting(keep=Path(folder) / "kept")
                found.append(animate_parts([part], output, casting=keep, setting=Setting(size=(500, 500))))
                outputs.append(output.read_bytes())
            same &= outputs[0] == outputs[1]
    for name, found in taken.items():
        best = min(found, key=lambda outcome: outcome.seconds)
        pace = best.frames / (best.seconds - best.setup)
        beside = name != "another clip on it"
        yield Row(
            f"pegbar animate, {suffix.upper()}, {name}",
            f"{best.seconds:.2f} s, {best.setup:.2f} s to the first picture, then {pace:.0f} a second",
            f"AnimatedDrawings {PEER} s (given)" if beside else "",
            f"{PEER / best.seconds:.1f}x" if beside else "",
            "promise 15x" if beside else "",
            f"{best.frames} pictures; cold and kept give {'the same bytes' if same else 'OTHER BYTES'}",
        )


def kept(name: str) -> Row:
    """Making a puppet beside taking the kept one up again for another clip."""
    motions = [read_motion(path) for path in (CLIP, OTHER)]
    picture, times, sizes = FIGURES / name / "texture.png", [], []
    with tempfile.TemporaryDirectory() as folder:
        for path, motion in zip((CLIP, OTHER), motions, strict=True):
            begin = time.perf_counter()
            puppet = kept_puppet(picture, motion, clip=path.stem, keep=Path(folder))
            times.append(time.perf_counter() - begin)
            sizes.append(len(puppet.vertices))
    agreement = f"{sizes[0]} vertices both times" if np.ptp(sizes) == 0 else f"{sizes} vertices: DIFFERENT"
    ours, first = f"{times[1]:.2f} s", f"ours the first time {times[0]:.2f} s"
    return Row(f"kept_puppet, {name}, again", ours, first, f"{times[0] / times[1]:.1f}x", "", agreement)
