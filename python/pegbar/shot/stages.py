"""The stages of a frame: depth of the drawing, and the depth composite (2010 paper, section 3.3).

Each stage is a task for `pegbar.shot.batch`: a frame number in, files out, an `Outcome` back. A frame that is up to
date is left alone.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.io.atomic import clean_leftovers
from pegbar.io.exr import read_passes, write_exr
from pegbar.io.frames import read_image, write_image
from pegbar.layer.composite import Space, depth_composite, holdout_matte, visible_matte
from pegbar.layer.reframe import reframe_coverage, reframe_picture
from pegbar.layer.rim import rim_depth
from pegbar.report.contact_sheet import over_paper
from pegbar.report.depth_picture import depth_picture
from pegbar.scene.film_view import FilmView
from pegbar.shot.drawn import Drawn, drawn_inputs, read_drawn
from pegbar.shot.drawn_layers import drawn_layers
from pegbar.shot.framed import reframed
from pegbar.shot.plan import Shot
from pegbar.shot.record import fingerprint, forget, is_up_to_date, write_record

VERSION = 2


@dataclass(frozen=True)
class Outcome:
    """What a stage did for one frame: ``made`` (else it was up to date), and what the user should know."""

    made: bool
    outputs: tuple[Path, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Stage:
    """What both stages share: outputs are made when they are missing or out of date."""

    shot: Shot
    overwrite: bool = False

    def __call__(self, frame: int, /) -> Outcome:
        """Make the outputs of ``frame`` unless they are up to date."""
        outputs, inputs = self.outputs(frame), self.inputs(frame)
        for path in inputs:
            if not path.is_file():
                raise FileNotFoundError(f"frame {frame}: no such file: {path}")
        if self.is_done(frame):
            return Outcome(False, tuple(outputs))
        recipe, prints = self._recipe(frame), [fingerprint(path) for path in inputs]
        forget(outputs)
        notes = self.make(frame)
        write_record(outputs, recipe, prints)
        return Outcome(True, tuple(outputs), notes)

    def is_done(self, frame: int) -> bool:
        """Whether ``frame`` needs no work: its outputs are there and nothing that they depend on has changed."""
        try:
            return not self.overwrite and is_up_to_date(self.outputs(frame), self._recipe(frame), self.inputs(frame))
        except ValueError:
            return False

    def prepare(self, frames: list[int]) -> None:
        """Make the output folders and clear what killed runs left in them; OSError where that cannot be."""
        for folder in {path.parent for path in self.outputs(frames[0])}:
            folder.mkdir(parents=True, exist_ok=True)
            clean_leftovers(folder)

    def outputs(self, frame: int) -> list[Path]:
        """The files that the stage writes for ``frame``, the main one first."""
        raise NotImplementedError

    def inputs(self, frame: int) -> list[Path]:
        """The picture files that the stage reads for ``frame``."""
        raise NotImplementedError

    def make(self, frame: int) -> tuple[str, ...]:
        """Read, compute and write ``frame``; return notes for the user."""
        raise NotImplementedError

    def sections(self) -> list[Any]:
        """The settings that the stage's result depends on."""
        raise NotImplementedError

    def _recipe(self, frame: int) -> str:
        """A hash of all that decides the result besides the picture files: version, settings, this frame's marks."""
        shot = self.shot
        parts: list[Any] = [VERSION, type(self).__name__, [section.model_dump() for section in self.sections()]]
        parts += [shot.matte, shot.palette.colors.tolist(), shot.palette.labels.tolist()]
        if (marks := shot.annotations) is not None and shot.drawing_depth is None:
            index = shot.annotation_index(frame)
            depths = None if marks.depths is None else marks.depths[index].tolist()
            parts += [marks.markers[index].tolist(), depths, marks.limb_markers.tolist()]
        parts += shot.framing(frame)
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


class DepthStage(Stage):
    """Depth of the drawing (eq. of section 3.3.1): an EXR map in metres, a picture to look at, and layers for Nuke."""

    def outputs(self, frame: int) -> list[Path]:
        return [path for key in ("depth", "depth_picture", "layers") if (path := self.shot.output(key, frame))]

    def inputs(self, frame: int) -> list[Path]:
        return drawn_inputs(self.shot, frame)

    def sections(self) -> list[Any]:
        return [self.shot.settings.drawing]

    def make(self, frame: int) -> tuple[str, ...]:
        drawn = reframed(self.shot, frame, read_drawn(self.shot, frame))
        depth, picture, layers = (self.shot.output(key, frame) for key in ("depth", "depth_picture", "layers"))
        if depth is not None:
            write_exr(depth, {"Z": drawn.depth})
        if picture is not None:
            write_image(picture, depth_picture(drawn.depth, *self._range(drawn)))
        if layers is not None:
            marks = self.shot.annotations
            write_exr(layers, drawn_layers(drawn, [limb.name for limb in marks.limbs] if marks is not None else []))
        return drawn.notes

    def _range(self, drawn: Drawn) -> tuple[float, float]:
        """Nearest and farthest depth of the whole shot, so that the pictures do not flicker."""
        marks = self.shot.annotations
        known = marks.depths if marks is not None and marks.depths is not None else drawn.depth
        finite = known[np.isfinite(known)]
        return (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)


