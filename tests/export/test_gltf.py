import numpy as np
import pygltflib
import pytest
from scipy.spatial.transform import Rotation

from pegbar import Motion
from pegbar.export.gltf import glb
from tests.motions import swaying

SHAPES = {"SCALAR": (), "VEC3": (3,), "VEC4": (4,), "MAT4": (4, 4)}
DTYPES = {5126: np.float32, 5125: np.uint32, 5123: np.uint16, 5121: np.uint8}


class Played:
    """A .glb file evaluated by the rules of glTF 2.0, for one frame."""

    def __init__(self, data, frame):
        self.file = pygltflib.GLTF2.load_from_bytes(data)
        self.blob = self.file.binary_blob()
        self.transforms = [self._at_rest(node) for node in self.file.nodes]
        for channel in self.file.animations[0].channels:
            sampler = self.file.animations[0].samplers[channel.sampler]
            self.transforms[channel.target.node][channel.target.path] = self.array(sampler.output)[frame]
        self.world = [None] * len(self.file.nodes)
        for root in self.file.scenes[0].nodes:
            self._place(root, np.eye(4))

    @staticmethod
    def _at_rest(node):
        return {
            "translation": node.translation or [0, 0, 0],
            "rotation": node.rotation or [0, 0, 0, 1],
            "scale": node.scale or [1, 1, 1],
        }

    def array(self, index):
        accessor = self.file.accessors[index]
        view = self.file.bufferViews[accessor.bufferView]
        values = np.frombuffer(
            self.blob,
            DTYPES[accessor.componentType],
            offset=view.byteOffset,
            count=accessor.count * max(1, int(np.prod(SHAPES[accessor.type]))),
        )
        return values.reshape(accessor.count, *SHAPES[accessor.type])

    def _place(self, index, parent):
        part = self.transforms[index]
        local = np.eye(4)
        local[:3, :3] = Rotation.from_quat(part["rotation"]).as_matrix() * np.asarray(part["scale"])
        local[:3, 3] = part["translation"]
        self.world[index] = parent @ local
        for child in self.file.nodes[index].children or []:
            self._place(child, self.world[index])

    def joint(self, name):
        return self.world[[node.name for node in self.file.nodes].index(name)]

    def vertices(self):
        primitive, skin = self.file.meshes[0].primitives[0], self.file.skins[0]
        inverse = self.array(skin.inverseBindMatrices).transpose(0, 2, 1)
        matrices = np.stack([self.world[node] @ inverse[slot] for slot, node in enumerate(skin.joints)])
        points = self.array(primitive.attributes.POSITION)
        points = np.c_[points, np.ones(len(points))]
        slots = self.array(primitive.attributes.JOINTS_0)[:, 0]
        return np.einsum("nij,nj->ni", matrices[slots], points)[:, :3]


def away_from_bones(points, motion, frame):
    """Each point's distance from the nearest bone."""
    place, least = motion.positions[frame], np.full(len(points), np.inf)
    for child, parent in enumerate(motion.parents):
        a, b = place[parent if parent >= 0 else child], place[child]
        share = np.clip((points - a) @ (b - a) / max((b - a) @ (b - a), 1e-12), 0, 1)[:, None]
        least = np.minimum(least, np.linalg.norm(points - a - share * (b - a), axis=1))
    return least


@pytest.mark.parametrize("stretch", [0.0, 0.3])
@pytest.mark.parametrize("frame", [0, 3, 6])
def test_players_see_the_joints_and_a_figure_about_them(stretch, frame):
    motion = swaying(stretch=stretch)
    played = Played(glb(motion), frame)
    for index, name in enumerate(motion.names):
        np.testing.assert_allclose(played.joint(name)[:3, 3], motion.positions[frame, index], atol=1e-5)
        np.testing.assert_allclose(played.joint(name)[:3, :3], motion.rotations[frame, index], atol=1e-5)
    vertices = played.vertices()
    distances = away_from_bones(vertices, motion, frame)
    assert distances.max() < 0.1
    # Both ends of the shin have a ring of the figure about them.
    for joint in (4, 5):
        near = np.linalg.norm(vertices - motion.positions[frame, joint], axis=1)
        assert near.min() < 0.07


def test_triangles_face_outwards_and_normals_with_them():
    motion = swaying(1)
    played = Played(glb(motion), 0)
    primitive = played.file.meshes[0].primitives[0]
    corners = played.array(primitive.attributes.POSITION)[played.array(primitive.indices).reshape(-1, 3)]
    normals = played.array(primitive.attributes.NORMAL)[played.array(primitive.indices).reshape(-1, 3)]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.linalg.norm(faces, axis=1) > 1e-9).all()
    assert (np.einsum("ti,tci->tc", faces, normals) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1, atol=1e-5)


def test_times_and_interpolation_are_kept():
    motion = swaying(3)
    data = pygltflib.GLTF2.load_from_bytes(glb(motion, times=[0, 0.25, 1], interpolation="step"))
    assert {sampler.interpolation for sampler in data.animations[0].samplers} == {"STEP"}
    clock = data.accessors[data.animations[0].samplers[0].input]
    assert (clock.min, clock.max, clock.count) == ([0], [1], 3)
    plain = pygltflib.GLTF2.load_from_bytes(glb(motion))
    assert plain.accessors[plain.animations[0].samplers[0].input].max == pytest.approx([2 / 24])


def test_quaternions_do_not_jump():
    turn = np.linspace(0, 4 * np.pi, 40)
    rotations = Rotation.from_rotvec(np.outer(turn, [0, 1, 0])).as_matrix()[:, None]
    motion = Motion(("root",), (-1,), np.zeros((40, 1, 3)), rotations, 24.0)
    data = glb(motion)
    played = Played(data, 0)
    channel = next(c for c in played.file.animations[0].channels if c.target.path == "rotation")
    quaternions = played.array(played.file.animations[0].samplers[channel.sampler].output)
    assert (np.einsum("fq,fq->f", quaternions[1:], quaternions[:-1]) > 0.9).all()


@pytest.mark.parametrize("times", [[0, 0, 1], [-1, 0, 1], [0, 1], [0, np.nan, 1]])
def test_wrong_times_are_named(times):
    with pytest.raises(ValueError, match="times"):
        glb(swaying(3), times=times)


def test_points_have_no_skeleton_to_export():
    points = Motion(("a", "b"), (-1, -1), np.zeros((2, 2, 3)), np.tile(np.eye(3), (2, 2, 1, 1)), 24.0)
    with pytest.raises(ValueError, match="skeleton"):
        glb(points)
