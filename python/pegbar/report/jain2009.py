"""Table 1 and figure 10 of Jain, Sheikh, Hodgins 2009: a walk drawn by a known camera, lifted with another walk.

The error is the distance in metres of the markers of the upper body, the root apart, from the walk that was drawn: as
root mean square over markers and frames, and as a ratio to that of the time-aligned clip.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pegbar.align.descriptor import pose_descriptor, pose_distance
from pegbar.align.timewarp import time_warp
from pegbar.lift.limbs import align_limbs
from pegbar.lift.markers import reconstruct_markers
from pegbar.scene.motion import Motion
from pegbar.scene.orthographic import OrthographicCamera

Floats = NDArray[np.float64]
#: The walk that is drawn and the one that lifts it, CMU numbers.
PAIRS = (("07_01", "35_01"), ("35_01", "07_01"), ("07_01", "02_01"))
#: Every so many frames of 120 a second are taken.
STEP = 4
_SIDES = ("Left", "Right")
#: The 19 markers of the CMU skeleton, the root first, then the upper body.
MARKERS = (
    *("Hips", "Spine", "Spine1", "Neck", "Head"),
    *(side + joint for side in _SIDES for joint in ("Arm", "ForeArm", "Hand")),
    *(side + joint for side in _SIDES for joint in ("UpLeg", "Leg", "Foot", "ToeBase")),
)
UPPER = slice(1, 11)
_CHAINS = (
    ("Hips", "Spine", "Spine1", "Neck", "Head"),
    *(("Spine1", *(side + joint for joint in ("Arm", "ForeArm", "Hand"))) for side in _SIDES),
    *(("Hips", *(side + joint for joint in ("UpLeg", "Leg", "Foot", "ToeBase"))) for side in _SIDES),
)
_NAMED = [pair for chain in _CHAINS for pair in pairwise(chain)]
LIMBS = np.array([(MARKERS.index(first), MARKERS.index(second)) for first, second in _NAMED])
#: Limbs that s3.4 turns: all that end in the upper body.
_TURNED = LIMBS[(LIMBS[:, 1] >= UPPER.start) & (LIMBS[:, 1] < UPPER.stop)]
#: Limbs of the descriptor: upper arms, forearms, thighs and shins.
_DESCRIBED = np.array([pair for pair, (first, _) in zip(LIMBS, _NAMED, strict=True) if first.endswith(("Arm", "Leg"))])
_DESCRIBED = np.array([pair for pair in _DESCRIBED if not MARKERS[pair[1]].endswith("ToeBase")])
#: The camera, and how far off it is given: (azimuth, elevation) in degrees.
CAMERA = (45.0, 15.0)
OFFSETS = ((0, 0), (5, 0), (-5, 0), (10, 0), (-10, 0), (0, 5), (0, -5), (0, 10), (0, -10))
VIEWS = {"front": (0.0, 10.0), "three-quarter": CAMERA, "side": (90.0, 10.0)}
#: Deviation of the marks, in pixels of a picture in which a figure of 1.7 m is 500 px tall.
NOISES = (0, 1, 3, 5)
METRES_PER_PIXEL = 1.7 / 500
#: Frames of one cycle (two steps) of the walks.
CYCLE = 34
#: The ways to lift: closed form, rigid limbs of unknown length, rigid limbs of known length.
WAYS = ("closed form", "refine", "refine, lengths given")
#: Metres: a limb that is less deep lies in the picture plane.
FLAT = 0.05
#: The paper's table 1: mean and largest error in metres for each offset, and for the clip alone.
PRINTED = {
    (0, 0): (0.0045, 0.0173),
    (5, 0): (0.0046, 0.0173),
    (-5, 0): (0.0045, 0.0174),
    (10, 0): (0.0048, 0.0179),
    (-10, 0): (0.0047, 0.0175),
    (0, 10): (0.0050, 0.0169),
    (0, -10): (0.0051, 0.0180),
}
PRINTED_CLIP = (0.0062, 0.0257)


@dataclass(frozen=True)
class Lifted:
    """A walk (F, 19, 3), the time-aligned clip and what each way made of it, all in metres, the root at the origin."""

    truth: Floats
    clip: Floats
    ways: Mapping[str, Floats]

    def error(self, way: str, markers: slice = UPPER) -> float:
        """Root mean square distance in metres."""
        return _rms(self.ways[way] - self.truth, markers)

    def clip_error(self, markers: slice = UPPER) -> float:
        """The same for the time-aligned clip."""
        return _rms(self.clip - self.truth, markers)

    def ratio(self, way: str, markers: slice = UPPER) -> float:
        """Error over that of the time-aligned clip."""
        return self.error(way, markers) / self.clip_error(markers)

    def worst(self, way: str) -> tuple[float, int, str]:
        """The largest distance in metres, its frame and its marker."""
        distances = np.linalg.norm(self.ways[way] - self.truth, axis=-1)
        frame, marker = np.unravel_index(np.argmax(distances), distances.shape)
        return float(distances[frame, marker]), int(frame), MARKERS[int(marker)]


@dataclass(frozen=True)
class Culprit:
    """The limb that errs most, by its outer marker, and the frames in which it points the wrong way in depth.

    ``error`` (m) is the root mean square of the outer marker's, as seen from the inner one; ``wrong`` counts frames of
    the lifted limb, ``clip_wrong`` of the clip's.
    """

    marker: str
    error: float
    wrong: int
    clip_wrong: int


def culprit(lifted: Lifted, way: str, angles: tuple[float, float]) -> Culprit:
    """Return where ``way`` errs most of a figure seen from ``angles`` (azimuth, elevation in degrees), and why."""
    away = OrthographicCamera.from_angles(*angles).rotation[2]
    found, clip, truth = (
        one[:, LIMBS[:, 1]] - one[:, LIMBS[:, 0]] for one in (lifted.ways[way], lifted.clip, lifted.truth)
    )
    errors = np.sqrt(np.mean(np.sum((found - truth) ** 2, axis=-1), axis=0))
    limb = int(np.argmax(errors))
    depth, own, clips = (one[:, limb] @ away for one in (truth, found, clip))
    # A limb that lies in the picture plane has no sign.
    signed = np.abs(depth) > FLAT
    wrong, clip_wrong = (int(np.sum((one * depth < 0) & signed)) for one in (own, clips))
    return Culprit(MARKERS[LIMBS[limb, 1]], float(errors[limb]), wrong, clip_wrong)


@dataclass(frozen=True)
class Result:
    """For each pair: lifted with the camera off by `OFFSETS`, and from `VIEWS` with `NOISES` (view, noise).

    ``same`` is the first pair's walk, one cycle of it lifted with the next.
    """

    offsets: Mapping[tuple[str, str], Mapping[tuple[int, int], Lifted]]
    views: Mapping[tuple[str, str], Mapping[tuple[str, int], Lifted]]
    same: Lifted

    def mean_ratio(self, way: str, offset: tuple[int, int] = (0, 0)) -> float:
        """Mean over the pairs of the upper body's ratio."""
        return float(np.mean([lifted[offset].ratio(way) for lifted in self.offsets.values()]))


