"""Secondary motion from drawings to finished frames: every stage that is out of date, in order, with its time."""

from __future__ import annotations

import dataclasses
import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from pegbar.io import atomic
from pegbar.io.animation import write_animation
from pegbar.io.frames import read_picture, write_image
from pegbar.io.simulation_cache import DiskCache
from pegbar.report.contact_sheet import contact_sheet, over_paper
from pegbar.scene.alignment import Alignment
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.driving import Driving
from pegbar.shot.blender_stage import BlenderStage
from pegbar.shot.dots_stage import DotsStage
from pegbar.shot.find import plan_output
from pegbar.shot.measured import measured
from pegbar.shot.passes_stage import ElementsStage, Layers
from pegbar.shot.remarks import Remarks
from pegbar.shot.secondary import Secondary
from pegbar.shot.simulation_stage import SimulationStage
from pegbar.simulate.blender.engine import BlenderEngine
from pegbar.simulate.cloth import ClothEngine
from pegbar.simulate.engine import Engine, assign
from pegbar.simulate.particles import ParticleEngine
from pegbar.simulate.rapier import RapierEngine
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.strands import StrandEngine

Progress = Callable[[str, int, int], None]
_SHEET = 12
# Balls first, so that cloth, strands and particles can meet them.
ENGINES = (RapierEngine(), ClothEngine(), StrandEngine(), ParticleEngine())


