"""The dancer's head: neck, face, hair and pony tail as parts to paint."""

from __future__ import annotations

import numpy as np

from pegbar.sample.figure import HAIR_LABEL, LABELS, SKIN, SKIN_SHADE, TRIM, Pose
from pegbar.sample.marks import INK, Axis, Color, Fill, Part, Stroke, View, outline, resample, smooth
from pegbar.sample.skeleton import NAMES, Floats

HAIR: Color = (110, 62, 50)
HAIR_LIGHT: Color = (156, 92, 66)
WHITE: Color = (255, 252, 248)
IRIS: Color = (58, 92, 96)
LIPS: Color = (176, 58, 66)
BLUSH: Color = (238, 120, 110, 110)

# Spheres in the head's axes: x, y, z, radius in metres.
_BACK_HAIR = [(0.0, 0.028, -0.012, 0.130), (0.0, -0.010, -0.050, 0.092)]
_FACE = [
    (0.0, 0.020, 0.022, 0.098),
    (0.050, -0.032, 0.042, 0.060),
    (-0.050, -0.032, 0.042, 0.060),
    (0.0, -0.078, 0.052, 0.048),
    (0.0, -0.100, 0.060, 0.027),
]
_HAIRLINE = [
    (-0.118, -0.045, 0.020),
    (-0.106, 0.020, 0.060),
    (-0.070, 0.058, 0.095),
    (-0.030, 0.088, 0.105),
    (0.020, 0.055, 0.122),
    (0.070, 0.038, 0.102),
    (0.106, 0.005, 0.060),
    (0.118, -0.045, 0.020),
]
_TAIL_RADII = np.array([0.030, 0.046, 0.052, 0.050, 0.042, 0.030, 0.012])


def head(pose: Pose, view: View) -> list[Part]:
    """Hair, neck, face and pony tail."""
    return [_hair(pose, view), _neck(pose, view), _face(pose, view), _tail(pose, view)]


def _points(pose: Pose, local: object) -> Floats:
    return pose.around("head", np.array(local, float))


def _spheres(pose: Pose, view: View, spheres: list[tuple[float, float, float, float]]) -> tuple[Floats, Floats]:
    values = np.array(spheres)
    return view.discs(_points(pose, values[:, :3]), values[:, 3])


def _neck(pose: Pose, view: View) -> Part:
    base, top = pose.at("neck"), pose.at("head", 0.0, -0.06, -0.01)
    discs = view.discs(np.array([base + 0.1 * (base - top), top]), np.array([0.05, 0.043]))
    part = Part("neck", "head", view.axis(np.array([base, top]), 0.045))
    rim = outline(*discs)
    below = np.clip(((rim - discs[0][0]) @ (discs[0][1] - discs[0][0])) / (discs[1][0] * 20), 0, 1)
    part.lines.append(view.pen(rim, 301, weight=below))
    part.fills.append(Fill(rim, SKIN_SHADE, LABELS["head"]))
    return part


def _axis(pose: Pose, view: View) -> Axis:
    return view.axis(np.array([pose.at("head"), pose.at("head", 0.0, 0.03, 0.0)]), 0.125)


def _hair(pose: Pose, view: View) -> Part:
    """The hair on the back of the head, which lies behind the neck."""
    part = Part("hair", "head", _axis(pose, view))
    rim = outline(*_spheres(pose, view, _BACK_HAIR))
    part.lines.append(view.pen(rim, 302))
    part.fills.append(Fill(rim, HAIR, HAIR_LABEL))
    return part


def _face(pose: Pose, view: View) -> Part:
    part = Part("head", "head", _axis(pose, view))
    face = _spheres(pose, view, _FACE)
    rims = [*_ears(pose, view), outline(*face)]
    part.lines += [view.pen(rim, 303 + number) for number, rim in enumerate(rims)]
    part.fills += [Fill(rim, SKIN_SHADE, LABELS["head"]) for rim in rims]
    lit = face[0] + face[1][:, None] * (-0.09, -0.04)
    part.details.append(Fill(outline(lit, 0.9 * face[1]), SKIN))
    part.details += _features(pose, view)
    fringe = _fringe(pose, view)
    part.details += [view.pen(fringe, 309), Fill(fringe, HAIR, HAIR_LABEL)]
    part.details += _shine(pose, view)
    return part


def _facing(pose: Pose, view: View, local: tuple[float, float, float]) -> float:
    """Cosine between a direction in the head's axes and the way to the camera."""
    rotation = pose.rotations[NAMES.index("head")]
    sight = view.camera.position - pose.at("head")
    return float(rotation @ local @ sight / np.linalg.norm(sight) / np.linalg.norm(local))


def _ears(pose: Pose, view: View) -> list[Floats]:
    """Outlines of the ears that are seen."""
    seen = [side for side in (-1.0, 1.0) if _facing(pose, view, (side, 0.0, 0.25)) > 0.2]
    spheres = [[(side * 0.110, -0.018, 0.008, 0.021), (side * 0.105, -0.044, 0.014, 0.014)] for side in seen]
    return [outline(*_spheres(pose, view, ear)) for ear in spheres]


