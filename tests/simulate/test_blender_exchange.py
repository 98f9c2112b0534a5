"""What goes to Blender and what comes back, without Blender: jobs, cameras, passes, results."""

from __future__ import annotations

import json
import os

import numpy as np
import pytest

from pegbar.errors import BlenderError
from pegbar.scene.camera import PerspectiveCamera
from pegbar.scene.mesh import Mesh
from pegbar.scene.volumes import TaperedCylinders
from pegbar.simulate.blender.cloth import UNIT, cloth_entry, colliders, settings_of, wind_of
from pegbar.simulate.blender.engine import BlenderEngine, limb_arrays
from pegbar.simulate.blender.locate import Blender, find_blender
from pegbar.simulate.blender.render import BlenderJob, camera_of, passes_of, squared, welded, write_meshes
from pegbar.simulate.blender.strands import Web, strand_settings, strands_entry
from pegbar.simulate.cache import MemoryCache
from pegbar.simulate.chains import Bobs
from pegbar.simulate.elements import Balls, Boxes, Cloth, Pin, Strands
from pegbar.simulate.engine import simulate_scene
from pegbar.simulate.materials import ClothMaterial, StrandMaterial, Wind
from pegbar.simulate.passes import Ink
from pegbar.simulate.scene import Character, PreRoll, SimulationScene
from tests.blenders import fake_blender

SQUARE = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]], (1, 0, 0, 1))
VIEW = PerspectiveCamera.look_at((0.5, 1.1, 3.0), (0, 0.4, 0), (120, 68), 0.8)


def blender_pixels(given, points, size):
    """Project as Blender does: lens and shift in picture widths, x right, y up, z backward."""
    local = (np.c_[points, np.ones(len(points))] @ np.linalg.inv(np.array(given["matrix"])).T)[:, :3]
    plane = local[:, :2] / -local[:, 2:] * given["focal"] - given["shift"]
    return np.stack([plane[:, 0] * size[0] + (size[0] - 1) / 2, (size[1] - 1) / 2 - plane[:, 1] * size[0]], axis=1)


@pytest.mark.parametrize("intrinsic", [None, ((150, 0, 30), (0, 150, 75)), ((190, 9, 40), (0, 140, 30))])
def test_blenders_camera_sees_points_where_ours_does(intrinsic):
    matrix = VIEW.matrix
    if intrinsic is not None:
        matrix = np.array([*intrinsic, (0, 0, 1.0)]) @ np.linalg.inv(VIEW.intrinsic) @ matrix
    view = PerspectiveCamera(matrix, (80, 110))
    points = np.random.default_rng(0).uniform(-1, 1, (50, 3))
    moved = squared(points, view)
    assert np.allclose(blender_pixels(camera_of(view), moved, view.image_size), view.project(points), atol=1e-6)
    assert np.allclose(view.depth(moved), view.depth(points))
    assert (moved is points) == (intrinsic is None or intrinsic[0][0] == 150)


def test_a_job_tells_blender_everything(tmp_path):
    job = BlenderJob(2, near=0.1, light=(0, 2, 0), bands=(0.5, 1), ink=Ink(1.5, (0, 0, 0, 1), None))
    other = Mesh(SQUARE.vertices, SQUARE.triangles, (0, 1, 0, 0.5), 0xFF05)
    assert job.write(tmp_path, [("a", VIEW, [SQUARE, other])]) == [tmp_path / "a.exr"]
    said = json.loads((tmp_path / "render.json").read_text())
    assert (said["size"], said["near"], said["light"], said["bands"]) == ([240, 136], 0.1, [0, 1, 0], [0.5, 1])
    assert said["ink"] == {"width": 3.0, "color": [0, 0, 0, 1], "crease_angle": None}
    with np.load(tmp_path / "a.npz") as file:
        assert file["ids"].tolist() == [1, 0x7F05]
        assert file["bare"].tolist() == [False, True]
        assert file["colors_1"].shape == (2, 3, 4)
        assert file["vertices_0"][file["triangles_0"]].tolist() == SQUARE.vertices[SQUARE.triangles].tolist()


