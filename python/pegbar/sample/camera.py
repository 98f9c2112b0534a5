"""The sample shot's camera: a slow orbit with a dolly and a drift, back where it began when the dance loops."""

from __future__ import annotations

import math

import numpy as np

from pegbar.scene.camera import PerspectiveCamera

FIELD_OF_VIEW = math.radians(40)


def camera(phase: float, size: tuple[int, int]) -> PerspectiveCamera:
    """Return the camera at ``phase`` of the loop (0 to 1 and around again) for pictures of ``size`` (width, height)."""
    turn = 2 * math.pi * phase
    azimuth = math.radians(7 * math.sin(turn) + 4)
    distance = 5.35 - 0.25 * math.cos(turn)
    target = np.array([0.05 * math.sin(turn + 0.6), 0.94 + 0.015 * math.cos(turn), 0.0])
    height = 1.15 + 0.12 * math.sin(turn + 1.0)
    position = [distance * math.sin(azimuth), height, distance * math.cos(azimuth)]
    return PerspectiveCamera.look_at(position, target, size, FIELD_OF_VIEW)
