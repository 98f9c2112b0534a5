"""A cloth as Blender is told of it: its material in Blender's terms, what holds it, and what it meets."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pegbar.simulate.cache import Cache
from pegbar.simulate.elements import Balls, Cloth, Prop
from pegbar.simulate.hulls import hull_triangles, hull_vertices, poses
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.tracks import Volumes, pin_track

Floats = NDArray[np.float64]
Arrays = dict[str, NDArray[Any]]
#: Newtons a metre of width under which a strip grows by its material's ``stretch``.
PULL = 10.0
#: Blender solves its springs to one part in a hundred of all forces: with springs as stiff as cloth's, gravity is lost
#: in that. So a spring has at most this many N/m for each kilogram of a vertex, times the sheet's length over the
#: squared length of a spring (1/m): a sheet that hangs then stretches alike however fine it is. Measured on a scarf of
#: 0.8 m: with springs 1000 times as stiff it floats, with these its edges are 0.01% too long in the middle.
STIFFEST = 33.0
#: Blender's wind pushes with 0.02 N a square metre and unit of strength (``SIM_mass_spring_force_face_wind``).
WIND_PRESSURE = 0.02
#: Half the density of air in kg/m^3: pressure is this times the squared speed.
HALF_AIR = 0.6
THINNEST = 1e-4
#: Frames before the pre-roll: ``LEAD`` in ``inside/simulate.py``.
LEAD = 3
#: Blender's bending stiffness for each kilogram of a vertex and unit of ``bend``.
BEND = 10.0


def cloth_entry(
    scene: SimulationScene, cloth: Cloth, name: str, cache: Cache, substeps: int, self_collision: bool
) -> tuple[dict[str, Any], Arrays]:
    """Return the settings and arrays of ``cloth``.

    Before the first frame everything glides along with the speed that the cloth's pins have in it, so that the cloth
    begins with this speed.
    """
    pins, places = held(scene, cloth)
    launch = np.zeros(3)
    if len(places) > 1 and len(pins) and not any(pin.kind == "world" for pin in cloth.pins):
        launch = (places[1] - places[0]).mean(axis=0)
    before = LEAD + scene.pre_roll.frames
    glide = np.minimum(np.arange(-before, scene.frames), 0)[:, None, None] * launch
    whole = np.concatenate([np.repeat(places[:1], before, axis=0), places])
    track = np.repeat(cloth.vertices[None], len(glide), axis=0)
    track[:, pins] = whole
    track += glide
    track[0] = rest_near(np.asarray(cloth.rest), track[0])
    collider, triangles = colliders(scene, cache, before)
    arrays = {
        "triangles": cloth.triangles,
        "seams": cloth.seams,
        "rest": track[0],
        "pins": pins,
        "track": track.astype(np.float32),
        "collider": (collider + glide).astype(np.float32),
        "wind": wind_of(scene, cloth, whole.mean(axis=1) if len(pins) else cloth.vertices.mean(axis=0)[None], before),
    }
    entry = {
        "name": name,
        "settings": settings_of(cloth, substeps),
        "sewn": bool(len(cloth.seams)),
        "thickness": max(0.001, cloth.material.thickness),
        "friction": cloth.material.friction,
        "collision_quality": 4,
        "self_collision": self_collision,
    }
    return entry, {f"{name}_{what}": array for what, array in arrays.items()} | {"collider_triangles": triangles}


def settings_of(cloth: Cloth, substeps: int) -> dict[str, float | int]:
    """Return Blender's cloth settings for a material.

    Blender's springs are as stiff as ``tension_stiffness`` over the mean length of all, and its masses are those of
    vertices.
    """
    rest, material = np.asarray(cloth.rest), cloth.material
    sides = rest[cloth.triangles]
    area = float(np.linalg.norm(np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0]), axis=1).sum() / 2)
    length = float(np.linalg.norm(sides - np.roll(sides, 1, axis=1), axis=2).mean())
    mass = material.density * area / max(len(rest), 1)
    reach = float(np.ptp(rest, axis=0).max(initial=0.0))
    spring = min(PULL / max(material.stretch, 1e-9), STIFFEST * mass * reach / length**2)
    stiffness = spring * length
    damping = 0.2 * float(np.sqrt(spring * mass))
    # Air holds a vertex's share of the cloth, taken at the speed of 1 m/s and a quarter of it facing the way.
    held = HALF_AIR * material.drag * area / max(len(rest), 1) / 4 + material.damping * mass
    return {
        "quality": substeps,
        "mass": mass,
        "tension_stiffness": stiffness,
        "compression_stiffness": stiffness,
        "shear_stiffness": stiffness,
        "tension_damping": damping,
        "compression_damping": damping,
        "shear_damping": damping,
        "bending_stiffness": BEND * material.bend * mass,
        "bending_damping": 0.0,
        "air_damping": 100 * held,
        "pin_stiffness": 1.0,
    }


def held(scene: SimulationScene, cloth: Cloth) -> tuple[NDArray[np.int64], Floats]:
    """The pinned vertices (P,) and their places (F, P, 3); a vertex of several pins follows the last."""
    found: dict[int, Floats] = {}
    for pin in cloth.pins:
        vertices = np.arange(len(cloth.vertices)) if pin.vertices is None else pin.vertices
        track = pin_track(scene, pin, cloth.vertices[vertices])
        found |= {int(vertex): track[:, index] for index, vertex in enumerate(vertices)}
    if not found:
        return np.empty(0, np.int64), np.empty((scene.frames, 0, 3))
    order = sorted(found)
    return np.array(order), np.stack([found[vertex] for vertex in order], axis=1)


def rest_near(rest: Floats, start: Floats) -> Floats:
    """Return the ``rest`` shape (n, 3) turned and moved to lie as near to ``start`` (n, 3) as it can."""
    turn, _ = Rotation.align_vectors(start - start.mean(axis=0), rest - rest.mean(axis=0))
    placed: Floats = turn.apply(rest - rest.mean(axis=0)) + start.mean(axis=0)
    return placed


def colliders(scene: SimulationScene, cache: Cache, before: int) -> tuple[Floats, NDArray[np.int64]]:
    """Limbs, props and balls as hulls: vertices (T, C * n, 3) from ``before`` frames on, and triangles."""
    times = np.arange(-before, scene.frames, dtype=float)
    rows = [Volumes(scene, [element for element in scene.elements if isinstance(element, Prop)]).at(times)]
    for balls in (element for element in scene.elements if isinstance(element, Balls)):
        known = cache.frames(balls.name)
        states = [cache.read(balls.name, min(frame, known[-1]))["positions"] for frame in range(scene.frames) if known]
        places = np.array(states or [balls.centers] * scene.frames, float)
        places = np.concatenate([np.repeat(places[:1], before, axis=0), places])
        radii = np.broadcast_to(balls.radii[:, None], (*places.shape[:2], 1))
        rows.append(np.concatenate([places, radii, places, radii], axis=2))
    every = np.concatenate(rows, axis=1)
    lengths = np.linalg.norm(every[..., 4:7] - every[..., :3], axis=2)
    hulls = hull_vertices(lengths, np.maximum(every[..., 3], THINNEST), np.maximum(every[..., 7], THINNEST))
    count, corners = every.shape[1], hulls.shape[2]
    for frame, row in enumerate(every):
        middles, turns = poses(row)
        if count:
            matrices = Rotation.from_quat(turns).as_matrix()
            hulls[frame] = np.einsum("cij,cnj->cni", matrices, hulls[frame]) + middles[:, None]
    offsets = (np.arange(count) * corners)[:, None, None]
    triangles = (hull_triangles().astype(np.int64) + offsets).reshape(-1, 3)
    return hulls.reshape(len(times), count * corners, 3), triangles


def wind_of(scene: SimulationScene, cloth: Cloth, middle: Floats, before: int) -> Floats:
    """The wind's push (T, 3) at ``middle`` (T or 1, 3) in Blender's strength; (0, 3) where no air moves."""
    if not any(scene.wind.velocity):
        return np.empty((0, 3))
    times = np.arange(-before, scene.frames) / scene.frame_rate
    air = np.tile(np.array(scene.wind.velocity), (len(times), 1))
    waves = scene.wind.waves()
    if len(waves):
        phase = middle @ waves[:, 3:6].T - times[:, None] * waves[:, 6] + waves[:, 7]
        air += np.sin(phase) @ waves[:, :3]
    speed = np.linalg.norm(air, axis=1, keepdims=True)
    push: Floats = air * speed * HALF_AIR * cloth.material.drag / WIND_PRESSURE
    return push
