"""Opens an exported shot in Blender (3.4 and later): camera, markers, limbs, ground, frames, passes.

In Blender:     blender --python open_in_blender.py
Or to render:   blender --background shot.blend --python open_in_blender.py -- --render

It reads shot.json beside itself. Run it again after a new export: what it made before is replaced, all else stays.
Options after --: --render, --frames 1-48, --save shot.blend, --passes folder/name.####.exr, --samples 16.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from typing import Any

Row = list[float]
# Blender's own modules, which are there in Blender alone.
bpy: Any = None
bpy_extras: Any = None
mathutils: Any = None
#: The view layer with limbs and ground alone, by which `pegbar import-passes` checks camera, unit and kind of depth.
CHECK = "check"
SENSOR = 36.0
GROUND = 10.0
AROUND, RINGS = 24, 6
TRACKS = ("start", "end", "start_radius", "end_radius")


def main() -> None:
    """Build the scene, and save or render it where that is asked for."""
    for name in ("bpy", "bpy_extras.object_utils", "mathutils"):
        globals()[name.partition(".")[0]] = __import__(name)
    arguments = _arguments()
    folder = os.path.dirname(os.path.abspath(__file__))
    with open(os.path.join(folder, "shot.json"), encoding="utf-8") as file:
        shot = json.load(file)
    _build(shot, folder)
    _passes(shot, os.path.abspath(arguments.passes or os.path.join(folder, "passes", "passes.####.exr")))
    apart = _check(shot)
    first, last = shot["frames"][0], shot["frames"][-1]
    print(f"pegbar: {shot['name']}: frames {first}-{last}, markers {apart:.4f} px off at most")
    if arguments.samples:
        bpy.context.scene.cycles.samples = arguments.samples
    if arguments.save:
        bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath(arguments.save))
    if arguments.render:
        if arguments.frames:
            begin, _, end = arguments.frames.partition("-")
            bpy.context.scene.frame_start, bpy.context.scene.frame_end = int(begin), int(end or begin)
        bpy.ops.render.render(animation=True)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--render", action="store_true", help="render the passes")
    parser.add_argument("--frames", help="like 1-48")
    parser.add_argument("--save", help="the .blend file to write")
    parser.add_argument("--passes", help="where passes go, like passes/passes.####.exr")
    parser.add_argument("--samples", type=int, help="samples a pixel")
    own = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    # As a Python library there is no Blender that takes arguments of its own.
    return parser.parse_args(sys.argv[1:] if os.path.basename(sys.argv[0]) == os.path.basename(__file__) else own)


def _build(shot: dict[str, Any], folder: str) -> None:
    scene, taste = bpy.context.scene, bpy.context.preferences.edit
    if not bpy.data.filepath and {thing.name for thing in bpy.data.objects} == {"Camera", "Cube", "Light"}:
        # Blender's own first scene: its cube and camera are nobody's work.
        bpy.data.batch_remove([bpy.data.objects["Cube"], bpy.data.objects["Camera"]])
    scene.unit_settings.system, scene.unit_settings.scale_length = "METRIC", 1.0
    scene.frame_start, scene.frame_end = shot["frames"][0], shot["frames"][-1]
    rate = shot["frame_rate"]
    scene.render.fps = math.ceil(rate - 1e-9)
    scene.render.fps_base = scene.render.fps / rate
    usual, taste.keyframe_new_interpolation_type = taste.keyframe_new_interpolation_type, "LINEAR"
    try:
        root = _collection("pegbar", scene.collection)
        camera = _camera(shot, root)
        scene.camera = camera
        _drawings(shot, folder, camera)
        _ground(shot, root)
        limbs = _collection("pegbar limbs", root)
        markers = _collection("pegbar markers", root)
        for character in shot["characters"]:
            for name, places in character["markers"].items():
                _marker(f"{character['name']}.{name}", places, shot["frames"], markers)
            for name, limb in character["limbs"].items():
                _limb(f"{character['name']}.limb.{name}", limb, shot["frames"], limbs)
    finally:
        taste.keyframe_new_interpolation_type = usual
    scene.frame_set(scene.frame_start)


def _collection(name: str, parent: Any) -> Any:
    """An empty collection of this name below ``parent``: what stood in it before is gone."""
    found = bpy.data.collections.get(name)
    if found is None:
        found = bpy.data.collections.new(name)
        parent.children.link(found)
    old = [[thing, thing.data] if thing.data else [thing] for thing in found.objects]
    bpy.data.batch_remove([part for parts in old for part in parts])
    return found


def _add(name: str, data: Any, collection: Any) -> Any:
    thing = bpy.data.objects.new(name, data)
    collection.objects.link(thing)
    return thing


def _key(thing: Any, frame: int, *paths: str) -> None:
    for path in paths:
        thing.keyframe_insert(path, frame=frame)


def _upright(place: Row) -> tuple[float, float, float]:
    """Blender's z points up."""
    x, y, z = place
    return x, -z, y


