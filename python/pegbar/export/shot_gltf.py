"""An aligned shot as binary glTF: a camera, a node a marker, and limb meshes with a joint at each end."""

from __future__ import annotations

import math

import numpy as np
import pygltflib as gltf
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pegbar.export.gltf_writer import GltfWriter
from pegbar.export.limbs import Capsule, capsule_shape, capsules, nearest_known
from pegbar.export.rig import steady
from pegbar.export.shot_scene import ShotScene, camera_poses, lenses
from pegbar.simulate.scene import Character

Floats = NDArray[np.float64]
# glTF hides nothing over time: what is not known in a frame shrinks to this scale.
_HIDDEN = 1e-6
# A film offset below this share of the film's width is no offset.
_CENTRED = 1e-5


def shot_glb(scene: ShotScene) -> bytes:
    """Return ``scene`` as a .glb file; metres, Y up, the first film frame at 0 seconds.

    Nodes are ``camera`` and one a character, with ``NAME.MARKER`` and ``NAME.limb.LIMB`` below it. A limb's mesh
    hangs on two joints that carry its half spheres: their scales are the radii. ValueError for a camera with skew.
    """
    writer = GltfWriter("LINEAR", scene.name)
    seconds = np.arange(len(scene.frames)) / scene.frame_rate
    clock = writer.array(seconds.astype(np.float32), bounds=True)
    document = writer.document
    material = gltf.PbrMetallicRoughness(baseColorFactor=[0.6, 0.6, 0.6, 1.0], metallicFactor=0.0, roughnessFactor=0.8)
    document.materials.append(gltf.Material(name="limb", pbrMetallicRoughness=material))
    roots = [_camera(writer, scene, clock)]
    for character in scene.characters:
        children = _markers(writer, character, clock)
        for limb in capsules(character):
            children += _limb(writer, f"{character.name}.limb.{limb.name}", limb, clock)
        document.nodes.append(gltf.Node(name=character.name, children=children))
        roots.append(len(document.nodes) - 1)
    document.scenes.append(gltf.Scene(name=scene.name, nodes=roots))
    document.scene = 0
    return writer.finish()


def gltf_notes(scene: ShotScene) -> list[str]:
    """Return what of ``scene`` a glTF file cannot hold."""
    found = lenses(scene)
    notes = []
    shift = max(max(abs(lens.right), abs(lens.up)) / lens.width for lens in found)
    if shift > _CENTRED:
        notes.append(f"glTF knows no film offset: its camera is off by up to {shift * scene.image_size[0]:.1f} px")
    focal = [lens.focal_length / lens.width for lens in found]
    if max(focal) - min(focal) > _CENTRED * max(focal):
        notes.append("glTF knows no zoom: its camera keeps the first frame's focal length")
    return notes


def _camera(writer: GltfWriter, scene: ShotScene, clock: int) -> int:
    first = lenses(scene)[0]
    perspective = gltf.Perspective(
        aspectRatio=first.width / first.height,
        yfov=2 * math.atan(first.height / 2 / first.focal_length),
        znear=0.01,
        zfar=10_000.0,
    )
    document = writer.document
    document.cameras.append(gltf.Camera(name="camera", type="perspective", perspective=perspective))
    poses = camera_poses(scene.cameras)
    turns = steady(Rotation.from_matrix(poses[:, :3, :3]).as_quat()[:, None])[:, 0]
    width, height = scene.image_size
    extras = {"image_size": [width, height], "frame_rate": scene.frame_rate, "first_frame": scene.frames[0]}
    node = gltf.Node(name="camera", camera=0, extras=extras)
    return _moving(writer, node, clock, poses[:, :3, 3], turns)


def _markers(writer: GltfWriter, character: Character, clock: int) -> list[int]:
    nodes = []
    for marker, name in enumerate(character.marker_names):
        known = np.asarray(np.isfinite(character.markers[:, marker]).all(axis=1))
        if known.any():
            held = character.markers[nearest_known(known), marker]
            nodes.append(_moving(writer, gltf.Node(name=f"{character.name}.{name}"), clock, held))
    return nodes


def _limb(writer: GltfWriter, name: str, limb: Capsule, clock: int) -> list[int]:
    """A mesh of unit half spheres whose joints bring them to the limb's ends."""
    document, (directions, at_end, triangles) = writer.document, capsule_shape()
    joints = []
    for side, places in enumerate((limb.start, limb.end)):
        sizes = np.where(limb.known, limb.radii[:, side], _HIDDEN)
        node = gltf.Node(name=f"{name}.{('start', 'end')[side]}")
        joints.append(_moving(writer, node, clock, places, limb.turns, np.repeat(sizes[:, None], 3, axis=1)))
    slots = np.zeros((len(directions), 4), np.uint16)
    slots[:, 0] = at_end
    attributes = gltf.Attributes(
        POSITION=writer.array(directions.astype(np.float32), bounds=True),
        NORMAL=writer.array(directions.astype(np.float32)),
        JOINTS_0=writer.array(slots),
        WEIGHTS_0=writer.array(np.tile(np.array([1, 0, 0, 0], np.float32), (len(slots), 1))),
    )
    indices = writer.array(triangles.astype(np.uint32).reshape(-1))
    primitive = gltf.Primitive(attributes=attributes, indices=indices, material=0)
    document.meshes.append(gltf.Mesh(name=name, primitives=[primitive]))
    bind = writer.array(np.tile(np.eye(4, dtype=np.float32), (2, 1, 1)))
    document.skins.append(gltf.Skin(joints=joints, inverseBindMatrices=bind))
    document.nodes.append(gltf.Node(name=name, mesh=len(document.meshes) - 1, skin=len(document.skins) - 1))
    return [*joints, len(document.nodes) - 1]


def _moving(
    writer: GltfWriter,
    node: gltf.Node,
    clock: int,
    places: Floats,
    turns: Floats | None = None,
    scales: Floats | None = None,
) -> int:
    """Add ``node`` and let it move; what does not change is stored once."""
    nodes = writer.document.nodes
    nodes.append(node)
    for path, values in (("translation", places), ("rotation", turns), ("scale", scales)):
        if values is None:
            continue
        setattr(node, path, values[0].tolist())
        if not (values == values[:1]).all():
            writer.animate(len(nodes) - 1, path, clock, values)
    return len(nodes) - 1
