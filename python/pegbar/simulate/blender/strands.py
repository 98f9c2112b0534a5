"""Strands as Blender is told of them: a cloth of slivers, since Blender's hair meets nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.simulate.blender.cloth import UNIT, air_at, held
from pegbar.simulate.elements import Strands
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.strands import AIR, LOAD

Floats = NDArray[np.float64]
Arrays = dict[str, NDArray[Any]]
#: The least share by which strands grow under their load: stiffer ones end Blender's solver's patience.
LEAST_STRETCH = 1e-3
#: The angle in radians between links at which springs over two links are as stiff as the material's E I.
BENT = 0.5
#: Speed in m/s at which Blender's air, which holds in proportion to speed, holds as much as ours.
USUAL_SPEED = 2.0


def strands_entry(scene: SimulationScene, strands: Strands, name: str, substeps: int) -> tuple[dict[str, Any], Arrays]:
    """Return the settings and arrays of ``strands``: every three points in a row are a sliver, a triangle without area.

    Its long side is a spring over two links, which resists bending. Slivers have no area for wind to blow at, so wind
    comes as a pull beside gravity.
    """
    pins, places = held(scene, strands)
    launch = np.zeros(3)
    if len(places) > 1 and len(pins) and not any(pin.kind == "world" for pin in strands.pins):
        launch = (places[1] - places[0]).mean(axis=0)
    middle = places.mean(axis=1) if len(pins) else np.repeat(strands.points.mean(axis=0)[None], scene.frames, axis=0)
    ends = np.cumsum(strands.counts) - 1
    first = np.setdiff1d(np.arange(len(strands.points)), np.concatenate([ends, ends - 1]))
    single = ends[strands.counts == 2]
    arrays = {
        "start": strands.points,
        "triangles": first[:, None] + np.arange(3),
        "seams": np.stack([single - 1, single], axis=1),
        "rest": np.asarray(strands.rest),
        "pins": pins,
        "places": places,
        "launch": launch,
        "wind": pull_of(scene, strands, middle),
    }
    entry = {
        "name": name,
        "settings": strand_settings(strands, substeps, scene.frame_rate),
        "sewn": False,
        "pulls": True,
        "thickness": max(0.001, float(strands.radii.mean())),
        "friction": strands.material.friction,
        "collision_quality": 4,
        "self_collision": False,
    }
    return entry, {f"{name}_{what}": array for what, array in arrays.items()}


def strand_settings(strands: Strands, substeps: int, frame_rate: float) -> dict[str, float | int]:
    """Return Blender's cloth settings for strands: all points have the mean mass, all links the mean stiffness."""
    material, mass = strands.material, point_mass(strands)
    link = float(strands.link_lengths[strands.links[:, 0]].mean())
    rest, ends = np.asarray(strands.rest), np.cumsum(strands.counts) - 1
    first = np.setdiff1d(np.arange(len(rest)), np.concatenate([ends, ends - 1]))
    springs = np.concatenate([strands.links, np.stack([first, first + 2], axis=1)])
    length = float(np.linalg.norm(rest[springs[:, 0]] - rest[springs[:, 1]], axis=1).mean())
    # Blender divides by the mean length of all springs.
    spring = UNIT**2 * LOAD / max(material.stretch, LEAST_STRETCH) / link
    # Two links at an angle t shorten the spring over them by l t^2 / 4; its energy at BENT is that of E I t^2 / (2 l).
    bend = min(UNIT**2 * 16 * material.bend / (link**3 * BENT**2), spring)
    damping = 0.05 * float(np.sqrt(spring * mass))
    rate = drag_rate(strands) * USUAL_SPEED + material.damping
    return {
        "quality": substeps,
        "mass": mass,
        "tension_stiffness": spring * length,
        "compression_stiffness": bend * length,
        "shear_stiffness": 0.0,
        "tension_damping": damping,
        "compression_damping": damping * float(np.sqrt(bend / spring)),
        "shear_damping": 0.0,
        "bending_stiffness": 0.0,
        "bending_damping": 0.0,
        "air_damping": 100 * UNIT * mass * rate,
        "time_scale": round(1024 / frame_rate / UNIT) / 1024,
        "pin_stiffness": 1.0,
    }


def point_mass(strands: Strands) -> float:
    """The mean mass of a point in kg."""
    volumes = np.pi * strands.radii[strands.strand_of] ** 2 * strands.link_lengths
    return float(volumes.sum() * strands.material.density / len(strands.points))


def drag_rate(strands: Strands) -> float:
    """What air takes of the speed in a second and at a metre a second, across the strands."""
    sides = float((2 * strands.radii[strands.strand_of] * strands.link_lengths).sum()) / len(strands.points)
    return AIR / 2 * strands.material.drag * sides / point_mass(strands)


def pull_of(scene: SimulationScene, strands: Strands, middle: Floats) -> Floats:
    """Gravity and the wind's push at ``middle`` (F, 3) by frame (T, 3) in m/s^2, pre-roll included."""
    numbers = np.arange(-scene.pre_roll.frames, scene.frames)
    air = air_at(scene, middle[np.maximum(numbers, 0)], numbers[:, None] / scene.frame_rate)
    speed = np.linalg.norm(air, axis=1, keepdims=True)
    pull: Floats = np.array(scene.gravity) + air * speed * drag_rate(strands)
    return pull