def _camera(shot: dict[str, Any], collection: Any) -> Any:
    scene, track = bpy.context.scene, shot["camera"]
    width, height = shot["image_size"]
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
    (wide, tall), data = track["focal_length"][0], bpy.data.cameras.new("pegbar camera")
    # A pixel is as many times taller than wide as the lens is longer across than upright.
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = max(1.0, tall / wide), max(1.0, wide / tall)
    data.sensor_fit, data.sensor_width, data.clip_start, data.clip_end = "HORIZONTAL", SENSOR, 0.01, 10000.0
    camera = _add("pegbar camera", data, collection)
    camera.rotation_mode = "QUATERNION"
    turn, before = mathutils.Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1))), None
    for row, frame in enumerate(shot["frames"]):
        (wide, tall), (across, down) = track["focal_length"][row], track["principal_point"][row]
        data.lens = SENSOR * wide / width
        data.shift_x = (width / 2 - 0.5 - across) / width
        data.shift_y = (down + 0.5 - height / 2) * wide / tall / width
        _key(data, frame, "lens", "shift_x", "shift_y")
        pose = turn @ mathutils.Matrix(track["to_world"][row])
        camera.location, camera.rotation_quaternion = pose.translation, pose.to_quaternion()
        if before is not None and camera.rotation_quaternion.dot(before) < 0:
            camera.rotation_quaternion.negate()
        before = camera.rotation_quaternion.copy()
        _key(camera, frame, "location", "rotation_quaternion")
    return camera


def _drawings(shot: dict[str, Any], folder: str, camera: Any) -> None:
    """The drawings behind the camera's view, each for the frames that show it."""
    shown = [(frame, picture) for frame, picture in zip(shot["frames"], shot["pictures"], strict=True) if picture]
    if not shown:
        return
    path = os.path.normpath(os.path.join(folder, shown[0][1]))
    try:
        image = bpy.data.images.load(path, check_existing=True)
    except RuntimeError:
        return
    data = camera.data
    data.show_background_images = True
    behind = data.background_images.new()
    behind.image, behind.alpha, behind.display_depth = image, 0.5, "FRONT"
    numbers = dict(zip(shot["frames"], shot["drawings"], strict=True))
    if len({picture for _, picture in shown}) < 2:
        return
    image.source, user, first = "SEQUENCE", behind.image_user, shot["frames"][0]
    user.frame_start, user.frame_duration = first, shot["frames"][-1] - first + 1
    for frame, _ in shown:
        # Blender takes the file whose number is the sequence's frame, from 1 on, plus this offset.
        user.frame_offset = numbers[frame] - (frame - first + 1)
        data.keyframe_insert("background_images[0].image_user.frame_offset", frame=frame)


