import numpy as np
import pytest

from pegbar import OrthographicCamera, PerspectiveCamera
from pegbar.align.proportions import Body, Proportions, drawn_proportions, jacobians_of, own_proportions
from pegbar.scene.body import MARKERS

FRAMES = 24
REST = {
    "pelvis": (0, 0.95, 0),
    "chest": (0, 1.2, 0),
    "neck": (0, 1.45, 0),
    "head": (0, 1.65, 0.03),
    "shoulder": (0.19, 1.42, 0),
    "elbow": (0.22, 1.15, 0),
    "hand": (0.23, 0.9, 0.03),
    "hip": (0.1, 0.93, 0),
    "knee": (0.1, 0.5, 0.02),
    "foot": (0.1, 0.08, 0),
}


def walker(names=tuple(MARKERS), turn=0.0):
    """Arms and legs that swing to and fro about shoulders and hips, heading ``turn`` radians left of +z."""
    phase = 2 * np.pi * np.arange(FRAMES) / 12
    points = np.zeros((FRAMES, len(names), 3))
    for index, name in enumerate(names):
        side = -1 if name.startswith("right_") else 1
        kind = name.removeprefix("left_").removeprefix("right_")
        place = np.array(REST[kind]) * (side, 1, 1)
        hinge = {"elbow": "shoulder", "hand": "shoulder", "knee": "hip", "foot": "hip"}.get(kind)
        points[:, index] = place
        if hinge:
            angle = side * (-0.5 if hinge == "shoulder" else 0.45) * np.sin(phase)
            arm = place - np.array(REST[hinge]) * (side, 1, 1)
            points[:, index, 1] += arm[1] * (np.cos(angle) - 1) + arm[2] * np.sin(angle)
            points[:, index, 2] += arm[2] * (np.cos(angle) - 1) - arm[1] * np.sin(angle)
    cosine, sine = np.cos(turn), np.sin(turn)
    return points @ np.array([[cosine, 0, -sine], [0, 1, 0], [sine, 0, cosine]])


def body(**changes):
    return Body(tuple(MARKERS), walker(**changes), 12.0)


def some(kinds, **values):
    return np.array([values.get(kind, 1.0) for kind in kinds])


def test_own_proportions_change_nothing():
    clip = body()
    np.testing.assert_allclose(clip.drawn(own_proportions(clip)), clip.points, atol=1e-12)


def test_lengths_and_swings_are_those_asked_for():
    clip = body(turn=0.7)
    drawn = clip.drawn(Proportions(some(clip.kinds, foot=0.5, head=2.0), some(clip.kinds, elbow=0.0)))
    marker = {name: drawn[:, index] for index, name in enumerate(MARKERS)}
    before = {name: clip.points[:, index] for index, name in enumerate(MARKERS)}
    for outer, inner, factor in (
        ("left_foot", "left_knee", 0.5),
        ("head", "neck", 2.0),
        ("right_hand", "right_elbow", 1),
    ):
        length, was = (np.linalg.norm(m[outer] - m[inner], axis=1) for m in (marker, before))
        np.testing.assert_allclose(length, factor * was, rtol=1e-9)
    still = marker["left_elbow"] - marker["left_shoulder"]
    np.testing.assert_allclose(still, np.broadcast_to(still[0], still.shape), atol=1e-9)
    feet = [MARKERS.index("left_foot"), MARKERS.index("right_foot")]
    assert drawn[:, feet, 1].min() == pytest.approx(clip.points[:, feet, 1].min())


