"""Strands as Blender is told of them: a cloth of slivers, since Blender's hair meets nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.simulate.blender.bobs import Balls, blow_of, bob_drag, bob_mass, bob_settings, string_drag, string_mass
from pegbar.simulate.blender.cloth import UNIT, air_at, held
from pegbar.simulate.elements import Strands
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.strands import LOAD

Floats = NDArray[np.float64]
Arrays = dict[str, NDArray[Any]]
#: The least share by which strands grow under ``LOAD``, and under so many times their own weight: what is stiffer is
#: not solved within the steps that Blender's solver takes, and then lags behind.
LEAST_STRETCH, LEAST_GROWTH, WEIGHTS = 1e-3, 2e-3, 5.0
#: The angle in radians between links at which springs over two links are as stiff as the material's E I.
BENT = 0.5
#: Speed in m/s at which Blender's air, which holds in proportion to speed, holds as much as ours.
USUAL_SPEED = 2.0


def strands_entry(scene: SimulationScene, strands: Strands, name: str, substeps: int) -> tuple[dict[str, Any], Arrays]:
    """Return the settings and arrays of ``strands``: every three points in a row are a sliver, a triangle without area.

    Its long side is a spring over two links, which resists bending. Slivers have no area for wind to blow at, so wind
    comes as a pull beside gravity. Bobs are balls after the points, and wind blows at them.
    """
    pins, places = held(scene, strands)
    launch = np.zeros(3)
    if len(places) > 1 and len(pins) and not any(pin.kind == "world" for pin in strands.pins):
        launch = (places[1] - places[0]).mean(axis=0)
    middle = places.mean(axis=1) if len(pins) else np.repeat(strands.points.mean(axis=0)[None], scene.frames, axis=0)
    web = Web(strands)
    arrays = {
        "start": web.around(strands.points),
        "triangles": web.triangles,
        "seams": web.seams,
        "rest": web.around(np.asarray(strands.rest)),
        "stiff": np.empty(0, np.int64) if web.balls is None else web.balls.stiff,
        "pins": pins,
        "places": places,
        "launch": launch,
        "wind": pull_of(scene, strands, middle) if web.balls is None else blow_of(scene, strands, web.balls, middle),
    }
    entry = {
        "name": name,
        "points": len(strands.points),
        "settings": strand_settings(strands, web, substeps, scene.frame_rate),
        "sewn": False,
        "pulls": web.balls is None,
        "thickness": max(0.001, float(strands.radii.mean())),
        "friction": strands.material.friction,
        "collision_quality": 2 if web.balls is None else 4,
        # Strings do not meet each other, bobs do.
        "self_collision": web.balls is not None and len(strands.counts) > 1,
    }
    return entry, {f"{name}_{what}": array for what, array in arrays.items()}


class Web:
    """What Blender's cloth is made of for ``strands``: triangles (n, 3), loose edges ``seams`` (m, 2), and balls."""

    def __init__(self, strands: Strands) -> None:
        self.balls = None if strands.bobs is None else Balls(strands)
        # Strings end at their knots, about which bobs turn freely.
        counts = strands.counts - (self.balls is not None)
        begins = np.cumsum(strands.counts) - strands.counts
        first = np.concatenate([begin + np.arange(count - 2) for begin, count in zip(begins, counts, strict=True)])
        single = begins[counts == 2]
        self.triangles = first.astype(np.int64)[:, None] + np.arange(3)
        self.seams = np.stack([single, single + 1], axis=1)
        if self.balls is not None:
            self.triangles = np.concatenate([self.triangles, self.balls.triangles])
            self.seams = np.concatenate([self.seams, self.balls.ties])

    def around(self, points: Floats) -> Floats:
        """The strands' ``points`` (n, 3) and after them those of the balls."""
        return points if self.balls is None else self.balls.around(points)

    def springs(self) -> NDArray[np.int64]:
        """Blender's springs (n, 2): the sides of triangles, and loose edges."""
        sides = np.stack([self.triangles, np.roll(self.triangles, -1, axis=1)], axis=2).reshape(-1, 2)
        return np.unique(np.sort(np.concatenate([sides, self.seams]), axis=1), axis=0)


def strand_settings(strands: Strands, web: Web, substeps: int, frame_rate: float) -> dict[str, float | int]:
    """Return Blender's cloth settings for strands: all points have the mean mass, all links the mean stiffness."""
    material, mass = strands.material, point_mass(strands, web)
    link = float(strands.link_lengths[strands.links[:, 0]].mean())
    rest, springs = web.around(np.asarray(strands.rest)), web.springs()
    length = float(np.linalg.norm(rest[springs[:, 0]] - rest[springs[:, 1]], axis=1).mean())
    # Blender divides by the mean length of all springs.
    spring = UNIT**2 * pull_of_growth(strands) / link
    # Two links at an angle t shorten the spring over them by l t^2 / 4; its energy at BENT is that of E I t^2 / (2 l).
    bend = min(UNIT**2 * 16 * material.bend / (link**3 * BENT**2), spring)
    damping = 0.05 * float(np.sqrt(spring * mass))
    rate = drag_rate(strands) * USUAL_SPEED + material.damping
    settings: dict[str, float | int] = {
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
    return settings if web.balls is None else settings | bob_settings(strands, web.balls, spring * length)


def pull_of_growth(strands: Strands) -> float:
    """The newtons that a link's stiffness is measured by: what pulls one to twice its length, were it to hold."""
    weight = 9.81 * total_mass(strands) / len(strands.counts)
    return min(LOAD / max(strands.material.stretch, LEAST_STRETCH), WEIGHTS * weight / LEAST_GROWTH)


def point_mass(strands: Strands, web: Web) -> float:
    """The mean mass in kg of a point, bobs' balls among them."""
    return total_mass(strands) / (len(strands.points) if web.balls is None else len(strands.points) + web.balls.count)


def total_mass(strands: Strands) -> float:
    """The mass of all in kg, with the air that bobs take along."""
    return string_mass(strands) + (0.0 if strands.bobs is None else len(strands.counts) * bob_mass(strands))


def drag_rate(strands: Strands) -> float:
    """What air takes of the speed in a second and at a metre a second, across the strands."""
    return (string_drag(strands) + (0.0 if strands.bobs is None else bob_drag(strands))) / total_mass(strands)


def pull_of(scene: SimulationScene, strands: Strands, middle: Floats) -> Floats:
    """Gravity and the wind's push at ``middle`` (F, 3) by frame (T, 3) in m/s^2, pre-roll included."""
    numbers = np.arange(-scene.pre_roll.frames, scene.frames)
    air = air_at(scene, middle[np.maximum(numbers, 0)], numbers[:, None] / scene.frame_rate)
    speed = np.linalg.norm(air, axis=1, keepdims=True)
    pull: Floats = np.array(scene.gravity) + air * speed * drag_rate(strands)
    return pull
