"""Figures of a report: names and units that people read, and the limits at which pegbar warns."""

import re

import numpy as np
import pytest

from pegbar.report.figures import DEEP, alignment_figures, lift_figures, secondary_figures
from pegbar.report.lift_quality import FAR, RIGID
from pegbar.scene.alignment import MISFIT, Alignment
from pegbar.scene.camera import PerspectiveCamera

LIFT = {
    "drawings": 48,
    "marker_reprojection_px": 1e-13,
    "skeleton_reprojection_px": 4.01,
    "limb_length_residual": 0.0385,
    "limb_length_residuals": {"chest": 0.0424, "right_hand": 0.0718},
    "skeleton_to_markers_m": 0.0187,
    "skeleton_to_markers_worst": {"m": 0.083, "drawing": 7, "joint": "right_hand"},
    "foot_slide_m_per_drawing": 0.0004,
    "foot_slide_worst_m": 0.003,
    "standing": {"left_foot": ["1-29", "45-48"]},
    "to_clip_m": 0.02,
    "loop_travel_m": [0.0, 0.0, 0.0],
    "skeleton_size": 1.0,
    "figure_height_px": 400.0,
    "notes": ["a note"],
}
SECONDARY = {
    "frames": 48,
    "characters": ["anna"],
    "elements": ["scarves_left", "snow"],
    "engine": "pegbar",
    "renderer": "blender",
    "ground_m": 0.0076,
    "reprojection_px": 2.4e-13,
    "overlap_before_m": 0.03,
    "overlap_after_m": 0.001,
    "repaired_boxes": 2,
    "cloth": {
        "scarves_left": {
            "vertices": 204,
            "deepest_penetration_m": 0.021,
            "in_frame": 9,
            "in_limb": "left_forearm",
            "stretch_median": 0.0003,
            "stretch_p99": 0.046,
            "stretch_max": 0.217,
        }
    },
    "strands": {},
    "particles": {
        "snow": {
            "falling_mean": 411.6,
            "settled_mean": 20.2,
            "deepest_penetration_m": 0.0,
            "in_frame": 1,
            "in_limb": "",
        }
    },
    "deepest_penetration_m": 0.021,
    "height_m": 1.85,
    "stretch_p99": 0.046,
    "seconds": {"align": 0.0, "render and composite": 18.1},
    "made": {"align": False},
    "notes": [],
    "warnings": [],
}


def rows(figures):
    return {figure.name: (figure.value, figure.verdict, figure.good) for figure in figures}


def alignment(errors):
    """A figure 200 pixels tall in as many drawings as there are ``errors``."""
    count = len(errors)
    matrix = PerspectiveCamera(np.array([[100.0, 0, 50, 0], [0, 100, 50, 0], [0, 0, 1, 3]]), (100, 100)).matrix
    marks = np.tile([[50.0, 20.0], [50.0, 220.0]], (count, 1, 1))
    points = np.zeros((count, 2, 3))
    flags = np.zeros((count, 2), bool)
    flags[0, 1] = True
    return Alignment(
        ("head", "left_foot"),
        (100, 100),
        np.arange(count, dtype=float),
        points,
        np.tile(matrix, (count, 1, 1)),
        marks,
        flags,
        ~flags,
        points,
        np.array(errors, float),
        "free",
        "in_place",
        "/home/anna/secret/walk.bvh",
    )


def test_the_alignments_figures_have_units_limits_and_no_folder_of_this_machine():
    found = rows(alignment_figures(alignment([3, 4, 5]), [7, 8, 9]))
    assert found["clip"] == ("walk.bvh", "", True)
    assert found["camera"][0] == "free, 53 degrees wide"
    assert found["the clip's person"][0] == "stays in place"
    rms = np.sqrt(50 / 3)
    name = "clip to the drawn joints, all drawings"
    assert found[name] == (f"{rms:.1f} pixels, 2.0% of the figure's height", "good: up to 10% of the height", True)
    assert found["clip to the drawn joints, worst: drawing 9"] == ("5.0 pixels", "good: up to 20 pixels", True)
    assert found["hidden joints that were guessed"][0] == "1 of 6"
    assert found["feet put on the ground"][0] == "5"