def _fringe(pose: Pose, view: View) -> Floats:
    """The hair over the forehead: from temple to temple along the hairline, back over the crown."""
    line = view.camera.project(_points(pose, _HAIRLINE))
    centers, radii = _spheres(pose, view, [(0.0, 0.030, -0.005, 0.131)])
    up = view.camera.project(pose.at("head", 0.0, 0.1, 0.0)) - view.camera.project(pose.at("head"))
    # Angles from the crown, clockwise: from the last temple to the first they lead over it.
    upright = np.arctan2(up[1], up[0])
    start, end = (np.angle(np.exp(1j * (np.arctan2(y, x) - upright))) for x, y in line[[-1, 0]] - centers[0])
    turn = upright + np.linspace(start, end, 24)
    crown = centers[0] + radii[0] * np.column_stack([np.cos(turn), np.sin(turn)])
    return resample(np.concatenate([smooth(line), crown, line[:1]]), 1.5)[:-1]


def _shine(pose: Pose, view: View) -> list[Fill | Stroke]:
    arc = view.camera.project(_points(pose, [(0.075, 0.085, 0.075), (0.03, 0.115, 0.07), (-0.03, 0.120, 0.06)]))
    line = smooth(arc)
    bulge = np.sin(np.linspace(0, np.pi, len(line)))
    return [Stroke(line, 0.022 * float(view.scale(pose.at("head"))) * bulge, HAIR_LIGHT)]


def _features(pose: Pose, view: View) -> list[Fill | Stroke]:
    """Eyes, brows, nose, mouth and cheeks: what shows where she looks."""
    size = float(view.scale(pose.at("head")))
    marks: list[Fill | Stroke] = []
    for side in (-1.0, 1.0):
        if _facing(pose, view, (side * 0.55, 0.0, 0.83)) > 0.12:
            marks += _eye(pose, view, side, size)
    line = view.camera.project(_points(pose, [(0.004, -0.022, 0.124), (0.008, -0.046, 0.132), (-0.004, -0.050, 0.126)]))
    marks.append(Stroke(smooth(line), _taper(smooth(line), 0.007 * size), SKIN_SHADE[:3]))
    mouth = [(-0.026, -0.074, 0.088), (-0.010, -0.083, 0.100), (0.010, -0.083, 0.100), (0.028, -0.072, 0.088)]
    line = smooth(view.camera.project(_points(pose, mouth)))
    marks.append(Stroke(line, _taper(line, 0.012 * size), LIPS))
    return marks


def _eye(pose: Pose, view: View, side: float, size: float) -> list[Fill | Stroke]:
    def spot(x: float, y: float, z: float, wide: float, high: float) -> Floats:
        turn = np.linspace(0, 2 * np.pi, 20, endpoint=False)
        local = np.column_stack(
            [side * x + wide * np.cos(turn), y + high * np.sin(turn), z - side * 0.35 * wide * np.cos(turn)]
        )
        return view.camera.project(_points(pose, local))

    lash = [(side * 0.022, 0.006, 0.116), (side * 0.044, 0.018, 0.110), (side * 0.066, 0.004, 0.096)]
    brow = [(side * 0.020, 0.036, 0.117), (side * 0.046, 0.046, 0.109), (side * 0.070, 0.036, 0.093)]
    lines = [smooth(view.camera.project(_points(pose, local))) for local in (lash, brow)]
    return [
        Fill(spot(0.070, -0.040, 0.088, 0.020, 0.012), BLUSH),
        Fill(spot(0.044, -0.006, 0.108, 0.019, 0.021), WHITE),
        Fill(spot(0.043, -0.006, 0.110, 0.013, 0.019), IRIS),
        Fill(spot(0.043, -0.008, 0.111, 0.007, 0.011), INK),
        Fill(spot(0.043 - side * 0.005, 0.003, 0.112, 0.0045, 0.005), WHITE),
        Stroke(lines[0], _taper(lines[0], 0.013 * size), INK),
        Stroke(lines[1], _taper(lines[1], 0.009 * size), HAIR),
    ]


def _taper(line: Floats, width: float) -> Floats:
    return np.asarray(width * (0.35 + 0.65 * np.sin(np.linspace(0.0, np.pi, len(line)))))


def _tail(pose: Pose, view: View) -> Part:
    radii = np.interp(np.linspace(0, 1, len(pose.tail)), np.linspace(0, 1, len(_TAIL_RADII)), _TAIL_RADII)
    centers, discs = view.discs(pose.tail, radii)
    part = Part("tail", "head", view.axis(pose.tail[[0, -1]], 0.045))
    pieces = [outline(centers[i : i + 2], discs[i : i + 2]) for i in range(len(centers) - 1)]
    part.lines += [view.pen(piece, 401 + number) for number, piece in enumerate(pieces)]
    part.fills += [Fill(piece, HAIR, HAIR_LABEL) for piece in pieces]
    lock = smooth(centers[1:] + discs[1:, None] * (-0.3, 0.0))
    part.details.append(Stroke(lock, _taper(lock, 0.014 * float(view.scale(pose.at("head")))), HAIR_LIGHT))
    tie = Stroke(centers[:1], 2.1 * discs[:1], TRIM)
    part.details.append(tie)
    return part
