"""Blender's passes against those of our own renderer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pegbar.io.exr import read_exr, read_passes
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.mesh import Mesh
from pegbar.simulate.blender.locate import Blender
from pegbar.simulate.blender.render import BlenderJob, passes_of
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.elements import Balls, Boxes
from pegbar.simulate.materials import Look
from pegbar.simulate.meshes import Models
from pegbar.simulate.passes import Ink, Passes, render_passes
from pegbar.simulate.scene import SimulationScene

LIGHT, BANDS = (0.4, 0.8, 0.45), (0.4, 0.7, 1.0)
INK = Ink(2.0, (0.0, 0.0, 0.2, 1.0), None)


def still_life() -> list[Mesh]:
    """Balls that hide each other, a turned box, and a sheet of many colours."""
    balls = Balls(
        "balls",
        np.array([[0, 0.3, 0], [0.25, 0.25, 0.3], [-0.5, 0.2, -0.4]]),
        np.array([0.3, 0.25, 0.2]),
        look=Look((0.8, 0.1, 0.1, 1), (0.1, 0.2, 0.9, 1), "stripes"),
    )
    boxes = Boxes("boxes", np.array([[0.7, 0.3, -0.2]]), np.array([[0.3, 0.6, 0.4]]))
    scene = SimulationScene(24, 1, (balls, boxes))
    cache = MemoryCache()
    turn = np.array([0.1, 0.3, 0.2, 0.9])
    for element, count in ((balls, 3), (boxes, 1)):
        turns = np.tile(turn / np.linalg.norm(turn), (count, 1))
        cache.write(element.name, 0, {"positions": element.centers, "rotations": turns})
    across, along = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(0, 1.2, 7), indexing="ij")
    places = np.stack([across, along, -0.8 + 0.2 * np.sin(3 * across)], axis=-1).reshape(-1, 3)
    corners = [(7 * i + j, 7 * i + j + 7, 7 * i + j + 8) for i in range(8) for j in range(6)]
    corners += [(7 * i + j, 7 * i + j + 8, 7 * i + j + 1) for i in range(8) for j in range(6)]
    colors = np.random.default_rng(1).uniform(0, 1, (63, 4)).astype(np.float32)
    colors[:, 3] = 1
    # A flake, whose normals look to the light however its triangles are turned.
    flake = np.array([[-0.2, 0.9, 0.6], [0.1, 0.9, 0.6], [0.1, 1.1, 0.6], [-0.2, 1.1, 0.6]])
    lit = Mesh(flake, np.array([[0, 2, 1], [0, 2, 3]]), (0.7, 0.8, 1.0, 1.0), 0xFF05, np.tile(LIGHT, (4, 1)))
    return [*Models(scene).meshes(cache, 0), Mesh(places, np.array(corners), colors, 300), lit]


def cameras() -> dict[str, PerspectiveCamera]:
    plain = PerspectiveCamera.look_at((0.5, 1.1, 3.0), (0, 0.4, 0), (120, 68), 0.8)
    # An image centre that is elsewhere, pixels that are not square or lean, and a picture higher than wide.
    shifted = np.array([[150.0, 0, 30.0], [0, 170.0, 75.0], [0, 0, 1]]) @ np.linalg.inv(plain.intrinsic) @ plain.matrix
    wide = np.array([[190.0, 9.0, 40.0], [0, 140.0, 30.0], [0, 0, 1]]) @ np.linalg.inv(plain.intrinsic) @ plain.matrix
    return {
        "plain": plain,
        "shifted": PerspectiveCamera(shifted, (80, 110)),
        "wide pixels": PerspectiveCamera(wide, (96, 54)),
    }


def render(blender: Blender, folder: Path, camera: PerspectiveCamera, samples: int, ink: Ink | None) -> Passes:
    job = BlenderJob(samples, light=LIGHT, bands=BANDS, ink=ink)
    (output,) = job.write(folder, [("frame", camera, still_life())])
    job.run(blender, folder, [output])
    return passes_of(read_exr(output).channels, samples, 0 if ink is None else ink.width)


@pytest.mark.parametrize("name", list(cameras()))
@pytest.mark.parametrize("samples", [1, 2])
def test_depth_ids_and_colours_are_those_of_our_renderer(
    blender: Blender, tmp_path: Path, name: str, samples: int
) -> None:
    camera = cameras()[name]
    theirs = render(blender, tmp_path, camera, samples, None)
    ours = render_passes(still_life(), camera, samples=samples, light=LIGHT, bands=BANDS)
    covered = (ours.coverage > 0) & (theirs.coverage > 0)
    assert covered.mean() > 0.2
    # Pixels whose middle an edge meets may be another surface's.
    assert (ours.coverage != theirs.coverage).mean() < 1e-3
    same = covered & (ours.object_id == theirs.object_id)
    assert same.sum() > 0.998 * covered.sum()
    apart = np.abs(ours.depth[same] - theirs.depth[same])
    assert np.percentile(apart, 99.5) < 1e-3
    assert np.isinf(theirs.depth[theirs.coverage == 0]).all()
    colors = np.abs(ours.beauty - theirs.beauty).max(axis=2)[same]
    assert (colors < 2e-3).mean() > 0.98
    assert set(np.unique(theirs.object_id)) == {0, 1, 2, 300, 0xFF05}
    flake = theirs.beauty[same & (theirs.object_id == 0xFF05)]
    assert np.abs(flake - (0.7, 0.8, 1.0, 1.0)).max() < 2e-3


def test_ink_has_a_depth_and_lies_around_what_it_outlines(blender: Blender, tmp_path: Path) -> None:
    camera = cameras()["plain"]
    plain = render_passes(still_life(), camera, samples=2, light=LIGHT, bands=BANDS)
    theirs = render(blender, tmp_path, camera, 2, INK)
    drawn = (theirs.coverage > 0) & (np.abs(theirs.beauty - INK.color).max(axis=2) < 5e-3)
    ours = render_passes(still_life(), camera, samples=2, light=LIGHT, bands=BANDS, ink=INK)
    wanted = (ours.coverage > 0) & (np.abs(ours.beauty - INK.color).max(axis=2) < 5e-3)
    # Half of a line lies on the surface and half beside it; ours lies beside it.
    assert 0.5 < drawn.sum() / wanted.sum() < 1.5
    outside = drawn & (plain.coverage == 0)
    assert outside.sum() > 50
    assert np.isfinite(theirs.depth[outside]).all()
    assert (theirs.object_id[outside] > 0).all()
    assert (theirs.beauty[theirs.coverage == 0] == 0).all()
    rest = ~drawn & (plain.coverage > 0) & (theirs.object_id == plain.object_id)
    assert np.percentile(np.abs(theirs.depth[rest] - plain.depth[rest]), 99) < 1e-3


def test_the_same_bits_every_time_and_frames_of_one_job_are_their_own(blender: Blender, tmp_path: Path) -> None:
    views, meshes = list(cameras().values())[:1], still_life()
    moved = [
        Mesh(mesh.vertices + np.array([0.2, 0, 0]), mesh.triangles, mesh.colors, mesh.object_id) for mesh in meshes
    ]
    seen = []
    for run in ("a", "b"):
        (tmp_path / run).mkdir()
        job = BlenderJob(1, light=LIGHT, bands=BANDS, ink=INK)
        frames = [("one", views[0], meshes), ("two", views[0], moved), ("none", views[0], [])]
        told: list[tuple[int, int]] = []
        outputs = job.write(tmp_path / run, frames)
        job.run(blender, tmp_path / run, outputs, lambda done, total, told=told: told.append((done, total)))
        assert told == [(1, 3), (2, 3), (3, 3)]
        seen.append([read_exr(path).channels for path in outputs])
    for first, second in zip(*seen, strict=True):
        assert first.keys() == second.keys()
        assert all(np.array_equal(first[name], second[name]) for name in first)
    one, two, none = (passes_of(channels, 1, INK.width) for channels in seen[0])
    assert not np.array_equal(one.depth, two.depth)
    assert none.coverage.sum() == 0


def test_the_file_is_one_that_compositing_reads_as_it_is(blender: Blender, tmp_path: Path) -> None:
    job = BlenderJob(1, light=LIGHT)
    (output,) = job.write(tmp_path, [("frame", cameras()["plain"], still_life())])
    job.run(blender, tmp_path, [output])
    passes, ours = read_passes(output), render_passes(still_life(), cameras()["plain"])
    assert passes.depth is not None
    assert np.isinf(passes.depth).mean() == pytest.approx(np.isinf(ours.depth).mean(), abs=2e-3)
    assert passes.beauty is not None
    assert np.abs(passes.beauty - ours.beauty).mean() < 2e-3
