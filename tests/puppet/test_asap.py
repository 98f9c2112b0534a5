import numpy as np
import pytest

from pegbar import DegenerateError
from pegbar.puppet.asap import AsapShapes, bone_frames
from pegbar.puppet.bone_weights import bone_weights
from pegbar.puppet.drawn_pose import focal_lengths
from pegbar.puppet.inflation import inflation_heights
from pegbar.puppet.performance import Direction, deformed_meshes
from tests.oracles import asap as oracle
from tests.puppets import HALF, PIXEL, arm_puppet, turned_poses


def width_at(mesh, column):
    """How far apart the arm's two outlines are at one column of its mesh."""
    rows = mesh.reshape(5, 21, 2)
    return np.linalg.norm(rows[-1, column] - rows[0, column])


def test_the_pose_as_drawn_gives_the_mesh_as_drawn():
    puppet = arm_puppet()
    flat = AsapShapes.of_puppet(puppet, puppet.pose, inflation=0).shapes(puppet.pose[None])[0]
    assert np.allclose(flat, puppet.vertices)
    # A point before the plane is seen on another ray, unless it is put there along the ray; the outline stays.
    round_ = AsapShapes.of_puppet(puppet, puppet.pose).shapes(puppet.pose[None])[0]
    assert np.allclose(round_[puppet.boundary], puppet.vertices[puppet.boundary])
    assert np.abs(round_ - puppet.vertices).max() < 4


@pytest.mark.parametrize("inflation", [0.0, 1.0])
def test_every_vertex_is_where_the_paper_puts_it(inflation):
    puppet = arm_puppet(distance=2.0)
    pose = puppet.pose + np.array([[0, 0, 0], [0, 0, 0.2], [0, 0, -0.1]])
    poses = turned_poses(puppet, [35.0, -50.0], elbow=0.8) + np.array([0.1, 0.2, -0.3])
    found = AsapShapes.of_puppet(puppet, pose, inflation=inflation).shapes(poses)
    weights, heights = bone_weights(puppet), inflation * inflation_heights(puppet)
    scale = puppet.camera.depth(pose[puppet.bones[:, 0]]) / focal_lengths(puppet.camera).mean()
    for vertex in range(0, len(puppet.vertices), 7):
        for frame, then in enumerate(poses):
            points = np.zeros(3)
            for bone, (parent, child) in enumerate(puppet.bones):
                height = heights[vertex] * scale[bone]
                local = oracle.unproject(
                    puppet.vertices[vertex], height, pose[parent], pose[child], puppet.camera.matrix
                )
                points += weights[vertex, bone] * oracle.place(local, then[parent], then[child], puppet.camera.position)
            want = oracle.project(points, puppet.camera.matrix)
            assert np.allclose(found[frame, vertex], want, atol=1e-6)


def test_an_arm_towards_the_camera_keeps_its_width():
    puppet = arm_puppet(distance=4.0)
    poses = turned_poses(puppet, [50.0, 70.0, 80.0])
    asap, arap = (deformed_meshes(puppet, puppet.pose, poses, Direction(shapes=shapes)) for shapes in ("asap", "arap"))
    for column in (4, 6, 10, 14, 16):
        points = poses[:, 0] + (poses[:, 2] - poses[:, 0]) * column / 20
        wanted = 2 * HALF * 4.0 / puppet.camera.depth(points)
        widths = [np.ptp(made.reshape(3, 5, 21, 2)[:, :, column, 1], axis=1) / wanted for made in (asap, arap)]
        assert (widths[0] > 0.9).all()
        assert (widths[0] < 1.1).all()
        assert column < 14 or (widths[1] < 0.9).all()


def test_a_figure_that_comes_nearer_grows_all_over():
    puppet = arm_puppet(distance=4.0)
    nearer = (puppet.pose + np.array([0, 0, 2.0]))[None]
    asap, arap = (
        deformed_meshes(puppet, puppet.pose, nearer, Direction(shapes=shapes))[0] for shapes in ("asap", "arap")
    )
    assert width_at(asap, 6) > 0.95 * 2 * (2 * HALF)
    assert width_at(arap, 6) < 0.8 * 2 * (2 * HALF)


