"""A lifted drawing as files: BVH, glTF and USD of the skeleton, CSV and npz of the markers, all at the same frames."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pegbar.align.retime import sample_markers
from pegbar.export.gltf import glb
from pegbar.export.usd import usd_layer
from pegbar.io import atomic
from pegbar.io.bvh import write_bvh
from pegbar.scene.lifted import Lifted
from pegbar.scene.motion import Motion
from pegbar.shot.film import film_moments, on_film
from pegbar.shot.lifting import scaled
from pegbar.shot.model import LiftSection

Floats = NDArray[np.float64]
FILES = {
    "bvh": "animation.bvh",
    "glb": "animation.glb",
    "usd": "animation.usda",
    "csv": "markers.csv",
    "npz": "markers.npz",
}


@dataclass(frozen=True, eq=False)
class Film:
    """What is written: ``motion`` and ``markers`` (T, N, 3) at ``seconds`` (T,), and the ``drawings`` seen then."""

    motion: Motion
    seconds: Floats
    drawings: tuple[int, ...]
    markers: Floats


def film_of(
    lifted: Lifted, numbers: Sequence[int], holds: Sequence[int], frame_rate: float, section: LiftSection
) -> Film:
    """Return the frames that ``section`` asks for, of drawings ``numbers`` on a film of ``frame_rate`` a second."""
    stepped, rate = section.interpolation == "step", section.frame_rate or frame_rate
    seconds, places = film_moments(holds, frame_rate, stepped=stepped, rate=rate, loop=section.loop)
    motion = on_film(
        lifted.motion, holds, frame_rate, stepped=stepped, rate=rate, loop=section.loop, travel=lifted.travel
    )
    markers = lifted.markers
    if section.loop:
        markers = np.concatenate([markers, markers[:1] + lifted.travel])
    shown = [numbers[place % len(numbers)] for place in places.astype(int).tolist()]
    size = lifted.size if section.skeleton_size == "own" else 1.0
    return Film(scaled(motion, size), seconds, tuple(shown), sample_markers(markers, places))


def write_film(path: Path, kind: str, film: Film, lifted: Lifted, section: LiftSection) -> None:
    """Write one of `FILES`, complete or not at all."""
    step = section.interpolation
    if kind == "bvh":
        write_bvh(path, film.motion, stretch=section.stretch, offsets=film.motion.ends)
    elif kind == "glb":
        atomic.write_bytes(path, glb(film.motion, times=film.seconds, interpolation=step, name=path.stem))
    elif kind == "usd":
        with atomic.complete_file(path) as part:
            if not usd_layer(film.motion, times=film.seconds, interpolation=step).Export(str(part)):
                raise OSError(f"{path}: could not be written")
    elif kind == "csv":
        atomic.write_bytes(path, _table(film, lifted.names).encode())
    else:
        _write_arrays(path, film, lifted)


def _table(film: Film, names: Sequence[str]) -> str:
    """The markers as CSV: one row a frame (from 1) and marker, metres."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["frame", "seconds", "drawing", "marker", "x", "y", "z"])
    for frame, (moment, number, places) in enumerate(zip(film.seconds, film.drawings, film.markers, strict=True), 1):
        for name, place in zip(names, places.tolist(), strict=True):
            table.writerow([frame, round(float(moment), 6), number, name, *(round(value, 6) for value in place)])
    return text.getvalue()


def _write_arrays(path: Path, film: Film, lifted: Lifted) -> None:
    motion = lifted.motion
    parents = np.array(motion.parents)
    above = np.where(parents < 0, np.arange(len(parents)), parents)
    lengths = np.linalg.norm(motion.positions - motion.positions[:, above], axis=2)
    usual = np.median(lengths, axis=0)
    with atomic.complete_file(path) as part, part.open("wb") as file:
        np.savez_compressed(
            file,
            names=np.array(lifted.names),
            markers=lifted.markers,
            planted=lifted.planted,
            bones=lifted.bones,
            joints=np.array(motion.names),
            bone_scales=np.where(usual > 0, lengths / np.where(usual > 0, usual, 1), 1.0),
            frame_seconds=film.seconds,
            frame_drawings=film.drawings,
            frame_markers=film.markers,
        )
