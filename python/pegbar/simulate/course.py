"""Points on their way through a scene's frames: what pushes, pins and blows them, whatever they are made of."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from pegbar.simulate.cache import Cache
from pegbar.simulate.colliders import Colliders
from pegbar.simulate.elements import Cloth, Pin, Strands
from pegbar.simulate.engine import Progress, refuse_explosion
from pegbar.simulate.scene import SimulationScene
from pegbar.simulate.tracks import at_times, pin_track

Floats = NDArray[np.float64]


class Course:
    """One element of points on its way through the frames; ``step`` is its kernel."""

    def __init__(self, scene: SimulationScene, element: Cloth | Strands, points: Floats, around: Colliders) -> None:
        self.scene, self.name, self.around = scene, element.name, around
        self.pins, self.places = pinned(scene, element.pins, points)
        self._in_world = any(pin.kind == "world" for pin in element.pins)
        self._waves = scene.wind.waves()
        self.positions, self.velocities = points.copy(), np.zeros_like(points)

    def step(self, seconds: float, air: Floats, targets: Floats, capsules: Floats) -> None:
        """Move ``positions`` and ``velocities`` (n, 3) on by a frame of substeps of so many ``seconds``.

        ``air`` (n, 3) is its velocity, ``targets`` (S, P, 3) the places of ``pins``, ``capsules`` (S + 1, C, 8).
        """
        raise NotImplementedError

    def settle(self) -> None:
        """Go through the pre-roll; at its end the points have the speed of what they are pinned to."""
        launch = self._launch()
        for frame in range(-self.scene.pre_roll.frames, 0):
            self._advance(frame, self.around.capsules(frame, frame + 1), launch)
        self.velocities += launch

    def take_up(self, cache: Cache, frame: int) -> None:
        """Begin with the state after ``frame``."""
        state = cache.read(self.name, frame)
        self.positions = np.array(state["positions"], np.float64)
        self.velocities = np.array(state["velocities"], np.float64)

    def advance(self, frame: int, capsules: Floats) -> None:
        """Go from the frame before to ``frame``."""
        self._advance(frame - 1, capsules, np.zeros(3))

    def _advance(self, before: int, capsules: Floats, launch: Floats) -> None:
        rate = self.scene.frame_rate
        targets = at_times(self.places, np.maximum(self.around.times(before)[1:], 0))
        air = self._air((before + 0.5) / rate) - launch
        seconds = 1 / rate / self.around.substeps
        self.step(seconds, np.ascontiguousarray(air), np.ascontiguousarray(targets), capsules)

    def _air(self, time: float) -> Floats:
        air = np.tile(np.array(self.scene.wind.velocity), (len(self.positions), 1))
        if len(self._waves):
            phase = self.positions @ self._waves[:, 3:6].T - self._waves[:, 6] * time + self._waves[:, 7]
            air += np.sin(phase) @ self._waves[:, :3]
        return air

    def _launch(self) -> Floats:
        """The mean velocity (3,) in m/s of the pins in the first frame; nothing for what is pinned to the world."""
        if len(self.places) < 2 or not len(self.pins) or self._in_world:
            return np.zeros(3)
        speed: Floats = (self.places[1] - self.places[0]).mean(axis=0) * self.scene.frame_rate
        return speed


def run_courses(engine: str, courses: Sequence[Course], cache: Cache, start: int, progress: Progress | None) -> None:
    """Write frames ``start`` and later of ``courses``, which have the same surroundings, to ``cache``.

    SimulationError names the element and frame of an explosion.
    """
    scene, around = courses[0].scene, courses[0].around
    with ThreadPoolExecutor(len(courses)) as pool:
        if start == 0:
            list(pool.map(Course.settle, courses))
        else:
            for course in courses:
                course.take_up(cache, start - 1)
        for frame in range(start, scene.frames):
            if frame:
                capsules = around.capsules(frame - 1, frame)
                list(pool.map(Course.advance, courses, [frame] * len(courses), [capsules] * len(courses)))
            for course in courses:
                refuse_explosion(course.name, frame, course.positions, course.velocities)
                cache.write(course.name, frame, {"positions": course.positions, "velocities": course.velocities})
            if progress is not None:
                progress(engine, frame + 1, scene.frames)


def pinned(scene: SimulationScene, pins: Sequence[Pin], points: Floats) -> tuple[NDArray[np.int64], Floats]:
    """Return which of ``points`` (n, 3) are pinned (P,), and their places (F, P, 3); of several pins the last holds."""
    held: dict[int, Floats] = {}
    for pin in pins:
        vertices = np.arange(len(points)) if pin.vertices is None else pin.vertices
        track = pin_track(scene, pin, points[vertices])
        held |= {int(vertex): track[:, index] for index, vertex in enumerate(vertices)}
    if not held:
        return np.empty(0, np.int64), np.empty((scene.frames, 0, 3))
    order = sorted(held)
    return np.array(order), np.stack([held[vertex] for vertex in order], axis=1)
