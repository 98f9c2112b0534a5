"""Figure 9 of Jain et al. 2010: how wrong a walk's depth is when it comes from other clips.

A walk is drawn by a camera that is known, then takes its depth from clips of other motions and actors, time-warped to
it. The error is the distance in depth from the truth, averaged over the markers, in metres, frame by frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pegbar.align.descriptor import pose_descriptor, pose_distance
from pegbar.align.registration import register_cameras
from pegbar.align.timewarp import time_warp
from pegbar.report.clips import moving_markers, person_height
from pegbar.scene.body import LIMBS, MARKERS
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.gait import facing
from pegbar.scene.motion import Motion
from pegbar.scene.orthographic import OrthographicCamera

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Source:
    """A clip that lends its depth: its CMU number, what it shows, the part taken, what the paper printed of its like.

    ``slow`` is the mean error in metres of an independent slow transcription of the experiment, side view.
    """

    clip: str
    shows: str
    printed: str
    slow: float
    part: tuple[int | None, int | None] = (None, None)


TRUTH = "07_01"
SOURCES = (
    Source("35_01", "walk, another actor", "least (happy walk)", 0.020),
    Source("08_07", "walk, exaggerated stride", "least (happy walk)", 0.045),
    Source("35_17", "run", "as the jump, below the curve", 0.025),
    Source("09_01", "run, another actor", "as the jump, below the curve", 0.024),
    Source("16_05", "broad jump", "as the run", 0.025),
    Source("16_11", "walk along a curve", "most", 0.047),
    Source("17_03", "sneak", "-", 0.106),
    Source("127_32", "side shuffle, ducking", "below the curve (no ducking)", 0.188, (20, 217)),
)
#: Every so many frames of 120 a second are taken.
STEP = 4
AZIMUTHS = {"side": 90.0, "three-quarter": 45.0}
#: The camera that draws the walk where cameras are registered: metres from the middle of the walk, picture, lens.
DISTANCE, IMAGE_SIZE, FIELD_OF_VIEW, ELEVATION = 6.0, (1280, 720), math.radians(45), math.radians(5)
#: Arms and legs: the limbs whose angles are compared.
LIMB_PAIRS = np.array([(MARKERS.index(limb.start), MARKERS.index(limb.end)) for limb in LIMBS if "_" in limb.name])


@dataclass(frozen=True)
class Result:
    """Errors (F,) in metres over the walk's frames, by the way depth was taken and by clip; ``rate`` in frames/s."""

    errors: Mapping[str, Mapping[str, Floats]]
    rate: float

    def mean(self, way: str, clip: str) -> float:
        """Mean error in metres over the frames."""
        return float(self.errors[way][clip].mean())


def figure9(motions: Mapping[str, Motion], *, registered: bool = True) -> Result:
    """Repeat figure 9 with the clips of `TRUTH` and `SOURCES`, in six ways.

    "side" and "three-quarter" are views from azimuth 90 and 45 degrees with parallel rays; clips are scaled to the
    walker's height, turned once to face as the walk does at its start, and moved to its pelvis in every frame (the
    paper's experiment as far as it is told). "..., whole" turns the clips by their mean facing instead. "...,
    registered" sees the travelling walk through a perspective camera 6 m away and finds the camera of the warped clip
    as `pegbar align` does (mode and root "auto"); errors are then relative to the pelvis. ``registered`` false leaves
    these out.

    Raises
    ------
    KeyError
        For a clip that is missing.
    """
    truth = motions[TRUTH]
    walk, height = _markers(truth, (None, None)), person_height(truth)
    errors: dict[str, dict[str, Floats]] = {}
    for view, azimuth in AZIMUTHS.items():
        ways: dict[str, Callable[[Floats], Floats]] = {
            view: partial(_aligned, walk, azimuth, True),
            f"{view}, whole": partial(_aligned, walk, azimuth, False),
        }
        if registered:
            ways[f"{view}, registered"] = partial(_registered, walk, azimuth)
        for way, measure in ways.items():
            errors[way] = {
                source.clip: measure(
                    _markers(motions[source.clip], source.part) * height / person_height(motions[source.clip])
                )
                for source in SOURCES
            }
    return Result(errors, truth.frame_rate / STEP)


def _markers(motion: Motion, part: tuple[int | None, int | None]) -> Floats:
    """Every 4th frame (F, N, 3) of a part of the clip, without an inserted T-pose."""
    return moving_markers(motion)[slice(*part)][::STEP]


def turned(points: Floats, start: bool) -> Floats:
    """The points turned about the vertical so that the person faces +Z at first, or in the mean."""
    azimuths = facing(dict(zip(MARKERS, points.transpose(1, 0, 2), strict=True)))
    assert azimuths is not None
    turn = math.radians(float(azimuths[0] if start else azimuths.mean()))
    rotation = np.array([[math.cos(turn), 0, -math.sin(turn)], [0, 1, 0], [math.sin(turn), 0, math.cos(turn)]])
    turned: Floats = points @ rotation.T
    return turned


def warped(drawn: Floats, seen: Floats) -> NDArray[np.int64]:
    """For each drawn frame the clip's, by the angles of arms and legs in the picture."""
    return time_warp(pose_distance(pose_descriptor(drawn, LIMB_PAIRS), pose_descriptor(seen, LIMB_PAIRS))).frames


def _aligned(walk: Floats, azimuth: float, start: bool, points: Floats) -> Floats:
    camera = OrthographicCamera.from_angles(azimuth, 0)
    walk, points = (turned(clip - clip[:, :1], start) for clip in (walk, points))
    frames = warped(camera.project(walk), camera.project(points))
    errors: Floats = np.abs(camera.depth(points[frames]) - camera.depth(walk)).mean(axis=1)
    return errors


def _registered(walk: Floats, azimuth: float, points: Floats) -> Floats:
    walk, points = turned(walk, True), turned(points, True)
    camera = _camera(walk, azimuth)
    drawn = camera.project(walk)
    # For the warp the clip is seen as the walk is: the camera travels with its pelvis.
    beside = points - points[:, :1] + walk.mean(axis=0)[:1]
    frames = warped(drawn, camera.project(beside))
    track = register_cameras(drawn, points[frames], IMAGE_SIZE, field_of_view=FIELD_OF_VIEW, mode="auto", root="auto")
    rows = track.matrices[:, 2]
    depths = np.einsum("fi,fni->fn", rows[:, :3], track.points) + rows[:, 3:]
    truth = camera.depth(walk)
    errors: Floats = np.abs((depths - depths[:, :1]) - (truth - truth[:, :1])).mean(axis=1)
    return errors


def _camera(walk: Floats, azimuth: float) -> PerspectiveCamera:
    middle = walk.mean(axis=(0, 1))
    turn = math.radians(azimuth)
    way = np.array([math.sin(turn), math.tan(ELEVATION), math.cos(turn)])
    return PerspectiveCamera.look_at(middle + DISTANCE * way, middle, IMAGE_SIZE, FIELD_OF_VIEW)
