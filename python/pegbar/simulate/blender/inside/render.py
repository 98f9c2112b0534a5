"""Renders frames of meshes by Cycles with toon bands, and ink by Freestyle, to multilayer EXR files.

Called with a folder that holds ``render.json`` and a ``.npz`` of meshes a frame; see `pegbar.simulate.blender.render`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

COLOR, NORMAL = "pegbar_color", "pegbar_normal"


def main(folder: Path) -> None:
    """Render every frame of the job, one after the other."""
    job = json.loads((folder / "render.json").read_text(encoding="utf-8"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    set_render(scene, job)
    # Around what is in it no ink is drawn.
    scene.collection.children.link(bpy.data.collections.new("bare"))
    set_passes(scene.view_layers[0], job)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    material = toon_material(job["light"], job["bands"])
    frames = job["frames"]
    for done, frame in enumerate(frames, 1):
        set_camera(camera, frame["camera"], job["near"])
        objects = load_meshes(scene, folder / frame["meshes"], material)
        scene.render.filepath = str(folder / frame["output"])
        bpy.ops.render.render(write_still=True)
        for built in objects:
            mesh = built.data
            bpy.data.objects.remove(built)
            bpy.data.meshes.remove(mesh)
        print(f"pegbar:progress:{done}:{len(frames)}", flush=True)


def set_render(scene: Any, job: dict[str, Any]) -> None:
    """One sample in the middle of every pixel, without noise: what is smooth is so by the picture's size."""
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = job["size"]
    render.resolution_percentage = 100
    render.film_transparent = True
    render.use_compositing = render.use_sequencer = False
    render.use_persistent_data = False
    render.dither_intensity = 0.0
    render.use_file_extension = False
    cycles.device = "CPU"
    cycles.samples = 1
    cycles.use_adaptive_sampling = cycles.use_denoising = cycles.use_auto_tile = False
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 0.01
    cycles.max_bounces = 0
    cycles.transparent_max_bounces = 64
    cycles.seed = 0
    image = render.image_settings
    # Since 5.0 the kind of file is chosen first.
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format = "OPEN_EXR_MULTILAYER"
    image.color_depth = "32"
    image.exr_codec = "ZIP"


def set_passes(layer: Any, job: dict[str, Any]) -> None:
    """Depth and object index beside the colours, and the ink in a pass of its own."""
    layer.use_pass_combined = layer.use_pass_z = layer.use_pass_object_index = True
    layer.pass_alpha_threshold = 0.0
    ink = job["ink"]
    bpy.context.scene.render.use_freestyle = layer.use_freestyle = ink is not None
    if ink is None:
        return
    settings = layer.freestyle_settings
    settings.as_render_pass = True
    settings.use_culling = False
    for old in list(settings.linesets):
        settings.linesets.remove(old)
    lines = settings.linesets.new("ink")
    for kind in ("silhouette", "border", "crease", "contour", "external_contour", "edge_mark", "material_boundary"):
        setattr(lines, f"select_{kind}", kind in ("silhouette", "border"))
    lines.select_ridge_valley = lines.select_suggestive_contour = False
    if ink["crease_angle"] is not None:
        # Blender's angle is the one between the faces' sides: a flat edge has half a turn.
        lines.select_crease = True
        settings.crease_angle = np.pi - ink["crease_angle"]
    lines.select_by_collection, lines.collection_negation = True, "EXCLUSIVE"
    lines.collection = bpy.data.collections["bare"]
    # A new line set has no line style of its own when there is no window.
    style = bpy.data.linestyles.new("ink")
    lines.linestyle = style
    style.color, style.alpha = ink["color"][:3], ink["color"][3]
    style.thickness, style.thickness_position, style.caps = ink["width"], "CENTER", "ROUND"
    bpy.context.scene.render.line_thickness_mode = "ABSOLUTE"


def set_camera(camera: Any, given: dict[str, Any], near: float) -> None:
    """Place the camera: its matrix, focal length and principal point, all in pixels and metres."""
    lens = camera.data
    lens.sensor_fit, lens.sensor_width = "HORIZONTAL", 36.0
    lens.lens = given["focal"] * 36.0
    lens.shift_x, lens.shift_y = given["shift"]
    lens.clip_start, lens.clip_end = near, 1e6
    camera.matrix_world = Matrix(given["matrix"])