@dataclass(eq=False)
class SecondaryStage:
    """Runs the stages of the shot file ``path``; ``engine`` and ``renderer`` go before the file's own.

    ``times`` are seconds a stage, ``remarks`` what was assumed and what looks wrong.
    """

    path: Path
    overwrite: bool = False
    progress: Progress | None = None
    times: dict[str, float] = field(default_factory=dict)
    remarks: Remarks = field(default_factory=Remarks)
    made: dict[str, bool] = field(default_factory=dict)
    engine: Literal["pegbar", "blender"] | None = field(default=None, kw_only=True)
    renderer: Literal["pegbar", "blender"] | None = field(default=None, kw_only=True)

    @cached_property
    def secondary(self) -> Secondary:
        """What the shot's section means."""
        return Secondary(self.path, self.overwrite, engine=self.engine, renderer=self.renderer)

    def drive(self) -> list[Driving]:
        """Read dots, align, and find boxes and volumes of every character, where that is out of date."""
        self.secondary.check()
        dots = DotsStage(self.path, self.overwrite)
        if dots.is_wanted:
            with self._timed("dots"):
                remarks, self.made["dots"] = dots.run()
                self.remarks.add(remarks, made=self.made["dots"])
        alignments: list[tuple[Alignment | None, bool]] = []
        with self._timed("align"):
            alignments += [stage.align(self._told("align")) for stage in self.secondary.stages]
        with self._timed("volumes"):
            found = [stage.run(self._told("volumes")) for stage in self.secondary.stages]
        self.made |= {"align": any(made for _, made in alignments), "volumes": any(made for _, made in found)}
        for alignment, made in alignments:
            if alignment is not None:
                self.remarks.add(alignment.notes, alignment.warnings, made=made)
        for stage, (driving, made) in zip(self.secondary.stages, found, strict=True):
            self.remarks.add(warnings=[*stage.remarks(), *driving.notes], made=made)
        return [driving for driving, _ in found]

    @property
    def engines(self) -> tuple[Engine, ...]:
        """What simulates."""
        if self.secondary.section.engine == "pegbar":
            return ENGINES
        return (BlenderEngine(self.secondary.blender), *ENGINES)

    def simulate(self, drivings: list[Driving]) -> SimulationScene:
        """Simulate what is out of date; return the scene. SimulationError where it explodes."""
        with self._timed("simulation"):
            scene = self.secondary.scene(drivings)
            self.made["simulation"] = SimulationStage(self.secondary, scene, self.engines).run(self.progress)
            self.remarks.add(self.own_work(scene), made=self.made["simulation"])
        return scene

    def own_work(self, scene: SimulationScene) -> list[str]:
        """Return a note of the elements that Blender, asked to simulate, leaves to our own engines."""
        if self.secondary.section.engine == "pegbar":
            return []
        shares = [share for engine, share in assign(scene, self.engines) if not isinstance(engine, BlenderEngine)]
        left = ", ".join(element.name for share in shares for element in share)
        return [f"Blender cannot simulate {left}: pegbar's own engines do"] if left else []

    def frames(self, drivings: list[Driving], scene: SimulationScene) -> ElementsStage:
        """Return the stage that renders and composites, frame by frame."""
        secondary, section = self.secondary, self.secondary.section
        shot, *others = secondary.drawn_shots(drivings)
        output = shot.settings.output.model_copy(update={"frames": section.frames})
        planned = dataclasses.replace(shot, settings=shot.settings.model_copy(update={"output": output}))
        lenses = [PerspectiveCamera(driving.matrices[0], driving.image_size).focal_length for driving in drivings]
        rendered = plan_output(secondary.folder, "depth", "blender/elements.####.exr")
        layers = Layers(
            scene=scene,
            section=section,
            cache=DiskCache(secondary.folder / "cache"),
            first=secondary.frames[0],
            finals=plan_output(shot.folder, "frames", section.frames),
            passes=plan_output(secondary.folder, "depth", "passes/passes.####.exr"),
            characters=tuple(secondary.inputs()),
            others=tuple(others),
            scales=tuple(lenses[0] / lens for lens in lenses[1:]),
            rendered=rendered if section.renderer == "blender" else None,
        )
        return ElementsStage(planned, self.overwrite, layers=layers)

    def render(self, stage: ElementsStage, frames: Sequence[int]) -> None:
        """Have Blender render the elements of ``frames`` where that is asked for and out of date.

        Raises BlenderError where it fails; what it had finished is kept.
        """
        if stage.layers.rendered is not None:
            with self._timed("Blender"):
                work = BlenderStage(stage.layers, self.secondary.blender, self.overwrite)
                self.made["Blender"] = work.run(frames, self._told("Blender")) > 0

    def finish(self, scene: SimulationScene, drivings: list[Driving], finals: list[Path]) -> dict[str, Any]:
        """Write animation, contact sheet and report; return the report."""
        folder = self.secondary.folder
        with self._timed("animation"):
            rate = self.secondary.stages[0].bare.settings.shot.frame_rate
            if finals[0].suffix.lower() != ".exr":
                write_animation(folder / "animation.png", (over_paper(read_picture(path)) for path in finals), rate)
                chosen = [finals[i * len(finals) // min(_SHEET, len(finals))] for i in range(min(_SHEET, len(finals)))]
                sheet = contact_sheet([over_paper(read_picture(path)) for path in chosen], columns=3, width=640)
                write_image(folder / "sheet.png", sheet)
        report = self._report(scene, drivings)
        atomic.write_bytes(folder / "report.json", json.dumps(report, indent=1).encode())
        return report

    def _report(self, scene: SimulationScene, drivings: list[Driving]) -> dict[str, Any]:
        apart = [_reprojection(driving) for driving in drivings]
        return {
            "frames": scene.frames,
            "characters": [character.name for character in scene.characters],
            "elements": [element.name for element in scene.elements],
            "engine": self.secondary.section.engine,
            "renderer": self.secondary.section.renderer,
            "ground_m": scene.ground,
            "reprojection_px": max(apart),
            "overlap_before_m": float(max(driving.overlaps[:, 0].max(initial=0) for driving in drivings)),
            "overlap_after_m": float(max(driving.overlaps[:, 1].max(initial=0) for driving in drivings)),
            "repaired_boxes": int(sum(driving.repaired.sum() for driving in drivings)),
            **measured(scene, DiskCache(self.secondary.folder / "cache"), self.secondary.frames[0]),
            "seconds": {name: round(value, 3) for name, value in self.times.items()},
            "made": self.made,
            "notes": self.remarks.notes,
            "warnings": self.remarks.warnings,
        }

    @contextmanager
    def _timed(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            yield
        finally:
            self.times[name] = self.times.get(name, 0.0) + time.perf_counter() - start

    def _told(self, name: str) -> Callable[[int, int], None] | None:
        tell = self.progress
        return None if tell is None else lambda done, total: tell(name, done, total)


def _reprojection(driving: Driving) -> float:
    """How far in pixels the 3D markers are seen from the drawn marks, at most."""
    cameras = [PerspectiveCamera(matrix, driving.image_size) for matrix in driving.matrices]
    seen = np.stack([camera.project(points) for camera, points in zip(cameras, driving.positions, strict=True)])
    return float(np.nanmax(np.linalg.norm(seen - driving.markers, axis=2)))
