"""Simulates particles in Blender.

Called with a folder that holds ``simulate.json`` and ``simulate.npz``; see `pegbar.simulate.blender.particles`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from parts import (  # type: ignore[import-not-found]  # beside this script
    Progress,
    add_ground,
    add_pull,
    follow,
    new_object,
    new_scene,
)


def main(folder: Path) -> None:
    """Simulate every element by itself, and write the frames of each to a file."""
    job = json.loads((folder / "simulate.json").read_text(encoding="utf-8"))
    with np.load(folder / "simulate.npz", allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    tell = Progress(sum(entry["total"] for entry in job["particles"]))
    for entry in job["particles"]:
        np.savez(folder / f"{entry['name']}.npz", **simulate(job, entry, arrays, folder, tell))


def simulate(
    job: dict[str, Any], entry: dict[str, Any], arrays: dict[str, Any], folder: Path, tell: Progress
) -> dict[str, Any]:
    """Positions and velocities (F, N, 3), who is ``alive`` and who just ``born`` (F, N), places ``before`` (N, 3).

    Those in the air at first come before those that enter.
    """
    name, total, early = entry["name"], entry["total"], entry["pre_roll"]
    scene = new_scene(job | {"total": total})
    add_pull(scene, arrays[f"{name}_pull"])
    if entry["flutter"] > 0:
        add_turbulence(scene, entry)
    collider = arrays["collider"]
    if collider.shape[1]:
        track = np.concatenate([np.repeat(collider[:1], early, axis=0), collider])
        volumes = new_object(scene, "volumes", track[0], arrays["collider_triangles"])
        follow(volumes, folder / "volumes.pc2", track)
        add_touch(volumes)
    if job["ground"] is not None:
        add_touch(add_ground(scene, job["ground"]))
    emitters = [add_emitter(scene, kind, entry, arrays[f"{name}_{kind}"]) for kind in ("filling", "entering")]
    found: dict[str, list[Any]] = {"positions": [], "velocities": [], "alive": [], "seen": []}
    for frame in range(1, total + 1):
        scene.frame_set(frame)
        graph = bpy.context.evaluated_depsgraph_get()
        states = [read(built, graph) for built in emitters if built is not None]
        tell.step()
        if frame >= early:
            for what, rows in found.items():
                rows.append(np.concatenate([state[what] for state in states]))
    made = {what: np.array(rows) for what, rows in found.items()}
    # The frame before the film's first is there for how far all has come since.
    if early == 0:
        made = {what: np.concatenate([rows[:1], rows]) for what, rows in made.items()}
    born = ~made["seen"][:-1]
    before = made["positions"][0]
    del made["seen"]
    return {what: rows[1:] for what, rows in made.items()} | {"before": before, "born": born}


def add_emitter(scene: Any, kind: str, entry: dict[str, Any], places: Any) -> Any:
    """Particles that begin at ``places`` (n, 3), all in the first frame or one after the other in all."""
    if not len(places):
        return None
    built = new_object(scene, kind, places, np.empty((0, 3), int))
    built.modifiers.new("particles", "PARTICLE_SYSTEM")
    system = built.particle_systems[0]
    settings, total = system.settings, entry["total"]
    settings.count, settings.lifetime = len(places), total + 1
    settings.frame_start, settings.frame_end = 1, 1 if kind == "filling" else total
    settings.emit_from, settings.use_emit_random = "VERT", False
    settings.normal_factor, settings.object_align_factor = 0.0, entry["stream"]
    settings.physics_type, settings.integrator = "NEWTON", "MIDPOINT"
    # Its drag is the squared speed over the mass.
    settings.drag_factor, settings.mass, settings.particle_size = 1.0, entry["mass"], 1.0
    settings.use_size_deflect, settings.use_die_on_collision = False, not entry["sticks"]
    settings.timestep, settings.subframes = 1 / entry["frame_rate"], entry["substeps"] - 1
    system.point_cache.frame_start, system.point_cache.frame_end = 1, total
    return built


def read(built: Any, graph: Any) -> dict[str, Any]:
    """The state of an emitter's particles."""
    particles = built.evaluated_get(graph).particle_systems[0].particles
    places, speeds = np.empty((len(particles), 3), np.float32), np.empty((len(particles), 3), np.float32)
    particles.foreach_get("location", places.reshape(-1))
    particles.foreach_get("velocity", speeds.reshape(-1))
    states = [particle.alive_state for particle in particles]
    alive = np.array([state == "ALIVE" for state in states])
    seen = np.array([state != "UNBORN" for state in states])
    return {"positions": places, "velocities": speeds, "alive": alive, "seen": seen}


def add_turbulence(scene: Any, entry: dict[str, Any]) -> None:
    """Air that differs from place to place."""
    built = bpy.data.objects.new("turbulence", None)
    scene.collection.objects.link(built)
    bpy.context.view_layer.objects.active = built
    bpy.ops.object.forcefield_toggle()
    field = built.field
    field.type, field.strength, field.size = "TURBULENCE", entry["flutter"], entry["flutter_size"]
    field.flow, field.noise, field.seed = 0.0, 0.0, entry["seed"]


def add_touch(built: Any) -> None:
    """Let particles end or lie on an object."""
    built.modifiers.new("collision", "COLLISION")
    settings = built.collision
    settings.damping_factor, settings.friction_factor, settings.stickiness = 1.0, 1.0, 10.0
    settings.thickness_outer = 0.001


if __name__ == "__main__":
    main(Path(sys.argv[1]))
