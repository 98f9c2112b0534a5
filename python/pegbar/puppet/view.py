"""The camera and the clip's pose that a figure shows, and from which side it is seen (Hornung et al. 2007, s5)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from pegbar.align.pose import fit_pose
from pegbar.align.pose_fit import PoseFit
from pegbar.errors import DegenerateError
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.drawn_skeleton import limb_chains
from pegbar.scene.gait import facing
from pegbar.scene.motion import Motion
from pegbar.scene.puppet_input import PuppetInput

Floats = NDArray[np.float64]
View = Literal["front", "half profile", "side", "half back", "back"]
#: Azimuths between camera and facing up to which a view reaches: templates stand 45 degrees apart (figure 3).
_REACH = (22.5, 67.5, 112.5, 157.5, 180.0)
#: Poses that are tried: frames of a clip are alike, and every pose takes its time.
MOST_POSES = 160
#: Pictures are drawn from about eye level: a clip that lacks the drawn pose must not tilt the camera to make up for it.
ELEVATION_SPREAD, ROLL_SPREAD = math.radians(6), math.radians(2)
#: The RMS error, as part of the marks' extent, beyond which no pose of the clip is the figure's. People drawn in a
#: pose that the clip lacks have up to 0.22, a four-legged figure 0.32 and more.
NO_FIT = 0.27
#: From this error on, a user should hear that the clip has no pose like the drawn one.
POOR_FIT = 0.1
# Errors of poses that are about as alike, as parts of the best one's, and degrees of facing that make no difference.
_ALIKE, _TURN = 1.3, 20.0
_USUAL_FIELD_OF_VIEW = math.radians(40)
#: Half the distance between the left and right limbs of a figure that is no person, in metres.
_HALF_WIDTH = 0.1


#: Shoulders or hips that are farther apart than these parts of the trunk's length are seen from the front, or in half
#: profile.
_FRONT, _HALF = 0.45, 0.25


@dataclass(frozen=True, eq=False)
class SeenPose:
    """The ``camera``, the clip's ``frame``, and its ``pose`` (J, 3) in world metres, that a figure shows.

    ``fitted`` is false where no pose of the clip is like the figure (an animal's): ``pose`` is then the drawing itself,
    put upright before the camera. ``azimuth`` is how far to its own left of where it faces the figure is seen from, in
    degrees, and ``view`` its name; ``error`` the RMS distance in pixels between marks and seen joints.
    """

    camera: PerspectiveCamera
    frame: int
    pose: Floats
    fitted: bool
    azimuth: float
    view: View
    error: float
    notes: tuple[str, ...]


def view_of(azimuth: float) -> View:
    """Name the view from ``azimuth`` degrees beside where the figure faces."""
    turned = abs((azimuth + 180) % 360 - 180)
    names: tuple[View, ...] = get_args(View)
    return next(name for name, reach in zip(names, _REACH, strict=True) if turned <= reach)


def drawn_view(source: PuppetInput) -> View:
    """The view that the drawing itself tells: by how far shoulders and hips are apart, and which is on which side."""
    places = dict(zip(source.names, source.marks, strict=True))
    trunk = max(float(np.linalg.norm(places["neck"] - places["pelvis"])), 1e-9)
    pairs = [(f"left_{joint}", f"right_{joint}") for joint in ("shoulder", "hip")]
    across = [places[left] - places[right] for left, right in pairs if left in places and right in places]
    wide = max((float(np.linalg.norm(apart)) / trunk for apart in across), default=1.0)
    behind = bool(across) and sum(float(apart[0]) for apart in across) < 0
    if wide > _FRONT:
        return "back" if behind else "front"
    return "side" if wide <= _HALF else "half back" if behind else "half profile"


def near_side(source: PuppetInput) -> int:
    """Which side of the figure is nearer: 1 the left, -1 the right, by where more joints are hidden; 0 unknown."""
    hidden = {name for name, seen in zip(source.names, source.visible, strict=True) if not seen}
    count = [sum(name.startswith(side) for name in hidden) for side in ("left_", "right_")]
    return (count[1] > count[0]) - (count[0] > count[1])


def seen_pose(
    source: PuppetInput, motion: Motion, *, view: View | None = None, field_of_view: float | None = None
) -> SeenPose:
    """Find the camera and the pose of ``motion`` under which it looks most like the figure (equations 1-3).

    Parameters
    ----------
    source : PuppetInput
    motion : Motion
    view : {"front", "half profile", "side", "half back", "back"}, optional
        Only poses seen so are taken; where there is none the best pose is, under the wanted name. None is the camera's
        for a clip that has the drawn pose, else what the drawing tells (`drawn_view`).
    field_of_view : float, optional
        Horizontal, radians; None finds one near the usual.

    Raises
    ------
    ValueError
        For an unknown view, or a clip that moves fewer than four of the figure's joints, or no frame.
    """
    if view is not None and view not in get_args(View):
        raise ValueError(f"view: want one of {', '.join(get_args(View))}, got {view!r}")
    moved, points, frames = poses = _poses(source, motion)
    marks = source.marks[moved]
    extent = float(np.linalg.norm(np.ptp(source.marks, axis=0)))
    towards = _facing(motion)[frames]
    try:
        fit = fit_pose(
            marks,
            points,
            source.image_size,
            field_of_view=field_of_view,
            elevation_spread=ELEVATION_SPREAD,
            roll_spread=ROLL_SPREAD,
        )
    except DegenerateError:
        fit = None
    if fit is None or fit.error > NO_FIT * extent or _is_animal(source):
        return _as_drawn(source, motion, poses, view, field_of_view)
    poor = fit.error > POOR_FIT * extent
    wanted = view or (drawn_view(source) if poor else None)
    choice, azimuth, found = _choice(fit, points, towards, wanted, near_side(source))
    camera, error = fit.cameras[choice], float(fit.errors[choice])
    assert camera is not None
    frame = int(frames[choice])
    notes: tuple[str, ...] = ()
    if error > POOR_FIT * extent:
        notes = (f"no pose of the clip is like the drawn one: the best, frame {frame}, is off by {error:.0f} px",)
    pose = _completed(source, moved, points[choice], camera)
    return SeenPose(camera, frame, pose, True, azimuth, found, error, notes)


def _is_animal(source: PuppetInput) -> bool:
    """Whether a figure lies and has other limbs than a person."""
    trunk = source.marks[source.names.index("neck")] - source.marks[source.names.index("pelvis")]
    return bool(abs(trunk[0]) > abs(trunk[1])) and any(name != marker for name, marker in source.drives.items())


def _poses(source: PuppetInput, motion: Motion) -> tuple[list[int], Floats, NDArray[np.intp]]:
    """The joints that the clip moves, their poses (P, K, 3), and the clip's frames of these (P,)."""
    found = {marker: _marker(motion, marker) for marker in sorted(set(source.drives.values()))}
    known = {marker: points for marker, points in found.items() if points is not None}
    moved = [joint for joint, name in enumerate(source.names) if source.drives.get(name) in known]
    if len(moved) < 4:
        raise ValueError(f"motion: want a clip that moves four of the figure's joints or more, got {len(moved)}")
    points = np.stack([known[source.drives[source.names[joint]]] for joint in moved], axis=1)
    whole = np.asarray(np.isfinite(points).all(axis=(1, 2)))
    if motion.rest_frame is not None:
        whole[motion.rest_frame] = False
    frames = np.flatnonzero(whole)
    if not len(frames):
        raise ValueError("motion: want a frame in which all joints are known, got none")
    frames = frames[:: -(-len(frames) // MOST_POSES)]
    return moved, points[frames], frames


def _marker(motion: Motion, marker: str) -> Floats | None:
    """A marker (F, 3) of the clip; pelvis and neck also as the middle of hips and shoulders."""
    if marker in motion.known_markers:
        return motion.markers([marker])[:, 0]
    half = {"pelvis": "hip", "neck": "shoulder"}.get(marker)
    sides = [f"{side}_{half}" for side in ("left", "right")]
    if half is None or any(side not in motion.known_markers for side in sides):
        return None
    middle: Floats = motion.markers(sides).mean(axis=1)
    return middle


def _facing(motion: Motion) -> Floats:
    """Azimuth in which the clip's person faces, degrees (F,); 0 where nothing tells."""
    sides = [f"{side}_{joint}" for side in ("left", "right") for joint in ("hip", "shoulder")]
    azimuth = facing({name: motion.markers([name])[:, 0] for name in sides if name in motion.known_markers})
    return np.zeros(len(motion.positions)) if azimuth is None else np.nan_to_num(azimuth)


def _choice(fit: PoseFit, points: Floats, towards: Floats, wanted: View | None, near: int) -> tuple[int, float, View]:
    """The best pose of the wanted view, how far beside its facing the camera stands, and the view.

    Poses that show the ``near`` side (1 left, -1 right, 0 unknown) are taken before others.
    """
    found = []
    for pose in fit.ranking[: np.isfinite(fit.costs).sum()].tolist():
        camera = fit.cameras[pose]
        assert camera is not None
        apart = camera.position - points[pose].mean(axis=0)
        azimuth = (math.degrees(math.atan2(apart[0], apart[2])) - towards[pose] + 180) % 360 - 180
        found.append((pose, float(azimuth), view_of(azimuth)))
    fitting = [entry for entry in found if wanted in (None, entry[2])]
    if not fitting:
        assert wanted is not None
        return (*found[0][:2], wanted)
    # Marks alone hardly tell a figure from its mirror image in depth; a camera to its left sees the left side.
    fitting = [entry for entry in fitting if near * math.sin(math.radians(entry[1])) >= 0] or fitting
    # Of poses that are about as alike the one is taken that faces as the clip mostly does: a pose in the middle of a
    # turn would show the rest of the clip from the wrong side.
    turned = np.abs((towards[:, None] - towards[None, :] + 180) % 360 - 180)
    strays = np.round(np.median(turned, axis=0) / _TURN)
    alike = [entry for entry in fitting if fit.errors[entry[0]] <= _ALIKE * fit.errors[fitting[0][0]]]
    return min(alike, key=lambda entry: float(strays[entry[0]]))


def _completed(source: PuppetInput, moved: list[int], points: Floats, camera: PerspectiveCamera) -> Floats:
    """The pose (J, 3), with joints that no marker moves as deep as what they hang on."""
    pose = np.full((len(source.names), 3), np.nan)
    pose[moved] = points
    middle = float(np.mean(camera.depth(points)))
    root = 0 if not len(source.bones) else int(source.bones[0, 0])
    if np.isnan(pose[root]).any():
        pose[root] = camera.unproject(source.marks[root], middle)
    for parent, child in source.bones:
        if np.isnan(pose[child]).any():
            pose[child] = camera.unproject(source.marks[child], camera.depth(pose[parent]))
    return pose


def _as_drawn(
    source: PuppetInput,
    motion: Motion,
    poses: tuple[list[int], Floats, NDArray[np.intp]],
    view: View | None,
    field_of_view: float | None,
) -> SeenPose:
    """The drawing itself as the pose, where the clip's body is another: an animal's, seen from its side if it lies."""
    moved, points, frames = poses
    trunk = source.marks[source.names.index("neck")] - source.marks[source.names.index("pelvis")]
    found: View = view or ("side" if abs(trunk[0]) > abs(trunk[1]) else "front")
    turned = {"front": 0.0, "half profile": 45.0, "side": 90.0, "half back": 135.0, "back": 180.0}[found]
    azimuth = -turned if trunk[0] > 0 else turned
    scale = _metres_a_pixel(source, moved, points)
    towards = _facing(motion)[frames]
    choice = _alike(source, moved, points, towards + azimuth)
    angle = math.radians(towards[choice] + azimuth)
    away = np.array([math.sin(angle), 0.0, math.cos(angle)])
    sight = field_of_view or _USUAL_FIELD_OF_VIEW
    distance = scale * source.image_size[0] / 2 / math.tan(sight / 2)
    # The picture's middle lies before the camera; the figure stands on the clip's floor line as it does in the picture.
    centre = points[choice].mean(axis=0) * [1, 0, 1] + [
        0,
        scale * (source.marks[:, 1].max() - source.image_size[1] / 2),
        0,
    ]
    camera = PerspectiveCamera.look_at(centre + distance * away, centre, source.image_size, sight)
    left = np.array([math.cos(math.radians(towards[choice])), 0, -math.sin(math.radians(towards[choice]))])
    sides = np.array([_side(source.drives.get(name, "")) for name in source.names])
    depths = distance - _HALF_WIDTH * sides * float(left @ away)
    pose = camera.unproject(source.marks, depths)
    frame = int(frames[choice])
    note = f"no pose of the clip is like the figure: it is as drawn in frame {frame}, and limbs turn from there"
    return SeenPose(camera, frame, pose, False, azimuth, found, 0.0, (note,))


def _side(marker: str) -> int:
    return 1 if marker.startswith("left_") else -1 if marker.startswith("right_") else 0


def _metres_a_pixel(source: PuppetInput, moved: list[int], points: Floats) -> float:
    """How large a pixel is where the figure's limbs are as long as the clip's."""
    places = {joint: place for place, joint in enumerate(moved)}
    limbs = [bone for bone in _limb_bones(source) if all(int(joint) in places for joint in source.bones[bone])]
    bones = source.bones[limbs] if limbs else source.bones[[all(int(j) in places for j in b) for b in source.bones]]
    drawn = np.linalg.norm(np.diff(source.marks[bones], axis=1)[:, 0], axis=1)
    held = points[:, [[places[int(joint)] for joint in bone] for bone in bones]]
    real = np.median(np.linalg.norm(held[:, :, 1] - held[:, :, 0], axis=2), axis=0)
    return float(np.median(real[drawn > 0] / drawn[drawn > 0]))


def _alike(source: PuppetInput, moved: list[int], points: Floats, azimuths: Floats) -> int:
    """The pose whose limbs, seen from ``azimuths`` (P,) degrees, point most as the drawn ones do."""
    places = {joint: place for place, joint in enumerate(moved)}
    limbs = [bone for bone in _limb_bones(source) if all(int(joint) in places for joint in source.bones[bone])]
    if not limbs:
        return 0
    drawn = np.diff(source.marks[source.bones[limbs]], axis=1)[:, 0]
    held = points[:, [[places[int(joint)] for joint in bone] for bone in source.bones[limbs]]]
    bones = held[:, :, 1] - held[:, :, 0]
    angle = np.radians(azimuths)[:, None]
    seen = np.stack([bones[..., 0] * np.cos(angle) - bones[..., 2] * np.sin(angle), -bones[..., 1]], axis=2)
    unlike = np.abs(np.angle(_complex(seen) * np.conj(_complex(drawn))))
    return int(np.argmin(unlike.sum(axis=1)))


def _complex(vectors: Floats) -> NDArray[np.complex128]:
    return np.asarray(vectors[..., 0] + 1j * vectors[..., 1], np.complex128)


def _limb_bones(source: PuppetInput) -> list[int]:
    return [bone for chain in limb_chains(source.names, source.bones) for bone in chain]
