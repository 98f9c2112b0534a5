"""What the 3D engine adds to the sample: a hoop that rises and tips around the dancer, a ribbon from her left hand."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from pegbar.sample.clearance import capsules, distance
from pegbar.sample.dancer import FRAMES, pose, run
from pegbar.sample.figure import Pose
from pegbar.sample.skeleton import NAMES, Floats, unit
from pegbar.scene.mesh import Mesh

HOOP_RADIUS, HOOP_TUBE = 0.64, 0.019
RIBBON_LENGTH, RIBBON_WIDTH = 2.3, 0.062
RIBBON_CLEARANCE = 0.05
"""How far the middle of the ribbon keeps from the body, beyond the part that lies at the hand."""
AT_HAND = 0.2
"""Length of ribbon at the hand that holds it, free of the clearance."""

# Every second frame: height above the floor, and how much the ring rises per metre to the left and to the front.
# Chosen by search for the widest clearance from the body over the whole dance.
_HOOP = (
    (0.51, 0.20, -0.07),
    (0.55, 0.21, -0.07),
    (0.65, 0.20, -0.08),
    (0.80, 0.16, -0.09),
    (0.96, 0.13, -0.12),
    (1.11, 0.11, -0.16),
    (1.15, 0.06, -0.20),
    (1.08, -0.01, -0.21),
    (0.95, -0.08, -0.21),
    (0.81, -0.14, -0.20),
    (0.70, -0.19, -0.17),
    (0.63, -0.21, -0.13),
    (0.60, -0.23, -0.08),
    (0.60, -0.23, -0.03),
    (0.63, -0.23, 0.02),
    (0.68, -0.23, 0.06),
    (0.75, -0.23, 0.09),
    (0.83, -0.23, 0.10),
    (0.93, -0.24, 0.09),
    (1.04, -0.25, 0.04),
    (1.11, -0.24, -0.03),
    (1.05, -0.18, -0.08),
    (0.76, -0.01, -0.10),
    (0.57, 0.13, -0.09),
)
_GOLD, _AMBER = (1.0, 0.62, 0.06, 1.0), (0.95, 0.30, 0.03, 1.0)
_TEAL, _MINT = (0.0, 0.30, 0.36, 1.0), (0.22, 0.72, 0.60, 1.0)


def hoop_ring(time: float, turn: Floats) -> Floats:
    """Points (n, 3) of the hoop's centre line at angles ``turn`` (n,), ``time`` in frames of the loop."""
    height, left, front = run(_HOOP, np.array([time]))[0]
    pelvis = pose(np.array([time]), 1.0)[0][0, 0]
    side = unit(np.array([1.0, left, 0.0]))
    ahead = np.array([0.0, front, 1.0])
    ahead = unit(ahead - (ahead @ side) * side)
    centre = np.array([0.8 * pelvis[0], height, pelvis[2]])
    return np.asarray(centre + HOOP_RADIUS * (np.outer(np.sin(turn), side) + np.outer(np.cos(turn), ahead)))