def test_a_bone_that_points_into_the_camera_is_finite_and_continuous():
    puppet = arm_puppet(distance=3.0)
    # The arm's own plane goes through the camera where it lies along a ray; that is near 90 degrees.
    degrees = np.linspace(60, 120, 601)
    meshes = deformed_meshes(puppet, puppet.pose, turned_poses(puppet, degrees), Direction())
    assert np.isfinite(meshes).all()
    sizes = np.ptp(meshes, axis=1)
    assert np.abs(np.diff(sizes, axis=0)).max() < 2.0
    exact = turned_poses(puppet, [90.0])
    exact[0, 1:] = exact[0, 0] + np.array([[0.1], [0.2]]) * (puppet.camera.position - exact[0, 0])
    shape = AsapShapes.of_puppet(puppet, puppet.pose).shapes(exact)
    assert np.isfinite(shape).all()
    assert np.isfinite(deformed_meshes(puppet, puppet.pose, exact, Direction())).all()


def test_a_bone_drawn_into_the_camera_keeps_its_mesh_near():
    puppet = arm_puppet(distance=3.0)
    pose = puppet.pose.copy()
    pose[2] = pose[1] + (puppet.camera.position - pose[1]) * 0.15
    points = AsapShapes.of_puppet(puppet, pose).points(pose[None])
    assert np.linalg.norm(points - pose[1], axis=2).max() < 3


def test_frames_turn_to_the_camera_and_have_unit_sides():
    generator = np.random.default_rng(4)
    poses = generator.normal(size=(50, 3, 3))
    eye = np.array([0.3, 0.2, 5.0])
    origins, frames = bone_frames(poses, np.array([[0, 1], [1, 2]]), eye)
    for frame, pose in zip(frames.reshape(-1, 3, 3), poses[:, [[0, 1], [1, 2]]].reshape(-1, 2, 3), strict=True):
        assert np.allclose(frame, oracle.frame(pose[0], pose[1], eye))
    toward = (frames[..., 2] * (eye - origins)).sum(axis=2)
    assert (toward > 0).all()


def test_inflation_is_a_round_limb():
    puppet = arm_puppet()
    heights = inflation_heights(puppet).reshape(5, 21)
    assert (heights[[0, -1]] == 0).all()
    assert np.allclose(heights[2, 5:16], HALF)
    assert np.allclose(heights[1, 5:16], np.sqrt(HALF**2 - (HALF / 2) ** 2))
    metres = AsapShapes.of_puppet(puppet, puppet.pose).points(puppet.pose[None])[0].reshape(5, 21, 3)
    assert np.allclose(metres[2, 10, 2], HALF * PIXEL)


def test_weights_are_the_own_bone_s_far_from_joints():
    weights = bone_weights(arm_puppet())
    assert np.allclose(weights.sum(axis=1), 1)
    rows = weights.reshape(5, 21, 2)
    assert (rows[:, :5, 0] == 1).all()
    assert (rows[:, 16:, 1] == 1).all()
    # As far along the arm as it is wide, both bones move it: what is inside a bend must give way.
    assert (rows[:, 8, 1] > 0.1).all()
    assert np.allclose(rows[:, 10].mean(axis=0), 0.5, atol=0.1)
    assert (np.diff(rows[2, :, 1]) >= -1e-12).all()


def test_a_figure_that_comes_to_the_camera_is_named():
    puppet = arm_puppet(distance=1.0)
    shapes = AsapShapes.of_puppet(puppet, puppet.pose)
    poses = np.repeat(puppet.pose[None], 3, axis=0)
    poses[2, :, 2] += 1.2
    with pytest.raises(DegenerateError, match="frame 2: the figure comes to the camera"):
        shapes.shapes(poses)
    behind = puppet.pose + np.array([0, 0, 2])
    with pytest.raises(DegenerateError, match="left_shoulder"):
        AsapShapes.of_puppet(puppet, behind)
