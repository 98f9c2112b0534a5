"""A clip and drawings of it for the tests of the search: the sample's dance, which is not its own mirror image."""

from functools import cache

import numpy as np

from pegbar import Clip, OrthographicCamera
from pegbar.sample.dancer import dance
from pegbar.scene.body import MARKERS
from pegbar.scene.clip import interpolate

RATE = 24.0


@cache
def dance_clip():
    """Two seconds of dance at 120 frames a second."""
    motion = dance(240).clip
    object.__setattr__(motion, "frame_rate", 120.0)
    return Clip.from_motion("dance.bvh", motion)


def drawn(clip, start, count, azimuth, elevation=5.0, *, speed=1.0, rate=RATE):
    """Marks (F, 16, 2) of ``count`` drawings of the clip from file frame ``start`` on, drawn at ``speed``."""
    times = start + np.arange(count) * (clip.frame_rate / rate * speed)
    camera = OrthographicCamera.from_angles(azimuth, elevation, scale=100, center=(320, 240))
    return camera.project(clip.at(times))


def covered(clip, start, count, azimuth, elevation=5.0):
    """Which marks are not covered: of each pair of joints the nearer one."""
    camera = OrthographicCamera.from_angles(azimuth, elevation)
    depth = camera.depth(clip.at(start + np.arange(count) * (clip.frame_rate / RATE)))
    seen = np.ones(depth.shape, bool)
    for index, name in enumerate(MARKERS):
        if name.startswith(("left_", "right_")):
            other = name.replace("left_", "@").replace("right_", "left_").replace("@", "right_")
            seen[:, index] = depth[:, index] <= depth[:, MARKERS.index(other)]
    return seen


def turned(clip, degrees):
    """The clip turned about the vertical: the camera that saw it from azimuth a now stands at a + degrees."""
    sine, cosine = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    rotation = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    markers = (clip.markers @ rotation.T).astype(np.float32)
    return Clip(clip.name, markers, clip.rate, clip.frame_rate, clip.first, clip.frames)


def apart(first, second):
    """How far two azimuths are from each other, in degrees."""
    return abs((first - second + 180) % 360 - 180)


def standstill(seconds=4.0):
    """A clip of nobody moving, in a pose of the dance."""
    pose = interpolate(dance_clip().markers, np.full(int(seconds * 30), 7.0))
    return Clip("still.bvh", pose.astype(np.float32), 30.0, 30.0, 0, len(pose))
