"""What the floor knows of a standing foot's depth: depth errors of feet and knees with and without `ground_depths`.

Clips lend their depth to one another, as in figure 9 of Jain et al. 2010, under a camera that looks down at different
angles. The drawn clip's floor is levelled first, since a drawing's is.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pegbar.align.registration import register_cameras
from pegbar.lift.contact import ground_depths
from pegbar.report.clips import moving_markers, person_height, read_clips
from pegbar.report.jain2010 import turned, warped
from pegbar.scene.body import MARKERS
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.contacts import ankle_heights, foot_contacts, foot_places
from pegbar.scene.motion import Motion

Floats = NDArray[np.float64]
NAME = "foot-contact"
TRUTHS = ("07_01", "35_01", "16_11", "35_17")
SOURCES = ("07_01", "35_01", "16_11", "35_17", "08_07", "17_03")
ELEVATIONS, AZIMUTHS = (5, 15, 30), (90, 45)
#: Every 5th frame of 120 a second; marks that are off by so many pixels (standard deviation); height of the ankles.
STEP, RATE, NOISE, ANKLE = 5, 24.0, 2.0, 0.08
_FEET = foot_places(MARKERS)
_KNEES = [MARKERS.index("left_knee"), MARKERS.index("right_knee")]


@dataclass(frozen=True)
class Case:
    """One drawing: whose it is, whose depth it takes, the view in degrees, and mean errors in metres.

    ``feet`` and ``knees`` are errors without and with the floor.
    """

    truth: str
    source: str
    camera: str
    elevation: int
    azimuth: int
    feet: tuple[float, float]
    knees: tuple[float, float]


def reproduce(data: Path, output: Path) -> list[str]:
    """Measure with the clips in ``data``, write a file into ``output`` and return the table's lines."""
    cases = measure(read_clips(data, dict.fromkeys((*TRUTHS, *SOURCES))))
    output.mkdir(parents=True, exist_ok=True)
    path = output / f"{NAME}.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(
            [
                "drawn",
                "depth of",
                "camera",
                "elevation",
                "azimuth",
                "feet (m)",
                "with the floor",
                "knees (m)",
                "with the floor",
            ]
        )
        for case in cases:
            numbers = [f"{error:.4f}" for error in (*case.feet, *case.knees)]
            writer.writerow([case.truth, case.source, case.camera, case.elevation, case.azimuth, *numbers])
    return [*table(cases), "", f"wrote {path}"]


def table(cases: list[Case]) -> list[str]:
    """Return the lines of the table: means over clips and azimuths."""
    lines = [
        "Mean depth error in metres, without and with the floor; marks off by 2 px at 1280 x 720",
        "",
        f"{'camera':12}{'looks down':>11}{'cases':>7}{'feet':>8}{'floor':>8}{'better':>8}{'knees':>8}{'floor':>8}",
    ]
    for camera in dict.fromkeys(case.camera for case in cases):
        for elevation in ELEVATIONS:
            chosen = [case for case in cases if (case.camera, case.elevation) == (camera, elevation)]
            feet, knees = (np.array([getattr(case, name) for case in chosen]) for name in ("feet", "knees"))
            better = float((feet[:, 1] < feet[:, 0]).mean())
            lines.append(
                f"{camera:12}{elevation:>7} deg{len(chosen):7}{feet[:, 0].mean():8.3f}{feet[:, 1].mean():8.3f}"
                f"{better:8.0%}{knees[:, 0].mean():8.3f}{knees[:, 1].mean():8.3f}"
            )
    return lines


