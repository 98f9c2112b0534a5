"""What presets measure of the ground: how much of it the cameras see, how high ankles are over it, where soles are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from pegbar.scene.camera import PerspectiveCamera
from pegbar.simulate.figure import marker
from pegbar.simulate.scene import Character

Floats = NDArray[np.float64]
SIDES = ("left", "right")
#: Of the cameras, every so manieth is looked through for what they see.
EVERY = 6
#: A sole's half width, and its rounding's middles before and behind the ankle, in body heights: in all it is 0.15 long
#: (Drillis and Contini 1966).
HALF, TOE, HEEL = 0.026, 0.080, 0.022
#: Share of the frames in which the lower ankle is taken to stand on the ground.
STANDING = 0.1
#: A figure that goes less far than this, in body heights, goes nowhere; frames over which its way is evened out.
STEP, EVEN = 0.25, 4


def seen_ground(cameras: Sequence[PerspectiveCamera], ground: float, farthest: float) -> tuple[Floats, Floats]:
    """Return the corners (x, z) of the level rectangle that holds what the cameras see of the ground.

    It goes on to under the cameras. Looked at is what lies within ``farthest`` metres of a camera; one that sees the
    horizon sees as far as that.
    """
    places = []
    for camera in [*cameras[::EVERY], cameras[-1]]:
        width, height = camera.image_size
        pixels = np.array([(x, y) for x in (0, width / 2, width) for y in (0, height)], np.float64)
        eye = camera.position
        rays = camera.unproject(pixels, np.ones(len(pixels))) - eye
        fall = (eye[1] - ground) / np.maximum(-rays[:, 1], 1e-9)
        level = np.linalg.norm(rays[:, [0, 2]], axis=1)
        # A ray that does not come down within reach goes as far as that.
        way = np.minimum(np.where(rays[:, 1] < 0, fall, np.inf), farthest / np.maximum(level, 1e-9))
        # What lies on the ground is nearer to the camera than the ground that it hides.
        places += [eye[[0, 2]] + way[:, None] * rays[:, [0, 2]], eye[None, [0, 2]]]
    found = np.concatenate(places)
    return found.min(axis=0), found.max(axis=0)


def ankle_height(character: Character, ground: float) -> float:
    """Return how high the ankles of the feet that stand are over the ground, in metres; never below zero."""
    lower = np.minimum(*(marker(character, f"{side}_foot")[:, 1] for side in SIDES))
    return max(0.0, float(np.quantile(lower, STANDING)) - ground)


def soles(character: Character, ground: float, tall: float) -> Floats:
    """Return level capsules (F, S, 8) where the soles are of feet that have no volume of their own.

    They are as long as feet of a figure ``tall`` metres high are, point along its way, and where it goes nowhere to
    where the hips face, and are on the ground where an ankle is as low as in the frames in which it stands.
    """
    ahead, low = _ahead(character, tall), ankle_height(character, ground)
    made = [np.empty((len(ahead), 0, 8))]
    for side in SIDES:
        if _has_foot(character, f"{side}_foot"):
            continue
        ankle = marker(character, f"{side}_foot")
        middle = ankle - (0.0, low - HALF * tall, 0.0)
        radius = np.full((len(ankle), 1), HALF * tall)
        ends = (middle - HEEL * tall * ahead, radius, middle + TOE * tall * ahead, radius)
        made.append(np.concatenate(ends, axis=1)[:, None])
    return np.concatenate(made, axis=1)


def _has_foot(character: Character, ankle: str) -> bool:
    """Whether a limb begins at the ankle and goes on from it."""
    ends = character.limb_markers or ()
    return any(ankle in pair and not any(joint.endswith("_knee") for joint in pair) for pair in ends)


def _ahead(character: Character, tall: float) -> Floats:
    """Level unit vectors (F, 3) that say where the figure goes, or faces."""
    pelvis = marker(character, "pelvis") * (1, 0, 1)
    hips = marker(character, "left_hip") - marker(character, "right_hip")
    facing = np.cross(hips, (0.0, 1.0, 0.0))
    if np.linalg.norm(pelvis[-1] - pelvis[0]) > STEP * tall:
        way = np.gradient(gaussian_filter1d(pelvis, EVEN, axis=0, mode="nearest"), axis=0)
        mean = (pelvis[-1] - pelvis[0]) / max(len(pelvis) - 1, 1)
        # Who walks backwards has the toes behind.
        way *= np.sign(np.sum(way * facing) or 1.0)
        slow = np.linalg.norm(way, axis=1, keepdims=True) < 0.2 * np.linalg.norm(mean)
        facing = np.where(slow, facing, way)
    facing = gaussian_filter1d(facing * (1, 0, 1), EVEN, axis=0, mode="nearest")
    sizes = np.linalg.norm(facing, axis=1, keepdims=True)
    ahead: Floats = np.where(sizes > 1e-9, facing / np.maximum(sizes, 1e-9), (0.0, 0.0, 1.0))
    return ahead
