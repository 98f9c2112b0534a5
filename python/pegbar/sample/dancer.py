"""The dance: a phrase of four beats that loops, as a motion capture clip and as an artist would exaggerate it.

Keys are poses, eight in a loop; periodic cubic splines run through them. Upper body and head dwell on the beats and
hurry between them, arms trail the chest, hands trail the arms. The feet are given places on the floor and the legs
reach for them, so a planted foot does not slide, stretched or not.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from pegbar.sample.skeleton import (
    FOOT,
    NAMES,
    PARENTS,
    SHIN,
    THIGH,
    Floats,
    euler,
    forward,
    reach_leg,
    swing,
    unit,
)
from pegbar.scene.motion import Motion

Keys = tuple[float, ...] | tuple[tuple[float, ...], ...]

FRAMES = 48
FRAME_RATE = 24.0
TAIL_ROOT, TAIL_JOINTS = (0.0, 0.075, -0.125), 8
"""Where the pony tail is tied, in the head's axes, and its number of points."""
BEAT = 12
STANCE = {"left": (0.17, 0.02, 0.04), "right": (-0.17, 0.02, 0.04)}
LIFTED = {"right": (4, 20), "left": (28, 44)}
"""From which to which frame of the loop each foot is in the air."""

# Eight keys, one every half beat: left step, rise, right leg's lift, fall, low reach, rise, left knee's lift, fall.
_ROOT = (
    (0.02, 0.80, 0.00),
    (0.13, 0.875, 0.00),
    (0.155, 0.925, -0.01),
    (0.09, 0.87, 0.00),
    (-0.02, 0.77, 0.03),
    (-0.12, 0.86, 0.01),
    (-0.155, 0.925, -0.02),
    (-0.08, 0.87, -0.01),
)
_PELVIS = ((0, 6, 4), (12, 2, 1), (22, -2, -5), (8, 3, 0), (-8, 9, 5), (-18, 2, -1), (-26, -4, 5), (-12, 2, 0))
_CHEST = ((-6, 6, 7), (14, 2, 2), (42, -8, -10), (10, 4, 0), (-30, 13, 6), (-32, 2, 0), (-50, -6, 10), (-22, -6, 2))
_HEAD = ((8, 0, -8), (8, -4, 4), (20, -10, 12), (0, 4, 2), (-2, -6, 8), (-10, 2, 0), (-22, -12, -12), (-4, -2, -4))
# Directions of upper arm and forearm in the chest's axes, x outward on either side.
_ARMS = {
    "left": [
        ((0.70, 0.70, 0.10), (0.30, 0.95, 0.10)),
        ((0.95, 0.10, 0.25), (0.85, 0.35, 0.45)),
        ((0.65, -0.62, -0.50), (-0.05, -0.80, -0.62)),
        ((0.70, -0.70, 0.10), (0.60, -0.40, 0.60)),
        ((0.62, 0.12, 0.85), (0.50, 0.42, 0.85)),
        ((0.75, 0.05, 0.65), (0.65, 0.30, 0.70)),
        ((0.30, -0.55, 0.80), (-0.80, -0.05, 0.55)),
        ((0.85, -0.30, 0.55), (0.85, 0.05, 0.60)),
    ],
    "right": [
        ((0.90, -0.40, 0.10), (0.95, -0.15, 0.25)),
        ((0.75, -0.20, 0.60), (0.35, 0.05, 0.90)),
        ((0.35, -0.55, 0.75), (-0.75, 0.10, 0.60)),
        ((0.90, -0.20, 0.45), (0.80, 0.30, 0.60)),
        ((0.75, 0.65, -0.15), (0.45, 0.90, -0.05)),
        ((1.00, 0.10, -0.15), (0.95, 0.25, 0.00)),
        ((0.60, -0.60, -0.55), (-0.10, -0.75, -0.65)),
        ((0.80, -0.60, 0.10), (0.75, -0.50, 0.40)),
    ],
}
# Ball of the foot in the air, relative to its place on the floor, and the foot's pitch: (frame, x, y, z, degrees).
_LIFTS = {
    "right": [(4, 0, 0, 0, 18), (8, -0.06, 0.20, -0.02, 50), (12, -0.30, 0.50, 0.20, 62), (16, -0.16, 0.30, 0.16, 45)],
    "left": [(28, 0, 0, 0, 18), (32, -0.06, 0.18, -0.06, 55), (36, -0.12, 0.40, 0.12, 60), (40, 0.04, 0.20, 0.14, 38)],
}
_HEELS = {
    "right": [(20, 0), (24, 0), (28, 2), (36, 24), (41, 4), (44, 0), (48, 0), (52, 18)],
    "left": [(44, 0), (48, 0), (52, 2), (60, 24), (65, 4), (68, 0), (72, 0), (76, 18)],
}
_KNEES = {"right": (-0.62, 0.1, 0.80), "left": (0.40, 0.0, 0.92)}
_TURNOUT = {"right": -24.0, "left": 24.0}
# How much longer than in the clip the artist draws bones, by key.
_STRETCH = {
    "torso": (-0.07, 0.02, 0.10, 0.02, -0.09, 0.03, 0.10, 0.02),
    "leg": (-0.06, 0.00, 0.06, 0.02, -0.08, 0.00, 0.06, 0.02),
    "left": (0.10, 0.05, -0.05, 0.00, 0.12, 0.05, -0.06, 0.05),
    "right": (0.08, 0.00, -0.06, 0.05, 0.10, 0.08, -0.05, 0.00),
}


