"""Bobs as Blender is told of them, and what becomes of its drops, without Blender."""

from __future__ import annotations

import numpy as np
import pytest

from pegbar.scene.volumes import TaperedCylinders
from pegbar.simulate.blender.bobs import Balls, are_alike, blow_of, bob_settings, icosphere
from pegbar.simulate.blender.splashes import Aftermath, impacts_of
from pegbar.simulate.blender.strands import Web, drag_rate, point_mass, strands_entry
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.chains import Bobs
from pegbar.simulate.elements import Pin, Strands
from pegbar.simulate.materials import StrandMaterial, Wind
from pegbar.simulate.particles import DROPLET, FALLING, SLIDING
from pegbar.simulate.scene import Character, SimulationScene
from pegbar.simulate.strands import AIR, point_rows
from pegbar.simulate.weather import ParticleMaterial, Particles


@pytest.mark.parametrize("divisions", [0, 1, 2])
def test_an_icosphere_is_a_closed_ball_whose_first_vertices_are_its_top(divisions):
    vertices, sides = icosphere(divisions)
    assert len(vertices) == 10 * 4**divisions + 2
    assert np.allclose(np.linalg.norm(vertices, axis=1), 1)
    edges = np.sort(np.stack([sides, np.roll(sides, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    # Turned outward: every side's share of the volume is positive.
    shares = np.linalg.det(vertices[sides])
    assert (shares > 0).all()
    assert shares.sum() / 6 == pytest.approx(4 / 3 * np.pi, rel=0.5 / 3.5**divisions)
    assert (np.diff(vertices[:, 2]) < 1e-9).all()


def bunch(density=0.5, radii=(0.2, 0.2), links=5):
    """Two strings up along y, each with a bob on a knot that is 1.1 radii from its middle."""
    points = []
    for index, radius in enumerate(radii):
        up = np.append(np.arange(links + 1) * 0.1, links * 0.1 + 1.1 * radius)
        points.append(np.stack([np.full(links + 2, float(index)), up, np.zeros(links + 2)], axis=1))
    pin = Pin("world", vertices=np.array([0, links + 2]))
    bobs, material = Bobs(np.array(radii), density), StrandMaterial(density=400.0)
    counts = np.full(2, links + 2)
    return Strands("b", np.concatenate(points), counts, np.full(2, 0.002), (pin,), bobs=bobs, material=material)


def test_balls_sit_at_the_ends_and_are_tied_to_their_knots():
    strands = bunch()
    web = Web(strands)
    balls = web.balls
    places = web.around(strands.points)
    assert len(places) == 14 + balls.count
    assert np.array_equal(places[:14], strands.points)
    for index, center in enumerate((6, 13)):
        surface = places[14:].reshape(2, -1, 3)[index]
        assert np.allclose(np.linalg.norm(surface - strands.points[center], axis=1), 0.2)
        # The knot is below, and so are those of the surface that it is tied to.
        tied = [b for a, b in balls.ties if a == center - 1 and b != center]
        lowest = np.sort(surface[:, 1])[5]
        assert len(tied) == 6
        assert (places[tied][:, 1] <= lowest + 1e-9).all()
        assert np.linalg.norm(places[tied] - strands.points[center], axis=1) == pytest.approx(0.2)
    # No sliver reaches over a knot, where a bob turns freely.
    slivers = web.triangles[: -len(balls.triangles)]
    assert slivers.tolist() == [[i + a, i + a + 1, i + a + 2] for i in (0, 7) for a in range(4)]
    short = Web(bunch(links=1))
    assert short.seams[:2].tolist() == [[0, 1], [3, 4]]


@pytest.mark.parametrize("density", [0.5, 600.0])
def test_masses_and_lift_are_those_of_our_engine(density):
    strands = bunch(density)
    web = Web(strands)
    rows = point_rows(strands, np.empty(0, int))
    masses = 1 / rows[:, 0]
    vertices = len(strands.points) + web.balls.count
    assert point_mass(strands, web) * vertices == pytest.approx(masses.sum())
    settings = bob_settings(strands, web.balls, 2.0)
    # What the air's pressure bears, in kilograms, on balls that are flat between their vertices.
    borne = -1000 * settings["fluid_density"] * web.balls.volume
    assert masses.sum() - borne == pytest.approx((masses * rows[:, 5]).sum())
    assert drag_rate(strands) == pytest.approx((rows[:, 6]).sum() / masses.sum(), rel=0.15)
    assert settings["compression_stiffness_max"] == 2.0


def test_wind_blows_at_bobs_with_the_force_of_ours():
    strands = bunch()
    scene = SimulationScene(24, 3, (strands,), wind=Wind((3.0, 0, 0), 0.0))
    entry, arrays = strands_entry(scene, strands, "s", 16)
    assert (entry["pulls"], entry["self_collision"], entry["points"]) == (False, True, 14)
    balls = Balls(strands)
    force = AIR / 2 * 0.47 * np.pi * 0.2**2 * 2 * 3.0**2
    # Blender pushes with 0.02 a square metre and strength, over the frames a second, where a newton is 0.001.
    newtons = arrays["s_wind"][:, 0] * 0.02 * balls.area / 24 / 0.001
    assert np.allclose(newtons, force, rtol=0.1)
    assert (newtons > force).all()
    assert np.array_equal(arrays["s_wind"], blow_of(scene, strands, balls, np.zeros((3, 3))))


def test_bobs_that_differ_stay_with_our_engine():
    assert are_alike(bunch())
    assert are_alike(bunch(radii=(0.2, 0.205)))
    assert not are_alike(bunch(radii=(0.2, 0.24)))


def rain(**more):
    material = ParticleMaterial(terminal_velocity=5.0, splash=3, splash_life=0.2, **more)
    return Particles("rain", (-1, 0, -1), (1, 2, 1), 4, material)


def ended(frames=6):
    """Four drops: one ends in frame 2, one then leaves the box, one stays, one begins and ends in frame 3."""
    positions = np.full((frames, 4, 3), 0.5)
    positions[:, 0, 1] = np.maximum(1 - 5 / 24 * np.arange(frames), 0.001)
    positions[:, 1] = (0.5, 0.9, 1.2)
    alive, born = np.ones((frames, 4), bool), np.zeros((frames, 4), bool)
    alive[2:, 0] = alive[2:, 1] = False
    alive[:, 3], born[3, 3] = False, True
    velocities = np.tile((0.0, -5.0, 0.0), (frames, 4, 1))
    return {"positions": positions, "velocities": velocities, "alive": alive, "born": born}


def test_impacts_are_where_drops_end_in_the_box():
    found = impacts_of(rain(), ended())
    assert [len(places) for places in found.places] == [0, 0, 1, 1, 0, 0]
    assert np.allclose(found.places[2], [[0.5, 1 - 10 / 24, 0.5]])
    assert np.allclose(found.velocities[3], [[0, -5, 0]])


@pytest.mark.parametrize(("run_off", "phase", "count"), [(0.0, DROPLET, 3), (1.0, SLIDING, 1)])
def test_a_drop_bursts_or_runs_off_where_it_fell(run_off, phase, count):
    element, drops = rain(run_off=run_off), ended()
    drops["alive"][:, 1:] = True
    # A bar whose top Blender has 2 mm too high.
    start, end, radii = np.tile((-1.0, 0.4, 0.5), (6, 1, 1)), np.tile((1.0, 0.4, 0.5), (6, 1, 1)), np.full((6, 1), 0.18)
    bar = Character("bar", ("top",), end, ("trunk",), TaperedCylinders(start, end, radii, radii))
    scene = SimulationScene(24, 6, (element,), (bar,), ground=0.0)
    after = Aftermath(scene, element, MemoryCache(), impacts_of(element, drops))
    states = [after.go(frame) for frame in range(6)]
    for state in states:
        assert not np.isin(state["codes"][:, 2], [FALLING]).any()
    # It fell once before the film too: what came of that is there in the first frame.
    young = [state["sizes"][:, 1] < 1.5 / 24 for state in states]
    assert 0 < (states[0]["codes"][:, 2] == phase).sum() <= count
    assert [new.sum() for new in young] == [0, 0, count, 0, 0, 0]
    assert (states[2]["codes"][young[2], 2] == phase).all()
    fresh = states[2]["positions"][young[2]]
    assert (np.linalg.norm(fresh - (0.5, 0.58, 0.5), axis=1) < 0.08).all()


def test_a_drop_that_misses_falls_on():
    element, drops = rain(), ended()
    drops["alive"][:, 1:] = True
    after = Aftermath(
        SimulationScene(24, 6, (element,), ground=0.0), element, MemoryCache(), impacts_of(element, drops)
    )
    states = [after.go(frame) for frame in range(6)]
    assert (states[2]["codes"][:, 2] == FALLING).sum() == 1
    assert states[2]["positions"][states[2]["codes"][:, 2] == FALLING, 1] == pytest.approx(1 - 15 / 24 + 0.02, abs=0.02)
    assert (states[5]["codes"][:, 2] == DROPLET).sum() == 3