def _ground(shot: dict[str, Any], collection: Any) -> None:
    if shot["ground"] is None:
        return
    mesh = bpy.data.meshes.new("ground")
    corners = [(x * GROUND, y * GROUND, shot["ground"]) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    ground = _add("ground", mesh, collection)
    # It is seen only where something casts a shadow on it.
    ground.is_shadow_catcher = True


def _marker(name: str, places: list[Row | None], frames: list[int], collection: Any) -> None:
    if all(place is None for place in places):
        return
    marker = _add(name, None, collection)
    marker.empty_display_type, marker.empty_display_size = "SPHERE", 0.03
    for frame, place in zip(frames, places, strict=True):
        if place is not None:
            marker.location = _upright(place)
            _key(marker, frame, "location")
        marker.hide_viewport = place is None
        if None in places:
            _key(marker, frame, "hide_viewport")


def _limb(name: str, limb: dict[str, Any], frames: list[int], collection: Any) -> None:
    """A mesh of two half spheres that hang on an empty each, whose scales are the radii."""
    known = [None not in values for values in zip(*(limb[key] for key in TRACKS), strict=True)]
    if not any(known):
        return
    vertices, faces, ends = _capsule()
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.polygons.foreach_set("use_smooth", [True] * len(faces))
    body = _add(name, mesh, collection)
    hooks = [_add(f"{name}.{key}", None, collection) for key in ("start", "end")]
    for side, hook in enumerate(hooks):
        hook.empty_display_size, hook.rotation_mode = 1.0, "QUATERNION"
        modifier = body.modifiers.new(hook.name, "HOOK")
        group = body.vertex_groups.new(name=hook.name)
        group.add([i for i, end in enumerate(ends) if end == bool(side)], 1.0, "REPLACE")
        modifier.vertex_group, modifier.object, modifier.falloff_type = group.name, hook, "NONE"
    body.modifiers.new("Collision", "COLLISION")
    turn, along = mathutils.Quaternion(), mathutils.Vector((0.0, 1.0, 0.0))
    for row, frame in enumerate(frames):
        if known[row]:
            places = [mathutils.Vector(_upright(limb[key][row])) for key in ("start", "end")]
            axis = places[1] - places[0]
            if axis.length > 1e-9:
                turn, along = along.rotation_difference(axis) @ turn, axis.normalized()
            for hook, place, key in zip(hooks, places, ("start_radius", "end_radius"), strict=True):
                hook.location, hook.rotation_quaternion, hook.scale = place, turn, [limb[key][row]] * 3
                _key(hook, frame, "location", "rotation_quaternion", "scale")
        body.hide_render = body.hide_viewport = not known[row]
        if not all(known):
            _key(body, frame, "hide_render", "hide_viewport")


def _capsule() -> tuple[list[tuple[float, float, float]], list[tuple[int, ...]], list[bool]]:
    """Two half spheres of radius 1 at the origin, about y: vertices, faces, and which vertices are the end's."""
    tilts = [math.pi / 2 * (ring / RINGS - 1) for ring in range(1, RINGS + 1)]
    rings = [*tilts, *(-tilt for tilt in reversed(tilts))]
    turns = [2 * math.pi * step / AROUND for step in range(AROUND)]
    vertices = [(0.0, -1.0, 0.0)]
    vertices += [(math.cos(a) * math.cos(t), math.sin(t), math.sin(a) * math.cos(t)) for t in rings for a in turns]
    vertices.append((0.0, 1.0, 0.0))
    last = len(vertices) - 1
    faces: list[tuple[int, ...]] = []
    for step in range(AROUND):
        after = (step + 1) % AROUND
        faces.append((0, 1 + step, 1 + after))
        faces.append((last, last - AROUND + after, last - AROUND + step))
        for ring in range(2 * RINGS - 1):
            a, b = 1 + ring * AROUND + step, 1 + ring * AROUND + after
            faces.append((a, a + AROUND, b + AROUND, b))
    return vertices, faces, [index > RINGS * AROUND for index in range(len(vertices))]


def _passes(shot: dict[str, Any], pattern: str) -> None:
    """Multilayer EXR with colour, alpha and depth, and a layer to check them by."""
    scene = bpy.context.scene
    # Without a denoiser, as some distributions build it, Blender refuses to render.
    scene.cycles.use_denoising &= getattr(__import__("_cycles"), "with_openimagedenoise", True)
    scene.render.engine, scene.render.filepath, scene.render.film_transparent = "CYCLES", pattern, True
    scene.render.use_compositing = scene.render.use_sequencer = scene.render.use_file_extension = False
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "32", "ZIP"
    check = scene.view_layers.get(CHECK) or scene.view_layers.new(CHECK)
    check.use_pass_combined, check.use_pass_z, check.samples = False, True, 1
    check.cycles.use_denoising = False
    for layer in scene.view_layers:
        if layer.name == CHECK:
            for child in layer.layer_collection.children:
                child.exclude = child.name != "pegbar"
            continue
        layer.use_pass_combined = layer.use_pass_z = True
        # Limbs cast shadows but are not seen: the drawing is there.
        layer.layer_collection.children["pegbar"].children["pegbar limbs"].indirect_only = True


def _check(shot: dict[str, Any]) -> float:
    """How far Blender sees the markers from where the shot's camera sees them, in pixels, at most."""
    scene, worst = bpy.context.scene, 0.0
    (width, height), frames = shot["image_size"], shot["frames"]
    for row in sorted({0, len(frames) // 2, len(frames) - 1}):
        scene.frame_set(frames[row])
        matrix = mathutils.Matrix([*shot["camera"]["matrix"][row], (0.0, 0.0, 0.0, 1.0)])
        for character in shot["characters"]:
            for places in character["markers"].values():
                if places[row] is None:
                    continue
                x, y, depth, _ = matrix @ mathutils.Vector((*places[row], 1.0))
                seen = bpy_extras.object_utils.world_to_camera_view(
                    scene, scene.camera, mathutils.Vector(_upright(places[row]))
                )
                apart = seen[0] * width - 0.5 - x / depth, (1 - seen[1]) * height - 0.5 - y / depth
                worst = max(worst, math.hypot(*apart))
    scene.frame_set(frames[0])
    return worst


if __name__ == "__main__":
    main()
