"""A cloth as Blender is told of it: its material in Blender's terms, what holds it, and what it meets."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pegbar.simulate.cache import Cache
from pegbar.simulate.elements import Balls, Boxes, Cloth, Prop, Strands
from pegbar.simulate.hulls import hull_triangles, hull_vertices, poses
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.tracks import Volumes, pin_track

Floats = NDArray[np.float64]
Arrays = dict[str, NDArray[Any]]
#: Newtons a metre of width under which a strip grows by its material's ``stretch``.
PULL = 10.0
#: Blender's cloth counts time in units of its own, so many seconds whatever the frame rate: it takes gravity times
#: 0.001 (measured in free fall). Forces are times 0.001 for the same reason.
UNIT = 0.001**0.5
#: Blender's wind pushes with 0.02 of its units a square metre and strength, over the frames a second (measured).
WIND_PRESSURE = 0.02
#: Half the density of air in kg/m^3: pressure is this times the squared speed.
HALF_AIR = 0.6
THINNEST = 1e-4
#: Pushed together, cloth folds: as stiff as against a pull, what begins gathered would leap apart.
BUCKLING = 0.005
#: Blender's bending stiffness for each kilogram of a vertex and unit of ``bend``.
BEND = 10.0


def cloth_entry(
    scene: SimulationScene, cloth: Cloth, name: str, substeps: int, self_collision: bool
) -> tuple[dict[str, Any], Arrays]:
    """Return the settings and arrays of ``cloth``; its speed in the first frame is that of its pins."""
    pins, places = held(scene, cloth)
    launch = np.zeros(3)
    if len(places) > 1 and len(pins) and not any(pin.kind == "world" for pin in cloth.pins):
        launch = (places[1] - places[0]).mean(axis=0)
    middle = places.mean(axis=1) if len(pins) else np.repeat(cloth.vertices.mean(axis=0)[None], scene.frames, axis=0)
    arrays = {
        "start": cloth.vertices,
        "triangles": cloth.triangles,
        "seams": cloth.seams,
        "rest": np.asarray(cloth.rest),
        "stiff": np.empty(0, np.int64),
        "pins": pins,
        "places": places,
        "launch": launch,
        "wind": wind_of(scene, cloth, middle),
    }
    entry = {
        "name": name,
        "points": len(cloth.vertices),
        "settings": settings_of(cloth, substeps, scene.frame_rate),
        "sewn": bool(len(cloth.seams)),
        "pulls": False,
        "thickness": max(0.001, cloth.material.thickness),
        "friction": cloth.material.friction,
        "collision_quality": 4,
        "self_collision": self_collision,
    }
    return entry, {f"{name}_{what}": array for what, array in arrays.items()}


def settings_of(cloth: Cloth, substeps: int, frame_rate: float) -> dict[str, float | int]:
    """Return Blender's cloth settings for a material.

    Blender's springs are as stiff as ``tension_stiffness`` over the mean length of all, and its masses are those of
    vertices.
    """
    rest, material = np.asarray(cloth.rest), cloth.material
    sides = rest[cloth.triangles]
    area = float(np.linalg.norm(np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0]), axis=1).sum() / 2)
    length = float(np.linalg.norm(sides - np.roll(sides, 1, axis=1), axis=2).mean())
    mass = material.density * area / max(len(rest), 1)
    spring = UNIT**2 * PULL / max(material.stretch, 1e-6)
    stiffness = spring * length
    damping = 0.2 * float(np.sqrt(spring * mass))
    # Blender's air holds in proportion to speed: that of a plate at 2 m/s, half of it facing the way.
    rate = HALF_AIR * material.drag / material.density + material.damping
    return {
        "quality": substeps,
        "mass": mass,
        "tension_stiffness": stiffness,
        "compression_stiffness": BUCKLING * stiffness,
        "shear_stiffness": stiffness,
        "tension_damping": damping,
        "compression_damping": damping,
        "shear_damping": damping,
        "bending_stiffness": BEND * material.bend * mass,
        "bending_damping": 0.0,
        "air_damping": 100 * UNIT * mass * rate,
        "time_scale": round(1024 / frame_rate / UNIT) / 1024,
        "pin_stiffness": 1.0,
    }


def held(scene: SimulationScene, cloth: Cloth | Strands) -> tuple[NDArray[np.int64], Floats]:
    """The pinned vertices (P,) and their places (F, P, 3); a vertex of several pins follows the last."""
    start = cloth.points if isinstance(cloth, Strands) else cloth.vertices
    found: dict[int, Floats] = {}
    for pin in cloth.pins:
        vertices = np.arange(len(start)) if pin.vertices is None else pin.vertices
        track = pin_track(scene, pin, start[vertices])
        found |= {int(vertex): track[:, index] for index, vertex in enumerate(vertices)}
    if not found:
        return np.empty(0, np.int64), np.empty((scene.frames, 0, 3))
    order = sorted(found)
    return np.array(order), np.stack([found[vertex] for vertex in order], axis=1)


def colliders(scene: SimulationScene, cache: Cache) -> tuple[Floats, NDArray[np.int64]]:
    """Limbs, props, balls and boxes as hulls: vertices (T, n, 3), pre-roll included, and triangles."""
    times = np.arange(-scene.pre_roll.frames, scene.frames, dtype=float)
    rows = [Volumes(scene, [element for element in scene.elements if isinstance(element, Prop)]).at(times)]
    boxes, sides = [np.empty((len(times), 0, 3))], [np.empty((0, 3), np.int64)]
    for element in scene.elements:
        if isinstance(element, Balls):
            places, _ = _bodies(element, scene, cache)
            radii = np.broadcast_to(element.radii[:, None], (*places.shape[:2], 1))
            rows.append(np.concatenate([places, radii, places, radii], axis=2))
        elif isinstance(element, Boxes):
            places, turns = _bodies(element, scene, cache)
            matrices = Rotation.from_quat(turns.reshape(-1, 4)).as_matrix().reshape(*turns.shape[:2], 3, 3)
            corners = np.einsum("tbij,bnj->tbni", matrices, element.sizes[:, None] / 2 * _CORNERS) + places[:, :, None]
            boxes.append(corners.reshape(len(times), -1, 3))
            sides.append((_SIDES + 8 * np.arange(len(element.sizes))[:, None, None]).reshape(-1, 3))
    hulls, triangles = _hulls(np.concatenate(rows, axis=1))
    parts, every = [hulls], [triangles]
    for corners, faces in zip(boxes, sides, strict=True):
        every.append(faces + sum(part.shape[1] for part in parts))
        parts.append(corners)
    return np.concatenate(parts, axis=1), np.concatenate(every)


_CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
_SIDES = np.array(
    [
        *((0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)),
        *((2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)),
    ]
)


def _bodies(bodies: Balls | Boxes, scene: SimulationScene, cache: Cache) -> tuple[Floats, Floats]:
    """Places (T, n, 3) and rotations (T, n, 4) of simulated bodies, still before the first frame."""
    count, known = len(bodies.centers), cache.frames(bodies.name)
    places = np.repeat(bodies.centers[None], scene.frames, axis=0)
    turns = np.tile([0.0, 0.0, 0.0, 1.0], (scene.frames, count, 1))
    for frame in range(scene.frames) if known else ():
        state = cache.read(bodies.name, min(frame, known[-1]))
        places[frame] = state["positions"]
        turns[frame] = state.get("rotations", turns[frame])
    still = np.concatenate([np.zeros(scene.pre_roll.frames, int), np.arange(scene.frames)])
    return places[still], turns[still]


def _hulls(rows: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Capsules (T, C, 8) as vertices (T, C n, 3) and triangles."""
    lengths = np.linalg.norm(rows[..., 4:7] - rows[..., :3], axis=2)
    hulls = hull_vertices(lengths, np.maximum(rows[..., 3], THINNEST), np.maximum(rows[..., 7], THINNEST))
    frames, count, corners = hulls.shape[:3]
    if count:
        for frame, row in enumerate(rows):
            middles, turns = poses(row)
            matrices = Rotation.from_quat(turns).as_matrix()
            hulls[frame] = np.einsum("cij,cnj->cni", matrices, hulls[frame]) + middles[:, None]
    offsets = (np.arange(count) * corners)[:, None, None]
    return hulls.reshape(frames, -1, 3), (hull_triangles().astype(np.int64) + offsets).reshape(-1, 3)


def wind_of(scene: SimulationScene, cloth: Cloth, middle: Floats) -> Floats:
    """The wind's push (T, 3) at ``middle`` (F, 3), pre-roll included, in Blender's strength; (0, 3) in still air."""
    if not any(scene.wind.velocity):
        return np.empty((0, 3))
    numbers = np.arange(-scene.pre_roll.frames, scene.frames)
    places, times = middle[np.maximum(numbers, 0)], numbers[:, None] / scene.frame_rate
    air = air_at(scene, places, times)
    speed = np.linalg.norm(air, axis=1, keepdims=True)
    force = HALF_AIR * cloth.material.drag * UNIT**2 / WIND_PRESSURE
    push: Floats = air * speed * force * scene.frame_rate
    return push


def air_at(scene: SimulationScene, places: Floats, times: Floats) -> Floats:
    """The air's velocity (T, 3) in m/s at ``places`` (T, 3) and ``times`` (T, 1) in seconds."""
    air = np.tile(np.array(scene.wind.velocity), (len(places), 1))
    waves = scene.wind.waves()
    if len(waves):
        air += np.sin(places @ waves[:, 3:6].T - times * waves[:, 6] + waves[:, 7]) @ waves[:, :3]
    return air
