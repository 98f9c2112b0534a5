"""The search for a drawn walk: beside vectorised numpy, and in a million frames made by varying the real clips."""

from __future__ import annotations

import os
import resource
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from benches.measure import Row, alternate, milliseconds
from pegbar import Clip, OrthographicCamera, _kernels, match_clips, read_clips
from pegbar.align.candidates import AZIMUTHS, ELEVATIONS, line_vectors, views
from pegbar.align.marks import read_marks
from pegbar.io.clip_index import NAME, Entry, load_index, save_index
from pegbar.scene.body import MARKERS
from pegbar.scene.clip import interpolate

DATA = Path(os.environ.get("PEGBAR_TEST_DATA", Path(__file__).parents[2] / "shared" / "data")) / "mocap"
FRAMES = 1_000_000


def drawing(clips: tuple[Clip, ...]) -> np.ndarray:
    """Two seconds of a walk at 24 frames a second, seen from the side."""
    walk = next(clip for clip in clips if clip.name.endswith("cmu_07_01.bvh"))
    return OrthographicCamera.from_angles(90, 5).project(walk.at(60 + 5.0 * np.arange(48)))


def varied(clip: Clip, number: int, rng: np.random.Generator) -> Clip:
    """The clip at another speed, every marker going its own slow way by centimetres."""
    speed = rng.uniform(0.8, 1.25)
    markers = interpolate(clip.markers, np.arange(0, len(clip.markers) - 1, speed))
    phase = rng.uniform(0, 2 * np.pi, (len(MARKERS), 3)) + np.linspace(0, 12, len(markers))[:, None, None]
    moved = (markers + 0.02 * np.sin(phase)).astype(np.float32)
    return Clip(f"{number}/{clip.name}", moved, clip.rate, clip.rate, 0, len(moved))


def million(clips: tuple[Clip, ...], folder: Path) -> tuple[int, int]:
    """Write an index of a million frames to ``folder``; return the numbers of clips and frames."""
    rng, made, count = np.random.default_rng(0), [], 0
    while count < FRAMES:
        made.append(varied(clips[len(made) % len(clips)], len(made), rng))
        count += len(made[-1].markers)
    save_index(folder, [Entry(clip.name, (), clip, "", False) for clip in made])
    return len(made), count


def search_index(folder: Path, drawn: np.ndarray) -> tuple[float, float, float, str]:
    """Seconds to load the index and to search it, the process's largest memory in MB, and the best match."""
    begin = time.perf_counter()
    clips = [entry.clip for entry in load_index(folder)[1].values() if entry.clip is not None]
    loaded = time.perf_counter()
    best = match_clips(drawn, MARKERS, clips, frame_rate=24).matches[0]
    done = time.perf_counter()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return loaded - begin, done - loaded, peak, f"{best.clip} {best.cost:.1f} degrees"


def run() -> Iterator[Row]:
    """Yield the rows."""
    clips = read_clips(DATA, use_index=False).clips
    drawn = drawing(clips)
    yield _beside_numpy(clips, drawn)
    (whole,) = alternate(lambda: match_clips(drawn, MARKERS, clips, frame_rate=24), rounds=5)
    frames = sum(len(clip.markers) for clip in clips)
    yield Row(f"match_clips, {frames} frames at 30/s", milliseconds(whole), "", "")
    with tempfile.TemporaryDirectory() as folder:
        many, count = million(clips, Path(folder))
        size = (Path(folder) / NAME).stat().st_size / 2**20
        # In a process of its own, so that its memory is the search's.
        with ProcessPoolExecutor(1, get_context("spawn")) as pool:
            load, search, peak, best = pool.submit(search_index, Path(folder), drawn).result()
    yield Row(
        f"match_clips, {count} frames in {many} clips",
        f"{search:.1f} s",
        "",
        f"{search / whole * 1e3:.0f}x the time for {count / frames:.0f}x the frames",
        "",
        f"index of {size:.0f} MB loaded in {load:.2f} s, process at most {peak:.0f} MB, best {best}",
    )


def _beside_numpy(clips: tuple[Clip, ...], drawn: np.ndarray) -> Row:
    """The first pass alone: the kernel on all views, numpy on one of them, times their number."""
    marks = read_marks(
        drawn, MARKERS, np.ones(drawn.shape[:2], bool), frame_rate=24.0, holds=np.ones(len(drawn)), loops=False
    )
    drawings = marks.thinned(12.5)
    steps = marks.steps(drawings, 0, 30.0, 2.0)
    vectors = np.concatenate([line_vectors(clip.markers, marks.pairs) for clip in clips], axis=2)
    axes, _ = views(AZIMUTHS, ELEVATIONS)
    angles = np.ascontiguousarray(marks.angles[:1, drawings], np.float32)
    shares = np.ascontiguousarray(marks.shares()[:1, drawings], np.float32)
    whole = np.array([[0, vectors.shape[2]]], np.uint64)
    order = np.arange(len(drawings), dtype=np.uint32)[None]

    def ours() -> float:
        found = _kernels.search_clips(vectors, whole, axes, (angles, shares, order, steps[None]), 1 << 20)
        return float(found[0][0, 0])

    def numpy() -> float:
        x, y = np.einsum("vd,kdt->vkt", axes[0], vectors)
        apart = np.abs(np.arctan2(y, x)[None] - angles[0][..., None])
        costs = np.einsum("fk,fkt->ft", shares[0], np.minimum(apart, 2 * np.pi - apart))
        row = costs[0]
        for cost, (low, high) in zip(costs[1:], steps[1:], strict=True):
            best = np.full(len(row), np.inf, np.float32)
            for step in range(low, high + 1):
                best[step:] = np.minimum(best[step:], row[: len(row) - step])
            row = best + cost
        return float(row.min())

    kernel, peer = alternate(ours, numpy, rounds=5)
    return Row(
        f"search_clips, {vectors.shape[2]} frames, {len(drawings)} drawings, {len(axes)} views",
        milliseconds(kernel),
        f"numpy {milliseconds(peer)} a view",
        f"{peer * len(axes) / kernel:.0f}x faster",
        "",
        f"costs differ by {abs(ours() - numpy()):.0e} radians",
    )
