"""From marks and limb colours to volumes in 3D: the sample shot, whose truth is known, and real drawings."""

import dataclasses
import json

import numpy as np
import pytest

from pegbar import DegenerateError, PerspectiveCamera, read_annotations, write_annotations
from pegbar.io.frames import read_picture
from pegbar.sample.figure import RADII
from pegbar.sample.shot import write_sample
from pegbar.shot.driving_stage import DrivingStage, read_driving
from pegbar.shot.model import SecondarySection

SECTION = SecondarySection(elements=["skirt"])


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    """The sample shot, 12 small frames, without boxes of its own."""
    shot = write_sample(tmp_path_factory.mktemp("driven"), size=(480, 270), frames=12, samples=1)
    marks = read_annotations(shot.parent / "annotation.json")
    write_annotations(shot.parent / "annotation.json", dataclasses.replace(marks, boxes=None))
    return shot


def stage(shot, section=SECTION):
    return DrivingStage(shot, section, shot.parent / "secondary")


def test_volumes_are_as_thick_as_the_dancer_and_stand_on_her_floor(sample):
    driving, made = stage(sample).run()
    assert made
    assert driving.ground == pytest.approx(0, abs=0.06)
    known = 0
    for limb, name in enumerate(driving.limb_names):
        radii = RADII[name.removeprefix("left_").removeprefix("right_")]
        if name in ("torso", "head") or name.endswith(("foot", "hand", "thigh")):
            continue
        known += 1
        found = [np.median(driving.volumes.start_radius[:, limb]), np.median(driving.volumes.end_radius[:, limb])]
        np.testing.assert_allclose(found, radii, atol=0.018)
    assert known == 6
    truth = np.load(sample.parent / "truth.npz")
    np.testing.assert_allclose(driving.positions, truth["drawn"], atol=2e-3)


def test_end_caps_reproject_to_their_boxes_to_half_a_pixel(sample):
    driving, _ = stage(sample).run()
    volumes, boxes = driving.volumes, driving.boxes
    for row, matrix in enumerate(driving.matrices):
        camera = PerspectiveCamera(matrix, driving.image_size)
        for end, radius, (a, b) in (
            (volumes.start, volumes.start_radius, (0, 3)),
            (volumes.end, volumes.end_radius, (1, 2)),
        ):
            wide = radius[row] * camera.focal_length / camera.depth(end[row])
            drawn = np.linalg.norm(boxes[row, :, a] - boxes[row, :, b], axis=1) / 2
            np.testing.assert_allclose(wide, drawn, atol=0.5)
            middle = (boxes[row, :, a] + boxes[row, :, b]) / 2
            np.testing.assert_allclose(camera.project(end[row]), middle, atol=0.5)


def test_results_stand_until_something_changes_and_read_back(sample):
    first, _ = stage(sample).run()
    again, made = stage(sample).run()
    assert not made
    for field in dataclasses.fields(first):
        if field.name not in ("volumes", "notes"):
            np.testing.assert_array_equal(getattr(again, field.name), getattr(first, field.name))
    assert read_driving(stage(sample).outputs()[0]).limb_names == first.limb_names
    assert not stage(sample, SecondarySection(elements=["skirt"], ground=0.1)).is_done()
    other, _ = stage(sample, SecondarySection(elements=["skirt"], ground=0.1)).run()
    assert other.ground == 0.1
    assert read_picture(stage(sample).outputs()[1]).shape[1] > 480


def change(shot, folder, edit):
    """A copy of the shot file and its marks in `folder`, with the pictures where they are."""
    folder.mkdir(exist_ok=True)
    marks = json.loads((shot.parent / "annotation.json").read_text())
    edit(marks)
    (folder / "annotation.json").write_text(json.dumps(marks))
    text = (
        shot.read_text()
        .replace('"drawings/', f'"{shot.parent}/drawings/')
        .replace('"labels/', f'"{shot.parent}/labels/')
    )
    start = text.index("[passes]")
    (folder / "shot.toml").write_text(text[:start])
    return folder / "shot.toml"


def test_a_marker_that_no_drawing_shows_costs_its_limbs_their_volumes(sample, tmp_path):
    def hide(marks):
        hand = marks["markers"].index("left_finger")
        for frame in marks["frames"]:
            frame["xy"][hand], frame["visible"][hand] = None, False

    driving, _ = stage(change(sample, tmp_path / "hidden", hide)).run()
    assert any("left_finger is missing in all drawings: left_hand without" in note for note in driving.notes)
    assert np.isnan(driving.volumes.end_radius[:, driving.limb_names.index("left_hand")]).all()
    assert np.isfinite(driving.volumes.end_radius[:, driving.limb_names.index("left_forearm")]).all()


def test_a_marker_that_some_drawings_lack_is_filled_and_flagged(sample, tmp_path):
    def hide(marks):
        elbow = marks["markers"].index("left_elbow")
        marks["frames"][4]["xy"][elbow], marks["frames"][4]["visible"][elbow] = None, False

    whole, _ = stage(sample).run()
    driving, _ = stage(change(sample, tmp_path / "gap", hide)).run()
    elbow = driving.names.index("left_elbow")
    assert driving.estimated[4, elbow]
    assert np.linalg.norm(driving.markers[4, elbow] - whole.markers[4, elbow]) < 40
    assert np.isfinite(driving.volumes.start).all()


def test_a_box_that_is_inside_out_is_named(sample, tmp_path):
    def turn(marks):
        for frame in marks["frames"]:
            frame["boxes"] = [[[0, 0], [9, 0], [9, 5], [0, 5]]] * len(marks["limbs"])
        marks["frames"][3]["boxes"] = [[[0, 0], [9, 5], [9, 0], [0, 5]]] * len(marks["limbs"])

    with pytest.raises(DegenerateError, match="drawing 4, limb torso: its box is inside out"):
        stage(change(sample, tmp_path / "turned", turn)).run()


def test_a_limb_of_no_length_is_named(sample, tmp_path):
    def shrink(marks):
        foot, knee = (marks["markers"].index(name) for name in ("left_foot", "left_knee"))
        for frame in marks["frames"]:
            frame["xy"][foot] = frame["xy"][knee]

    with pytest.raises(DegenerateError, match="limb left_shin: it has no length in any drawing"):
        stage(change(sample, tmp_path / "short", shrink)).run()


def test_a_camera_that_knows_no_up_is_turned(test_data, tmp_path):
    folder = test_data / "annotated/morevna_side_walk"
    for number in range(0, 12, 3):
        (tmp_path / f"{number:03d}.png").symlink_to(folder / f"frames/{number:03d}.png")
    (tmp_path / "shot.toml").write_text(
        f'[shot]\n[drawing]\nframes = "###.png"\nlabels = "{folder}/seg/###.png"\n'
        f'annotations = "{folder}/annotation.json"\n'
    )
    driving, _ = stage(tmp_path / "shot.toml").run()
    head, foot = (driving.positions[:, driving.names.index(name), 1] for name in ("head", "left_foot"))
    assert (head > foot + 1).all()
    assert 0 < (foot.min() - driving.ground) < 0.3
    camera = PerspectiveCamera(driving.matrices[2], driving.image_size)
    np.testing.assert_allclose(camera.project(driving.positions[2]), driving.markers[2], atol=1e-6)