def measure(motions: Mapping[str, Motion], *, registered: bool = True) -> list[Case]:
    """Draw every one of `TRUTHS` and take its depth from every other clip of `SOURCES`.

    The camera is known and the clip's pelvis is moved over the drawn one's; or, ``registered``, a camera that stands
    still is found for the clip as it is, and depths count from the pelvis.
    """
    random = np.random.default_rng(0)
    clips = {clip: level(turned(moving_markers(motion, STEP), True)) for clip, motion in motions.items()}
    heights = {clip: person_height(motion) for clip, motion in motions.items()}
    cases = []
    for truth in (clip for clip in TRUTHS if clip in clips):
        for source in (clip for clip in SOURCES if clip in clips and clip != truth):
            for elevation in ELEVATIONS:
                for azimuth in AZIMUTHS:
                    shot = _Shot.of(
                        clips[truth], clips[source] * heights[truth] / heights[source], elevation, azimuth, random
                    )
                    cases.append(Case(truth, source, "known", elevation, azimuth, *shot.known()))
                    if registered:
                        cases.append(Case(truth, source, "registered", elevation, azimuth, *shot.registered()))
    return cases


def level(points: Floats) -> Floats:
    """The points (F, N, 3) sheared so that the ankles rest at one height: a clip's floor may slope by a few cm."""
    standing = foot_contacts(points, MARKERS, RATE)
    ankles = np.concatenate([points[standing[:, side], foot] for side, foot in enumerate(_FEET)])
    plane = np.column_stack([ankles[:, [0, 2]], np.ones(len(ankles))])
    slope = np.linalg.lstsq(plane, ankles[:, 1], rcond=1e-6)[0]
    lowered = points.copy()
    lowered[..., 1] -= points[..., [0, 2]] @ slope[:2] + slope[2] - ANKLE
    return lowered


@dataclass(frozen=True)
class _Shot:
    """A drawn clip, its camera and its marks, and the other clip warped to it."""

    walk: Floats
    camera: PerspectiveCamera
    marks: Floats
    lent: Floats
    ankles: Floats

    @classmethod
    def of(cls, walk: Floats, other: Floats, elevation: float, azimuth: float, random: np.random.Generator) -> _Shot:
        middle = walk.mean(axis=(0, 1))
        up, turn = math.radians(elevation), math.radians(azimuth)
        way = np.array([math.sin(turn) * math.cos(up), math.sin(up), math.cos(turn) * math.cos(up)])
        camera = PerspectiveCamera.look_at(middle + 7 * way, middle, (1280, 720), math.radians(40))
        marks = camera.project(walk) + random.normal(0, NOISE, (*walk.shape[:2], 2))
        frames = warped(marks, camera.project(other - other[:, :1] + middle))
        ankles = ankle_heights(other, MARKERS, foot_contacts(other, MARKERS, RATE))
        return cls(walk, camera, marks, other[frames], ankles)

    def known(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Errors of feet and knees, without and with the floor, under the camera that drew."""
        beside = self.lent - (self.lent[:, :1] - self.walk[:, :1]) * [1, 0, 1]
        matrices = np.repeat(self.camera.matrix[None], len(self.walk), axis=0)
        return self._errors(matrices, beside, from_pelvis=False)

    def registered(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The same under a camera found for the clip, relative to the pelvis."""
        field = self.camera.field_of_view
        track = register_cameras(self.marks, self.lent, (1280, 720), field_of_view=field, mode="static")
        return self._errors(track.matrices, track.points, from_pelvis=True)

    def _errors(
        self, matrices: Floats, points: Floats, *, from_pelvis: bool
    ) -> tuple[tuple[float, float], tuple[float, float]]:
        depths = np.einsum("fi,fni->fn", matrices[:, 2, :3], points) + matrices[:, 2, 3:]
        grounded = ground_depths(self.marks, matrices, depths, MARKERS, RATE, ankle_height=self.ankles).depths
        truth = self.camera.depth(self.walk)
        pair = []
        for found in (depths, grounded):
            errors = np.abs((found - found[:, :1]) - (truth - truth[:, :1]) if from_pelvis else found - truth)
            pair.append((float(errors[:, _FEET].mean()), float(errors[:, _KNEES].mean())))
        (feet, knees), (feet_too, knees_too) = pair
        return (feet, feet_too), (knees, knees_too)