@pytest.mark.parametrize("azimuth", [0, 50, 90, 200])
def test_drawn_proportions_are_found(azimuth):
    clip = body()
    truth = Proportions(
        some(clip.kinds, head=1.8, knee=0.6, foot=0.6, hand=1.2), some(clip.kinds, knee=0.7, foot=0.7, elbow=1.3)
    )
    view = OrthographicCamera.from_angles(azimuth, 5, scale=200, center=(480, 300))
    marks = view.project(clip.drawn(truth))
    rays = np.broadcast_to(view.rotation[:2], (FRAMES, len(MARKERS), 2, 3))
    found = drawn_proportions(marks, np.ones(marks.shape[:2], bool), clip, rays)
    common = found.lengths[clip.kinds.index("chest")]
    told = [clip.kinds.index(kind) for kind in ("head", "elbow", "hand", "knee", "foot")]
    np.testing.assert_allclose(found.lengths[told] / common, truth.lengths[told], rtol=0.12)
    swung = [clip.kinds.index(kind) for kind in ("knee", "elbow")]
    if 20 < azimuth < 160:
        np.testing.assert_allclose(found.swings[swung], truth.swings[swung], atol=0.15)


def test_the_clips_own_body_is_left_alone_in_noise():
    clip = body()
    view = OrthographicCamera.from_angles(80, 5, scale=200)
    marks = view.project(clip.points) + np.random.default_rng(3).normal(0, 2, (FRAMES, len(MARKERS), 2))
    rays = np.broadcast_to(view.rotation[:2], (FRAMES, len(MARKERS), 2, 3))
    found = drawn_proportions(marks, np.ones(marks.shape[:2], bool), clip, rays)
    np.testing.assert_allclose(found.lengths, 1, atol=0.05)
    np.testing.assert_allclose(found.swings, 1, atol=0.1)


def test_marks_that_are_not_seen_or_lacking_do_not_count():
    clip = body()
    view = OrthographicCamera.from_angles(60, 5, scale=200)
    marks, rays = view.project(clip.points), np.broadcast_to(view.rotation[:2], (FRAMES, len(MARKERS), 2, 3))
    seen = np.ones(marks.shape[:2], bool)
    seen[3, 5] = seen[:, 8] = False
    wild = np.where(seen[..., None], marks, [[[np.nan, 9000.0]]])
    plain = drawn_proportions(marks, seen, clip, rays)
    np.testing.assert_array_equal(drawn_proportions(wild, seen, clip, rays).lengths, plain.lengths)
    lacking = clip.points.copy()
    lacking[:, 8] = np.nan
    gone = drawn_proportions(marks, seen, Body(clip.names, lacking, 12.0), rays)
    np.testing.assert_allclose(gone.lengths, plain.lengths, rtol=1e-6)


def test_no_marks_at_all_leave_the_clips_own():
    clip = body()
    rays = np.zeros((FRAMES, len(MARKERS), 2, 3))
    found = drawn_proportions(np.zeros((FRAMES, len(MARKERS), 2)), np.zeros((FRAMES, len(MARKERS)), bool), clip, rays)
    assert (found.lengths == 1).all()


def test_a_figure_without_pelvis_is_one_tree():
    names = ("neck", "left_hip", "right_hip", "left_knee", "right_knee", "left_foot", "right_foot")
    clip = Body(names, walker(names), 12.0)
    assert len(clip.limbs) == len(names) - 1
    np.testing.assert_allclose(clip.drawn(own_proportions(clip)), clip.points, atol=1e-12)


def test_a_single_drawing_has_no_swing():
    clip = Body(tuple(MARKERS), walker()[:1], 12.0)
    assert np.abs(clip.swings).max() < 1e-12


def test_jacobians_are_the_projections_differences():
    points = walker()[:3]
    camera = PerspectiveCamera.look_at((4.0, 1.5, 3.0), (0, 0.9, 0), (960, 540), 0.7)
    found = jacobians_of(np.repeat(camera.matrix[None], 3, axis=0), points)
    for axis in range(3):
        step = np.eye(3)[axis] * 1e-5
        difference = (camera.project(points + step) - camera.project(points - step)) / 2e-5
        np.testing.assert_allclose(found[..., axis], difference, rtol=1e-6, atol=1e-4)
