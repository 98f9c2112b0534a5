"""A picture of every effect on a shot: each preset as its defaults make it, simulated and composited by itself.

An umbrella is shown in the rain.
"""

from __future__ import annotations

import dataclasses
import itertools
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import SimulationError
from pegbar.io.simulation_cache import DiskCache
from pegbar.report.contact_sheet import over_paper
from pegbar.shot.passes_stage import ElementsStage
from pegbar.shot.secondary_stage import ENGINES, SecondaryStage
from pegbar.simulate.engine import Progress, simulate_scene
from pegbar.simulate.presets import preset_elements
from pegbar.simulate.scene import SimulationScene

Picture = NDArray[np.uint8]
#: Where in the shot a picture is taken when no frame is named.
SHARE = 0.5
#: What an effect makes sense with.
COMPANIONS = {"umbrella": ("rain",)}


def effect_pictures(
    shot: Path, presets: Sequence[str], *, frame: int | None = None, width: int = 480, progress: Progress | None = None
) -> Iterator[tuple[str, Picture | str]]:
    """Yield by preset a picture (H, ``width``, 3) uint8 of it on the shot file ``shot``, or why there is none.

    The shot needs a ``[secondary]`` section; its elements are left out, its air, ground and seed count. ``frame`` is
    the film frame (None: the middle of the shot). Raises ShotError for a shot without the section and ValueError
    for a frame that it has not.
    """
    import cv2

    stage = SecondaryStage(shot, progress=progress)
    frames = stage.secondary.frames
    shown = frames[int(SHARE * (len(frames) - 1))] if frame is None else frame
    if shown not in frames:
        raise ValueError(f"frame: want {frames[0]} to {frames[-1]}, got {frame}")
    drivings = stage.drive()
    characters, bare = stage.secondary.characters(drivings)
    for name in presets:
        with tempfile.TemporaryDirectory() as folder:
            try:
                made = [
                    preset_elements(kind, characters[0], ground=bare.ground, seed=bare.seed, cameras=bare.cameras)
                    for kind in (name, *COMPANIONS.get(name, ()))
                ]
                scene = dataclasses.replace(bare, elements=tuple(itertools.chain(*made)))
                cache = DiskCache(Path(folder))
                simulate_scene(scene, cache, ENGINES, progress=progress)
            except (ValueError, SimulationError) as error:
                yield name, str(error)
                continue
            picture = _picture(stage.frames(drivings, scene), scene, cache, shown)
        height = round(picture.shape[0] * width / picture.shape[1])
        yield name, np.asarray(cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def _picture(planned: ElementsStage, scene: SimulationScene, cache: DiskCache, frame: int) -> Picture:
    """The finished frame with the elements of ``scene``, over white."""
    layers = dataclasses.replace(planned.layers, scene=scene, cache=cache)
    return over_paper(dataclasses.replace(planned, layers=layers).picture(frame))
