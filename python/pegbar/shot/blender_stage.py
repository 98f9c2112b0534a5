"""The stage that renders a shot's elements by Blender: many frames in one process, each kept as it is finished."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pegbar.errors import BlenderError
from pegbar.io.hold import hold
from pegbar.shot.passes_stage import BANDS, INK, Layers, pen_width
from pegbar.shot.record import fingerprint, is_up_to_date, write_record
from pegbar.shot.rendered import read_rendered
from pegbar.shot.view import LIGHT
from pegbar.simulate.blender.locate import Blender
from pegbar.simulate.blender.render import BlenderJob
from pegbar.simulate.meshes import Models
from pegbar.simulate.passes import Ink

VERSION = 2
# Frames that one Blender renders: it starts in two seconds, and this many frames' meshes are some hundred megabytes.
CHUNK = 24


@dataclass(frozen=True, eq=False)
class BlenderStage:
    """Renders the frames of ``layers`` to its ``rendered`` files: multilayer EXR as Blender writes it."""

    layers: Layers
    blender: Blender
    overwrite: bool = False

    def run(self, frames: Sequence[int], progress: Callable[[int, int], None] | None = None) -> int:
        """Render those of the film's ``frames`` that are out of date; return how many.

        Raises BlenderError where Blender fails; what it had finished is kept. BusyError where another run is at it.
        """
        assert self.layers.rendered is not None
        with hold(self.layers.rendered.path(0).parent):
            return self._run(frames, progress)

    def _run(self, frames: Sequence[int], progress: Callable[[int, int], None] | None) -> int:
        todo = [frame for frame in frames if not self.is_done(frame)]
        models = Models(self.layers.scene) if todo else None
        for first in range(0, len(todo), CHUNK):

            def tell(done: int, first: int = first) -> None:
                if progress is not None:
                    progress(first + done, len(todo))

            assert models is not None
            self._render(todo[first : first + CHUNK], models, tell)
        return len(todo)

    def is_done(self, frame: int) -> bool:
        """Whether the frame's file is there and of what it would be made of now."""
        return not self.overwrite and is_up_to_date([self._path(frame)], self._recipe(), self._inputs(frame))

    def _render(self, frames: Sequence[int], models: Models, tell: Callable[[int], None]) -> None:
        layers, kept = self.layers, 0
        target = self._path(frames[0]).parent
        prints = [[fingerprint(path) for path in self._inputs(frame)] for frame in frames]
        size = layers.scene.cameras[0].image_size
        pen = pen_width(size)
        job = BlenderJob(layers.section.samples, light=LIGHT, bands=BANDS, ink=Ink(pen, INK.color, INK.crease_angle))
        # In the same folder, so that a finished file only has to be renamed.
        with tempfile.TemporaryDirectory(prefix=".pegbar-blender-", dir=target) as place:
            folder = Path(place)
            outputs = job.write(folder, (self._frame(frame, models) for frame in frames))

            def keep(done: int, total: int) -> None:
                nonlocal kept
                while kept < min(done, len(frames)):
                    read_rendered(outputs[kept], layers.section.samples, size, pen)
                    os.replace(outputs[kept], self._path(frames[kept]))
                    write_record([self._path(frames[kept])], self._recipe(), prints[kept])
                    kept += 1
                    tell(kept)

            job.run(self.blender, folder, [], keep)
        if kept < len(frames):
            raise BlenderError(f"Blender {self.blender.version} did not render frame {frames[kept]}")

    def _frame(self, frame: int, models: Models) -> tuple[str, Any, Any]:
        index = frame - self.layers.first
        return f"frame_{frame}", self.layers.scene.cameras[index], self.layers.meshes(models, frame)[0]

    def _path(self, frame: int) -> Path:
        assert self.layers.rendered is not None
        return self.layers.rendered.path(frame)

    def _inputs(self, frame: int) -> list[Path]:
        layers = self.layers
        name = f"{frame - layers.first:04d}.npz"
        return [*(layers.cache.folder / element.name / name for element in layers.scene.elements), *layers.characters]

    def _recipe(self) -> str:
        section = self.layers.section
        parts: list[Any] = [VERSION, self.blender.version, [entry.model_dump() for entry in section.elements]]
        parts += [section.seed, section.samples, section.shadow, self.layers.scene.ground, self.layers.first]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
