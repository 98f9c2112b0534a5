import hashlib
import tomllib

import numpy as np
import pytest

from pegbar.io.annotations import read_annotations
from pegbar.io.exr import read_passes
from pegbar.io.frames import read_image
from pegbar.sample.clearance import capsules, distance
from pegbar.sample.elements import AT_HAND, HOOP_TUBE, RIBBON_LENGTH, RIBBON_WIDTH, hoop, hoop_ring, ribbon, ribbon_line
from pegbar.sample.figure import PALETTE
from pegbar.sample.shot import make_frame, make_scene, write_sample
from pegbar.sample.skeleton import NAMES
from pegbar.scene.camera import PerspectiveCamera
from pegbar.shot.dots_stage import DotsStage


@pytest.fixture(scope="module")
def scene():
    return make_scene()


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sample")
    steps = []
    shot = write_sample(folder, size=(192, 108), frames=6, progress=lambda done, of: steps.append((done, of)))
    assert steps == [(done, 6) for done in range(1, 7)]
    return shot


def digest(folder):
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def test_the_same_bits_whatever_the_workers(written, tmp_path):
    write_sample(tmp_path, size=(192, 108), frames=6, workers=1)
    assert digest(tmp_path) == digest(written.parent)
    assert len(digest(tmp_path)) == 4 * 6 + 5


def test_everything_that_is_named_is_there(written):
    shot = tomllib.loads(written.read_text())
    assert shot["shot"] == {"name": "sample", "frames": "1-6", "frame_rate": 24, "size": [192, 108]}
    wanted = {f"#{r:02x}{g:02x}{b:02x}": limb for (r, g, b), limb in PALETTE.items()}
    assert shot["drawing"]["palette"] == wanted
    for pattern in (shot["drawing"]["frames"], shot["drawing"]["labels"], shot["passes"]["beauty"]):
        for number in range(1, 7):
            assert (written.parent / pattern.replace("####", f"{number:04d}")).is_file()
    marked = read_annotations(written.parent / shot["drawing"]["annotations"])
    truth = np.load(written.parent / "truth.npz")
    assert tuple(truth["names"]) == marked.names == NAMES
    assert marked.loops
    assert marked.frame_rate == 24
    assert marked.image_size == (192, 108)
    for index, camera in enumerate(marked.cameras):
        np.testing.assert_allclose(camera.matrix, truth["matrices"][index], atol=1e-9)
        np.testing.assert_allclose(marked.markers[index], camera.project(truth["drawn"][index]), atol=1e-6)
        np.testing.assert_allclose(marked.depths[index], camera.depth(truth["drawn"][index]), atol=1e-6)
    assert [path.name for path in marked.images] == [f"dancer.{number:04d}.png" for number in range(1, 7)]
    assert not np.allclose(truth["clip"], truth["drawn"])


def test_the_pictures_fit_together(written):
    drawing = read_image(written.parent / "drawings/dancer.0001.png")
    labels = read_image(written.parent / "labels/labels.0001.png")
    passes = read_passes(written.parent / "passes/passes.0001.exr")
    assert drawing.shape == (108, 192, 4)
    assert labels.shape == (108, 192, 3)
    assert passes.beauty.shape == (216, 384, 4)
    assert passes.depth.shape == (216, 384)
    covered = passes.beauty[..., 3] > 0
    assert np.array_equal(np.isfinite(passes.depth), covered)
    assert 0.005 < covered.mean() < 0.2
    assert passes.depth[covered].min() > 3
    assert passes.depth[covered].max() < 7


def test_the_clip_is_written_as_bvh(written):
    lines = (written.parent / "clip.bvh").read_text().split("\n")
    assert lines[0] == "HIERARCHY"
    assert sum(name in line for line in lines for name in NAMES if line.split()[-1:] == [name]) == len(NAMES)
    assert "Frames: 6" in [line.strip() for line in lines]


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("size", {"size": (0, 5)}),
        ("size", {"size": (4.5, 5)}),
        ("frames", {"frames": 0}),
        ("samples", {"samples": 0}),
        ("samples", {"samples": 1.5}),
    ],
)
def test_wrong_input_is_named_before_anything_is_written(name, options, tmp_path):
    with pytest.raises(ValueError, match=f"^{name}: "):
        write_sample(tmp_path / "shot", **options)
    assert not (tmp_path / "shot").exists()


