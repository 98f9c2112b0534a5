"""Particles as Blender is told of them, and what it made of them as frames of the cache."""

from __future__ import annotations

import json
import math
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar import _kernels
from pegbar.errors import BlenderError
from pegbar.simulate.blender.cloth import air_at, colliders
from pegbar.simulate.blender.locate import Blender
from pegbar.simulate.blender.process import INSIDE, run_blender
from pegbar.simulate.blender.splashes import Aftermath, impacts_of
from pegbar.simulate.cache import Cache
from pegbar.simulate.elements import Cloth, Prop
from pegbar.simulate.engine import refuse_explosion
from pegbar.simulate.particles import FALLING, LONGEST_START, MARGIN, SETTLED, over_props
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.tracks import Volumes
from pegbar.simulate.weather import Particles

Floats = NDArray[np.float64]
Arrays = dict[str, NDArray[Any]]
Tell = Callable[[int, int], None]
#: What is slower along its stream than this share of it has landed.
LANDED = 0.4
#: Metres in a volume at which a particle is gone.
DEEP = 0.005
#: Where a particle is put whose place is no number: outside of every box.
AWAY = 1e6
#: Strength of Blender's turbulence that makes what falls at 1 m/s sway at 1 m/s (measured).
TURBULENCE = 3.8


def simulate_particles(
    scene: SimulationScene, elements: Sequence[Particles], cache: Cache, start: int, blender: Blender, tell: Tell
) -> None:
    """Have ``blender`` simulate ``elements``, and write the frames from ``start`` on; BlenderError where it fails."""
    raised = [over_props(scene, element) for element in elements]
    job: dict[str, Any] = {
        "frame_rate": scene.frame_rate,
        "gravity": scene.gravity,
        "ground": scene.ground,
        "particles": [],
    }
    arrays: Arrays = {}
    arrays["collider"], arrays["collider_triangles"] = met(scene, cache)
    for index, element in enumerate(raised):
        entry, more = particles_entry(scene, element, f"element_{index}")
        job["particles"].append(entry)
        arrays |= more
    with tempfile.TemporaryDirectory(prefix="pegbar-blender-") as place:
        folder = Path(place)
        (folder / "simulate.json").write_text(json.dumps(job), encoding="utf-8")
        with (folder / "simulate.npz").open("wb") as file:
            np.savez(file, **arrays)  # type: ignore[arg-type]
        outputs = [folder / f"{entry['name']}.npz" for entry in job["particles"]]
        run_blender(blender, INSIDE / "particles.py", [place], outputs=outputs, progress=tell)
        for element, entry, path in zip(raised, job["particles"], outputs, strict=True):
            store_particles(scene, element, read_particles(path, scene, element, entry), cache, start)


def met(scene: SimulationScene, cache: Cache) -> tuple[Floats, NDArray[np.int64]]:
    """What particles meet: limbs and bodies, cloth and props; vertices (F, n, 3) and triangles."""
    hulls, triangles = colliders(scene, cache)
    parts, sides = [hulls[scene.pre_roll.frames :]], [triangles]
    for element in scene.elements:
        if isinstance(element, Cloth | Prop) and len(cache.frames(element.name)) >= scene.frames:
            frames = [cache.read(element.name, frame)["positions"] for frame in range(scene.frames)]
            sides.append(np.asarray(element.triangles) + sum(part.shape[1] for part in parts))
            parts.append(np.asarray(frames, np.float64))
    return np.concatenate(parts, axis=1), np.concatenate(sides)


def particles_entry(scene: SimulationScene, element: Particles, name: str) -> tuple[dict[str, Any], Arrays]:
    """Return the settings and arrays of ``element``: where those begin that fill the air, and those that enter later.

    Blender's drag knows no wind, so gravity is what lets particles reach the speed that they have in the air's.
    """
    material, size = element.material, element.high - element.low
    stream = element.stream(np.array(scene.gravity), np.array(scene.wind.velocity))
    rates, fps = element.rates(stream), scene.frame_rate
    fastest = float(np.abs(stream / size).max())
    early = math.ceil(min(LONGEST_START / 24, 1.2 / fastest if fastest else 0.0) * fps)
    total = early + scene.frames
    rng = chance(scene, element)
    entering = rng.uniform(element.low, element.high, (round(float(rates.sum()) * total / fps), 3))
    if len(entering):
        sides = rng.choice(3, len(entering), p=rates / rates.sum())
        entering[np.arange(len(entering)), sides] = np.where(stream > 0, element.low, element.high)[sides]
    numbers = np.maximum(np.arange(-early, scene.frames), 0)
    middle = np.repeat((element.low + element.high)[None] / 2, total, axis=0)
    fall = stream - np.array(scene.wind.velocity)
    way = air_at(scene, middle, numbers[:, None] / fps) + fall
    drag = 9.81 / material.terminal_velocity**2
    arrays = {
        "filling": rng.uniform(element.low, element.high, (element.count, 3)),
        "entering": entering,
        "pull": drag * np.linalg.norm(way, axis=1, keepdims=True) * way,
    }
    entry = {
        "name": name,
        "total": total,
        "pre_roll": early,
        "frame_rate": fps,
        "substeps": 2,
        "stream": stream.tolist(),
        "mass": 1 / drag,
        "sticks": material.stick > 0,
        "flutter": TURBULENCE * material.flutter * material.terminal_velocity,
        "flutter_size": material.terminal_velocity / max(material.flutter_rate, 0.1),
        "seed": 1 + int(rng.integers(100)),
        "entering": len(entering),
    }
    return entry, {f"{name}_{what}": array for what, array in arrays.items()}


