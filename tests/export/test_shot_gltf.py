"""A shot as glTF, evaluated by the rules of the format."""

import dataclasses

import numpy as np
import pygltflib
import pytest

from pegbar.export.shot_gltf import gltf_notes, shot_glb
from tests.export.shots import GONE, shot
from tests.export.test_gltf import Played


def named(played, name):
    return played.world[[node.name for node in played.file.nodes].index(name)]


@pytest.mark.parametrize("row", [0, 5])
def test_the_camera_sees_markers_where_the_shot_does(row):
    scene = shot()
    played = Played(shot_glb(scene), row)
    lens = played.file.cameras[0].perspective
    to_camera = np.linalg.inv(named(played, "camera"))
    for index, name in enumerate(scene.characters[0].marker_names):
        x, y, z, _ = to_camera @ named(played, f"Anna & Bo.{name}")[:, 3]
        tall = -z * np.tan(lens.yfov / 2)
        pixel = (x / tall / lens.aspectRatio + 1) * 480 - 0.5, (1 - y / tall) * 270 - 0.5
        np.testing.assert_allclose(
            pixel, scene.cameras[row].project(scene.characters[0].markers[row, index]), atol=1e-3
        )


@pytest.mark.parametrize("row", [0, 5])
def test_limbs_are_the_volumes(row):
    scene = shot()
    played = Played(shot_glb(scene), row)
    volumes = scene.characters[0].volumes
    for limb, name in enumerate(scene.characters[0].limb_names):
        node = next(node for node in played.file.nodes if node.name == f"Anna & Bo.limb.{name}")
        primitive, skin = played.file.meshes[node.mesh].primitives[0], played.file.skins[node.skin]
        points = np.insert(played.array(primitive.attributes.POSITION), 3, 1, axis=1)
        slots = played.array(primitive.attributes.JOINTS_0)[:, 0]
        worlds = np.stack([played.world[joint] for joint in skin.joints])
        placed = np.einsum("nij,nj->ni", worlds[slots], points)[:, :3]
        for side, places, radii in ((0, volumes.start, volumes.start_radius), (1, volumes.end, volumes.end_radius)):
            away = np.linalg.norm(placed[slots == side] - places[row, limb], axis=1)
            np.testing.assert_allclose(away, radii[row, limb], atol=1e-6)


def test_a_limb_that_is_gone_has_no_size():
    played = Played(shot_glb(shot()), 0)
    names, animation = [node.name for node in played.file.nodes], played.file.animations[0]
    node = names.index("1.limb.torso.start")
    scale = next(c for c in animation.channels if c.target.node == node and c.target.path == "scale")
    sizes = played.array(animation.samplers[scale.sampler].output)[:, 0]
    assert tuple(row for row, size in enumerate(sizes) if size < 1e-5) == GONE


def test_what_gltf_cannot_hold_is_said():
    assert gltf_notes(shot()) == []
    assert "off by up to 40.0 px" in gltf_notes(shot(shift=(-40, 2)))[0]
    assert "no zoom" in gltf_notes(shot(zoom=0.01))[0]


def test_a_still_of_one_frame_has_no_animation():
    scene = shot()
    tracks = {name: getattr(scene, name)[:1] for name in ("frames", "drawings", "cameras", "pictures")}
    still = dataclasses.replace(scene.characters[0], markers=scene.characters[0].markers[:1], volumes=first(scene))
    data = shot_glb(dataclasses.replace(scene, **tracks, characters=(still,)))
    assert pygltflib.GLTF2.load_from_bytes(data).animations == []


def first(scene):
    volumes = scene.characters[0].volumes
    return type(volumes)(*(getattr(volumes, field.name)[:1] for field in dataclasses.fields(volumes)))