def test_a_job_refuses_what_blender_cannot(tmp_path):
    larger = PerspectiveCamera(VIEW.matrix, (121, 68))
    with pytest.raises(ValueError, match="cameras of one size"):
        BlenderJob().write(tmp_path, [("a", VIEW, []), ("b", larger, [])])
    with pytest.raises(ValueError, match="bands: Blender takes up to 32, got 33"):
        BlenderJob(bands=np.ones(33)).write(tmp_path, [("a", VIEW, [])])
    with pytest.raises(ValueError, match="object_id: Blender takes those below 16384"):
        BlenderJob().write(tmp_path, [("a", VIEW, [Mesh(SQUARE.vertices, SQUARE.triangles, (1, 1, 1, 1), 0x4000)])])


def test_vertices_at_one_place_become_one_and_lines_are_left_out():
    twice = np.concatenate([SQUARE.vertices, SQUARE.vertices + 1e-9])
    triangles = np.array([[0, 1, 2], [4, 6, 7], [0, 4, 1]])
    vertices, found, kept = welded(Mesh(twice, triangles, (1, 0, 0, 1)))
    assert len(vertices) == 4
    assert kept.tolist() == [True, True, False]
    assert np.allclose(vertices[found], twice[triangles[:2]])


def channels(depth, index, beauty=(0.5, 0.5, 0.5, 1.0), ink=None, name="Object Index"):
    depth, index = np.array(depth, np.float32), np.array(index, np.float32)
    there = (depth < 1e9)[..., None] * np.array(beauty, np.float32)
    found = {f"ViewLayer.Combined.{letter}": there[..., i] for i, letter in enumerate("RGBA")}
    found |= {"ViewLayer.Depth.Z": depth, f"ViewLayer.{name}.X": index}
    if ink is not None:
        drawn = np.array(ink, np.float32)
        found |= {f"ViewLayer.Freestyle.{letter}": drawn * (letter == "A") for letter in "RGBA"}
    return found


@pytest.mark.parametrize("name", ["Object Index", "IndexOB"])
def test_blenders_background_is_nothing_and_large_ids_come_back(name):
    passes = passes_of(channels([[2, 1e10]], [[0x7F05, 3]], name=name), 1, 0)
    assert passes.depth.tolist() == [[2, np.inf]]
    assert passes.object_id.tolist() == [[0xFF05, 0]]
    assert passes.coverage.tolist() == [[1, 0]]
    assert passes.beauty[0, 1].tolist() == [0, 0, 0, 0]


def test_ink_gets_depth_and_id_of_the_nearest_surface_within_its_width():
    row, far = [1e10] * 9, 1e10
    depth = [row[:], [far, far, 5, 5, 3, far, far, far, far], row[:]]
    index = [[0] * 9, [0, 0, 2, 2, 1, 0, 0, 0, 0], [0] * 9]
    ink = [[0] * 9, [0, 1, 0, 1, 0, 1, 0, 0, 1], [0] * 9]
    passes = passes_of(channels(depth, index, ink=ink), 1, 1)
    inf = np.inf
    assert passes.depth[1].tolist() == [inf, 5, 5, 3, 3, 3, inf, inf, inf]
    assert passes.object_id[1].tolist() == [0, 2, 2, 1, 1, 1, 0, 0, 0]
    # Ink is black here, over what is under it; a line far from everything is dropped.
    assert passes.beauty[1, :, 3].tolist() == [0, 1, 1, 1, 1, 1, 0, 0, 0]
    assert passes.beauty[1, :, 0].tolist() == [0, 0, 0.5, 0, 0.5, 0, 0, 0, 0]
    assert np.array_equal(passes.coverage > 0, np.isfinite(passes.depth))


def test_a_missing_pass_is_an_error_that_lists_what_is_there():
    found = channels([[1]], [[1]])
    del found["ViewLayer.Depth.Z"]
    with pytest.raises(ValueError, match=r"Combined, Depth and Object Index, got ViewLayer\.Combined\.A"):
        passes_of(found, 1, 0)