@pytest.mark.parametrize(("error", "good"), [(MISFIT * 200 - 0.1, True), (MISFIT * 200 + 0.1, False)])
def test_a_clip_that_is_warned_of_is_to_be_looked_at(error, good):
    found = rows(alignment_figures(alignment([error] * 3), [1, 2, 3]))
    value = found["clip to the drawn joints, all drawings"]
    assert value[2] is good
    assert value[1].startswith("good: up to 10%" if good else "look at it: more than 10%")


def test_one_drawing_that_is_far_off_is_named():
    found = rows(alignment_figures(alignment([2, 2, 2, 2, 30]), [11, 12, 13, 14, 15]))
    name = "clip to the drawn joints, worst: drawing 15"
    assert found[name] == ("30.0 pixels", "look at it: more than 20 pixels", False)
    assert found["clip to the drawn joints, all drawings"][2]


def test_the_lifts_figures_have_names_units_and_limits():
    found = rows(lift_figures(LIFT))
    assert found["3D joints to the drawn joints"] == ("0.0 pixels, 0.0% of the figure's height", "", True)
    skeleton = "4.0 pixels, 1.0% of the figure's height", f"good: up to {FAR:.0%} of the height", True
    assert found["skeleton to the drawn joints"] == skeleton
    assert found["limb whose length changes most: to the right hand"] == ("7.2%", f"good: up to {RIGID:.0%}", True)
    assert found["skeleton to the 3D joints"][0] == "1.9 cm (most 8.3 cm: right hand in drawing 7)"
    assert found["standing feet slide from drawing to drawing, at most"][0] == "3 mm"
    assert found["left foot stands in drawings"][0] == "1-29, 45-48"
    assert found["poses to the clip's"][0] == "2.0 cm: what the artist added"
    # Nothing to tell of a loop that stays and a skeleton of the figure's size; a raw key is none of a reader's.
    assert not [name for name in found if "loop" in name or "size" in name or re.search(r"_| (px|m)$", name)]


def test_the_lift_is_to_be_looked_at_where_it_is_warned_of():
    changed = {
        **LIFT,
        "skeleton_reprojection_px": 21.0,
        "limb_length_residuals": {"head": RIGID + 0.01},
        "loop_travel_m": [3.0, 0.0, 4.0],
        "skeleton_size": 39.37,
        "foot_slide_worst_m": None,
    }
    found = rows(lift_figures(changed))
    assert found["skeleton to the drawn joints"][1:] == ("look at it: more than 5% of the height", False)
    assert found["limb whose length changes most: to the head"] == ("9.0%", "look at it: more than 8%", False)
    assert found["the loop travels"][0] == "500 cm"
    assert found["the skeleton's own size"][0] == "39.37 times the figure's"
    assert "standing feet slide from drawing to drawing, at most" not in found


def test_the_secondary_motions_figures_have_names_units_and_limits():
    found = rows(secondary_figures(SECONDARY))
    assert found["elements"][0] == "scarves left, snow"
    assert (found["simulated by"][0], found["rendered by"][0]) == ("pegbar", "Blender")
    assert found["height of the ground"][0] == "0.8 cm"
    assert found["limbs' volumes overlap by"][0] == "3.0 cm, moved apart 0.1 cm"
    limit = f"{1000 * DEEP * 1.85:.0f} mm (1% of the height)"
    name = "scarves left: deepest in a limb"
    assert found[name] == ("21.0 mm: left forearm in frame 9", f"look at it: more than {limit}", False)
    assert found["snow: deepest in a limb"] == ("0.0 mm", f"good: up to {limit}", True)
    assert found["scarves left: made of"][0] == "204 vertices"
    assert found["scarves left: stretched by"][0] == "0.0% usually, 99 of 100 threads by at most 4.6%, one by 21.7%"
    assert found["snow: falling at a time, on average"][0] == "412"
    assert found["computing time of the last run"][0] == "align 0.0 s, render and composite 18.1 s"
    assert not [name for name in found if re.search(r"_| (px|m)$|made$|notes|warnings", name)]


def test_what_is_not_known_is_shown_as_it_is():
    found = rows(secondary_figures({**SECONDARY, "wind": {"gusts_a_second": 0.25, "north": True}, "cloth": {}}))
    assert found["wind: gusts a second"][0] == "0.25"
    assert found["wind: north"][0] == "True"
    assert rows(lift_figures({"drawings": 2}))["drawings"][0] == "2"
