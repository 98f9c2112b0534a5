"""A skirt on a walking figure of ten changing tapered cylinders: our cloth beside Rapier's; then passes at 1080p."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from benches.measure import Row, alternate, milliseconds
from pegbar.scene.camera import PerspectiveCamera
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.cloth import ClothEngine
from pegbar.simulate.elements import Cloth
from pegbar.simulate.engine import simulate_scene
from pegbar.simulate.hulls import hull_triangles, hull_vertices, poses
from pegbar.simulate.layers import shadow_meshes
from pegbar.simulate.measures import measure_cloth
from pegbar.simulate.meshes import Models, volume_meshes
from pegbar.simulate.passes import Ink, render_passes
from pegbar.simulate.presets import preset_elements
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.tracks import Volumes, at_times, pin_track
from tests.walkers import walker

FRAMES, SUBSTEPS = 100, 8


def scene() -> SimulationScene:
    """The figure in a skirt of some 2,000 vertices, seen from the side."""
    figure = walker(FRAMES)
    skirt = preset_elements("skirt", figure, fineness=80)
    camera = PerspectiveCamera.look_at((3.5, 1.2, 2), (0, 0.8, 2), (1920, 1080), 0.9)
    return SimulationScene(24, FRAMES, skirt, (figure,), (camera,) * FRAMES, ground=0.05)


def with_rapier(rapier: Any, made: SimulationScene, frames: int, substeps: int) -> MemoryCache:
    """The same skirt as Rapier's soft body of stiff springs, limbs as convex hulls made anew in every substep."""
    (cloth,) = made.elements
    assert isinstance(cloth, Cloth)
    world = rapier.PhysicsWorld(gravity=made.gravity)
    world.integration_parameters.dt = 1 / 24 / substeps
    world.set_num_threads(1)
    volumes, held = Volumes(made, ()), pin_track(made, cloth.pins[0], cloth.vertices[cloth.pins[0].vertices])
    limbs = []
    for center in poses(volumes.at(np.zeros(1))[0])[0]:
        body = world.add_body(rapier.RigidBody.kinematic_position_based().translation(tuple(center.tolist())))
        limbs.append((body, world.add_collider(rapier.Collider.ball(0.001).friction(0.3), parent=body)))
    build = rapier.SoftBodyBuilder(cloth.rest.astype(np.float32)).surface(cloth.triangles.astype(np.uint32).tolist())
    build = build.edges(build.surface_edges().tolist())
    build = build.dihedrals(build.surface_dihedrals().tolist())
    stiff, soft = rapier.SpringCoefficients(1000.0, 1.0), rapier.SpringCoefficients(3.0, 1.0)
    build = build.material(rapier.SoftBodyMaterial(edge_softness=stiff, bend_softness=soft))
    build = build.mass(0.1).pinned_particles(cloth.pins[0].vertices.tolist()).particle_radius(0.006).linear_damping(0.5)
    handle, cache = world.add_soft_body(build), MemoryCache()
    for frame in range(frames):
        for time_now in frame - 1 + (np.arange(substeps) + 1) / substeps:
            rows, places = volumes.at(np.array([time_now]))[0], at_times(held, np.array([time_now]))[0]
            middles, turns = poses(rows)
            hulls = hull_vertices(np.linalg.norm(rows[:, 4:7] - rows[:, :3], axis=1), rows[:, 3], rows[:, 7])
            for (body, collider), middle, (x, y, z, w), hull in zip(limbs, middles, turns.tolist(), hulls, strict=True):
                world.rigid_bodies[body].set_next_kinematic_translation(tuple(middle.tolist()))
                world.rigid_bodies[body].set_next_kinematic_rotation(rapier.Rotation3(w, x, y, z))
                shape = rapier.SharedShape.convex_mesh(hull.astype(np.float32), hull_triangles())
                world.colliders[collider].shape = shape
            for particle, place in enumerate(places.tolist()):
                world.soft_bodies[handle].set_particle_kinematic_target(particle, tuple(place))
            world.step()
        cache.write(cloth.name, frame, {"positions": np.asarray(world.soft_bodies[handle].particle_positions)})
    return cache


def quality(made: SimulationScene, cache: MemoryCache) -> str:
    """Stretch and penetration to print."""
    measures = measure_cloth(made, cache, "skirt")
    _, most, largest = (100 * value for value in measures.percentiles)
    return f"stretch p99 {most:.1f}%, most {largest:.0f}%, deepest {1e3 * measures.penetration.max():.1f} mm"


def run() -> Iterator[Row]:
    """Yield the simulation beside Rapier's, and the times of a rendered frame."""
    made, cache = scene(), MemoryCache()
    begin = time.perf_counter()
    simulate_scene(made, cache, [ClothEngine()])
    ours = 1e3 * (time.perf_counter() - begin) / (FRAMES + made.pre_roll.frames)
    name = f"skirt of {len(made.elements[0].vertices)} vertices, a frame"
    yield from beside_rapier(name, ours, made, cache)
    models, camera = Models(made), made.cameras[0]

    def picture(samples: int) -> None:
        meshes = models.meshes(cache, 50)
        shadows = shadow_meshes([*meshes, *volume_meshes(made, 50)], 0.05)
        render_passes([*meshes, *shadows], camera, samples=samples, bands=(0.45, 0.8, 1.0), ink=Ink())

    for samples in (1, 2):
        (each,) = alternate(lambda count=samples: picture(count), rounds=7)
        yield Row(
            f"its passes at 1080p, {samples} x {samples} samples, shadow, ink", milliseconds(each), "", "", "200 ms"
        )


def beside_rapier(name: str, ours: float, made: SimulationScene, cache: MemoryCache) -> Iterator[Row]:
    """Yield the comparison, or what is missing for it."""
    import rapier3d

    begin = time.perf_counter()
    peer = with_rapier(rapier3d, made, FRAMES, SUBSTEPS)
    theirs = 1e3 * (time.perf_counter() - begin) / FRAMES
    correctness = f"ours: {quality(made, cache)}; Rapier's: {quality(made, peer)}"
    yield Row(name, milliseconds(ours), f"Rapier {milliseconds(theirs)}", f"{theirs / ours:.1f}x", "", correctness)