def scene_of(*elements, frames=3, **more):
    way = np.arange(frames)[:, None, None] * np.array([0.1, 0, 0])
    radii = np.full((frames, 1), 0.1)
    volumes = TaperedCylinders(way, way + np.array([0.0, 1, 0]), radii, radii / 2)
    post = Character("post", ("top",), way + np.array([0, 1.2, 0]), ("trunk",), volumes)
    return SimulationScene(24, frames, elements, (post,), pre_roll=PreRoll(2, 1), **more)


FLAG = Cloth("flag", SQUARE.vertices, SQUARE.triangles, (Pin("marker", "top", np.array([2, 3])),))
BALLS = Balls("the balls", np.array([[0, 0.2, 0], [1, 0.2, 0]]), np.array([0.2, 0.1]))


def test_hulls_follow_the_limbs():
    found = limb_arrays(scene_of())
    assert found["limb_places"][:, 0].tolist() == [[x, 0.5, 0] for x in (0, 0, 0, 0.1, 0.2)]
    assert np.allclose(found["limb_scales"][2:], 1)
    assert (found["limb_scales"][0] < 0.2).sum() == 2
    # Round ends included.
    assert np.allclose([found["limb_hulls"][0, :, 1].min(), found["limb_hulls"][0, :, 1].max()], [-0.6, 0.55])


def test_cloth_meets_limbs_balls_and_boxes_where_the_cache_has_them():
    box = Boxes("box", np.array([[3.0, 0, 0]]), np.array([[0.2, 0.4, 0.6]]))
    scene, cache = scene_of(BALLS, box, FLAG), MemoryCache()
    for frame in range(3):
        turn = np.array([[0, 0, np.sin(np.pi / 4), np.cos(np.pi / 4)]])
        cache.write("the balls", frame, {"positions": BALLS.centers + np.array([0, frame, 0])})
        cache.write("box", frame, {"positions": box.centers, "rotations": turn})
    vertices, triangles = colliders(scene, cache)
    assert vertices.shape == (5, 3 * 98 + 8, 3)
    assert triangles.max() == vertices.shape[1] - 1
    first = vertices[:, 98:196]
    assert np.allclose(np.linalg.norm(first[4] - [0, 2.2, 0], axis=1), 0.2)
    assert np.allclose(first[0], first[2])
    # A quarter of a turn about z swaps width and height.
    assert np.allclose(np.ptp(vertices[4, -8:], axis=0), [0.4, 0.2, 0.6])
    sides = vertices[4][triangles[-12:]]
    outward = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    assert (np.einsum("ti,ti->t", outward, sides.mean(axis=1) - box.centers[0]) > 0).all()


def test_triangles_are_turned_to_where_their_normals_look(tmp_path):
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1.0, 0]])
    colors = np.eye(4, dtype=np.float32)
    mesh = Mesh(square, np.array([[0, 1, 2], [0, 3, 2]]), colors, 1, np.tile((0.1, 0, 1.0), (4, 1)))
    camera = PerspectiveCamera.look_at((0, 0, 3.0), (0, 0, 0), (16, 16), 0.8)
    write_meshes(tmp_path / "m.npz", [mesh], camera)
    with np.load(tmp_path / "m.npz") as file:
        places, sides, shades = file["vertices_0"], file["triangles_0"], file["colors_0"]
    corners = places[sides]
    assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0).all()
    # Colours stay with their corners.
    for side, shade in zip(corners, shades.reshape(2, 3, 4), strict=True):
        for place, color in zip(side, shade, strict=True):
            assert np.array_equal(color, colors[np.flatnonzero((square == place).all(axis=1))[0]])


