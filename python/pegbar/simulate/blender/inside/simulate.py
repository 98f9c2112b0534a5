"""Simulates rigid bodies and cloth in Blender.

Called with a folder that holds ``simulate.json`` and ``simulate.npz``; see `pegbar.simulate.blender.engine`. World
metres with Y up, as they come: gravity is a setting, and nothing else in Blender's physics knows what is up.
"""

from __future__ import annotations

import json
import struct
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Quaternion

#: Half the side of the ground, in metres.
REACH = 100.0
#: Frames before the pre-roll in which a cloth is carried from its rest shape to where it begins.
LEAD = 3


def main(folder: Path) -> None:
    """Simulate the bodies together, then one cloth after the other, and write the frames of each to a file."""
    job = json.loads((folder / "simulate.json").read_text(encoding="utf-8"))
    with np.load(folder / "simulate.npz", allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    tell = Progress(job["total"] * (len(job["cloths"]) + bool(job["bodies"])))
    if job["bodies"]:
        for name, state in simulate_bodies(job, arrays, tell).items():
            np.savez(folder / f"{name}.npz", **state)
    for cloth in job["cloths"]:
        np.savez(folder / f"{cloth['name']}.npz", positions=simulate_cloth(job, cloth, arrays, folder, tell))


class Progress:
    """Counts frames."""

    def __init__(self, total: int) -> None:
        self.done, self.total = 0, total

    def step(self) -> None:
        """One more frame is done."""
        self.done += 1
        print(f"pegbar:progress:{self.done}:{self.total}", flush=True)


def new_scene(job: dict[str, Any]) -> Any:
    """An empty scene with the job's time and gravity; Blender's frame 1 is the pre-roll's first."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.edit.keyframe_new_interpolation_type = "LINEAR"
    scene = bpy.context.scene
    # Whole frames a second with a divisor, which may be a fraction.
    rate = max(1, round(job["frame_rate"]))
    scene.render.fps, scene.render.fps_base = rate, rate / job["frame_rate"]
    scene.frame_start, scene.frame_end = 1, job["total"]
    scene.use_gravity, scene.gravity = True, job["gravity"]
    return scene


def simulate_bodies(job: dict[str, Any], arrays: dict[str, Any], tell: Progress) -> dict[str, dict[str, Any]]:
    """Balls and boxes in Bullet, against limbs as moving, growing hulls; positions and rotations by set."""
    scene = new_scene(job)
    bpy.ops.rigidbody.world_add()
    world = scene.rigidbody_world
    world.substeps_per_frame, world.solver_iterations = job["rigid_substeps"], 20
    world.point_cache.frame_start, world.point_cache.frame_end = 1, job["total"]
    for index in range(arrays["limb_places"].shape[1]):
        add_limb(scene, index, arrays)
    if job["ground"] is not None:
        ground = new_object(scene, "ground", *box((2 * REACH, 1.0, 2 * REACH)))
        ground.location = (0.0, job["ground"] - 0.5, 0.0)
        make_rigid(ground, "PASSIVE", "BOX", friction=0.6, bounce=0.8)
    sets = {bodies["name"]: add_bodies(scene, bodies, arrays) for bodies in job["bodies"]}
    found: dict[str, dict[str, list[Any]]] = {name: {"positions": [], "rotations": []} for name in sets}
    for frame in range(1, job["total"] + 1):
        scene.frame_set(frame)
        graph = bpy.context.evaluated_depsgraph_get()
        for name, objects in sets.items():
            places = [built.evaluated_get(graph).matrix_world.decompose() for built in objects]
            found[name]["positions"].append([tuple(place[0]) for place in places])
            turns = [place[1] for place in places]
            found[name]["rotations"].append([(turn.x, turn.y, turn.z, turn.w) for turn in turns])
        tell.step()
    return {
        name: {what: np.array(rows, np.float64)[job["pre_roll"] :] for what, rows in state.items()}
        for name, state in found.items()
    }


def add_limb(scene: Any, index: int, arrays: dict[str, Any]) -> None:
    """A hull that moves, turns and grows with its limb."""
    built = new_object(scene, f"limb_{index}", arrays["limb_hulls"][index], arrays["hull_triangles"])
    built.rotation_mode = "QUATERNION"
    rows = zip(*(arrays[f"limb_{what}"][:, index] for what in ("places", "turns", "scales")), strict=True)
    for frame, (place, turn, scale) in enumerate(rows, 1):
        x, y, z, w = turn.tolist()
        built.location, built.rotation_quaternion, built.scale = (
            place.tolist(),
            Quaternion((w, x, y, z)),
            scale.tolist(),
        )
        for path in ("location", "rotation_quaternion", "scale"):
            built.keyframe_insert(path, frame=frame)
    make_rigid(built, "PASSIVE", "CONVEX_HULL", friction=0.6, bounce=0.5, kinematic=True)


def add_bodies(scene: Any, bodies: dict[str, Any], arrays: dict[str, Any]) -> list[Any]:
    """The bodies of one set; one with a speed is carried along for a frame and let go."""
    name, made = bodies["name"], []
    rows = zip(*(arrays[f"{name}_{what}"] for what in ("centers", "velocities", "sizes")), strict=True)
    for index, (center, velocity, size) in enumerate(rows):
        built = new_object(scene, f"{name}_{index}", *box(size.tolist()))
        built.location = center.tolist()
        shape = "SPHERE" if bodies["round"] else "BOX"
        volume = float(np.prod(size)) * (np.pi / 6 if bodies["round"] else 1.0)
        body = make_rigid(built, "ACTIVE", shape, friction=bodies["friction"], bounce=bodies["bounce"])
        body.mass = max(1e-3, bodies["density"] * volume)
        body.linear_damping = body.angular_damping = min(1.0, bodies["damping"])
        body.use_deactivation = False
        if np.any(velocity):
            step = velocity / (scene.render.fps / scene.render.fps_base)
            for frame, offset in ((1, 0.0), (2, 1.0)):
                built.location = (center + offset * step).tolist()
                built.keyframe_insert("location", frame=frame)
            for frame, held in ((1, True), (2, True), (3, False)):
                body.kinematic = held
                body.keyframe_insert("kinematic", frame=frame)
        made.append(built)
    return made


def make_rigid(built: Any, kind: str, shape: str, *, friction: float, bounce: float, kinematic: bool = False) -> Any:
    """Make an object a rigid body."""
    bpy.context.view_layer.objects.active = built
    bpy.ops.rigidbody.object_add(type=kind)
    body = built.rigid_body
    body.collision_shape, body.kinematic = shape, kinematic
    body.friction, body.restitution = friction, bounce
    body.use_margin, body.collision_margin = True, 0.001
    return body


def simulate_cloth(
    job: dict[str, Any], cloth: dict[str, Any], arrays: dict[str, Any], folder: Path, tell: Progress
) -> Any:
    """One cloth against the moving collider and the ground; its positions (F, n, 3).

    Blender takes lengths from the shape in the first frame, so that is the rest shape, all of it held.
    """
    name, total = cloth["name"], job["total"] + LEAD
    scene = new_scene(job | {"total": total})
    built = new_object(scene, "cloth", arrays[f"{name}_rest"], arrays[f"{name}_triangles"], arrays[f"{name}_seams"])
    follow(built, folder / f"{name}.pc2", arrays[f"{name}_track"])
    hold(built, arrays[f"{name}_pins"].tolist())
    set_cloth(built, cloth, total)
    track = arrays[f"{name}_collider"]
    if track.shape[1]:
        collider = new_object(scene, "volumes", track[0], arrays["collider_triangles"])
        follow(collider, folder / f"{name}_collider.pc2", track)
        add_collision(collider, cloth)
    if job["ground"] is not None:
        corners = np.array([(-REACH, 0, -REACH), (-REACH, 0, REACH), (REACH, 0, REACH), (REACH, 0, -REACH)], float)
        corners[:, 1] = job["ground"]
        add_collision(new_object(scene, "ground", corners, np.array([(0, 1, 2), (0, 2, 3)])), cloth)
    if len(arrays[f"{name}_wind"]):
        add_wind(scene, arrays[f"{name}_wind"])
    places = np.empty((total, len(built.data.vertices), 3), np.float32)
    for frame in range(1, total + 1):
        scene.frame_set(frame)
        shown = built.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        shown.vertices.foreach_get("co", places[frame - 1].reshape(-1))
        if frame > LEAD:
            tell.step()
    return places[LEAD + job["pre_roll"] :].astype(np.float64)


def hold(built: Any, pins: list[int]) -> None:
    """Hold the ``pins``, and in the first frames everything."""
    built.vertex_groups.new(name="pins").add(pins, 1.0, "REPLACE")
    every = built.modifiers.new("hold", "VERTEX_WEIGHT_MIX")
    every.vertex_group_a, every.mix_set, every.mix_mode = "pins", "ALL", "SET"
    every.default_weight_b = 1.0
    for frame, share in ((1, 1.0), (LEAD, 1.0), (LEAD + 1, 0.0)):
        every.mask_constant = share
        every.keyframe_insert("mask_constant", frame=frame)


def set_cloth(built: Any, cloth: dict[str, Any], total: int) -> None:
    """Give the cloth its material; the stiffnesses come in Blender's terms."""
    modifier = built.modifiers.new("cloth", "CLOTH")
    settings, meets = modifier.settings, modifier.collision_settings
    for key, value in cloth["settings"].items():
        setattr(settings, key, value)
    settings.vertex_group_mass = "pins"
    settings.use_sewing_springs = cloth["sewn"]
    settings.effector_weights.gravity = 1.0
    meets.use_collision = True
    meets.collision_quality = cloth["collision_quality"]
    meets.distance_min = cloth["thickness"]
    meets.friction = cloth["friction"]
    meets.use_self_collision = cloth["self_collision"]
    meets.self_distance_min = cloth["thickness"]
    modifier.point_cache.frame_start, modifier.point_cache.frame_end = 1, total


def add_collision(built: Any, cloth: dict[str, Any]) -> None:
    """Let cloth collide with an object."""
    built.modifiers.new("collision", "COLLISION")
    built.collision.thickness_outer = 0.001
    built.collision.cloth_friction = 100 * min(0.8, cloth["friction"])
    built.collision.damping = 0.0


def add_wind(scene: Any, wind: Any) -> None:
    """Air that blows alike everywhere: its push (T, 3) a frame, in Blender's strength."""
    field = bpy.data.objects.new("wind", None)
    scene.collection.objects.link(field)
    bpy.context.view_layer.objects.active = field
    bpy.ops.object.forcefield_toggle()
    field.field.type = "WIND"
    field.field.flow = field.field.noise = 0.0
    field.rotation_mode = "QUATERNION"
    for frame, push in enumerate(wind, 1):
        strength = float(np.linalg.norm(push))
        if strength > 0:
            field.rotation_quaternion = direction(push / strength)
        field.field.strength = strength
        field.keyframe_insert("rotation_quaternion", frame=frame)
        field.field.keyframe_insert("strength", frame=frame)


def direction(unit: Any) -> Quaternion:
    """The rotation that takes +Z, along which wind blows, to ``unit``."""
    from mathutils import Vector

    return Vector((0.0, 0.0, 1.0)).rotation_difference(Vector(unit.tolist()))


def follow(built: Any, path: Path, track: Any) -> None:
    """Let a mesh's vertices follow ``track`` (T, n, 3), written as a point cache (PC2)."""
    header = struct.pack("<12siiffi", b"POINTCACHE2\0", 1, track.shape[1], 0.0, 1.0, len(track))
    path.write_bytes(header + np.ascontiguousarray(track, "<f4").tobytes())
    modifier = built.modifiers.new("follow", "MESH_CACHE")
    modifier.cache_format, modifier.filepath, modifier.frame_start = "PC2", str(path), 1.0


def new_object(scene: Any, name: str, vertices: Any, triangles: Any, edges: Any = ()) -> Any:
    """An object of triangles and, for seams, loose edges."""
    mesh = bpy.data.meshes.new(name)
    pairs = [tuple(pair) for pair in np.asarray(edges).reshape(-1, 2).tolist()]
    mesh.from_pydata(np.asarray(vertices).tolist(), pairs, np.asarray(triangles).tolist())
    mesh.update(calc_edges=True, calc_edges_loose=True)
    built = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(built)
    return built


def box(size: Any) -> tuple[Any, Any]:
    """Vertices and sides of a box about the origin."""
    corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners * np.asarray(size), np.array(sides)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
