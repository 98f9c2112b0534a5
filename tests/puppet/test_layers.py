import cv2
import numpy as np
import pytest

from pegbar.io.motion import read_motion
from pegbar.io.puppet_input import read_puppet_input
from pegbar.puppet.layers import cut_layers, give_slivers, plan_layers
from pegbar.puppet.limbs import drawn_limbs
from pegbar.puppet.make import plan_figure, prepare_figure
from pegbar.puppet.parts import Parts, grow_parts
from pegbar.puppet.view import seen_pose
from pegbar.scene.body import MARKERS
from tests.figures import animal, clip, figure

ACROSS = {"left_elbow": (0.27, 1.2, 0.16), "left_hand": (-0.02, 1.1, 0.2)}


def cut(source, order=None, view=None):
    seen = seen_pose(source, clip(), view=view)
    parts = grow_parts(source, source.mask)
    limbs = drawn_limbs(source, parts, seen)
    plan = plan_layers(len(source.bones), limbs, seen.view, order)
    return plan, cut_layers(source, source.mask, parts, plan), limbs


def test_from_the_front_all_is_one_layer():
    plan, layers, _ = cut(figure())
    assert plan.names == ("body",)
    np.testing.assert_array_equal(layers[0].drawn, figure().mask)
    assert plan.bone_layer.tolist() == [0] * 15


@pytest.mark.parametrize(("azimuth", "near", "far"), [(60, "left", "right"), (-60, "right", "left")])
def test_from_the_side_there_are_four(azimuth, near, far):
    plan, layers, limbs = cut(figure(azimuth))
    assert plan.names == (f"{near} arm", "body", f"{far} leg", f"{far} arm")
    assert limbs[0].name.startswith(near)
    assert sum(layer.parent < 0 for layer in layers) == 1
    for layer in layers:
        assert not (layer.drawn & ~layer.region).any()
    shown = np.any([layer.drawn for layer in layers], axis=0)
    assert (shown != figure(azimuth).mask).mean() < 0.001


def test_an_arm_across_the_trunk_has_a_layer_and_the_trunk_goes_on_behind_it():
    plan, layers, limbs = cut(figure(changes=ACROSS), view="front")
    assert next(limb for limb in limbs if limb.name == "left arm").beside
    assert plan.names == ("left arm", "body")
    arm, body = layers
    behind = body.region & arm.drawn & ~body.drawn
    x, y = np.rint(figure(changes=ACROSS).marks[MARKERS.index("left_hand")]).astype(int)
    assert behind[y, x]
    # Where the arm hangs both are there, but nothing of the trunk is beyond the figure.
    assert not (body.region & ~figure(changes=ACROSS).mask).any()


def test_a_hidden_arm_lies_behind():
    source = figure(changes=ACROSS, hidden=("left_elbow", "left_hand"))
    assert cut(source, view="front")[0].names == ("body", "left arm")


def test_layers_can_be_ordered():
    wanted = ("right arm", "body", "left arm", "right leg")
    plan, layers, _ = cut(figure(60), wanted)
    assert plan.names == tuple(layer.name for layer in layers) == wanted
    with pytest.raises(ValueError, match="layer_order: want left arm, body, right leg, right arm in some order"):
        cut(figure(60), ("body", "hat"))


def test_an_animal_has_a_layer_a_far_leg():
    plan, _, limbs = cut(animal())
    assert plan.names[plan.names.index("body") + 1 :] == ("left hip b", "left hip f")
    assert {limb.kind for limb in limbs} == {"arm", "leg", ""}
    assert sorted(bone for bones in plan.bones for bone in bones) == list(range(len(animal().bones)))


def test_outlines_along_a_limb_are_the_limb_s_and_a_tail_is_the_body_s():
    body, leg = np.zeros((60, 80), bool), np.zeros((60, 80), bool)
    body[10:30, 10:70] = True
    leg[30:55, 40:55] = True
    thorn, tail = np.zeros_like(body), np.zeros_like(body)
    thorn[30:48, 37:40] = True
    tail[30:48, 15:18] = True
    drawn = [body | thorn | tail, leg]
    give_slivers(drawn, 0, 7.0)
    assert (drawn[0] & thorn).sum() < 0.2 * thorn.sum()
    assert (drawn[1] & thorn).sum() > 0.8 * thorn.sum()
    assert drawn[0][tail].all()
    assert drawn[0][body].all()
    assert not (drawn[0] & drawn[1]).any()


def test_nothing_hidden_is_a_sliver(test_data):
    figure_ = prepare_figure(read_puppet_input(test_data / "annotated/morevna_side_walk/annotation.json"))
    plan = plan_figure(figure_, read_motion(test_data / "mocap/bvh/cmu_07_01.bvh"))
    layers = cut_layers(figure_, figure_.mask, Parts(figure_.bone_map, figure_.radii), plan.layers)
    assert len(layers) == 5
    for layer in layers:
        thick = cv2.morphologyEx(layer.region.view(np.uint8), cv2.MORPH_OPEN, np.ones((5, 5), np.uint8)) > 0
        assert (layer.region & ~layer.drawn & ~thick).sum() <= 10, layer.name


def test_a_hidden_arm_is_behind_the_body_though_the_clip_has_it_in_front():
    plan, _, _ = cut(figure(-60, hidden=("right_shoulder", "right_elbow")), view="side")
    assert plan.names == ("left arm", "body", "left leg", "right arm")


def test_an_animals_trunk_does_not_stick_out_under_its_belly_behind_a_leg(test_data):
    source = prepare_figure(read_puppet_input(test_data / "drawings/animated_drawings/char6/char_cfg.yaml"))
    plan = plan_figure(source, read_motion(test_data / "mocap/bvh/cmu_35_01.bvh"))
    layers = cut_layers(source, source.mask, Parts(source.bone_map, source.radii), plan.layers)
    body = layers[plan.layers.names.index("body")]
    hidden = body.region & ~body.drawn
    assert hidden.sum() > 500
    # Beside the leg that hides it the belly is drawn down to these rows.
    columns = np.flatnonzero(hidden.any(axis=0))
    beside = [np.flatnonzero(body.drawn[:, column]).max() for column in (columns.min() - 2, columns.max() + 2)]
    assert np.argwhere(hidden)[:, 0].max() <= max(beside) + 4
