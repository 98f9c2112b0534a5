"""Simulates rigid bodies and cloth in Blender.

Called with a folder that holds ``simulate.json`` and ``simulate.npz``; see `pegbar.simulate.blender.engine`. World
metres with Y up, as they come: gravity is a setting, and nothing else in Blender's physics knows what is up.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Quaternion
from parts import (  # type: ignore[import-not-found]  # beside this script
    REACH,
    Progress,
    add_collision,
    add_ground,
    add_pull,
    add_wind,
    box,
    follow,
    new_object,
    new_scene,
)

#: Frames at the start of a run in which a cloth is carried from its rest shape to where it begins.
LEAD = 3
#: How strongly the air holds a cloth that settles, in times its usual: in the first frame and in the last.
SETTLING = (40.0, 4.0)


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
        places = simulate_cloth(job, cloth, arrays, folder, tell)
        np.savez(folder / f"{cloth['name']}.npz", positions=places[:, : cloth["points"]])


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
    """The bodies of one set, at rest."""
    name, made = bodies["name"], []
    rows = zip(*(arrays[f"{name}_{what}"] for what in ("centers", "sizes")), strict=True)
    for index, (center, size) in enumerate(rows):
        built = new_object(scene, f"{name}_{index}", *box(size.tolist()))
        built.location = center.tolist()
        shape = "SPHERE" if bodies["round"] else "BOX"
        volume = float(np.prod(size)) * (np.pi / 6 if bodies["round"] else 1.0)
        body = make_rigid(built, "ACTIVE", shape, friction=bodies["friction"], bounce=bodies["bounce"])
        body.mass = max(1e-3, bodies["density"] * volume)
        body.linear_damping = body.angular_damping = min(1.0, bodies["damping"])
        body.use_deactivation = False
        made.append(built)
    return made


def make_rigid(built: Any, kind: str, shape: str, *, friction: float, bounce: float, kinematic: bool = False) -> Any:
    """Make an object a rigid body."""
    bpy.context.view_layer.objects.active = built
    bpy.ops.rigidbody.object_add(type=kind)
    body = built.rigid_body
    body.collision_shape, body.kinematic = shape, kinematic
    body.friction, body.restitution, body.use_margin, body.collision_margin = friction, bounce, True, 0.001
    return body


def simulate_cloth(
    job: dict[str, Any], cloth: dict[str, Any], arrays: dict[str, Any], folder: Path, tell: Progress
) -> Any:
    """One cloth, settled in the pre-roll and then let go with the speed of its pins; its positions (F, n, 3)."""
    name, early = cloth["name"], job["pre_roll"]
    kinds = ("start", "rest", "stiff", "pins", "places", "launch", "wind")
    given = {what: arrays[f"{name}_{what}"] for what in kinds}
    run = ClothRun(job, cloth, arrays[f"{name}_triangles"], arrays[f"{name}_seams"], folder, tell)
    collider, triangles, begin = arrays["collider"], arrays["collider_triangles"], given["start"]
    if early:
        still = np.repeat(begin[None], early + LEAD, axis=0)
        track = held_track(still, given["rest"], given["pins"], given["places"][:1], np.zeros(3))
        seen = np.concatenate([np.repeat(collider[:1], LEAD, axis=0), collider[:early]])
        begin = run.frames(track, given, (seen, triangles), given["wind"][:early], settles=True)[-1]
    whole = np.repeat(begin[None], job["total"] - early + LEAD - 1, axis=0)
    track = held_track(whole, given["rest"], given["pins"], given["places"], given["launch"])
    seen = np.concatenate([np.repeat(collider[early : early + 1], LEAD - 1, axis=0), collider[early:]])
    return run.frames(track, given, (seen, triangles), given["wind"][early:])[LEAD - 1 :]


def held_track(track: Any, rest: Any, pins: Any, places: Any, launch: Any) -> Any:
    """Where a cloth is held: its rest shape, where it begins with the speed ``launch`` a frame, then its pins' way.

    The last of the first frames is the film's; ``track`` (T, n, 3) is where it begins.
    """
    track = track.copy()
    later = np.clip(np.arange(len(track)) - (LEAD - 1), 0, len(places) - 1)
    track[:, pins] = places[later]
    for index in range(LEAD - 1):
        track[index] += (index - (LEAD - 1)) * launch
    # Turned and moved to lie as near as it can, so that it has not far to go (Kabsch).
    centered, middle = rest - rest.mean(axis=0), track[0].mean(axis=0)
    left, _, right = np.linalg.svd(centered.T @ (track[0] - middle))
    left[:, 2] *= np.sign(np.linalg.det(left @ right))
    track[0] = centered @ left @ right + middle
    return track


class ClothRun:
    """Runs one cloth through frames."""

    def __init__(
        self, job: dict[str, Any], cloth: dict[str, Any], triangles: Any, seams: Any, folder: Path, tell: Progress
    ) -> None:
        self.job, self.cloth, self.triangles, self.seams = job, cloth, triangles, seams
        self.folder, self.tell = folder, tell

    def frames(self, track: Any, given: Any, collider: tuple[Any, Any], wind: Any, *, settles: bool = False) -> Any:
        """Return positions (T, n, 3) of the frames of ``track``; all is held in the first ones, the pins in all.

        Blender takes lengths from the shape in the first frame: its own setting for a rest shape does nothing where
        another modifier comes before the cloth (5.0), or at all (4.5).
        """
        total, cloth, ground = len(track), self.cloth, self.job["ground"]
        scene = new_scene(self.job | {"total": total})
        built = new_object(scene, "cloth", track[0], self.triangles, self.seams)
        follow(built, self.folder / "cloth.pc2", track)
        hold(built, given["pins"].tolist())
        set_cloth(built, cloth, total, settles)
        stiffen(built, given["stiff"].tolist())
        if collider[0].shape[1]:
            volumes = new_object(scene, "volumes", collider[0][0], collider[1])
            follow(volumes, self.folder / "volumes.pc2", collider[0])
            add_collision(volumes, cloth)
        if ground is not None:
            add_collision(add_ground(scene, ground), cloth)
        if len(wind):
            blow = add_pull if cloth["pulls"] else add_wind
            blow(scene, np.concatenate([np.repeat(wind[:1], total - len(wind), axis=0), wind]))
        places = np.empty((total, len(track[0]), 3), np.float32)
        for frame in range(1, total + 1):
            scene.frame_set(frame)
            shown = built.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
            shown.vertices.foreach_get("co", places[frame - 1].reshape(-1))
            if frame >= LEAD + settles:
                self.tell.step()
        return places.astype(np.float64)


def hold(built: Any, pins: list[int]) -> None:
    """Hold the ``pins``, and in the first frames everything."""
    built.vertex_groups.new(name="pins").add(pins, 1.0, "REPLACE")
    every = built.modifiers.new("hold", "VERTEX_WEIGHT_MIX")
    every.vertex_group_a, every.mix_set, every.mix_mode = "pins", "ALL", "SET"
    every.default_weight_b = 1.0
    for frame, share in ((1, 1.0), (LEAD, 1.0), (LEAD + 1, 0.0)):
        every.mask_constant = share
        every.keyframe_insert("mask_constant", frame=frame)


def set_cloth(built: Any, cloth: dict[str, Any], total: int, settles: bool) -> None:
    """Give the cloth its material; the stiffnesses come in Blender's terms."""
    modifier = built.modifiers.new("cloth", "CLOTH")
    settings, meets = modifier.settings, modifier.collision_settings
    for key, value in cloth["settings"].items():
        setattr(settings, key, value)
    if settles:
        usual = settings.air_damping
        for frame in range(1, total + 1):
            share = max(0.0, (frame - LEAD) / max(1, total - LEAD))
            settings.air_damping = usual * SETTLING[0] ** (1 - share) * SETTLING[1] ** share
            settings.keyframe_insert("air_damping", frame=frame)
    settings.vertex_group_mass = "pins"
    settings.use_sewing_springs = cloth["sewn"]
    meets.use_collision, meets.collision_quality = True, cloth["collision_quality"]
    meets.distance_min = meets.self_distance_min = cloth["thickness"]
    meets.friction, meets.use_self_collision = cloth["friction"], cloth["self_collision"]
    modifier.point_cache.frame_start, modifier.point_cache.frame_end = 1, total


def stiffen(built: Any, stiff: list[int]) -> None:
    """Let what is between ``stiff`` vertices keep its shape, and only their triangles meet each other."""
    if not stiff:
        return
    cloth = built.modifiers["cloth"]
    built.vertex_groups.new(name="stiff").add(stiff, 1.0, "REPLACE")
    limp = sorted(set(range(len(built.data.vertices))) - set(stiff))
    built.vertex_groups.new(name="limp").add(limp, 1.0, "REPLACE")
    cloth.settings.vertex_group_structural_stiffness = "stiff"
    cloth.collision_settings.vertex_group_self_collisions = "limp"


if __name__ == "__main__":
    main(Path(sys.argv[1]))
