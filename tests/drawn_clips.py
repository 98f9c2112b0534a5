"""Drawings made from real clips: another figure's limbs, another timing, known cameras, marks by an unsteady hand."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pegbar import PerspectiveCamera, pose_descriptor, pose_distance, read_motion, time_warp
from pegbar.scene.body import LIMBS, MARKERS

SIZE = (1280, 720)
#: Clip, and every how many of its 120 frames a second is drawn: about 24.
CLIPS = {
    "07_01": ("bvh/cmu_07_01.bvh", 5),
    "35_01": ("bvh/cmu_35_01.bvh", 5),
    "02_01": ("bvh/cmu_02_01.bvh", 5),
    "35_17": ("bvh/cmu_35_17.bvh", 4),
    "118_01": ("bvh/cmu_118_01_trim.bvh", 3),
    "16_05": ("asfamc/16_05.amc", 5),
    "16_11": ("bvh/cmu_16_11.bvh", 5),
}
#: From where: azimuth, elevation and field of view in degrees.
VIEWS = ((30, 8, 40), (75, 3, 30), (150, -3, 50), (270, 20, 40))
_PARENTS = {
    **{"chest": "pelvis", "neck": "chest", "head": "neck"},
    **{f"{s}_{a}": b for s in ("left", "right") for a, b in (("shoulder", "neck"), ("hip", "pelvis"))},
    **{
        f"{s}_{a}": f"{s}_{b}"
        for s in ("left", "right")
        for a, b in (("elbow", "shoulder"), ("hand", "elbow"), ("knee", "hip"), ("foot", "knee"))
    },
}


@dataclass(frozen=True)
class DrawnClip:
    """Marks (F, N, 2) px, the figure drawn (F, N, 3), the clip warped to it (F, N, 3), and the cameras that saw it."""

    marks: np.ndarray
    figure: np.ndarray
    points: np.ndarray
    cameras: list[PerspectiveCamera]


def clip_points(folder: Path, name: str) -> np.ndarray:
    """Markers (F, 16, 3) of a clip at about 24 frames a second, the floor at 0."""
    path, step = CLIPS[name]
    motion = read_motion(folder / "mocap" / path)
    points = motion.markers(MARKERS)[0 if motion.rest_frame is None else motion.rest_frame + 1 :: step]
    return points - [0, np.percentile(points[..., 1], 1) - 0.08, 0]


def other_proportions(points: np.ndarray, amount: float, seed: int) -> np.ndarray:
    """The same poses with limbs longer or shorter by ``amount``, each kind in its own way, on the same floor."""
    rng = np.random.default_rng(seed)
    kinds = ("shoulder", "elbow", "hand", "hip", "knee", "foot", "chest", "neck", "head")
    factor = {kind: 1 + amount * rng.choice([-1, 1]) for kind in kinds}
    out = points.copy()
    for index, name in enumerate(MARKERS):
        if name in _PARENTS:
            parent = MARKERS.index(_PARENTS[name])
            out[:, index] = out[:, parent] + factor[name.split("_")[-1]] * (points[:, index] - points[:, parent])
    out[..., 1] -= np.percentile(out[..., 1], 1) - np.percentile(points[..., 1], 1)
    return out


def at_times(points: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Points (F, N, 3) at fractional frames."""
    times = np.clip(times, 0, len(points) - 1)
    first = np.minimum(times.astype(int), len(points) - 2)
    share = (times - first)[:, None, None]
    return (1 - share) * points[first] + share * points[first + 1]


def known_cameras(kind: str, figure: np.ndarray, view: tuple[float, float, float]) -> list[PerspectiveCamera]:
    """Cameras that show the figure about 60% of the picture high: static, pan, tilt, dolly, track or orbit."""
    azimuth, elevation, fov = map(math.radians, view)
    focal = SIZE[0] / 2 / math.tan(fov / 2)
    place = figure.mean(axis=1)
    middle = (figure.reshape(-1, 3).max(axis=0) + figure.reshape(-1, 3).min(axis=0)) / 2
    travel = float(np.linalg.norm(np.ptp(place[:, [0, 2]], axis=0)))
    near = 1.75 * focal / (0.6 * SIZE[1])
    far = max(near, (travel + 1) * focal / SIZE[0] + travel / 2)
    kernel = np.hanning(33)[1:-1] / np.hanning(33).sum()
    padded = np.pad(place, ((15, 15), (0, 0)), mode="reflect", reflect_type="odd")
    follow = np.stack([np.convolve(padded[:, axis], kernel, "valid") for axis in range(3)], axis=1)
    follow[:, 1] = middle[1]
    cameras = []
    for index, share in enumerate(np.linspace(0, 1, len(figure))):
        ease = share * share * (3 - 2 * share)
        turn = azimuth + (math.radians(60) * ease if kind == "orbit" else 0)
        level = math.cos(elevation)
        toward = np.array([math.sin(turn) * level, math.sin(elevation), math.cos(turn) * level])
        stand, look = middle + far * toward, middle
        if kind == "pan":
            stand, look = middle + 0.8 * far * toward, follow[index]
        elif kind == "tilt":
            look = middle + np.array([0, 0.7 * ease - 0.35, 0])
        elif kind == "dolly":
            stand = middle + (1.15 - 0.4 * ease) * far * toward
        elif kind in ("track", "orbit"):
            stand, look = follow[index] + near * toward, follow[index]
        cameras.append(PerspectiveCamera.look_at(stand, look, SIZE, fov))
    return cameras


