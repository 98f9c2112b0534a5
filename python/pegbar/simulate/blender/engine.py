"""The engine that simulates in Blender: bodies by Bullet, cloth and strands by its cloth, props carried along."""

from __future__ import annotations

import json
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.errors import BlenderError
from pegbar.simulate.blender.bobs import are_alike
from pegbar.simulate.blender.clearing import clear_of_volumes
from pegbar.simulate.blender.cloth import cloth_entry, colliders
from pegbar.simulate.blender.locate import Blender
from pegbar.simulate.blender.particles import Tell, simulate_particles
from pegbar.simulate.blender.process import INSIDE, run_blender
from pegbar.simulate.blender.strands import strands_entry
from pegbar.simulate.cache import Cache
from pegbar.simulate.elements import Balls, Boxes, Cloth, Element, Prop, Strands
from pegbar.simulate.engine import Progress, refuse_explosion
from pegbar.simulate.hulls import hull_triangles, hull_vertices, poses
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.tracks import Volumes, pin_track
from pegbar.simulate.weather import Particles

Floats = NDArray[np.float64]
Arrays = dict[str, NDArray[Any]]
#: The thinnest hull, in metres: volumes begin at nothing in the pre-roll.
THINNEST = 1e-3


@dataclass(frozen=True)
class BlenderEngine:
    """Simulates cloth, strands, bodies and particles in ``blender``, with ``rigid_substeps`` and ``cloth_substeps``.

    Bodies come first, then one cloth after the other: it meets the limbs, props, bodies and the ground, and with
    ``self_collision`` itself. Blender cannot go on from a frame: a run that is taken up begins anew and writes what
    is missing. Wind blows alike everywhere, with gusts as they pass the middle of the cloth.
    """

    blender: Blender
    rigid_substeps: int = 20
    cloth_substeps: int = 16
    self_collision: bool = False
    name: str = "blender"

    def supports(self, element: Element) -> bool:
        """Whether ``element`` is cloth, a prop, strands, falling particles, or bodies at rest.

        Blender knows no speed that a body begins with, and a cloth's vertices have one mass: bobs of one element have
        to be alike.
        """
        if isinstance(element, Balls | Boxes):
            return not element.velocities.any()
        if isinstance(element, Particles):
            return element.count > 0
        return isinstance(element, Cloth | Prop) or (isinstance(element, Strands) and are_alike(element))

    def run(
        self, scene: SimulationScene, elements: Sequence[Element], cache: Cache, start: int, progress: Progress | None
    ) -> None:
        """Write frames ``start`` and later to ``cache``; BlenderError where Blender fails."""
        for prop in (element for element in elements if isinstance(element, Prop)):
            for frame, places in enumerate(pin_track(scene, prop.pin, prop.vertices)):
                cache.write(prop.name, frame, {"positions": places})
        bodies = [element for element in elements if isinstance(element, Balls | Boxes)]
        cloths = [element for element in elements if isinstance(element, Cloth | Strands)]
        particles = [element for element in elements if isinstance(element, Particles)]
        steps = bool(bodies) + bool(cloths) + bool(particles)
        if bodies:
            self._simulate(scene, bodies, [], cache, start, progress, (0, steps))
        if cloths:
            self._simulate(scene, [], cloths, cache, start, progress, (int(bool(bodies)), steps))
        if particles:
            tell = self._teller(scene, progress, (steps - 1, steps))
            simulate_particles(scene, particles, cache, start, self.blender, tell)

    def _simulate(
        self,
        scene: SimulationScene,
        bodies: Sequence[Balls | Boxes],
        cloths: Sequence[Cloth | Strands],
        cache: Cache,
        start: int,
        progress: Progress | None,
        part: tuple[int, int],
    ) -> None:
        """Have Blender simulate one kind, and put its frames into the cache."""

        tell = self._teller(scene, progress, part)
        with tempfile.TemporaryDirectory(prefix="pegbar-blender-") as place:
            folder = Path(place)
            # Elements' names are kept out of file names.
            names = {element.name: f"element_{i}" for i, element in enumerate((*bodies, *cloths))}
            job, arrays = self._job(scene, bodies, cloths, cache, names)
            (folder / "simulate.json").write_text(json.dumps(job), encoding="utf-8")
            with (folder / "simulate.npz").open("wb") as file:
                np.savez(file, **arrays)  # type: ignore[arg-type]
            outputs = [folder / f"{name}.npz" for name in names.values()]
            run_blender(self.blender, INSIDE / "simulate.py", [place], outputs=outputs, progress=tell)
            for element, path in zip((*bodies, *cloths), outputs, strict=True):
                result = read_result(path, scene, element)
                if isinstance(element, Strands) and element.bobs is None:
                    result["positions"] = clear_of_volumes(scene, element, result["positions"])
                store(scene, element, result, cache, start)

    def _teller(self, scene: SimulationScene, progress: Progress | None, part: tuple[int, int]) -> Tell:
        """Return what is told of a part's steps, and tells of all frames."""

        def tell(done: int, total: int) -> None:
            if progress is not None:
                progress(self.name, round(scene.frames * (part[0] + done / max(total, 1)) / part[1]), scene.frames)

        return tell

    def _job(
        self,
        scene: SimulationScene,
        bodies: Sequence[Balls | Boxes],
        cloths: Sequence[Cloth | Strands],
        cache: Cache,
        names: dict[str, str],
    ) -> tuple[dict[str, Any], Arrays]:
        """What Blender is told: settings, and the arrays that they are about."""
        job: dict[str, Any] = {
            "frame_rate": scene.frame_rate,
            "pre_roll": scene.pre_roll.frames,
            "total": scene.pre_roll.frames + scene.frames,
            "gravity": scene.gravity,
            "ground": scene.ground,
            "rigid_substeps": max(1, round(self.rigid_substeps * 24 / scene.frame_rate)),
            "bodies": [],
            "cloths": [],
        }
        arrays: Arrays = {}
        if bodies:
            arrays |= limb_arrays(scene)
        for element in bodies:
            entry, more = body_entry(element, names[element.name])
            job["bodies"].append(entry)
            arrays |= more
        if cloths:
            arrays["collider"], arrays["collider_triangles"] = colliders(scene, cache)
        # A power of two: Blender adds up steps until a frame is full, and with any other number one more may fit.
        substeps = 2 ** max(0, round(np.log2(self.cloth_substeps * 24 / scene.frame_rate)))
        for cloth in cloths:
            if isinstance(cloth, Strands):
                entry, more = strands_entry(scene, cloth, names[cloth.name], substeps)
            else:
                entry, more = cloth_entry(scene, cloth, names[cloth.name], substeps, self.self_collision)
            job["cloths"].append(entry)
            arrays |= more
        return job, arrays