def test_the_hoop_keeps_clear_of_the_body_and_goes_round_it(scene):
    turn = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    heights = []
    for index in range(48):
        ring = hoop_ring(index, turn)
        gap, _ = distance(ring, capsules(scene.pose(index)))
        assert gap.min() > HOOP_TUBE + 0.03, index
        view, chest = scene.cameras[index], scene.pose(index).at("pelvis")
        depths = view.depth(ring)
        assert depths.min() < view.depth(chest) - 0.3
        assert depths.max() > view.depth(chest) + 0.3
        heights.append(ring[:, 1].mean())
    assert max(heights) - min(heights) > 0.4
    mesh = hoop(7.0)
    gap, _ = distance(mesh.vertices, capsules(scene.pose(7)))
    assert gap.min() > 0.03


def test_the_ribbon_is_held_and_otherwise_keeps_clear(scene):
    for index in range(0, 48, 2):
        body = scene.pose(index)
        line = ribbon_line(index, body.tail)
        at = np.linspace(0, RIBBON_LENGTH, len(line))
        gap, _ = distance(line[at > AT_HAND], capsules(body))
        assert gap.min() > RIBBON_WIDTH / 2, index
        assert np.linalg.norm(line[0] - body.at("left_finger")) < 0.05
        assert line[:, 1].min() > 0
        step = np.linalg.norm(np.diff(line, axis=0), axis=1)
        assert step.max() < 0.12


def test_elements_and_cameras_loop(scene):
    tail = scene.pose(0).tail
    for make in (hoop, lambda time: ribbon(time, tail)):
        np.testing.assert_allclose(make(0.0).vertices, make(48.0).vertices, atol=1e-9)
    assert np.array_equal(hoop(0.0).colors, hoop(48.0).colors)
    whole = make_scene((64, 36), 47).cameras + make_scene((64, 36), 1).cameras
    assert whole[-1] == whole[0] == make_scene((64, 36), 3).cameras[0]
    assert isinstance(whole[5], PerspectiveCamera)
    assert whole[5] != whole[0]
    assert np.degrees(whole[0].field_of_view) == pytest.approx(40)


def test_a_frame_is_a_pure_function():
    first, second = (make_frame(17, make_scene()) for _ in range(2))
    for name in ("drawing", "labels", "visible"):
        assert np.array_equal(getattr(first, name), getattr(second, name))
    assert np.array_equal(first.passes.beauty, second.passes.beauty)
    assert np.array_equal(first.passes.depth, second.passes.depth)


def test_the_elements_pass_before_and_behind_limbs_in_every_part_of_the_dance(scene):
    """Over the loop the hoop and the ribbon lie both before and behind the figure."""
    for index in range(0, 48, 12):
        frame = make_frame(index, scene, samples=1)
        figure = frame.labels.any(axis=2) & np.isfinite(frame.passes.depth)
        body = scene.cameras[index].depth(scene.pose(index).at("chest"))
        assert (frame.passes.depth[figure] < body).sum() > 50
        assert (frame.passes.depth[figure] > body).sum() > 50


def test_the_dots_give_the_annotated_marks(tmp_path):
    write_sample(tmp_path, size=(960, 540), frames=2, samples=1)
    stage = DotsStage(tmp_path / "dots.toml")
    stage.run()
    found, known = read_annotations(stage.output), read_annotations(tmp_path / "annotation.json")
    assert found.names == known.names
    assert np.array_equal(found.visible, known.visible)
    assert 30 < known.visible.sum() < known.visible.size
    # Half a pixel of a dot's own; more where a later dot covers part of an earlier one.
    away = np.linalg.norm(found.markers - known.markers, axis=2)[known.visible]
    assert np.median(away) < 0.3
    assert away.max() < 3
