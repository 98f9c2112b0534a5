"""The frame stage of simulated elements: rendered from the cache, put among the drawn characters, and written."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.io.exr import write_exr
from pegbar.io.sequence import FrameSequence
from pegbar.io.simulation_cache import DiskCache
from pegbar.layer.reframe import reframe_picture
from pegbar.scene.mesh import Mesh
from pegbar.shot.drawn import drawn_inputs, read_drawn
from pegbar.shot.framed import reframed_channels
from pegbar.shot.layered import layered
from pegbar.shot.model import SecondarySection
from pegbar.shot.plan import Shot
from pegbar.shot.rendered import part_seen, read_rendered
from pegbar.shot.stages import Stage, write_final
from pegbar.shot.view import LIGHT, View, lay_under, part_of, seen_window
from pegbar.simulate.field_meshes import cast_on_fields
from pegbar.simulate.fields import Puddle, SnowField
from pegbar.simulate.layers import render_shadow, shadow_meshes
from pegbar.simulate.meshes import Models, volume_meshes
from pegbar.simulate.passes import Ink, render_passes
from pegbar.simulate.scene import BARE, SimulationScene

VERSION = 1
# Toon shading from the side turned away from the light to the lit one, and lines as wide as in a drawing of 960 pixels.
BANDS = (0.42, 0.75, 1.0)
INK = Ink(1.8, (0.03, 0.012, 0.028, 1.0), None)


def pen_width(size: tuple[int, int]) -> float:
    """How wide lines are in a picture of ``size``, in pixels."""
    return INK.width * size[0] / 960


@dataclass(frozen=True, eq=False)
class Layers:
    """Where a frame's elements come from and go to.

    ``first`` is the film frame of the scene's first, ``drawn`` the files of the characters in 3D; ``others`` are the
    shots of further characters and ``scales`` what brings their depths to those of the shot's own camera. ``rendered``
    are the files that Blender rendered the elements to, None where pegbar renders them.
    """

    scene: SimulationScene
    section: SecondarySection
    cache: DiskCache
    first: int
    finals: FrameSequence
    passes: FrameSequence
    characters: tuple[Path, ...]
    others: tuple[Shot, ...] = ()
    scales: tuple[float, ...] = ()
    rendered: FrameSequence | None = None

    def meshes(self, models: Models, frame: int) -> tuple[list[Mesh], list[Mesh]]:
        """Return the elements' meshes in the film's ``frame``, fields with shadows on them, and what casts shadows.

        Shadows are cast by the elements but particles and what lies on the ground, and by the characters.
        """
        scene, index = self.scene, frame - self.first
        meshes = models.meshes(self.cache, index)
        casting: list[Mesh] = []
        if self.section.shadow and scene.ground is not None:
            flat = {scene.object_id(e.name) for e in scene.elements if isinstance(e, SnowField | Puddle)}
            casting = [mesh for mesh in meshes if mesh.object_id < BARE and mesh.object_id not in flat]
            casting += volume_meshes(scene, index)
        return cast_on_fields(scene, meshes, casting, light=LIGHT), casting


@dataclass(frozen=True, eq=False)
class ElementsStage(Stage):
    """Renders the elements of a frame and composites them with the drawings in depth order (2010, section 3.3)."""

    layers: Layers = field(kw_only=True)

    @cached_property
    def models(self) -> Models:
        """The elements' meshes, made ready once in every worker."""
        return Models(self.layers.scene)

    def outputs(self, frame: int) -> list[Path]:
        layers = self.layers
        exr = [layers.passes.path(frame)] if layers.section.passes else []
        return [layers.finals.path(frame), *exr]

    def inputs(self, frame: int) -> list[Path]:
        layers, name = self.layers, f"{frame - self.layers.first:04d}.npz"
        found = [layers.cache.folder / element.name / name for element in layers.scene.elements]
        for shot in (self.shot, *layers.others):
            found += drawn_inputs(shot, frame)
        rendered = [] if layers.rendered is None else [layers.rendered.path(frame)]
        return [*found, *layers.characters, *rendered]

    def make(self, frame: int) -> tuple[str, ...]:
        view = self.render(frame)
        final, *exr = self.outputs(frame)
        picture, notes = self._composite(frame, view)
        write_final(final, picture)
        film = self.shot.view(frame, view.size)
        if exr and film is None:
            write_exr(exr[0], view.channels(), window=view.window)
        elif exr and film is not None:
            write_exr(exr[0], reframed_channels(view.channels(), film))
        return notes

    def picture(self, frame: int) -> NDArray[np.uint8]:
        """Return the finished ``frame`` (H, W, 3|4) uint8 without writing anything."""
        output = self.shot.settings.output.model_copy(update={"frames": "frame.####.png"})
        planned = replace(
            self, shot=replace(self.shot, settings=self.shot.settings.model_copy(update={"output": output}))
        )
        return np.asarray(planned._composite(frame, planned.render(frame))[0], np.uint8)

    def render(self, frame: int) -> View:
        """Return what is seen of the elements in ``frame`` and of their and the characters' shadows."""
        layers = self.layers
        index, samples, ground = frame - layers.first, layers.section.samples, layers.scene.ground
        camera, (meshes, casting) = layers.scene.cameras[index], layers.meshes(self.models, frame)
        pen = pen_width(camera.image_size)
        window = seen_window(camera, meshes, casting, ground or 0.0, pen)
        part = part_of(camera, window)
        # A shadow of its own is only for the file; without one it is rendered along with the elements.
        apart = layers.section.passes or layers.rendered is not None
        shown = meshes if apart or ground is None else [*meshes, *shadow_meshes(casting, ground, light=LIGHT)]
        if layers.rendered is None:
            ink = Ink(pen, INK.color, INK.crease_angle)
            passes = render_passes(shown, part, samples=samples, light=LIGHT, bands=BANDS, ink=ink)
        else:
            passes = part_seen(read_rendered(layers.rendered.path(frame), samples, camera.image_size, pen), window)
        shadow = None
        if apart and casting and ground is not None:
            shadow = render_shadow(casting, part, ground, samples=samples, light=LIGHT)
            lay_under(passes, shadow)
        return View(camera.image_size, window, passes, shadow)

    def _composite(self, frame: int, view: View) -> tuple[NDArray[Any], tuple[str, ...]]:
        """Put one character after the other into what is rendered, the shot's own first."""
        output = self.shot.settings.output
        drawn = [read_drawn(shot, frame) for shot in (self.shot, *self.layers.others)]
        for one in drawn:
            if one.alpha.shape != view.size[::-1]:
                height, width = one.alpha.shape
                raise ValueError(
                    f"frame {frame}: the drawing has {width} x {height} pixels, "
                    f"the elements {view.size[0]} x {view.size[1]}"
                )
        dtype = np.float32 if output.is_exr else np.uint8
        picture = layered(view, drawn, (1.0, *self.layers.scales), output.composite_space, dtype)
        film = self.shot.view(frame, view.size)
        seen = picture if film is None else reframe_picture(picture, film)
        return seen, tuple(note for one in drawn for note in one.notes)

    def _recipe(self, frame: int) -> str:
        layers, shot = self.layers, self.shot
        section = layers.section
        parts: list[Any] = [VERSION, [entry.model_dump() for entry in section.elements], section.seed, section.samples]
        parts += [section.shadow, layers.scene.ground, layers.first, layers.scales, shot.settings.output.model_dump()]
        parts += [] if layers.rendered is None else ["blender"]
        for drawn in (shot, *layers.others):
            parts += [drawn.settings.drawing.model_dump(), drawn.matte]
            parts += [drawn.palette.colors.tolist(), drawn.palette.labels.tolist()]
        parts += shot.framing(frame)
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
