import numpy as np
import pytest
import yaml

from pegbar import FormatError, read_annotations, write_annotations
from pegbar.io.animated_drawings import read_char_config
from pegbar.scene.body import LIMBS, MARKERS


@pytest.mark.parametrize("name", ["char1", "char2", "char4"])
def test_real_people_have_all_canonical_markers(name, test_data, tmp_path):
    folder = test_data / "drawings" / "animated_drawings" / name
    drawing = read_annotations(folder / "char_cfg.yaml")
    assert drawing.names == MARKERS
    assert drawing.limbs == LIMBS
    assert drawing.images == (folder / "texture.png",)
    assert drawing.masks == (folder / "mask.png",)
    assert drawing.markers.shape == (1, 16, 2)
    assert (drawing.markers < drawing.image_size).all()
    place = dict(zip(drawing.names, drawing.markers[0], strict=True))
    joints = {
        joint["name"]: joint["loc"] for joint in yaml.safe_load((folder / "char_cfg.yaml").read_text())["skeleton"]
    }
    for marker, joint in {"pelvis": "hip", "neck": "torso", "head": "neck", "left_hand": "left_hand"}.items():
        assert place[marker].tolist() == joints[joint]
    # Head above neck above chest above pelvis, neck between the shoulders: the drawing stands upright.
    assert place["head"][1] < place["neck"][1] < place["chest"][1] < place["pelvis"][1]
    assert np.abs(place["neck"] - (place["left_shoulder"] + place["right_shoulder"]) / 2).max() <= 1
    write_annotations(tmp_path / "a.json", drawing)
    assert np.array_equal(read_annotations(tmp_path / "a.json").markers, drawing.markers)


def test_a_real_four_legged_character_keeps_its_own_joints(test_data):
    drawing = read_annotations(test_data / "drawings" / "animated_drawings" / "char6" / "char_cfg.yaml")
    assert drawing.names[:4] == ("pelvis", "chest", "neck", "head")
    assert "root" not in drawing.names
    assert len(drawing.names) == 16
    limbs = {limb.name: (limb.start, limb.end) for limb in drawing.limbs}
    assert limbs["left_knee_f"] == ("left_hip_f", "left_knee_f")
    assert limbs["right_hip_b"] == ("pelvis", "right_hip_b")
    assert limbs["torso"] == ("neck", "pelvis")
    assert len(limbs) == 14
    assert drawing.limb_markers.shape == (14, 2)


JOINT = "- {name: root, loc: [1, 2], parent: null}\n"
HEAD = "width: 9\nheight: 8\nskeleton:\n"


def test_a_character_without_pictures_beside_it(tmp_path):
    file = tmp_path / "char_cfg.yaml"
    file.write_text(
        HEAD + JOINT + "- {name: hip, loc: [3, 4], parent: root}\n- {name: tail, loc: [5, 6], parent: hip}\n"
    )
    drawing = read_char_config(file)
    assert drawing.names == ("pelvis", "tail")
    assert [(limb.name, limb.start, limb.end) for limb in drawing.limbs] == [("tail", "pelvis", "tail")]
    assert drawing.images == drawing.masks == ()
    assert drawing.image_size == (9, 8)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("width: 9\nheight: [}", r"yaml:2: not YAML"),
        ("width: \x01", "not YAML: unacceptable character"),
        ("width: 9\nheight: 8\n", "want a character with width, height and skeleton"),
        ("just words", "want a character"),
        ("!!python/object:os.system {}", "not YAML"),
        (HEAD.replace("9", "-1") + JOINT, "width: want a whole number"),
        (HEAD + " []", "skeleton: no joint besides the root"),
        (HEAD + "- {name: root}\n", r"skeleton\[0\]: want name, loc and parent"),
        (HEAD + JOINT.replace("2]", ".nan]"), r"skeleton\[0\].loc\[1\]: want a number"),
        (HEAD + JOINT.replace("2]", "2, 3]"), r"skeleton\[0\].loc: want 2 entries, got 3"),
        (HEAD + JOINT + JOINT, r"skeleton\[1\].name: the joint 'root' stands twice"),
        (HEAD + JOINT.replace("null", "spine"), r"skeleton\[0\].parent: no joint before it is called 'spine'"),
        (HEAD + JOINT.replace("root", "7"), r"skeleton\[0\].name: want a text"),
        (HEAD + JOINT, "no joint besides the root"),
        ("a: &a [*a]", "not YAML|want a character"),
    ],
)
def test_what_is_wrong_is_named(text, problem, tmp_path):
    file = tmp_path / "char_cfg.yaml"
    file.write_text(text)
    for read in (read_char_config, read_annotations):
        with pytest.raises(FormatError, match=problem) as error:
            read(file)
        assert str(error.value).startswith(str(file))
        assert "\n" not in str(error.value)


def test_a_real_file_cut_anywhere_is_refused(test_data, tmp_path):
    data = (test_data / "drawings" / "animated_drawings" / "char1" / "char_cfg.yaml").read_bytes()
    file = tmp_path / "char_cfg.yaml"
    for twentieth in range(20):
        file.write_bytes(data[: len(data) * twentieth // 20])
        with pytest.raises(FormatError, match=r"char_cfg\.yaml"):
            read_annotations(file)
