import dataclasses

import numpy as np
import pytest

from pegbar.io.motion import read_motion
from pegbar.io.puppet_input import read_puppet_input
from pegbar.puppet.deform import Deformer
from pegbar.puppet.make import build_puppet, make_puppet, plan_figure, pose_again, prepare_figure
from tests.figures import animal, clip, figure

CHARACTERS = "drawings/animated_drawings"


@pytest.mark.parametrize("source", [figure(), figure(60), animal()], ids=["front", "half", "animal"])
def test_a_puppet_is_whole_and_can_be_deformed(source):
    puppet = make_puppet(source, clip(), clip="wave", completion="flat")
    assert puppet.clip == "wave"
    assert puppet.background is None
    assert len(puppet.textures) == len(puppet.layers)
    assert (puppet.joint_handles >= 0).all()
    np.testing.assert_array_equal(puppet.bone_layer[puppet.triangle_bone], puppet.triangle_layer)
    mesh = Deformer(puppet.vertices, puppet.triangles, puppet.handles)
    rest = puppet.vertices[puppet.handles]
    np.testing.assert_allclose(mesh.deform(rest), puppet.vertices, atol=1e-6)
    with pytest.raises(ValueError, match="read-only"):
        puppet.vertices[0] = 0


def test_the_background_is_completed_on_request():
    source = figure()
    opaque = dataclasses.replace(source, image=np.ascontiguousarray(source.image[..., :3]))
    behind = make_puppet(opaque, clip(), completion="flat", background=True).background
    assert (behind > 250).all()
    assert make_puppet(source, clip(), completion="flat", background=True).background is None


def test_another_clip_takes_what_is_there():
    figure_ = prepare_figure(figure())
    assert prepare_figure(figure_) is figure_
    first = build_puppet(figure_, plan_figure(figure_, clip()), completion="flat")
    other = plan_figure(figure_, clip(sway=0.02, frames=5))
    again = pose_again(first, figure_, other, clip="other")
    whole = make_puppet(figure(), clip(sway=0.02, frames=5), completion="flat", clip="other")
    assert again.clip == "other"
    assert again.pose_frame == whole.pose_frame == 2
    np.testing.assert_array_equal(again.pose, whole.pose)
    np.testing.assert_array_equal(again.vertices, whole.vertices)


@pytest.mark.parametrize(
    ("name", "view"), [("char1", "front"), ("char2", "front"), ("char4", "front"), ("char6", "side")]
)
def test_real_drawings(test_data, name, view):
    source = read_puppet_input(test_data / CHARACTERS / name / "texture.png")
    motion = read_motion(test_data / "mocap" / "bvh" / "ad_fair1_dab.bvh")
    puppet = make_puppet(source, motion, completion="flat")
    assert puppet.view == view
    assert 600 <= len(puppet.triangles) <= 2500
    assert len(puppet.layers) == (1 if view == "front" else 4)
    assert puppet.fitted == (name != "char6")
    Deformer(puppet.vertices, puppet.triangles, puppet.handles)


def test_a_drawing_from_the_side_has_four_layers_and_the_legs_come_out_from_under_the_coat(test_data):
    source = read_puppet_input(test_data / "annotated" / "morevna_side_walk" / "annotation.json")
    motion = read_motion(test_data / "mocap" / "bvh" / "cmu_07_01.bvh")
    puppet = make_puppet(source, motion, completion="flat")
    assert puppet.layers == ("left arm", "body", "left leg", "right leg", "right arm")
    assert puppet.view in ("half profile", "side")


def test_limbs_drawn_one_over_the_other_are_the_nearer_ones_and_both_are_whole():
    source = figure(90)
    points = source.marks.copy()
    for side in ("left", "right"):
        points[source.names.index(f"{side}_hip")] = points[source.names.index("pelvis")]
    puppet = make_puppet(dataclasses.replace(source, marks=points), clip(), completion="flat")
    assert puppet.layers[0] == "left arm"
    whole = [name for name, handle in zip(puppet.names, puppet.joint_handles, strict=True) if handle >= 0]
    assert set(puppet.names) - set(whole) <= {"left_hip", "right_hip"}
    Deformer(puppet.vertices, puppet.triangles, puppet.handles)
