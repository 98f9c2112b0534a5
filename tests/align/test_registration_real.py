"""Real clips, drawn with another figure and timing through known cameras, warped by their poses."""

import math

import numpy as np
import pytest

from pegbar import register_cameras
from tests.drawn_clips import SIZE, VIEWS, clip_points, draw, recovery


@pytest.mark.parametrize(
    ("name", "kind", "view", "mode"),
    [
        ("07_01", "static", 1, "static"),
        ("07_01", "tilt", 3, "pan"),
        ("35_01", "dolly", 0, "free"),
        ("35_17", "static", 3, "static"),
        ("02_01", "pan", 2, "pan"),
        ("118_01", "dolly", 1, "free"),
    ],
)
def test_cameras_are_recovered(test_data, name, kind, view, mode):
    drawn = draw(clip_points(test_data, name), kind, VIEWS[view], seed=view)
    options = {"field_of_view": math.radians(VIEWS[view][2]), "mode": "auto"}
    track = register_cameras(drawn.marks, drawn.points, SIZE, **options)
    found = recovery(track, drawn)
    assert track.mode == mode
    assert found.view < 6
    assert found.most_view < 8
    assert found.place < 0.15 * found.distance
    assert found.jitter < 1
    assert (found.jitter == 0) == (mode == "static")


def test_a_walk_drawn_on_the_spot(test_data):
    drawn = draw(clip_points(test_data, "07_01"), "static", VIEWS[1], seed=1, in_place=True)
    options = {"field_of_view": math.radians(VIEWS[1][2]), "mode": "auto"}
    whole = register_cameras(drawn.marks, drawn.points, SIZE, **options)
    track = register_cameras(drawn.marks, drawn.points, SIZE, root="auto", **options)
    assert whole.mode != "static"
    assert track.mode == "static"
    assert abs(track.travel) < 0.1
    assert recovery(track, drawn).view < 6


def test_no_view_is_mistaken_for_its_mirror_image(test_data):
    clip = clip_points(test_data, "07_01")
    for azimuth in range(0, 360, 60):
        drawn = draw(clip, "orbit", (azimuth, 5, 40), seed=azimuth, amount=0.1)
        track = register_cameras(drawn.marks, drawn.points, SIZE, field_of_view=math.radians(40))
        assert recovery(track, drawn).most_view < 15
        turns = [a.rotation @ b.rotation.T for a, b in zip(track.cameras, track.cameras[1:], strict=False)]
        assert np.degrees(np.arccos(np.clip((np.trace(turns, axis1=1, axis2=2) - 1) / 2, -1, 1))).max() < 5
