"""Puppets of known shape: a straight arm before a camera, and clips that move it."""

import numpy as np

from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.motion import Motion
from pegbar.scene.puppet import Puppet

ARM = ("left_shoulder", "left_elbow", "left_hand")
SIZE = (300, 200)
#: Metres a pixel at the arm.
PIXEL = 0.005
HALF = 20


def camera(distance=3.0, field=None):
    """A camera on the z axis that sees the plane z = 0 with `PIXEL` metres a pixel."""
    width = field or 2 * np.arctan(SIZE[0] * PIXEL / 2 / distance)
    return PerspectiveCamera.look_at((0, 0, distance), (0, 0, 0), SIZE, width)


def arm_puppet(distance=3.0, columns=21, rows=5):
    """An arm of two bones, 100 px each, 40 px wide, along x in the picture's middle."""
    seen = camera(distance)
    marks = np.array([[50.0, 99.5], [150.0, 99.5], [250.0, 99.5]])
    across, down = np.linspace(50, 250, columns), np.linspace(99.5 - HALF, 99.5 + HALF, rows)
    vertices = np.stack(np.meshgrid(across, down), axis=2).reshape(-1, 2)
    place = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (place[:-1, :-1], place[:-1, 1:], place[1:, :-1], place[1:, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])
    bone = (vertices[triangles][..., 0].mean(axis=1) > 150).astype(np.int64)
    handles = place[rows // 2]
    along = (across - 50) / 100
    texture = np.zeros((SIZE[1], SIZE[0], 4), np.uint8)
    texture[..., 3] = 255
    texture[::8, :, 0] = 255
    edge = np.zeros(len(vertices), bool)
    edge[np.concatenate([place[0], place[-1], place[:, 0], place[:, -1]])] = True
    pose = seen.unproject(marks, np.full(3, distance))
    return Puppet(
        names=ARM,
        marks=marks,
        bones=np.array([[0, 1], [1, 2]]),
        drives={name: name for name in ARM},
        vertices=vertices,
        triangles=triangles,
        triangle_layer=np.zeros(len(triangles), np.int64),
        layers=("body",),
        triangle_bone=bone,
        handles=handles,
        handle_bone=(along > 1).astype(np.int64),
        handle_fraction=np.where(along > 1, along - 1, along),
        joint_handles=np.array([0, columns // 2, columns - 1]),
        boundary=edge,
        textures=(texture,),
        background=None,
        camera=seen,
        pose=pose,
        view="front",
        image_size=SIZE,
    )


def handed_puppet(distance=3.0):
    """`arm_puppet` with shorter bones, 75 px each: what is beyond 200 px is a hand of 50 px."""
    puppet = arm_puppet(distance)
    marks = np.array([[50.0, 99.5], [125.0, 99.5], [200.0, 99.5]])
    on_bones = puppet.vertices[puppet.handles, 0] <= 200
    handles = puppet.handles[on_bones]
    along = (puppet.vertices[handles, 0] - 50) / 75
    places = [int(np.abs(puppet.vertices[handles, 0] - x).argmin()) for x in marks[:, 0]]
    return puppet.changed(
        marks=marks,
        pose=puppet.camera.unproject(marks, np.full(3, distance)),
        triangle_bone=(puppet.vertices[puppet.triangles][..., 0].mean(axis=1) > 125).astype(np.int64),
        handles=handles,
        handle_bone=(along > 1).astype(np.int64),
        handle_fraction=np.where(along > 1, along - 1, along),
        joint_handles=np.array(places),
    )


def turned_poses(puppet, degrees, elbow=0.0):
    """The arm's poses (F, 3, 3), turned by `degrees` (F,) about the upright axis towards the camera."""
    angle = np.radians(np.asarray(degrees, float))
    upper = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    lower = np.stack([np.cos(angle + elbow), 0 * angle, np.sin(angle + elbow)], axis=1)
    first = np.repeat(puppet.pose[:1], len(angle), axis=0)
    second = first + 100 * PIXEL * upper
    return np.stack([first, second, second + 100 * PIXEL * lower], axis=1)


def clip(poses, names=ARM, frame_rate=30.0):
    """A motion of points."""
    poses = np.asarray(poses, float)
    turns = np.broadcast_to(np.eye(3), (*poses.shape[:2], 3, 3)).copy()
    return Motion(tuple(names), (-1,) * len(names), poses, turns, frame_rate)
