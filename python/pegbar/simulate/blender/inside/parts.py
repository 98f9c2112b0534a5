"""What the scripts in Blender have in common: scenes, meshes, what is collided with, counting frames."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Vector

#: Half the side of the ground, in metres.
REACH = 100.0


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
    rate = max(1, round(job["frame_rate"]))
    scene.render.fps, scene.render.fps_base = rate, rate / job["frame_rate"]
    scene.frame_start, scene.frame_end = 1, job["total"]
    scene.use_gravity, scene.gravity = True, job["gravity"]
    return scene


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
            # It blows along +Z.
            field.rotation_quaternion = Vector((0.0, 0.0, 1.0)).rotation_difference(Vector(push.tolist()))
        field.field.strength = strength
        field.keyframe_insert("rotation_quaternion", frame=frame)
        field.field.keyframe_insert("strength", frame=frame)


def add_ground(scene: Any, height: float) -> Any:
    """A square of ground."""
    sides = [(-REACH, height, -REACH), (-REACH, height, REACH), (REACH, height, REACH), (REACH, height, -REACH)]
    return new_object(scene, "ground", np.array(sides), np.array([(0, 1, 2), (0, 2, 3)]))


def add_pull(scene: Any, pull: Any) -> None:
    """Gravity that changes by frame (T, 3)."""
    for frame, way in enumerate(pull, 1):
        scene.gravity = way.tolist()
        scene.keyframe_insert("gravity", frame=frame)


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
