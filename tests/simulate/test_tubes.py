"""Strands as meshes: closed tubes of their radius, bobs in their place, colours, and widths that a camera can see."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pegbar.scene.camera import PerspectiveCamera
from pegbar.simulate.elements import Bobs, Strands
from pegbar.simulate.materials import Look
from pegbar.simulate.passes import render_passes
from pegbar.simulate.tubes import strand_meshes


def strands(count: int = 2, points: int = 5, radius: float = 0.02, **others) -> Strands:
    """Upright strands side by side, 1 m long."""
    down = np.linspace(1, 0, points)
    places = np.array([[0.3 * index, high, 0.0] for index in range(count) for high in down])
    return Strands("lines", places, np.full(count, points), np.full(count, radius), **others)


def mesh_of(element: Strands, camera: PerspectiveCamera | None = None):
    (mesh,) = strand_meshes(element, element.points, 3, camera)
    return mesh


def enclosed(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """The volume inside of triangles that look outwards, by Gauss's theorem."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def test_tubes_are_closed_and_as_thick_as_their_strands():
    mesh = mesh_of(strands())
    assert mesh.object_id == 3
    away = np.linalg.norm(mesh.vertices[:, [0, 2]] - np.round(mesh.vertices[:, [0, 2]] / 0.3) * 0.3, axis=1)
    assert set(np.round(away, 9)) == {0.0, 0.02}
    assert (mesh.vertices[:, 1].min(), mesh.vertices[:, 1].max()) == (0, 1)
    volume = enclosed(mesh.vertices, mesh.triangles)
    sides = 10
    slice_ = 0.02**2 * sides / 2 * np.sin(2 * np.pi / sides)
    assert volume == pytest.approx(2 * slice_)


def test_a_bent_strand_is_round_and_goes_through_its_points():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    mesh = mesh_of(Strands("bow", points, [4], [0.001]))
    gaps = np.linalg.norm(mesh.vertices[:, None] - points, axis=2).min(axis=0)
    assert gaps.max() < 0.0011
    assert mesh.vertices[:, 0].max() > 1.05


def test_strands_of_different_counts_stand_in_one_mesh():
    places = np.array([[0, 1, 0], [0, 0, 0], [1, 1, 0], [1, 0.5, 0], [1, 0, 0]], float)
    colors = np.array([[1, 0, 0, 1], [0, 1, 0, 1]], np.float32)
    mesh = mesh_of(Strands("two", places, [2, 3], [0.01, 0.02], colors=colors))
    red = (mesh.colors == colors[0]).all(axis=1)
    assert np.abs(mesh.vertices[red, 0]).max() < 0.02
    assert np.abs(mesh.vertices[~red, 0] - 1).max() < 0.021
    assert (mesh.colors[~red] == colors[1]).all()


@pytest.mark.parametrize("pattern", ["bands", "stripes"])
def test_patterns_go_along_the_strand(pattern):
    look = Look((1.0, 0, 0, 1), (0, 1.0, 0, 1), pattern, 0.4)
    mesh = mesh_of(replace(strands(1, points=21), look=look))
    is_second = (mesh.colors == np.array(look.second, np.float32)).all(axis=1)
    assert 0.3 < is_second.mean() < 0.7
    ring = np.isclose(mesh.vertices[:, 1], 0.5)
    assert (len(set(is_second[ring])) == 1) == (pattern == "bands")


def test_thin_strands_are_seen_without_gaps():
    camera = PerspectiveCamera.look_at((0, 0.5, 6), (0, 0.5, 0), (64, 64), 0.4)
    thin = strands(1, radius=1e-4)
    alone, widened = (render_passes([mesh_of(thin, lens)], camera, samples=2).resolved() for lens in (None, camera))
    rows = [(passes.coverage > 0).any(axis=1) for passes in (alone, widened)]
    assert rows[0].sum() < 20
    high = np.flatnonzero(rows[1])
    assert len(high) > 20
    assert (np.diff(high) == 1).all()
    thick = strands(1, radius=0.2)
    assert (mesh_of(thick, camera).vertices == mesh_of(thick).vertices).all()


@pytest.mark.parametrize(("knot", "is_ball"), [(0.2, True), (0.24, False)])
def test_bobs_hang_at_the_ends_and_balloons_reach_their_knots(knot, is_ball):
    points = np.array([[0, 1, 0], [0, 0.5, 0], [0, 0.5 - knot, 0]])
    colors = np.array([[0, 0, 1, 1]], np.float32)
    mesh = mesh_of(Strands("bob", points, [3], [0.01], bobs=Bobs([0.2], colors=colors)))
    ball = (mesh.colors == colors[0]).all(axis=1)
    away = np.linalg.norm(mesh.vertices[ball] - points[-1], axis=1)
    if is_ball:
        assert away == pytest.approx(0.2)
    else:
        assert np.median(away) == pytest.approx(0.2, abs=0.002)
        assert 0.5 < mesh.vertices[ball, 1].max() < 0.53
    assert mesh.vertices[ball, 1].min() == pytest.approx(0.5 - knot - 0.2)
    of_ball = mesh.triangles[ball[mesh.triangles].all(axis=1)]
    assert 0.93 < enclosed(mesh.vertices, of_ball) / (4 / 3 * np.pi * 0.2**3) < 1.1
    # The string ends at the knot, and the normals look away from the ball.
    assert mesh.vertices[~ball, 1].min() == pytest.approx(0.5)
    outward = np.einsum("ij,ij->i", mesh.normals[ball], mesh.vertices[ball] - points[-1])
    assert (outward > 0).mean() > 0.9