def toon_material(light: list[float], bands: list[float]) -> Any:
    """A surface that shines in its own colour times the band that the cosine between its normal and the light is in."""
    material = bpy.data.materials.new("toon")
    material.use_nodes = True
    # Called so since 3.5.
    if hasattr(material.cycles, "emission_sampling"):
        material.cycles.emission_sampling = "NONE"
    else:
        material.cycles.sample_as_light = False
    tree = material.node_tree
    tree.nodes.clear()
    color = add(tree, "ShaderNodeAttribute", attribute_name=COLOR)
    shown = color.outputs["Color"]
    if bands:
        shown = banded(tree, shown, light, bands)
    emission = add(tree, "ShaderNodeEmission")
    tree.links.new(shown, emission.inputs["Color"])
    clear, mix = add(tree, "ShaderNodeBsdfTransparent"), add(tree, "ShaderNodeMixShader")
    output = add(tree, "ShaderNodeOutputMaterial")
    tree.links.new(color.outputs["Alpha"], mix.inputs[0])
    tree.links.new(clear.outputs[0], mix.inputs[1])
    tree.links.new(emission.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return material


def banded(tree: Any, color: Any, light: list[float], bands: list[float]) -> Any:
    """Multiply ``color`` by the band of the side that is seen."""
    normal, geometry = add(tree, "ShaderNodeAttribute", attribute_name=NORMAL), add(tree, "ShaderNodeNewGeometry")
    unit = add(tree, "ShaderNodeVectorMath", operation="NORMALIZE")
    dot = add(tree, "ShaderNodeVectorMath", operation="DOT_PRODUCT")
    dot.inputs[1].default_value = light
    tree.links.new(normal.outputs["Vector"], unit.inputs[0])
    tree.links.new(unit.outputs[0], dot.inputs[0])
    # 0.5 + 0.5 cosine in front, 0.5 - 0.5 cosine behind.
    half = add(tree, "ShaderNodeMath", operation="MULTIPLY_ADD")
    half.inputs[1].default_value, half.inputs[2].default_value = -1.0, 0.5
    side = add(tree, "ShaderNodeMath", operation="MULTIPLY")
    tree.links.new(geometry.outputs["Backfacing"], half.inputs[0])
    tree.links.new(half.outputs[0], side.inputs[0])
    tree.links.new(dot.outputs["Value"], side.inputs[1])
    place = add(tree, "ShaderNodeMath", operation="ADD")
    place.inputs[1].default_value = 0.5
    tree.links.new(side.outputs[0], place.inputs[0])
    ramp = add(tree, "ShaderNodeValToRGB")
    ramp.color_ramp.interpolation = "CONSTANT"
    stops = ramp.color_ramp.elements
    while len(stops) < len(bands):
        stops.new(0.5)
    while len(stops) > max(len(bands), 1):
        stops.remove(stops[-1])
    for index, factor in enumerate(bands):
        stops[index].position = index / len(bands)
        stops[index].color = (factor, factor, factor, 1.0)
    tree.links.new(place.outputs[0], ramp.inputs[0])
    product = add(tree, "ShaderNodeVectorMath", operation="MULTIPLY")
    tree.links.new(color, product.inputs[0])
    tree.links.new(ramp.outputs["Color"], product.inputs[1])
    return product.outputs[0]


def add(tree: Any, kind: str, **settings: Any) -> Any:
    """Add a node."""
    node = tree.nodes.new(kind)
    for name, value in settings.items():
        setattr(node, name, value)
    return node


def load_meshes(scene: Any, path: Path, material: Any) -> list[Any]:
    """Make the frame's objects; their pass index is their id."""
    objects = []
    with np.load(path, allow_pickle=False) as file:
        ids = zip(file["ids"].tolist(), file["bare"].tolist(), strict=True)
        for index, (number, is_bare) in enumerate(ids):
            parts = (file[f"{name}_{index}"] for name in ("vertices", "triangles", "colors", "normals"))
            built = bpy.data.objects.new(f"element_{index}", build_mesh(*parts))
            built.pass_index = number
            built.data.materials.append(material)
            (bpy.data.collections["bare"] if is_bare else scene.collection).objects.link(built)
            objects.append(built)
    return objects


def build_mesh(vertices: Any, triangles: Any, colors: Any, normals: Any) -> Any:
    """A mesh of ``vertices`` (n, 3) and ``triangles`` (T, 3), with colours and normals (3 T, ...) of their corners."""
    mesh = bpy.data.meshes.new("element")
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(vertices, np.float32).ravel())
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", np.ascontiguousarray(triangles, np.int32).ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    # Until 3.5 a polygon's corners were counted; later ones find them from where the next begins.
    if not bpy.types.MeshPolygon.bl_rna.properties["loop_total"].is_readonly:
        mesh.polygons.foreach_set("loop_total", np.full(len(triangles), 3, np.int32))
    mesh.update(calc_edges=True)
    shades = mesh.attributes.new(COLOR, "FLOAT_COLOR", "CORNER")
    shades.data.foreach_set("color", np.ascontiguousarray(colors, np.float32).ravel())
    pointed = mesh.attributes.new(NORMAL, "FLOAT_VECTOR", "CORNER")
    pointed.data.foreach_set("vector", np.ascontiguousarray(normals, np.float32).ravel())
    return mesh


if __name__ == "__main__":
    main(Path(sys.argv[1]))