def draw(
    clip: np.ndarray,
    kind: str,
    view: tuple[float, float, float],
    *,
    noise: float = 2.0,
    amount: float = 0.1,
    warped: bool = True,
    in_place: bool = False,
    seed: int = 0,
) -> DrawnClip:
    """A figure of other proportions and timing, drawn with ``noise`` px, and the clip warped to it by its poses."""
    rng = np.random.default_rng(seed)
    frames = len(clip)
    figure = other_proportions(clip, amount, seed) if amount else clip
    wave = np.sin(np.linspace(0, 2 * np.pi, frames)) + 0.5 * np.sin(np.linspace(0, 6 * np.pi, frames))
    if warped:
        figure = at_times(figure, np.linspace(0, frames - 1, frames) + 1.5 * wave)
    if in_place:
        travel = np.polynomial.polynomial.Polynomial
        for axis in (0, 2):
            path = figure[..., axis].mean(axis=1)
            line = travel.fit(np.arange(frames), path, 1)(np.arange(frames))
            figure[..., axis] -= (line - line.mean())[:, None]
    cameras = known_cameras(kind, figure, view)
    clean = np.stack([camera.project(pose) for camera, pose in zip(cameras, figure, strict=True)])
    marks = clean + rng.normal(0, noise, clean.shape)
    points = at_times(clip, _warp_times(marks, clip, cameras)) if warped else clip
    return DrawnClip(marks, figure, points, cameras)


def _warp_times(marks: np.ndarray, clip: np.ndarray, cameras: list[PerspectiveCamera]) -> np.ndarray:
    """When in the clip each drawing is, from poses seen along the way in which the drawings' cameras look."""
    limbs = [[MARKERS.index(limb.start), MARKERS.index(limb.end)] for limb in LIMBS]
    middle = cameras[len(cameras) // 2].rotation
    drawn, seen = pose_descriptor(marks, limbs), pose_descriptor(clip @ middle[:2].T, limbs)
    return time_warp(pose_distance(drawn, seen), slope_limit=3).times


@dataclass(frozen=True)
class Recovery:
    """Errors of a track: RMS angle and view (from figure to camera) in degrees, place in metres, floor jitter in px.

    ``jitter`` is the RMS second difference over time of the error of a floor point's place in the picture, over the
    square root of 6 (what white noise of that size would give); ``step`` the RMS frame-to-frame change of that error.
    """

    angle: float
    view: float
    place: float
    distance: float
    jitter: float
    step: float
    most_view: float


def recovery(track, drawn: DrawnClip) -> Recovery:
    """How far the track's cameras are from those that saw the drawings."""
    places = drawn.figure.mean(axis=1)
    angle, view, place, distance = [], [], [], []
    for got, want, figure in zip(track.cameras, drawn.cameras, places, strict=True):
        angle.append(_angle_of(got.rotation @ want.rotation.T))
        ours, theirs = got.position - figure, want.position - figure
        cosine = ours @ theirs / np.linalg.norm(ours) / np.linalg.norm(theirs)
        view.append(math.degrees(math.acos(np.clip(cosine, -1, 1))))
        place.append(np.linalg.norm(got.position - want.position))
        distance.append(np.linalg.norm(theirs))
    jitter, step = np.mean([_floor(track, drawn, places[i]) for i in (0, len(places) // 2, -1)], axis=0)
    return Recovery(_rms(angle), _rms(view), _rms(place), float(np.mean(distance)), jitter, step, max(view))


def _floor(track, drawn: DrawnClip, below: np.ndarray) -> tuple[float, float]:
    point = [below[0], 0, below[2]]
    pairs = zip(track.cameras, drawn.cameras, strict=True)
    error = np.stack([got.project(point) - want.project(point) for got, want in pairs])
    second, first = np.diff(error, n=2, axis=0), np.diff(error, axis=0)
    return _rms(np.linalg.norm(second, axis=-1)) / math.sqrt(6), _rms(np.linalg.norm(first, axis=-1))


def _angle_of(rotation: np.ndarray) -> float:
    return math.degrees(math.acos(np.clip((np.trace(rotation) - 1) / 2, -1, 1)))


def _rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
