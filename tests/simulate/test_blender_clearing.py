"""Strands that Blender left in a limb."""

from __future__ import annotations

import numpy as np
import pytest

from pegbar.scene.volumes import TaperedCylinders
from pegbar.simulate.blender.clearing import clear_of_volumes
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.elements import Pin, Strands
from pegbar.simulate.measures import measure_strands
from pegbar.simulate.scene import Character, SimulationScene

#: Thickness of the strands, and of the bar along x that they hang about.
THIN, BAR = 0.005, 0.1


def scene_of(points, pins=(), frames=2):
    strands = Strands("s", np.concatenate(points), np.array([len(p) for p in points]), np.full(len(points), THIN), pins)
    start, end = np.tile((-1.0, 0, 0), (frames, 1, 1)), np.tile((1.0, 0, 0), (frames, 1, 1))
    radii = np.full((frames, 1), BAR)
    bar = Character("bar", ("top",), end, ("trunk",), TaperedCylinders(start, end, radii, radii))
    return SimulationScene(24, frames, (strands,), (bar,)), strands


def line(start, end, count=11):
    return np.linspace(start, end, count)


def deepest(scene, positions):
    cache = MemoryCache()
    for frame, places in enumerate(positions):
        cache.write("s", frame, {"positions": places})
    return measure_strands(scene, cache, "s").penetration.max()


def test_a_strand_that_runs_through_a_limb_is_laid_around_it_and_others_are_left():
    through, beside = line((0, 0.3, 0.03), (0, -0.2, 0.03)), line((0.3, 0.3, 0.2), (0.3, -0.2, 0.2))
    scene, strands = scene_of([through, beside], (Pin("world", vertices=np.array([0, 11])),))
    given = np.stack([strands.points, strands.points])
    given[0, 1:11, 2] = 0.2
    found = clear_of_volumes(scene, strands, given)
    # Nothing of the first frame is in the bar, nothing of the second strand ever is.
    assert np.array_equal(found[0], given[0])
    assert np.array_equal(found[1, 11:], given[1, 11:])
    assert np.array_equal(found[1, 0], given[1, 0])
    assert deepest(scene, given) > 0.06
    assert deepest(scene, found) < 1e-3
    assert np.hypot(found[1, :, 1], found[1, :, 2]).min() == pytest.approx(BAR + THIN, abs=2e-3)
    # It goes around on the side that it was on, and keeps its length.
    assert (found[1, 4:9, 2] > 0.02).all()
    links = np.linalg.norm(np.diff(found[1, :11], axis=0), axis=1)
    assert links.sum() == pytest.approx(0.5, rel=0.05)
    assert np.array_equal(given[1, :11], through)


def test_a_link_whose_ends_are_clear_does_not_pass_through():
    ends = np.array([[0, 0.12, 0.02], [0, -0.12, 0.02], [0, -0.1, 0.02]])
    scene, strands = scene_of([ends])
    found = clear_of_volumes(scene, strands, np.stack([ends, ends]))
    assert deepest(scene, np.stack([ends, ends])) > 0.05
    assert deepest(scene, found) < 1e-3


def test_what_is_pinned_in_a_limb_comes_out_of_it_on_its_way():
    inside = line((0, 0.02, 0), (0, 0.52, 0))
    scene, strands = scene_of([inside], (Pin("world", vertices=np.array([0])),))
    given = np.stack([inside, inside])
    assert np.allclose(clear_of_volumes(scene, strands, given), given, atol=1e-9)
    # Bent back into the limb it is deeper than the way from the pin explains.
    back = inside.copy()
    back[4:] = inside[4] - (inside[4:] - inside[4]) + (0, 0, 0.01)
    assert deepest(scene, [back, back]) > 0.02
    assert deepest(scene, clear_of_volumes(scene, strands, np.stack([back, back]))) < 2e-3


def test_without_limbs_nothing_moves():
    strands = Strands("s", line((0, 1, 0), (0, 0, 0)), np.array([11]), np.array([THIN]))
    given = strands.points[None]
    assert clear_of_volumes(SimulationScene(24, 1, (strands,)), strands, given) is given
