"""The dancer's body below the head: limbs, dress, hands and shoes as parts to paint, from one frame's markers."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from pegbar.sample.marks import Color, Fill, Part, Stroke, View, hull, outline, resample
from pegbar.sample.skeleton import NAMES, Floats
from pegbar.scene.drawing import Limb

SKIN: Color = (247, 206, 172)
SKIN_SHADE: Color = (226, 165, 138)
DRESS: Color = (226, 82, 76)
DRESS_SHADE: Color = (182, 52, 68)
TRIM: Color = (255, 214, 120)
LEGGINGS: Color = (92, 84, 138)
LEGGINGS_SHADE: Color = (66, 58, 108)
SHOES: Color = (250, 240, 228)
SHOES_SHADE: Color = (214, 196, 190)

LIMBS = (
    Limb("torso", "neck", "pelvis", (255, 255, 0)),
    Limb("head", "neck", "head", (255, 0, 255)),
    Limb("left_upper_arm", "left_shoulder", "left_elbow", (255, 0, 0)),
    Limb("left_forearm", "left_elbow", "left_hand", (255, 128, 0)),
    Limb("left_hand", "left_hand", "left_finger", (255, 192, 128)),
    Limb("right_upper_arm", "right_shoulder", "right_elbow", (0, 0, 255)),
    Limb("right_forearm", "right_elbow", "right_hand", (0, 128, 255)),
    Limb("right_hand", "right_hand", "right_finger", (128, 192, 255)),
    Limb("left_thigh", "left_hip", "left_knee", (0, 255, 0)),
    Limb("left_shin", "left_knee", "left_foot", (0, 128, 0)),
    Limb("left_foot", "left_foot", "left_toe", (160, 208, 96)),
    Limb("right_thigh", "right_hip", "right_knee", (0, 255, 255)),
    Limb("right_shin", "right_knee", "right_foot", (128, 0, 255)),
    Limb("right_foot", "right_foot", "right_toe", (96, 160, 208)),
)
DRESS_LABEL: Color = (224, 80, 80)
HAIR_LABEL: Color = (138, 74, 43)
PALETTE: dict[Color, str] = {DRESS_LABEL: "torso", HAIR_LABEL: "head"}
"""Colours of the label picture that belong to a limb without being its own."""

LABELS: dict[str, Color] = {limb.name: limb.color for limb in LIMBS if limb.color}
# Half the width of every limb at its two ends, in metres.
RADII: dict[str, tuple[float, float]] = {
    "torso": (0.11, 0.13),
    "head": (0.10, 0.12),
    "upper_arm": (0.046, 0.034),
    "forearm": (0.034, 0.023),
    "hand": (0.026, 0.016),
    "thigh": (0.088, 0.056),
    "shin": (0.054, 0.034),
    "foot": (0.034, 0.028),
}
# Spheres along a limb: place between its ends, radius, and how far back (against the limb's front) in metres.
_PROFILES: dict[str, list[tuple[float, ...]]] = {
    "upper_arm": [(0.0, 0.046, 0), (0.4, 0.043, 0), (1.0, 0.034, 0)],
    "forearm": [(0.0, 0.034, 0), (0.28, 0.036, 0), (0.7, 0.028, 0), (1.0, 0.023, 0)],
    "thigh": [(0.0, 0.088, 0), (0.4, 0.078, 0), (1.0, 0.055, 0)],
    "shin": [(0.0, 0.053, 0), (0.3, 0.054, 0.016), (0.62, 0.042, 0.008), (1.0, 0.033, 0)],
}
# Rings of the bodice: height above the chest, half its width and depth, how far forward.
_RIBS = [
    (-0.10, 0.110, 0.083, 0),
    (0.0, 0.134, 0.096, 0.008),
    (0.09, 0.149, 0.098, 0.012),
    (0.205, 0.112, 0.046, -0.01),
]
_COLORS = {
    "upper_arm": (SKIN, SKIN_SHADE),
    "forearm": (SKIN, SKIN_SHADE),
    "thigh": (LEGGINGS, LEGGINGS_SHADE),
    "shin": (LEGGINGS, LEGGINGS_SHADE),
}


class Pose(NamedTuple):
    """One frame of the drawn dancer: markers (N, 3), the joints' world rotations (N, 3, 3), the pony tail (n, 3)."""

    markers: NDArray[np.float64]
    rotations: NDArray[np.float64]
    tail: NDArray[np.float64]

    def at(self, name: str, *offset: float) -> Floats:
        """The joint's place (3,), or the point at ``offset`` (x, y, z) metres in its axes."""
        point: Floats = self.around(name, np.array([offset or (0.0, 0.0, 0.0)]))[0]
        return point

    def around(self, name: str, local: Floats) -> Floats:
        """World points (n, 3) of ``local`` (n, 3) metres in the joint's axes."""
        index = NAMES.index(name)
        points: Floats = self.markers[index] + local @ self.rotations[index].T
        return points