def table1(motions: Mapping[str, Motion]) -> Result:
    """Repeat table 1 with the CMU clips of `PAIRS`, and lift from other views and with noisy marks besides."""
    poses = {clip: walk_poses(motion) for clip, motion in motions.items()}
    offsets, views = {}, {}
    for pair in PAIRS:
        truth, clip = (poses[number] for number in pair)
        offsets[pair] = {offset: lift_walk(truth, clip, CAMERA, offset=offset) for offset in OFFSETS}
        views[pair] = {
            (view, noise): lift_walk(truth, clip, angles, noise=noise)
            for view, angles in VIEWS.items()
            for noise in NOISES
        }
    walk = poses[PAIRS[0][0]]
    return Result(offsets, views, lift_walk(walk[:CYCLE], walk[CYCLE : 2 * CYCLE], CAMERA))


def walk_poses(motion: Motion) -> Floats:
    """Return a clip's poses (F, 19, 3): the root at the origin, turned once so that the mean hip axis is +x."""
    first = 1 if motion.rest_frame == 0 else 0
    markers = motion.slice(first, None, STEP).markers(MARKERS, centres=False)
    poses = markers - markers[:, :1]
    across = (poses[:, MARKERS.index("LeftUpLeg")] - poses[:, MARKERS.index("RightUpLeg")]).mean(axis=0)
    angle = np.arctan2(across[2], across[0])
    cosine, sine = np.cos(angle), np.sin(angle)
    turned: Floats = poses @ np.array([[cosine, 0, -sine], [0, 1, 0], [sine, 0, cosine]])
    return turned


def lift_walk(
    truth: Floats, clip: Floats, angles: tuple[float, float], *, offset: tuple[int, int] = (0, 0), noise: float = 0
) -> Lifted:
    """Draw ``truth`` from ``angles`` with ``noise`` in pixels; lift it by a camera that is ``offset`` degrees off."""
    drawn = OrthographicCamera.from_angles(*angles).project(truth)
    drawn = drawn + noise * METRES_PER_PIXEL * np.random.default_rng(0).normal(size=drawn.shape)
    camera = OrthographicCamera.from_angles(angles[0] + offset[0], angles[1] + offset[1])
    cost = pose_distance(pose_descriptor(drawn, _DESCRIBED), pose_descriptor(camera.project(clip), _DESCRIBED))
    prior = clip[time_warp(cost, stiffness=0).frames]
    aligned = align_limbs(camera.project(prior), drawn, _TURNED)
    lengths, own = (np.median(limb_lengths(poses), axis=0) for poses in (clip, truth))
    ways = {
        WAYS[0]: reconstruct_markers(aligned, prior, camera, LIMBS, lengths, training=clip),
        WAYS[1]: reconstruct_markers(drawn, prior, camera, LIMBS, None, refine=True),
        WAYS[2]: reconstruct_markers(drawn, prior, camera, LIMBS, own, refine=True),
    }
    return Lifted(truth, prior, ways)


def limb_lengths(poses: Floats) -> Floats:
    """Return the lengths (F, V) of the limbs of ``poses`` (F, 19, 3)."""
    lengths: Floats = np.linalg.norm(poses[:, LIMBS[:, 1]] - poses[:, LIMBS[:, 0]], axis=-1)
    return lengths


def coordinate_errors(lifted: Lifted, points: Floats) -> Floats:
    """Return the root mean square error over frames of every coordinate (57,), as figure 10 shows it."""
    errors: Floats = np.sqrt(np.mean((points - lifted.truth) ** 2, axis=0)).ravel()
    return errors


def _rms(difference: Floats, markers: slice) -> float:
    return float(np.sqrt(np.mean(np.sum(difference[:, markers] ** 2, axis=-1))))