class Dance(NamedTuple):
    """The clip and what the artist made of it; both have the joints of `skeleton.NAMES` and the same frames."""

    clip: Motion
    drawn: NDArray[np.float64]
    tails: NDArray[np.float64]


def dance(frames: int = FRAMES) -> Dance:
    """Return the phrase in ``frames`` frames at 24 a second; frame ``frames + 1`` would be the first one again.

    ``Dance.clip`` has bones of constant length, metres, Y up, the floor at 0; ``Dance.drawn`` (F, N, 3) are the
    markers with squash and stretch: the same phrase with limbs and torso up to 12% longer or shorter on the accents;
    ``Dance.tails`` (F, n, 3) are the points of the drawn pony tail.
    """
    if frames < 1:
        raise ValueError(f"frames: want at least 1, got {frames}")
    times = np.asarray(np.arange(frames) * (FRAMES / frames), np.float64)
    positions, rotations = pose(times)
    clip = Motion(NAMES, PARENTS, positions, rotations, FRAME_RATE)
    return Dance(clip, pose(times, stretch=1.0)[0], pony_tail(times))


def pose(times: Floats, stretch: float = 0.0) -> tuple[Floats, Floats]:
    """Return positions (F, J, 3) and world rotations (F, J, 3, 3) at ``times`` (F,) in frames of the 48-frame loop.

    ``stretch`` is how much of the artist's squash and stretch is put on: 0 for the clip, 1 for the drawings.
    """
    scales = {part: 1 + stretch * run(keys, _dwell(times)) for part, keys in _STRETCH.items()}
    rotations = _trunk(times)
    for side in ("left", "right"):
        rotations |= _arm(side, times)
    root = run(_ROOT, times)
    # Squashed legs under an unmoved pelvis would only bend further: the pelvis goes with them.
    root[:, 1] += (scales["leg"] - 1) * (root[:, 1] - 0.1)
    for side in ("left", "right"):
        rotations |= _leg(side, times, root, rotations["pelvis"], scales["leg"])
    return forward(root, rotations, _bones(scales))


def _bones(scales: dict[str, Floats]) -> dict[str, Floats]:
    """Scale of every bone that stretches, by the joint it ends in."""
    bones = dict.fromkeys(("chest", "neck"), scales["torso"])
    for side in ("left", "right"):
        # The shoulders stay on the stretched torso: chest to shoulder is mostly upwards.
        bones |= {f"{side}_{name}": scales["leg"] for name in ("knee", "foot")}
        bones |= {f"{side}_{name}": scales[side] for name in ("elbow", "hand")}
        bones[f"{side}_shoulder"] = scales["torso"]
    return bones


def run(keys: Keys, times: Floats) -> Floats:
    """The periodic spline through ``keys`` spread evenly over the loop, at ``times`` in frames."""
    return np.asarray(_spline(keys)(np.mod(times, FRAMES)), np.float64)


@cache
def _spline(keys: Keys) -> CubicSpline:
    values = np.array([*keys, keys[0]], float)
    return CubicSpline(np.linspace(0, FRAMES, len(values)), values, bc_type="periodic")


def _dwell(times: Floats, late: float = 0.0) -> Floats:
    """Times that go slowly around each beat and fast between, ``late`` frames behind."""
    turn = 2 * np.pi / BEAT
    return times - late - 0.4 / turn * np.sin(turn * (times - late))


def _trunk(times: Floats) -> dict[str, Floats]:
    pelvis, chest, head = (
        euler(*run(keys, _dwell(times, late)).T) for keys, late in ((_PELVIS, 0.0), (_CHEST, 0.6), (_HEAD, 1.2))
    )
    return {"pelvis": pelvis, "chest": chest, "neck": _halfway(chest, head), "head": head}


