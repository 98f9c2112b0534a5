"""Lifting without files: a swaying figure that is drawn by a known camera."""

import dataclasses

import numpy as np
import pytest

from pegbar import Motion, PerspectiveCamera
from pegbar.scene.alignment import Alignment
from pegbar.shot.lift_choices import Hold, LiftOptions
from pegbar.shot.lifting import lift_drawing
from tests.motions import swaying

NAMES = ("pelvis", "head", "left_hip", "left_knee", "left_foot", "right_hip")
FRAMES = 30


@pytest.fixture(scope="module")
def drawn():
    """The drawn figure's markers, its clip (another dance of the same body), and what aligned them."""
    truth, clip = swaying(FRAMES, seed=3), swaying(FRAMES, seed=0)
    camera = PerspectiveCamera.look_at((4, 1.4, 5), (1.5, 0.8, 0), (640, 480), 0.9)
    markers, places = truth.markers(NAMES), clip.markers(NAMES)
    points = camera.project(markers)
    alignment = Alignment(
        names=NAMES,
        image_size=(640, 480),
        times=np.arange(FRAMES, dtype=float),
        clip=places,
        matrices=np.tile(camera.matrix, (FRAMES, 1, 1)),
        markers=points,
        estimated=np.zeros((FRAMES, len(NAMES)), bool),
        grounded=np.zeros((FRAMES, len(NAMES)), bool),
        positions=camera.unproject(points, camera.depth(places)),
        errors=np.zeros(FRAMES),
        mode="static",
        root="travel",
    )
    return markers, clip, alignment


def test_a_marker_that_no_drawing_shows_goes_along_with_its_neighbours(drawn):
    _, clip, alignment = drawn
    hidden = alignment.estimated.copy()
    knee = NAMES.index("left_knee")
    hidden[:, knee] = True
    options = LiftOptions(depth="lengths", planted=False)
    lifted = lift_drawing(dataclasses.replace(alignment, estimated=hidden), clip, 24, options)
    moved = lifted.markers - alignment.positions
    ends = [NAMES.index("left_hip"), NAMES.index("left_foot")]
    np.testing.assert_allclose(moved[:, knee], moved[:, ends].mean(axis=1), atol=1e-12)
    seen = np.linalg.norm(lifted.markers[:, ends[1]] - lifted.markers[:, ends[0]], axis=1)
    assert np.ptp(seen) < 1e-9  # hip and foot are one limb then


def test_the_clips_lengths_and_given_ones_are_the_limbs(drawn):
    _, clip, alignment = drawn
    for lengths, shin in (("clip", np.hypot(0.4, 0.02)), ({"left_foot": 0.44}, 0.44)):
        lifted = lift_drawing(alignment, clip, 24, LiftOptions(depth="lengths", lengths=lengths, planted=False))
        found = np.linalg.norm(lifted.markers[:, 4] - lifted.markers[:, 3], axis=1)
        np.testing.assert_allclose(found, shin, atol=1e-6)


def test_a_loop_is_closed_with_feet_that_stand_over_its_seam(drawn):
    _, clip, alignment = drawn
    planted = {"left_foot": [(0, 3), (27, 30)]}
    lifted = lift_drawing(alignment, clip, 24, LiftOptions(planted=planted, loop=True))
    assert np.linalg.norm(lifted.travel) > 1
    feet = lifted.motion.markers(["left_foot"])[:, 0]
    seam = np.concatenate([feet[27:], feet[:3] + lifted.travel])
    np.testing.assert_allclose(seam, np.tile(seam[0], (6, 1)), atol=1e-9)


def test_held_markers_are_where_they_are_held(drawn):
    _, clip, alignment = drawn
    hold = Hold("left_foot", (10, 15), (1.0, 0.3, 0.2))
    for depth in ("clip", "lengths"):
        lifted = lift_drawing(alignment, clip, 24, LiftOptions(depth=depth, held=(hold,), planted=False))
        np.testing.assert_allclose(lifted.markers[10:15, 4], [hold.place] * 5, atol=1e-9)
        np.testing.assert_allclose(lifted.motion.markers(["left_foot"])[10:15, 0], [hold.place] * 5, atol=1e-9)


def test_a_foot_that_slides_in_the_drawing_does_not_stand(drawn):
    _, clip, alignment = drawn
    still = clip.changed(positions=clip.positions[:1].repeat(FRAMES, 0), rotations=clip.rotations[:1].repeat(FRAMES, 0))
    names = (*NAMES, "right_foot")
    both = dataclasses.replace(still, joints={**still.joint_map, "right_foot": "right_hip"}).knowing(
        {**still.joint_map, "right_foot": "right_hip"}
    )
    extended = {
        key: np.concatenate([value, value[:, -1:]], axis=1)
        for key in ("clip", "markers", "estimated", "grounded", "positions")
        for value in (getattr(alignment, key),)
    }
    travelling = dataclasses.replace(alignment, names=names, **extended)
    assert not lift_drawing(travelling, both, 24, LiftOptions()).planted.any()
    resting = dataclasses.replace(travelling, positions=travelling.positions[:1].repeat(FRAMES, 0))
    assert lift_drawing(resting, both, 24, LiftOptions()).planted[:, [4, 6]].all()


def test_what_cannot_be_lifted_is_named(drawn):
    _, clip, alignment = drawn
    one = dataclasses.replace(
        alignment,
        **{
            key: getattr(alignment, key)[:1]
            for key in ("times", "clip", "matrices", "markers", "estimated", "grounded", "positions", "errors")
        },
    )
    assert len(lift_drawing(one, clip, 24, LiftOptions()).motion.positions) == 1
    with pytest.raises(ValueError, match=r"lift\.loop: want 3 drawings with marks or more to close a loop, got 1"):
        lift_drawing(one, clip, 24, LiftOptions(loop=True))
    points = Motion(NAMES, (-1,) * 6, clip.markers(NAMES), np.tile(np.eye(3), (FRAMES, 6, 1, 1)), 24.0)
    with pytest.raises(ValueError, match=r"clip: it has points and no skeleton.*lift\.skeleton"):
        lift_drawing(alignment, points, 24, LiftOptions())
    with pytest.raises(ValueError, match=r"lift\.planted: 'tail'"):
        lift_drawing(alignment, clip, 24, LiftOptions(planted={"tail": [(0, 2)]}))