def hoop(time: float) -> Mesh:
    """The hoop: a torus with two colours in turn, so that its spin is seen."""
    around, across = 144, 12
    turn = np.linspace(0, 2 * np.pi, around, endpoint=False)
    line = hoop_ring(time, turn)
    centre = line.mean(axis=0)
    outward = unit(line - centre)
    up = unit(np.cross(line[around // 4] - centre, line[0] - centre))
    bend = np.linspace(0, 2 * np.pi, across, endpoint=False)
    normals = np.cos(bend)[:, None] * outward[:, None] + np.sin(bend)[:, None] * -up
    # Stripes of an eighth of the ring: over the loop it spins by one pair of stripes, so the loop closes.
    spin = (turn / (2 * np.pi) * 8 + 2 * time / FRAMES) % 2 < 1
    colors = np.repeat(np.where(spin[:, None], _GOLD, _AMBER), across, axis=0)
    vertices = line[:, None] + HOOP_TUBE * normals
    return Mesh(vertices.reshape(-1, 3), _tube(around, across), colors, 1, normals.reshape(-1, 3))


def _tube(around: int, across: int) -> np.ndarray:
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    a, b = i * across + j, (i + 1) % around * across + j
    c, d = (i + 1) % around * across + (j + 1) % across, i * across + (j + 1) % across
    return np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])


def ribbon_line(time: float, tail: Floats, points: int = 96) -> Floats:
    """The ribbon's middle (n, 3) from the hand to its end, ``time`` in frames of the loop.

    It lies where the hand has been, waves, sinks and is pushed off the body; ``tail`` (m, 3) is the pony tail then.
    """
    age = np.arange(0, 40, 0.25)
    positions, rotations = pose(time - age, 1.0)
    finger = NAMES.index("left_finger")
    trail = positions[:, finger] + rotations[:, finger, :, 0] * 0.03
    trail[:, 1] -= 0.0045 * age
    trail[:, [0, 2]] *= (1 + 0.008 * age)[:, None]
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(trail, axis=0), axis=1))])
    wanted = np.linspace(0, RIBBON_LENGTH, points)
    line = CubicSpline(at, trail)(wanted)
    along = unit(np.gradient(line, axis=0))
    sideways = unit(np.cross(along, (0.3, 0.2, 1.0)))
    swell = 0.06 * np.clip(wanted / 0.8, 0, 1)
    line += (swell * np.sin(2 * np.pi * (wanted / 0.55 - time / 12)))[:, None] * sideways
    return _push_off(line, Pose(positions[0], rotations[0], tail), wanted)


def _push_off(line: Floats, body: Pose, at: Floats) -> Floats:
    """Move the line out of the body and make it smooth again, in turns; the last turn only moves out."""
    limbs = capsules(body)
    free = np.clip((at - 0.05) / (AT_HAND - 0.05), 0, 1)
    held = line[0].copy()
    for _ in range(24):
        line[1:-1] += 0.25 * (line[:-2] - 2 * line[1:-1] + line[2:])
        gap, away = distance(line, limbs)
        line += (np.clip(RIBBON_CLEARANCE + 0.02 - gap, 0, None) * free)[:, None] * away
        line[0] = held
    line[:, 1] = np.maximum(line[:, 1], RIBBON_WIDTH / 2)
    return line


def ribbon(time: float, tail: Floats) -> Mesh:
    """The ribbon: a strip that twists, teal on one side and mint on the other, narrow at its end."""
    line = ribbon_line(time, tail)
    along = unit(np.gradient(line, axis=0))
    across = _carried(along)
    at = np.linspace(0, 1, len(line))
    twist = 2 * np.pi * (1.25 * at - time / FRAMES)
    flat = np.cos(twist)[:, None] * across + np.sin(twist)[:, None] * np.cross(along, across)
    face = np.cross(along, flat)
    half = 0.5 * RIBBON_WIDTH * np.minimum(np.clip(at / 0.06, 0.3, 1), np.clip((1 - at) / 0.12, 0.05, 1))
    sheets = []
    for lift in (0.001, -0.001):
        edges = (line + lift * face)[:, None] + np.array([-1, 1])[:, None] * (half[:, None] * flat)[:, None]
        sheets.append(edges.reshape(-1, 3))
    count = 2 * len(line)
    start = np.arange(0, count - 2, 2)[:, None]
    strip = np.concatenate([start + np.array(corners) for corners in ((0, 1, 3), (0, 3, 2))])
    colors = np.concatenate([np.tile(color, (count, 1)) for color in (_TEAL, _MINT)])
    normals = np.concatenate([np.repeat(side * face, 2, axis=0) for side in (1, -1)])
    return Mesh(np.concatenate(sheets), np.concatenate([strip, strip + count]), colors, 2, normals)


def _carried(along: Floats) -> Floats:
    """Unit vectors across the line, carried along it without twist from its beginning."""
    out = np.empty_like(along)
    vector = np.cross(along[0], (0.0, 1.0, 0.2))
    for index, direction in enumerate(along):
        vector = unit(vector - (vector @ direction) * direction)
        out[index] = vector
    return out
