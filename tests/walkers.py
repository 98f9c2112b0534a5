"""A simple moving figure for tests of simulations: ten limbs, walking, squashing, swinging its arms."""

from __future__ import annotations

import numpy as np

from pegbar.scene.body import LIMBS, MARKERS
from pegbar.scene.volumes import TaperedCylinders
from pegbar.simulate.scene import Character

RADII = {"torso": (0.13, 0.13), "head": (0.06, 0.11), "upper_arm": (0.05, 0.04), "forearm": (0.04, 0.03)}
RADII |= {"thigh": (0.085, 0.06), "shin": (0.055, 0.04)}


def walker(frames: int = 24, *, speed: float = 1.0, swing: float = 0.5, name: str = "walker") -> Character:
    """A figure of some 1.7 m that walks along +Z, ``speed`` in m/s at 24 frames a second."""
    time = np.arange(frames) / 24
    phase = 2 * np.pi * time
    places: dict[str, np.ndarray] = {}
    pelvis = np.stack([0 * time, 0.95 + 0.02 * np.cos(2 * phase), speed * time], axis=1)
    places["pelvis"] = pelvis
    for joint, height in (("chest", 0.25), ("neck", 0.5), ("head", 0.68)):
        places[joint] = pelvis + np.array((0, height, 0))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        leg, arm = sign * swing * np.sin(phase), -sign * swing * np.sin(phase)
        hip = pelvis + np.array((0.09 * sign, -0.03, 0))
        shoulder = pelvis + np.array((0.22 * sign, 0.46, 0))
        places[f"{side}_hip"], places[f"{side}_shoulder"] = hip, shoulder
        places[f"{side}_knee"] = hip + 0.42 * _down(leg)
        places[f"{side}_foot"] = places[f"{side}_knee"] + 0.42 * _down(0.5 * leg - 0.2)
        out = np.array([0.12 * sign, 0, 0])
        places[f"{side}_elbow"] = shoulder + out + 0.27 * _down(arm)
        places[f"{side}_hand"] = places[f"{side}_elbow"] + 0.3 * out + 0.26 * _down(arm + 0.3)
    markers = np.stack([places[name] for name in MARKERS], axis=1)
    starts, ends = ([MARKERS.index(getattr(limb, end)) for limb in LIMBS] for end in ("start", "end"))
    radii = np.array([RADII[limb.name.removeprefix("left_").removeprefix("right_")] for limb in LIMBS])
    thick = radii[None] * (1 + 0.05 * np.sin(phase))[:, None, None]
    volumes = TaperedCylinders(markers[:, starts], markers[:, ends], thick[..., 0], thick[..., 1])
    limbs = tuple(limb.name for limb in LIMBS)
    return Character(name, tuple(MARKERS), markers, limbs, volumes, tuple((limb.start, limb.end) for limb in LIMBS))


def _down(angle: np.ndarray) -> np.ndarray:
    return np.stack([0 * angle, -np.cos(angle), np.sin(angle)], axis=1)
