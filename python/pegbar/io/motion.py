"""Reads a motion file as a motion in metres with Y up; what the file does not say is found from the poses."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pegbar.io.joint_map import read_joint_map, wrong_entry
from pegbar.io.recording import Recording
from pegbar.io.recording_file import read_recording
from pegbar.scene.clip_report import ClipReport
from pegbar.scene.conventions import (
    UNITS,
    guess_unit,
    inserted_pose,
    is_standing,
    person_height,
    up_axis,
    up_rotation,
)
from pegbar.scene.examine import examine
from pegbar.scene.joints import map_joints
from pegbar.scene.motion import Motion
from pegbar.scene.optical import joint_centres

Floats = NDArray[np.float64]
_Path = str | os.PathLike[str]
#: CMU's AMC files, nearly all that there are, were recorded at this rate; the format has no place for one.
ASSUMED_RATE = 120.0


def read_motion(
    path: _Path,
    *,
    skeleton: _Path | None = None,
    unit: float | str | None = None,
    up: str | None = None,
    frame_rate: float | None = None,
    joints: _Path | Mapping[str, str] | None = None,
) -> Motion:
    """Return the clip of a BVH, ASF/AMC or C3D file, in metres with Y up, with every frame of the file.

    What the file does not say is found: the unit from the skeleton's size, the up axis from where the head is, the
    joints' meaning from names and shape, an inserted T-pose from its jump. `Motion.report` says what was found and how;
    the data is turned and scaled, but never moved.

    Parameters
    ----------
    path : path
        A ``.bvh``, ``.amc`` or ``.c3d`` file.
    skeleton : path, optional
        The ``.asf`` of an ``.amc``, where it does not lie beside it under a like name.
    unit : float or {"m", "cm", "mm", "inch", "foot", "cmu"}, optional
        Metres in a unit of the file, or its name.
    up : {"x", "y", "z", "-x", "-y", "-z"}, optional
        The file's up axis. Z up becomes Y up by a quarter turn about X; points of a C3D file keep their cyclic order,
        (x, y, z) to (y, z, x), as CMU's own conversion does.
    frame_rate : float, optional
        Frames a second.
    joints : path or dict of str to str, optional
        Canonical marker -> joint of the file, for those that are to be other than found: a file as
        `write_joint_map` writes it, or a dict. An empty name says that the clip has no such joint.

    Raises
    ------
    FormatError
        For a broken file, or a wrong line of a joint map; it names path and line (or byte).
    ValueError
        For a wrong unit, axis, rate or joint, naming the argument.
    OSError
        When a file cannot be read.

    Examples
    --------
    >>> text = '''HIERARCHY
    ... ROOT Hips { OFFSET 0 0 0 CHANNELS 3 Xposition Yposition Zposition
    ...   End Site { OFFSET 0 1 0 } }
    ... MOTION
    ... Frames: 2
    ... Frame Time: 0.04
    ... 0 100 0
    ... 0 100 4'''
    >>> from pathlib import Path
    >>> _ = Path("slide.bvh").write_text(text)
    >>> motion = read_motion("slide.bvh", unit="cm")
    >>> motion.frame_rate, motion.markers(["pelvis"])[1].tolist()
    (25.0, [[0.0, 1.0, 0.04]])
    >>> Path("slide.bvh").unlink()
    """
    metres = _unit(unit)
    if up is not None:
        up = up.lower()
        up_rotation(up)
    if frame_rate is not None and not 0 < frame_rate < math.inf:
        raise ValueError(f"frame_rate: want frames a second above 0, got {frame_rate}")
    recording = read_recording(path, skeleton)
    given = _given_joints(joints, recording)
    clip = _Clip(recording, given)
    axis, axis_from, notes = clip.up(up)
    unit_metres, unit_from = clip.unit(metres, unit)
    rate, rate_from = frame_rate or recording.frame_rate or ASSUMED_RATE, "given" if frame_rate else "the file"
    if not frame_rate and not recording.frame_rate:
        rate_from = "assumed"
        notes.append(f"it says no frame rate: {ASSUMED_RATE:g} frames a second assumed")
    height = None if clip.height is None else clip.height * unit_metres
    motion = clip.motion(unit_metres, axis, rate)
    report = ClipReport(unit_metres, unit_from, axis, axis_from, rate_from, height, notes=(*recording.notes, *notes))
    return motion.changed(report=examine(motion, report))


def _unit(unit: float | str | None) -> float | None:
    if unit is None:
        return None
    metres = UNITS.get(unit) if isinstance(unit, str) else unit
    if metres is None or not 0 < metres < math.inf:
        raise ValueError(f"unit: want metres above 0 or one of {', '.join(UNITS)}, got {unit!r}")
    return float(metres)


def _given_joints(joints: _Path | Mapping[str, str] | None, recording: Recording) -> dict[str, str]:
    if joints is None:
        return {}
    if not isinstance(joints, Mapping):
        return read_joint_map(joints, recording.names)
    for marker, joint in joints.items():
        problem = wrong_entry(marker, joint, recording.names)
        if problem:
            raise ValueError(f"joints: {problem}")
    return dict(joints)


class _Clip:
    """A recording with its markers, still in the file's unit and axes."""

    def __init__(self, recording: Recording, given: Mapping[str, str]) -> None:
        self.recording, self.given = recording, given
        self.rest = _rest_positions(recording)
        self.optical = joint_centres(recording.names, recording.positions) if self.rest is None else {}
        self.joint_map = self._map(self.rest)
        self.standing = self.rest is not None and is_standing(self._at(self.rest))
        if self.rest is not None and not self.standing:
            # Bones laid end to end say nothing of left and right: a frame does.
            self.joint_map = self._map(recording.positions[len(recording.positions) // 2])
        self.frames = self._at(recording.positions) | self.optical
        chain = self._at(self.rest) if self.standing and self.rest is not None else self.frames
        self.height = person_height(chain, self._skull(chain), head=0.94 if self.optical else 0.88)

    def _map(self, rest: Floats | None) -> dict[str, str]:
        found = map_joints(self.recording.names, self.recording.parents, rest=rest) | dict(self.given)
        return {marker: joint for marker, joint in found.items() if joint}

    def _at(self, positions: Floats) -> dict[str, Floats]:
        places = {name: place for place, name in enumerate(self.recording.names)}
        return {marker: positions[..., places[joint], :] for marker, joint in self.joint_map.items()}

    def _skull(self, markers: Mapping[str, Floats]) -> Floats | None:
        """The top of the head: an end site or the only joint above it."""
        joint = self.joint_map.get("head")
        if joint is None or self.rest is None:
            return None
        recording, place = self.recording, self.recording.names.index(joint)
        lengths = [
            *(
                np.linalg.norm(end)
                for parent, end in zip(recording.end_parents, recording.end_offsets, strict=True)
                if parent == place
            ),
            *(
                np.linalg.norm(recording.offsets[child])
                for child, parent in enumerate(recording.parents)
                if parent == place and recording.offsets is not None
            ),
        ]
        if not lengths:
            return None
        return np.asarray(markers["head"] + np.array([0, max(lengths), 0]), np.float64)

    def up(self, given: str | None) -> tuple[str, str, list[str]]:
        """The up axis, where it is from, and what is odd about it."""
        seen = up_axis(self.frames)
        rest = up_axis(self._at(self.rest)) if self.standing and self.rest is not None else None
        said = given or self.recording.up
        if said:
            odd = seen is not None and seen[1] > 0.8 and seen[0] != said
            note = [f"the head is along {seen[0]} from the feet, though {said} is up"] if odd and seen else []
            return said, "given" if given else "the file", note
        if rest is not None:
            odd = seen is not None and seen[1] > 0.8 and seen[0] != rest[0]
            note = [f"lying or turned: at rest {rest[0]} is up, in the frames {seen[0]}"] if odd and seen else []
            return rest[0], "the pose", note
        if seen is not None and seen[1] > 0.5:
            return seen[0], "the pose", []
        return "y", "assumed", ["no head over feet shows which axis is up: y assumed"]

    def unit(self, metres: float | None, given: float | str | None) -> tuple[float, str]:
        """Metres in a unit of the file, and where that is from."""
        if metres is not None:
            return metres, f"given: {given}" if isinstance(given, str) else "given"
        if self.recording.unit is not None:
            return self.recording.unit, "the file"
        if self.height is None:
            return 1.0, "assumed: no person to measure"
        name, guessed = guess_unit(self.height)
        return guessed, f"a person's height: {name}" if name else "scaled to a height of 1.7 m"

    def motion(self, unit: float, up: str, rate: float) -> Motion:
        """The motion in metres, Y up."""
        recording = self.recording
        turn = up_rotation(up, laboratory=self.rest is None)
        # Points have no axes to turn.
        rotations = recording.rotations if up == "y" or self.rest is None else turn @ recording.rotations @ turn.T
        positions = (recording.positions * unit) @ turn.T
        rest = None if self.rest is None else self.rest * unit @ turn.T
        ends = {
            recording.names[parent]: turn @ end * unit
            for parent, end in zip(recording.end_parents, recording.end_offsets, strict=True)
        }
        motion = Motion(
            recording.names, recording.parents, positions, rotations, rate, None, dict(self.given), rest, ends
        ).knowing(self.joint_map)
        if self.rest is None:
            return motion
        at = {marker: positions[:, recording.names.index(joint)] for marker, joint in self.joint_map.items()}
        return motion.changed(rest_frame=inserted_pose(at, positions, rotations))


def _rest_positions(recording: Recording) -> Floats | None:
    """Joint positions of the rest pose in the file's unit and axes, or None for points."""
    if recording.offsets is None or all(parent < 0 for parent in recording.parents):
        return None
    rest = np.array(recording.offsets, np.float64)
    for joint, parent in enumerate(recording.parents):
        if parent >= 0:
            rest[joint] += rest[parent]
    return rest