def body(pose: Pose, view: View) -> list[Part]:
    """All parts of the body but the head."""
    parts = [_torso(pose, view), _skirt(pose, view)]
    for side in ("left", "right"):
        for limb in LIMBS:
            kind = limb.name.removeprefix(f"{side}_")
            if kind in _PROFILES and limb.name != kind:
                parts.append(_limb(pose, view, limb, kind))
        parts += [_hand(pose, view, side), _shoe(pose, view, side)]
    return parts


def shaded(part: Part, centers: Floats, radii: Floats, colors: tuple[Color, Color], label: Color) -> None:
    """Fill the outline of discs in shade, and in light a smaller one that is moved towards the upper left."""
    part.fills.append(Fill(outline(centers, radii), colors[1], label))
    lit = centers + radii[:, None] * (-0.15, -0.11)
    part.details.append(Fill(outline(lit, 0.80 * radii), colors[0]))


def _seed(name: str) -> int:
    return zlib.crc32(name.encode()) % 65521


def _limb(pose: Pose, view: View, limb: Limb, kind: str) -> Part:
    start, end = pose.at(limb.start), pose.at(limb.end)
    places, radii, back = _profile(_PROFILES[kind])
    front = pose.rotations[NAMES.index(limb.start)] @ (0.0, 0.0, 1.0)
    centers = start + places[:, None] * (end - start) - back[:, None] * front
    discs = view.discs(centers, radii)
    part = Part(limb.name, limb.name, view.axis(np.array([start, end]), float(radii.mean())))
    rim = outline(*discs)
    length = float(np.linalg.norm(end - start) * view.scale(start))
    part.lines.append(view.pen(rim, _seed(limb.name), weight=_open(rim, *discs, length, kind == "upper_arm")))
    part.fills.append(Fill(rim, _COLORS[kind][0], LABELS[limb.name]))
    part.details.append(Fill(_shadow(*discs), _COLORS[kind][1]))
    return part


def _shadow(centers: Floats, radii: Floats) -> Floats:
    """The shaded side of a limb: a crescent on the side away from the light, thin at the joints."""
    axis = centers[-1] - centers[0]
    across = np.array([-axis[1], axis[0]]) / max(float(np.hypot(*axis)), 1e-6)
    away = float(across @ (0.75, 0.66))
    side = across * np.sign(away) * radii[:, None]
    depth = 0.62 * abs(away) ** 0.5 * np.sin(np.linspace(0, np.pi, len(radii))) ** 0.5
    return np.concatenate([centers + side, (centers + side * (1 - depth[:, None]))[::-1]])


def _profile(keys: Sequence[tuple[float, ...]]) -> Floats:
    """Columns of smoothly interpolated ``keys``, evenly over their first column."""
    values = np.array(keys, float)
    fine = np.linspace(values[0, 0], values[-1, 0], 11)
    return np.concatenate([fine[None], PchipInterpolator(values[:, 0], values[:, 1:])(fine).T])


