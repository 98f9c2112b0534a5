"""Brings rendered passes of another package into pegbar's convention, after all of them have been checked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pegbar.export.shot_scene import ShotScene
from pegbar.io.atomic import clean_leftovers
from pegbar.io.exr import write_exr
from pegbar.io.hold import hold
from pegbar.io.sequence import FrameSequence
from pegbar.layer.depth_convention import ray_lengths
from pegbar.shot.find import check_clash, plan_output
from pegbar.shot.incoming import Finding, Incoming, joined, structure
from pegbar.shot.passes_check import Alpha, ImportOptions, Judgement, judge


@dataclass(frozen=True, eq=False)
class ImportStage:
    """Passes ``incoming`` of ``frames`` that were rendered for ``scene``; results go to ``folder``.

    ``camera`` says whether the scene's cameras move with those of an exposure sheet.
    """

    incoming: Incoming
    frames: tuple[int, ...]
    scene: ShotScene
    folder: Path
    options: ImportOptions
    camera: Literal["sheet", "drawn"] = "drawn"

    @property
    def outputs(self) -> FrameSequence:
        """The files that are written; ValueError where they would replace what is read."""
        sequence = plan_output(self.folder, "depth", "passes.####.exr")
        check_clash(sequence, {"the passes": self.incoming.beauty, "the depth": self.incoming.depth})
        return sequence

    def check(self) -> tuple[list[Finding], Judgement | None]:
        """Return everything that is found, and how to read the passes: None where they cannot be used."""
        found = structure(self.incoming, self.frames, self.scene.image_size)
        if any(line.kind == "problem" for line in found):
            return found, None
        judgement = judge(self.incoming, self.frames, self.scene, self.options)
        found += judgement.findings
        return found, None if any(line.kind == "problem" for line in found) else judgement

    def run(self, judgement: Judgement, progress: Callable[[], None] | None = None) -> None:
        """Write every frame as ``judgement`` says; OSError or FormatError for a file that fails, which is named.

        BusyError, an OSError, where another run writes to the folder.
        """
        with hold(self.folder):
            self._write(judgement, progress)

    def _write(self, judgement: Judgement, progress: Callable[[], None] | None) -> None:
        self.outputs.folder.mkdir(parents=True, exist_ok=True)
        clean_leftovers(self.outputs.folder)
        with ThreadPoolExecutor(2) as pool:
            for _ in pool.map(lambda frame: self._convert(frame, judgement), self.frames):
                if progress is not None:
                    progress()

    def _convert(self, frame: int, judgement: Judgement) -> None:
        channels, names = self.incoming.read(frame)
        beauty = joined(channels, names.beauty)
        width = beauty.shape[1]
        camera = self.scene.cameras[frame - self.scene.frames[0]]
        rays = ray_lengths(camera.scaled(width // self.scene.image_size[0]))
        written: dict[str, NDArray[Any]] = dict(
            zip("RGBA", np.moveaxis(multiplied(beauty, judgement.alpha), 2, 0), strict=True)
        )
        if all(channels[name].dtype == np.float16 for name in names.beauty):
            written = {name: plane.astype(np.float16) for name, plane in written.items()}
        written["Z"] = judgement.convention.planar(np.asarray(channels[names.depth], np.float32), rays)
        for name, plane in channels.items():
            if name not in (*names.beauty, names.depth):
                written[_free(name, written)] = plane
        write_exr(self.outputs.path(frame), written, exact=True)


def multiplied(beauty: NDArray[np.float32], alpha: Alpha) -> NDArray[np.float32]:
    """Return ``beauty`` (H, W, 4) with colours multiplied by its alpha."""
    if alpha == "premultiplied":
        return beauty
    return np.concatenate([beauty[..., :3] * beauty[..., 3:], beauty[..., 3:]], axis=2)


def _free(name: str, taken: Sequence[str] | dict[str, Any]) -> str:
    """``name``, or one that says where it comes from if it is taken."""
    return name if name not in taken else f"original.{name}"