def _halfway(first: Floats, second: Floats) -> Floats:
    """The rotation halfway between two that are not opposite: the nearest rotation to their mean."""
    left, _, right = np.linalg.svd(first + second)
    middle: Floats = left @ right
    return middle


def _arm(side: str, times: Floats) -> dict[str, Floats]:
    mirror = np.array([1.0 if side == "left" else -1.0, 1.0, 1.0])
    rest = mirror * (1.0, 0.0, 0.0)
    directions = []
    for bone, late in ((0, 1.0), (1, 1.8), (1, 3.6)):
        keys = tuple(key[bone] for key in _ARMS[side])
        chest = euler(*run(_CHEST, _dwell(times, late)).T)
        directions.append((chest @ (unit(run(keys, _dwell(times, late))) * mirror)[..., None])[..., 0])
    upper = _carry(euler(*run(_CHEST, _dwell(times, 0.6)).T), rest, directions[0])
    fore = _carry(upper, rest, directions[1])
    # The wrist gives way by part of the trail only.
    fingers = unit(directions[1] + 0.8 * directions[2])
    joints = (f"{side}_shoulder", f"{side}_elbow", f"{side}_hand")
    return dict(zip(joints, (upper, fore, _carry(fore, rest, fingers)), strict=True))


def _carry(parent: Floats, rest: Floats, directions: Floats) -> Floats:
    """World rotation of a bone that swings, without twist against its parent, onto ``directions``."""
    local = np.swapaxes(parent, -1, -2) @ directions[..., None]
    rotation: Floats = parent @ swing(rest, local[..., 0])
    return rotation


def _leg(side: str, times: Floats, root: Floats, pelvis: Floats, scale: Floats) -> dict[str, Floats]:
    ball, pitch = _foot(side, times)
    outward = np.full(len(times), _TURNOUT[side])
    foot = euler(outward, pitch, np.zeros(len(times)))
    ankle = ball - foot @ FOOT
    hip = root + pelvis @ np.array([0.09 if side == "left" else -0.09, -0.04, 0.0])
    knee = np.broadcast_to(np.array(_KNEES[side]), hip.shape)
    thigh, shin = reach_leg(hip, ankle, knee, THIGH * scale, SHIN * scale)
    return {f"{side}_hip": thigh, f"{side}_knee": shin, f"{side}_foot": foot}


@cache
def _steps(side: str) -> tuple[CubicSpline, CubicSpline]:
    """Place and pitch of a foot in the air, and its pitch on the floor, over the frames."""
    lifts = np.array([*_LIFTS[side], (LIFTED[side][1], 0, 0, 0, 0)], float)
    heels = np.array(_HEELS[side], float)
    path = CubicSpline(lifts[:, 0], lifts[:, 1:], bc_type="clamped")
    return path, CubicSpline(heels[:, 0], heels[:, 1], bc_type="clamped")


def _foot(side: str, times: Floats) -> tuple[Floats, Floats]:
    """Place of the ball of the foot (F, 3) and pitch of the foot (F,) in degrees, toes down positive."""
    start, end = LIFTED[side]
    path, heel = _steps(side)
    phase = np.mod(times - start, FRAMES) + start
    airborne = phase < end
    # The heel's keys start at landing and end at take-off; no step in pitch or its slope at either.
    travel = np.where(airborne[:, None], path(np.where(airborne, phase, start)), 0.0)
    grounded = np.where(airborne, end, phase)
    pitch = np.where(airborne, travel[:, 3], heel(grounded))
    return np.asarray(STANCE[side] + travel[:, :3]), pitch


def pony_tail(times: Floats) -> Floats:
    """Points (F, n, 3) of the hair that trails the drawn head: each hangs from where its root was a little before."""
    chain = np.empty((len(times), TAIL_JOINTS, 3))
    root = np.array(TAIL_ROOT)
    for number in range(TAIL_JOINTS):
        places, frames = pose(times - 1.1 * number, 1.0)
        frame = frames[:, NAMES.index("head")]
        anchor = places[:, NAMES.index("head")] + frame @ root
        if number == 0:
            now = chain[:, 0] = anchor
            continue
        fall = -1.15 * 0.8**number * frame[..., 2] - [0.0, 0.3 + 0.22 * number, 0.0] + 2.4 * (anchor - now)
        chain[:, number] = chain[:, number - 1] + 0.055 * unit(fall)
    return chain