def _open(rim: Floats, centers: Floats, radii: Floats, length: float, shoulder: bool = False) -> Floats:
    """How heavy the pen is round a limb: nothing round the joints (but light round a shoulder), unless seen end on."""
    axis = centers[-1] - centers[0]
    seen = float(np.hypot(*axis))
    end_on = 1 - np.clip((seen / length - 0.25) / 0.3, 0, 1)
    step = axis / max(seen, 1e-6)
    before, after = (rim - centers[0]) @ step / radii[0], (centers[-1] - rim) @ step / radii[-1]
    side = np.clip(np.minimum(before, after) / 0.35 + 0.9, 0, 1)
    cap = np.where(before < 0, 0.7, 0.0) if shoulder else 0.0
    return np.asarray(np.maximum(np.maximum(side, end_on), cap))


def _hand(pose: Pose, view: View, side: str) -> Part:
    name = f"{side}_hand"
    mirror = 1.0 if side == "left" else -1.0
    # Palm, two bunches of fingers, thumb: in the hand's axes, x along the fingers.
    pieces = [
        [(0.0, 0.0, 0.0, 0.023), (0.045, 0.0, 0.008, 0.030), (0.07, 0.0, -0.004, 0.027)],
        [(0.07, 0.0, -0.012, 0.016), (0.115, -0.006, -0.014, 0.013), (0.145, -0.014, -0.016, 0.009)],
        [(0.07, 0.0, 0.010, 0.017), (0.12, 0.004, 0.010, 0.0135), (0.160, -0.004, 0.006, 0.010)],
        [(0.025, 0.002, 0.02, 0.015), (0.06, 0.008, 0.048, 0.012), (0.085, 0.010, 0.058, 0.009)],
    ]
    part = Part(name, name, view.axis(np.array([pose.at(name), pose.at(f"{side}_finger")]), 0.025))
    for number, piece in enumerate(pieces):
        centers = np.array([pose.at(name, mirror * x, y, z) for x, y, z, _ in piece])
        discs = view.discs(centers, np.array([radius for *_, radius in piece]))
        rim = outline(*discs)
        weight = 0.85 * (_open(rim, *discs, 1e-9) if number == 0 else 1.0)
        part.lines.append(view.pen(rim, _seed(name) + number, weight=weight))
        shaded(part, *discs, (SKIN, SKIN_SHADE), LABELS[name])
    return part


def _shoe(pose: Pose, view: View, side: str) -> Part:
    foot, toe = f"{side}_foot", f"{side}_toe"
    spheres = [
        (pose.at(foot, 0, 0.0, 0.0), 0.034),
        (pose.at(foot, 0, -0.042, -0.028), 0.030),
        (pose.at(toe, 0, 0.010, 0.0), 0.032),
        (pose.at(toe, 0, 0.004, 0.055), 0.021),
    ]
    discs = view.discs(np.array([center for center, _ in spheres]), np.array([radius for _, radius in spheres]))
    part = Part(foot, foot, view.axis(np.array([pose.at(foot), pose.at(toe)]), 0.03))
    part.lines.append(view.pen(outline(*discs), _seed(foot)))
    shaded(part, *discs, (SHOES, SHOES_SHADE), LABELS[foot])
    return part


def _ring(pose: Pose, joint: str, height: float, wide: float, deep: float, forward: float = 0.0) -> Floats:
    """Points (24, 3) on an ellipse round a joint's vertical axis."""
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    local = np.column_stack([wide * np.sin(turn), np.full(24, height), deep * np.cos(turn) + forward])
    return pose.around(joint, local)


def _torso(pose: Pose, view: View) -> Part:
    rings = [_ring(pose, "chest", *row) for row in _profile(_RIBS).T] + [_ring(pose, "pelvis", 0.09, 0.104, 0.080)]
    part = Part("torso", "torso", view.axis(np.array([pose.at("neck"), pose.at("pelvis")]), 0.10))
    pieces = [hull(view.camera.project(np.concatenate(pair))) for pair in pairwise(rings)]
    part.lines += [view.pen(piece, 101 + number) for number, piece in enumerate(pieces)]
    part.fills += [Fill(piece, DRESS_SHADE, LABELS["torso"]) for piece in pieces]
    lit = [ring.mean(axis=0) + 0.86 * (ring - ring.mean(axis=0)) for ring in rings]
    nudge = np.array([-0.016, -0.004]) * float(view.scale(pose.at("chest")))
    part.details += [Fill(hull(view.camera.project(np.concatenate(pair))) + nudge, DRESS) for pair in pairwise(lit)]
    part.details += _neckline(pose, view)
    return part