def chance(scene: SimulationScene, element: Particles) -> np.random.Generator:
    """Chance that is the same in every run."""
    return np.random.default_rng([scene.seed, zlib.crc32(element.name.encode())])


def read_particles(path: Path, scene: SimulationScene, element: Particles, entry: dict[str, Any]) -> Arrays:
    """Read what Blender made of ``element``; BlenderError where it is not what was asked for.

    From where a place or speed is no number the particle is gone.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            found = {name: np.array(file[name]) for name in ("positions", "velocities", "alive", "before", "born")}
    except (ValueError, KeyError, EOFError, OSError, zipfile.BadZipFile) as error:
        raise BlenderError(f"{element.name}: what Blender wrote cannot be read: {error}") from None
    count = element.count + entry["entering"]
    each = (scene.frames, count)
    wanted = {"positions": (*each, 3), "velocities": (*each, 3), "alive": each, "born": each, "before": (count, 3)}
    for name, want in wanted.items():
        if found[name].shape != want:
            raise BlenderError(f"{element.name}: Blender wrote {name} of shape {found[name].shape}, want {want}")
    lost = ~(np.isfinite(found["positions"]) & np.isfinite(found["velocities"])).all(axis=2)
    lost = np.logical_or.accumulate(lost, axis=0)
    found["alive"][lost], found["positions"][lost], found["velocities"][lost] = False, AWAY, 0.0
    found["before"][~np.isfinite(found["before"]).all(axis=1)] = AWAY
    return found | {"early": np.array(entry["pre_roll"])}


def store_particles(scene: SimulationScene, element: Particles, result: Arrays, cache: Cache, start: int) -> None:
    """Write the frames from ``start`` on: particles of the box that fall, or lie and are not yet melted.

    Blender loses what a fast limb overtakes: what is ``DEEP`` in a volume is gone. What does not stick at all goes on
    in our own engine from where it falls on something.
    """
    positions = result["positions"].astype(np.float64)
    # Blender's own velocities go on growing in what lies.
    speeds = np.diff(positions, axis=0, prepend=result["before"][None]) * scene.frame_rate
    # What enters in a frame has no place before it.
    born = result["born"]
    speeds[born] = result["velocities"][born]
    material, count = element.material, positions.shape[1]
    rng = np.random.default_rng([scene.seed, zlib.crc32(element.name.encode()), 1])
    radii = rng.uniform(1 - material.spread, 1 + material.spread, count) * material.radius
    stays = rng.random(count) < material.stick
    stream = element.stream(np.array(scene.gravity), np.array(scene.wind.velocity))
    along = speeds @ stream / max(float(stream @ stream), 1e-12)
    # What lies when the film begins has come to lie at any time since the air was filled.
    ages = np.where(along[0] < LANDED, rng.uniform(0, result["early"] / scene.frame_rate, count), -1.0)
    volumes = Volumes(scene, [prop for prop in scene.elements if isinstance(prop, Prop)]).at(
        np.arange(scene.frames, dtype=float)
    )
    overtaken = np.zeros(count, bool)
    after = Aftermath(scene, element, cache, impacts_of(element, result)) if material.stick == 0 else None
    for frame, places in enumerate(positions):
        landed = ages >= 0
        ages[landed] += (frame > 0) / scene.frame_rate
        ages[~landed & (along[frame] < LANDED)] = 0.0
        landed = ages >= 0
        inside = ((places > element.low - MARGIN) & (places < element.high + MARGIN)).all(axis=1)
        overtaken |= result["alive"][frame] & (deepest(places, volumes[frame]) > DEEP)
        there = result["alive"][frame] & inside & ~overtaken & (~landed | (stays & (ages < material.settle)))
        refuse_explosion(element.name, frame, places[there], speeds[frame, there])
        serials = np.flatnonzero(there)
        state = {
            "positions": places[there],
            "velocities": speeds[frame, there],
            "sizes": np.stack([radii, np.maximum(ages, 0)], axis=1)[there],
            "codes": np.stack([serials, np.full(len(serials), -1), np.where(landed, SETTLED, FALLING)[there]], axis=1),
        }
        if after is not None:
            later = after.go(frame)
            state = {name: np.concatenate([array, later[name]]) for name, array in state.items()}
        if frame >= start:
            cache.write(element.name, frame, state | {"emitted": np.array(count)})


def deepest(places: Floats, rows: Floats) -> Floats:
    """How deep ``places`` (n, 3) lie in the volumes ``rows`` (C, 8), in metres; negative outside."""
    if not len(rows):
        return np.full(len(places), -np.inf)
    return -np.asarray(_kernels.capsule_distances(np.ascontiguousarray(places), np.ascontiguousarray(rows))[0])