def test_a_cloth_is_told_with_its_pins_speed_and_wind():
    entry, found = cloth_entry(scene_of(FLAG, wind=Wind((3.0, 0, 0), 0.0)), FLAG, "c", 20, True)
    assert entry["self_collision"] is True
    assert found["c_pins"].tolist() == [2, 3]
    assert np.allclose(found["c_launch"], [0.1, 0, 0])
    assert np.allclose(found["c_places"][2], FLAG.vertices[2:] + np.array([0.2, 0, 0]))
    # 0.6 v^2 N/m^2 in Blender's units.
    assert np.allclose(found["c_wind"], [[24 * 0.6 * 9 * 0.001 / 0.02, 0, 0]] * 5)
    assert wind_of(scene_of(FLAG), FLAG, FLAG.vertices[:3]).shape == (0, 3)


def test_a_material_in_blenders_terms():
    cloth = Cloth("c", FLAG.vertices, FLAG.triangles, material=ClothMaterial(density=0.2, stretch=0.01, drag=0.0))
    found = settings_of(cloth, 20, 24.0)
    assert found["mass"] == pytest.approx(0.2 / 4)
    length = (4 + 2 * 2**0.5) / 6
    assert found["tension_stiffness"] / length == pytest.approx(0.001 * 10 / 0.01)
    assert found["time_scale"] * UNIT == pytest.approx(1 / 24, rel=1e-3)
    assert float(np.float32(found["time_scale"] / 16) * 16) == found["time_scale"]
    assert found["air_damping"] == pytest.approx(100 * UNIT * 0.05 * 0.3)


LINES = np.array([[0, 1.2, 0], [0, 1.1, 0], [0, 1.0, 0], [0, 0.9, 0], [1, 1, 0], [1, 0.9, 0]])
TOP = Pin("marker", "top", np.array([0, 1]))


def tassel(**more):
    return Strands("tassel", LINES, np.array([4, 2]), np.array([0.01, 0.01]), (TOP,), **more)


def test_strands_are_told_as_slivers_with_the_wind_as_a_pull():
    material = StrandMaterial(density=800, bend=1e-4, stretch=0.01, drag=0.5)
    strands = tassel(material=material)
    entry, found = strands_entry(scene_of(strands, wind=Wind((2.0, 0, 0), 0.0)), strands, "s", 16)
    assert entry["pulls"] is True
    assert entry["thickness"] == pytest.approx(0.01)
    # No sliver and no edge goes from one strand to the next.
    assert found["s_triangles"].tolist() == [[0, 1, 2], [1, 2, 3]]
    assert found["s_seams"].tolist() == [[4, 5]]
    assert np.allclose(found["s_launch"], [0.1, 0, 0])
    assert np.allclose(found["s_places"][2], LINES[:2] + np.array([0.2, 0, 0]))
    mass = np.pi * 0.01**2 * 0.4 * 800 / 6
    push = 1.2 / 2 * 0.5 * 0.02 * 0.4 / 6 / mass * 4
    assert np.allclose(found["s_wind"], [[push, -9.81, 0]] * 5)


def test_a_strands_material_in_blenders_terms():
    strands = tassel(material=StrandMaterial(bend=1e-4, stretch=0.01, drag=0.0))
    found = strand_settings(strands, Web(strands), 16, 24.0)
    # Four links of 0.1 m and two springs over two.
    length = (4 * 0.1 + 2 * 0.2) / 6
    assert found["mass"] == pytest.approx(np.pi * 0.01**2 * 0.4 * 800 / 6)
    assert found["tension_stiffness"] / length == pytest.approx(0.001 * 10 / 0.01 / 0.1)
    assert found["compression_stiffness"] / length == pytest.approx(0.001 * 16 * 1e-4 / 0.1**3 / 0.25)
    assert found["air_damping"] == pytest.approx(100 * UNIT * found["mass"] * 0.3)
    stiff = strand_settings(tassel(material=StrandMaterial(bend=10.0)), Web(strands), 16, 24.0)
    # No stiffer than to grow by 0.2% under five times the weight of one of the two.
    pull = 5 * 9.81 * np.pi * 0.01**2 * 0.2 * 800 / 0.002
    assert stiff["compression_stiffness"] == stiff["tension_stiffness"] == pytest.approx(length * 0.001 * pull / 0.1)