def _neckline(pose: Pose, view: View) -> list[Fill | Stroke]:
    """Bare skin at the collar, with the dress's trim below it."""
    turn = np.linspace(-np.pi / 2, np.pi / 2, 15)
    drop = 0.19 - 0.085 * np.cos(turn)
    local = np.column_stack([0.088 * np.sin(turn), drop, 0.02 + 0.072 * np.cos(turn)])
    edge = view.camera.project(pose.around("chest", local))
    trim = resample(edge, 2.0)
    width = 0.013 * float(view.scale(pose.at("chest")))
    return [Fill(edge, SKIN_SHADE), Stroke(trim, np.full(len(trim), width), TRIM)]


def skirt_axis(pose: Pose) -> tuple[Floats, Floats]:
    """The waist and the middle of the hem, which hangs half from the pelvis and half straight down."""
    up = pose.rotations[NAMES.index("pelvis")][:, 1] * 0.5 + (0, 0.5, 0)
    return pose.at("pelvis"), pose.at("pelvis") - 0.30 * up


def _skirt(pose: Pose, view: View) -> Part:
    pelvis, low = skirt_axis(pose)
    top = _ring(pose, "pelvis", 0.10, 0.106, 0.082)
    hem = _hem(pose, low)
    hem_rim = view.camera.project(hem)
    cloth = [_thigh_cloth(pose, view, side) for side in ("left", "right")]
    drape = hull(np.concatenate([view.camera.project(np.concatenate([top, hem[::2]])), *cloth]))
    pieces = [drape, resample(np.concatenate([hem_rim, hem_rim[:1]]), 2.0)[:-1]]
    part = Part("skirt", "torso", view.axis(np.array([pelvis, pelvis + 0.7 * (low - pelvis)]), 0.19))
    part.lines += [view.pen(piece, 201 + number) for number, piece in enumerate(pieces)]
    part.fills += [Fill(piece, DRESS, DRESS_LABEL) for piece in pieces]
    part.details += _folds(view, top, hem)
    return part


def _thigh_cloth(pose: Pose, view: View, side: str) -> Floats:
    """Outline of the cloth that lies on a thigh."""
    hip, knee = pose.at(f"{side}_hip"), pose.at(f"{side}_knee")
    ends = np.array([hip, hip + 0.46 * (knee - hip)])
    return outline(*view.discs(ends, np.array([0.092, 0.094])))


def _hem(pose: Pose, centre: Floats) -> Floats:
    """The skirt's hem (72, 3): a waving ring that swings with the pelvis."""
    turn = np.linspace(0, 2 * np.pi, 72, endpoint=False)
    wave = 1 + 0.055 * np.cos(9 * turn)
    local = np.column_stack([0.245 * wave * np.sin(turn), 0.014 * np.cos(9 * turn), 0.215 * wave * np.cos(turn)])
    return pose.around("pelvis", local) + (centre - pose.at("pelvis"))


def _folds(view: View, top: Floats, hem: Floats) -> list[Fill | Stroke]:
    """Shaded pleats and the belt on the side of the skirt that is seen."""
    marks: list[Fill | Stroke] = []
    waist = view.camera.project(top)
    depths = view.camera.depth(top)
    near = depths < depths.mean() + 0.02
    for pleat in range(9):
        # Troughs of the hem's nine waves lie halfway between its crests.
        low = (pleat * 8 + 4) % 72
        root = low // 3
        if near[root]:
            a = view.camera.project(hem[[low - 2, (low + 2) % 72]])
            marks.append(Fill(np.array([waist[root] * 0.75 + a.mean(axis=0) * 0.25, a[0], a[1]]), DRESS_SHADE))
    belt = hull(np.concatenate([waist, waist - (0.0, 0.034 * float(view.scale(top.mean(axis=0))))]))
    marks += [view.pen(belt, 221, weight=0.8), Fill(belt, TRIM, DRESS_LABEL)]
    return marks