def limb_arrays(scene: SimulationScene) -> Arrays:
    """Limbs and props as hulls of their largest size, and where they are, how turned and scaled in every frame."""
    times = np.arange(-scene.pre_roll.frames, scene.frames, dtype=float)
    props = [element for element in scene.elements if isinstance(element, Prop)]
    rows = Volumes(scene, props).at(times)
    lengths = np.linalg.norm(rows[..., 4:7] - rows[..., :3], axis=2)
    radii = np.maximum(rows[..., [3, 7]], THINNEST)
    usual, thick = np.maximum(lengths.max(axis=0, initial=0), THINNEST), radii.max(axis=0, initial=THINNEST)
    placed = [poses(frame) for frame in rows]
    wide = radii.mean(axis=2) / thick.mean(axis=1)
    # The hull is as long as axis and round ends together.
    long = (lengths + radii.sum(axis=2)) / (usual + thick.sum(axis=1))
    count = rows.shape[1]
    return {
        "limb_hulls": hull_vertices(usual, thick[:, 0], thick[:, 1]),
        "hull_triangles": hull_triangles(),
        "limb_places": np.array([places for places, _ in placed]).reshape(len(times), count, 3),
        "limb_turns": np.array([turns for _, turns in placed]).reshape(len(times), count, 4),
        "limb_scales": np.stack([wide, long, wide], axis=2),
    }


def body_entry(element: Balls | Boxes, name: str) -> tuple[dict[str, Any], Arrays]:
    """A set of bodies as Blender is told of it."""
    material = element.material
    is_round = isinstance(element, Balls)
    sizes = np.repeat(2 * element.radii[:, None], 3, axis=1) if isinstance(element, Balls) else element.sizes
    entry = {
        "name": name,
        "round": is_round,
        "density": material.density,
        "friction": material.friction,
        "bounce": material.bounce,
        "damping": material.damping,
    }
    arrays = {"centers": element.centers, "sizes": sizes}
    return entry, {f"{name}_{what}": array for what, array in arrays.items()}


def read_result(path: Path, scene: SimulationScene, element: Balls | Boxes | Cloth | Strands) -> Arrays:
    """Read what Blender made of ``element``; BlenderError where it is not what was asked for."""
    shapes = {"positions": (scene.frames, _count(element), 3)}
    if isinstance(element, Balls | Boxes):
        shapes["rotations"] = (scene.frames, _count(element), 4)
    try:
        with np.load(path, allow_pickle=False) as file:
            found = {name: np.asarray(file[name], np.float64) for name in shapes}
    except (ValueError, KeyError, EOFError, OSError, zipfile.BadZipFile) as error:
        raise BlenderError(f"{element.name}: what Blender wrote cannot be read: {error}") from None
    for name, shape in shapes.items():
        if found[name].shape != shape:
            raise BlenderError(f"{element.name}: Blender wrote {name} of shape {found[name].shape}, want {shape}")
    return found


def store(scene: SimulationScene, element: Element, result: Arrays, cache: Cache, start: int) -> None:
    """Write the frames from ``start`` on, with velocities between frames; SimulationError where it exploded."""
    positions = result["positions"]
    with np.errstate(invalid="ignore", over="ignore"):
        velocities = np.gradient(positions, axis=0) * scene.frame_rate if scene.frames > 1 else np.zeros_like(positions)
    for frame in range(scene.frames):
        refuse_explosion(element.name, frame, positions[frame], velocities[frame])
        if frame >= start:
            state = {name: array[frame] for name, array in result.items()}
            cache.write(element.name, frame, state | {"velocities": velocities[frame]})


def _count(element: Balls | Boxes | Cloth | Strands) -> int:
    if isinstance(element, Strands):
        return len(element.points)
    return len(element.vertices) if isinstance(element, Cloth) else len(element.centers)