def test_strands_with_bobs_that_differ_are_refused_by_name():
    engine = BlenderEngine(Blender("blender", False, "5.0.1"))
    assert engine.supports(tassel())
    assert engine.supports(tassel(bobs=Bobs(np.array([0.05, 0.05]))))
    with pytest.raises(ValueError, match=r"blender cannot simulate tassel \(Strands\)"):
        simulate_scene(scene_of(tassel(bobs=Bobs(np.array([0.05, 0.08])))), MemoryCache(), [engine])


WRITES = """
sys.path.insert(0, {tree!r})
import json, numpy as np
folder = arguments[-1]
job = json.load(open(folder + "/simulate.json"))
given = np.load(folder + "/simulate.npz")
frames = job["total"] - job["pre_roll"]
for entry in job["bodies"] + job["cloths"]:
    name = entry["name"]
    start = given[name + ("_centers" if entry in job["bodies"] else "_start")]
    places = start + np.arange(frames)[:, None, None] * np.array([0.01, 0, 0])
    state = dict(positions=places, rotations=np.tile([0, 0, 0, 1.0], (frames, len(start), 1)))
    {spoil}
    np.savez(folder + "/" + name + ".npz", **state)
print("pegbar:progress:1:1")
print("pegbar:done")
"""


def engine_that(folder, spoil="pass"):
    return BlenderEngine(find_blender(fake_blender(folder, WRITES.format(tree=str(folder), spoil=spoil))))


@pytest.mark.skipif(os.name == "nt", reason="the pretended programs are scripts")
def test_the_engine_puts_what_blender_wrote_into_the_cache(tmp_path):
    scene, cache, told = scene_of(FLAG, BALLS, tassel()), MemoryCache(), []
    simulate_scene(scene, cache, [engine_that(tmp_path)], progress=lambda *step: told.append(step))
    assert np.allclose(cache.read("flag", 2)["positions"], FLAG.vertices + np.array([0.02, 0, 0]))
    assert np.allclose(cache.read("tassel", 2)["positions"], LINES + np.array([0.02, 0, 0]))
    assert np.allclose(cache.read("the balls", 1)["velocities"], [0.24, 0, 0])
    assert cache.read("the balls", 1)["rotations"].shape == (2, 4)
    assert told == [("blender", 2, 3), ("blender", 3, 3)]


@pytest.mark.skipif(os.name == "nt", reason="the pretended programs are scripts")
@pytest.mark.parametrize(
    ("spoil", "problem"),
    [
        ("state['positions'] = places[:-1]", r"wrote positions of shape \(2, 2, 3\), want \(3, 2, 3\)"),
        ("del state['rotations']", "cannot be read"),
        ("continue", "did not write element_0.npz"),
        ("open(folder + '/' + name + '.npz', 'wb').write(b'PK rubbish'); continue", "cannot be read"),
        ("places[1] = np.nan", "frame 0: the simulation exploded|frame 1: the simulation exploded"),
    ],
)
def test_a_wrong_result_is_an_error_and_never_in_the_cache(tmp_path, spoil, problem):
    cache = MemoryCache()
    with pytest.raises((BlenderError, RuntimeError), match=problem):
        simulate_scene(scene_of(BALLS), cache, [engine_that(tmp_path, spoil)])
    assert cache.frames("the balls") == []


def test_an_element_that_blender_lacks_is_named():
    thrown = Balls("thrown", BALLS.centers, BALLS.radii, np.array([[0, 1.0, 0], [0, 0, 0]]))
    engine = BlenderEngine(Blender("blender", False, "5.0.1"))
    assert engine.supports(FLAG)
    assert engine.supports(BALLS)
    with pytest.raises(ValueError, match=r"elements: blender cannot simulate thrown \(Balls\)"):
        simulate_scene(scene_of(FLAG, thrown), MemoryCache(), [engine])
