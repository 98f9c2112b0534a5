"""A BVH file of 2 MB, a real clip repeated, read with forward kinematics, beside pybvh's reading and node positions."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benches.measure import Row, alternate, milliseconds
from pegbar import read_motion
from pegbar.io.bvh_reader import read_bvh

SIZE = 2_000_000


def long_clip(folder: Path) -> Path | None:
    """A walk whose frames are repeated until the file has 2 MB; None without the real data."""
    root = Path(__file__).parents[1]
    data = Path(os.environ.get("PEGBAR_TEST_DATA", root.parent / "shared" / "data"))
    source = data / "mocap" / "bvh" / "cmu_02_01.bvh"
    if not source.is_file():
        return None
    head, _, body = source.read_text().partition("Frames:")
    _, time, *rows = body.splitlines()
    rows *= 1 + SIZE // len(body)
    length, count = len(head), 0
    while length < SIZE:
        length += len(rows[count]) + 1
        count += 1
    path = folder / "long.bvh"
    path.write_text(f"{head}Frames: {count}\n{time}\n" + "\n".join(rows[:count]) + "\n")
    return path


def run() -> Iterator[Row]:
    """Yield a row for the reader and one for the motion with its conventions found."""
    try:
        import pybvh  # type: ignore[import-not-found, unused-ignore]
    except ImportError:
        yield Row.left_out("read_bvh", "pybvh is not installed")
        return
    with tempfile.TemporaryDirectory() as folder:
        path = long_clip(Path(folder))
        if path is None:
            yield Row.left_out("read_bvh", "no real clips: set PEGBAR_TEST_DATA")
            return
        clip, peer_clip = read_bvh(path), pybvh.read_bvh_file(str(path))
        error = np.abs(clip.positions - np.asarray(peer_clip.joint_positions())).max()
        ours, motion, peer = alternate(
            lambda: read_bvh(path),
            lambda: read_motion(path),
            lambda: pybvh.read_bvh_file(str(path)).node_positions(),
            rounds=9,
        )
        same = f"largest difference {error:.0e} of a unit, {len(clip.positions)} frames"
        rows = (("BVH of 2 MB, positions of all joints", ours, "promise 10x"), ("the same as read_motion", motion, ""))
        for name, time, promise in rows:
            yield Row(name, milliseconds(time), f"pybvh {milliseconds(peer)}", f"{peer / time:.1f}x", promise, same)