class CompositeStage(Stage):
    """The drawing and the rendered passes in depth order (eqs. 16-17), and the mattes that do it elsewhere."""

    def outputs(self, frame: int) -> list[Path]:
        return [path for key in ("frames", "holdout", "visible") if (path := self.shot.output(key, frame))]

    def inputs(self, frame: int) -> list[Path]:
        assert self.shot.beauty is not None
        assert self.shot.depth is not None
        passes = [self.shot.beauty.path(frame), self.shot.depth.path(frame)]
        return [*drawn_inputs(self.shot, frame), *dict.fromkeys(passes)]

    def sections(self) -> list[Any]:
        settings = self.shot.settings
        assert settings.passes is not None
        return [settings.drawing, settings.passes, settings.output]

    def make(self, frame: int) -> tuple[str, ...]:
        drawn, view = self.read_drawn(frame)
        beauty, depth, space = self.read_rendered(frame)
        check_passes(frame, self.inputs(frame)[-1], drawn.alpha.shape, beauty, depth)
        depth = rim_depth(beauty, depth)
        target = self.shot.settings.output.composite_space
        final, holdout, visible = (self.shot.output(key, frame) for key in ("frames", "holdout", "visible"))
        assert final is not None
        picture = depth_composite(
            drawn.color,
            drawn.alpha,
            drawn.depth,
            beauty,
            depth,
            rendered_space=space,
            space=target,
            dtype=np.float32 if self.shot.settings.output.is_exr else np.uint8,
        )
        write_final(final, picture if view is None else reframe_picture(picture, view))
        if holdout is not None:
            _write_matte(holdout, holdout_matte(drawn.alpha, drawn.depth, depth), view)
        if visible is not None:
            coverage = np.asarray(beauty[..., 3], np.float32) / (255 if beauty.dtype == np.uint8 else 1)
            _write_matte(visible, visible_matte(drawn.alpha, drawn.depth, np.clip(coverage, 0, 1), depth), view)
        return drawn.notes

    def read_drawn(self, frame: int) -> tuple[Drawn, FilmView | None]:
        """Read the drawing in the pixels of the passes, and how the composite of both is seen; None for as it is."""
        assert self.shot.settings.passes is not None
        drawn = read_drawn(self.shot, frame)
        if self.shot.settings.passes.camera == "sheet":
            return reframed(self.shot, frame, drawn), None
        return drawn, self.shot.view(frame, drawn.size)

    def rendered_shape(self, paper: tuple[int, ...]) -> tuple[int, ...]:
        """Return the (H, W) that passes are to have, or a whole number of times that, for drawings of ``paper``."""
        passes, size = self.shot.settings.passes, self.shot.settings.output.size
        assert passes is not None
        return paper if passes.camera == "drawn" or size is None else size[::-1]

    def read_rendered(self, frame: int) -> tuple[NDArray[Any], NDArray[np.float32], Space]:
        """Read the rendered passes: beauty, depth in metres, and the space of the beauty's colours."""
        shot, settings = self.shot, self.shot.settings.passes
        assert settings is not None
        assert shot.beauty is not None
        assert shot.depth is not None
        paths = shot.beauty.path(frame), shot.depth.path(frame)
        is_exr = paths[0].suffix.lower() == ".exr"
        if is_exr and paths[0] == paths[1]:
            both = read_passes(paths[0], layer=settings.layer)
            beauty, depth = both.beauty, both.depth
        else:
            depth = read_passes(paths[1], layer=settings.layer, want=("depth",)).depth
            beauty = (
                read_passes(paths[0], layer=settings.layer, want=("beauty",)).beauty if is_exr else read_image(paths[0])
            )
        assert beauty is not None
        assert depth is not None
        if settings.metres != 1.0:
            depth = depth * np.float32(settings.metres)
        by_file: Space = "linear" if is_exr else "display"
        return beauty, depth, by_file if settings.space == "auto" else settings.space


def check_passes(frame: int, path: Path, drawn: tuple[int, ...], beauty: NDArray[Any], depth: NDArray[Any]) -> None:
    """Refuse passes that are not the same whole number of times larger than the drawing's (H, W), naming ``frame``."""
    (height, width), got = drawn, beauty.shape[:2]
    factor = got[0] // height
    if got != depth.shape or factor < 1 or got != (height * factor, width * factor):
        raise ValueError(
            f"frame {frame}: {path}: beauty {got[1]} x {got[0]} and depth {depth.shape[1]} x {depth.shape[0]} pixels: "
            f"both must be the same whole number of times the drawing's {width} x {height}"
        )


def _write_matte(path: Path, matte: NDArray[np.float32], view: FilmView | None) -> None:
    if view is not None:
        matte = reframe_coverage(matte, view)
    write_image(path, np.rint(matte * 255).astype(np.uint8)[..., None])


def write_final(path: Path, picture: NDArray[Any]) -> None:
    """Write a finished ``picture`` as the suffix of ``path`` says; JPEG is put over white."""
    if path.suffix.lower() in (".jpg", ".jpeg"):
        write_image(path, over_paper(picture))
    elif path.suffix.lower() == ".exr":
        write_exr(path, {name: picture[..., i] for i, name in enumerate("RGBA")})
    else:
        write_image(path, picture)
