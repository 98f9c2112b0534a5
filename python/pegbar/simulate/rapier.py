"""The rigid engine: balls, boxes and props in Rapier, against limbs as moving convex hulls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pegbar.simulate.cache import Cache
from pegbar.simulate.elements import Balls, Boxes, Element, Prop
from pegbar.simulate.engine import Progress, refuse_explosion
from pegbar.simulate.hulls import hull_triangles, hull_vertices, poses
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.tracks import Volumes, pin_track

Floats = NDArray[np.float64]
#: Radii and lengths (metres) closer than this are the same shape: a shape is only made anew when it changes.
SAME = 1e-6
#: Of limbs and ground; a body's own friction counts as much.
FRICTION = 0.6
#: The smallest radius that a hull may have, in metres: volumes begin at nothing in the pre-roll.
THINNEST = 1e-4


@dataclass(frozen=True)
class RapierEngine:
    """Simulates balls and boxes in Rapier, ``substeps`` a frame at 24 frames a second, and carries props along.

    Limbs and props push the bodies and are not pushed back. Runs on one thread; the result has the same bits in every
    run on one kind of processor. Rapier's state is kept in the cache with every frame, so that a run can be taken up.
    """

    substeps: int = 8
    name: str = "rapier"

    def supports(self, element: Element) -> bool:
        """Whether ``element`` is rigid."""
        return isinstance(element, Balls | Boxes | Prop)

    def run(
        self, scene: SimulationScene, elements: Sequence[Element], cache: Cache, start: int, progress: Progress | None
    ) -> None:
        """Write frames ``start`` and later of the bodies and props to ``cache``."""
        for prop in (element for element in elements if isinstance(element, Prop)):
            for frame, places in enumerate(pin_track(scene, prop.pin, prop.vertices)):
                cache.write(prop.name, frame, {"positions": places})
        sets = [element for element in elements if isinstance(element, Balls | Boxes)]
        if not sets:
            return
        world = _World(scene, sets, max(1, round(self.substeps * 24 / scene.frame_rate)))
        if start:
            world.take_up(start - 1, np.asarray(cache.read(sets[0].name, start - 1)["rapier"]).tobytes())
        else:
            for frame in range(-scene.pre_roll.frames, 0):
                world.advance(frame)
        for frame in range(start, scene.frames):
            if frame:
                world.advance(frame - 1)
            for element, state in world.states():
                refuse_explosion(element.name, frame, state["positions"], state["velocities"])
                extra = {"rapier": world.snapshot()} if element is sets[0] else {}
                cache.write(element.name, frame, state | extra)
            if progress is not None:
                progress(self.name, frame + 1, scene.frames)


class _World:
    """Rapier's world: handles of the bodies, and the limbs that are moved."""

    def __init__(self, scene: SimulationScene, sets: Sequence[Balls | Boxes], substeps: int) -> None:
        import rapier3d

        self.rapier: Any = rapier3d
        self.sets, self.substeps = sets, substeps
        self.volumes = Volumes(scene, [element for element in scene.elements if isinstance(element, Prop)])
        self.world = rapier3d.PhysicsWorld(gravity=scene.gravity)
        self.world.integration_parameters.dt = 1 / scene.frame_rate / substeps
        self.world.set_num_threads(1)
        first = self.volumes.at(np.array([-float(scene.pre_roll.frames)]))[0]
        self.limbs = [self._limb(row, place) for row, place in zip(first, zip(*poses(first), strict=True), strict=True)]
        self.shapes = np.full((len(first), 3), np.nan)
        self.bodies = [self._bodies(element) for element in sets]
        if scene.ground is not None:
            plane = rapier3d.Collider.halfspace((0.0, 1.0, 0.0)).friction(FRICTION).restitution(0.3)
            body = rapier3d.RigidBody.fixed().translation((0.0, scene.ground, 0.0))
            self.world.add_collider(plane, parent=self.world.add_body(body))

    def take_up(self, frame: int, snapshot: bytes) -> None:
        """Begin with the state of a snapshot after ``frame``; bodies keep their handles, limbs their shapes."""
        self.shapes = _shapes(self.volumes.at(np.array([float(frame)]))[0])
        self.world = self.rapier.PhysicsWorld.restore(snapshot)
        self.world.set_num_threads(1)

    def snapshot(self) -> NDArray[np.uint8]:
        """All of Rapier's state."""
        return np.frombuffer(self.world.snapshot(), np.uint8)

    def advance(self, before: int) -> None:
        """Go from frame ``before`` to the next."""
        times = before + (np.arange(self.substeps) + 1) / self.substeps
        for rows in self.volumes.at(times):
            (centers, turns), shapes = poses(rows), _shapes(rows)
            hulls = hull_vertices(*shapes.T).astype(np.float32)
            for index, (body, collider) in enumerate(self.limbs):
                limb = self.world.rigid_bodies[body]
                limb.set_next_kinematic_translation(tuple(centers[index].tolist()))
                limb.set_next_kinematic_rotation(self._rotation(turns[index]))
                if np.abs(shapes[index] - self.shapes[index]).max() >= SAME or np.isnan(self.shapes[index, 0]):
                    self.shapes[index] = shapes[index]
                    self.world.colliders[collider].shape = self._shape(shapes[index], hulls[index])
            self.world.step()

    def states(self) -> list[tuple[Balls | Boxes, dict[str, Floats]]]:
        """Positions, rotations and velocities of every set."""
        found = []
        for element, handles in zip(self.sets, self.bodies, strict=True):
            bodies = [self.world.rigid_bodies[handle] for handle in handles]
            state = {
                "positions": np.array([[*body.translation] for body in bodies], np.float64).reshape(-1, 3),
                "rotations": np.array([_quaternion(body.rotation) for body in bodies], np.float64).reshape(-1, 4),
                "velocities": np.array([[*body.linvel] for body in bodies], np.float64).reshape(-1, 3),
            }
            found.append((element, state))
        return found

    def _limb(self, row: Floats, place: tuple[Floats, Floats]) -> tuple[Any, Any]:
        center, turn = place
        build = self.rapier.RigidBody.kinematic_position_based().translation(tuple(center.tolist()))
        body = self.world.add_body(build)
        self.world.rigid_bodies[body].rotation = self._rotation(turn)
        collider = self.rapier.Collider.ball(THINNEST).friction(FRICTION)
        return body, self.world.add_collider(collider, parent=body)

    def _shape(self, shape: Floats, hull: NDArray[np.float32]) -> Any:
        length, first, last = shape.tolist()
        if length <= abs(first - last) + SAME:
            return self.rapier.SharedShape.ball(max(first, last))
        return self.rapier.SharedShape.convex_mesh(hull, hull_triangles())

    def _bodies(self, element: Balls | Boxes) -> list[Any]:
        material, handles = element.material, []
        for index, (center, velocity) in enumerate(zip(element.centers, element.velocities, strict=True)):
            body = self.rapier.RigidBody.dynamic().translation(tuple(center.tolist())).linvel(tuple(velocity.tolist()))
            body = body.linear_damping(material.damping).angular_damping(material.damping).ccd_enabled(True)
            if isinstance(element, Balls):
                collider = self.rapier.Collider.ball(float(element.radii[index]))
            else:
                collider = self.rapier.Collider.cuboid(*(element.sizes[index] / 2).tolist())
            collider = collider.friction(material.friction).restitution(material.bounce).density(material.density)
            handles.append(self.world.add_body(body))
            self.world.add_collider(collider, parent=handles[-1])
        return handles

    def _rotation(self, turn: Floats) -> Any:
        x, y, z, w = turn.tolist()
        return self.rapier.Rotation3(w, x, y, z)


def _shapes(rows: Floats) -> Floats:
    """Lengths and radii (C, 3) of capsules (C, 8)."""
    lengths = np.linalg.norm(rows[:, 4:7] - rows[:, :3], axis=1)
    return np.stack([lengths, np.maximum(rows[:, 3], THINNEST), np.maximum(rows[:, 7], THINNEST)], axis=1)


def _quaternion(rotation: Any) -> tuple[float, float, float, float]:
    return rotation.i, rotation.j, rotation.k, rotation.w
