import dataclasses

import numpy as np
import pytest

from pegbar import Drawing, PerspectiveCamera, read_annotations, read_motion
from pegbar.align.proportions import Body, Proportions
from pegbar.scene.body import LIMBS, MARKERS
from pegbar.scene.mirror import exchanged, mirrored
from pegbar.shot.alignment import AlignOptions, align_drawing
from pegbar.shot.registered import CameraOptions, View

SIZE = (960, 540)
STILL = CameraOptions(mode="static", root="travel")


@pytest.fixture(scope="module")
def walk(test_data):
    return read_motion(test_data / "mocap/bvh/cmu_07_01.bvh")


def camera():
    return PerspectiveCamera.look_at((5.0, 1.4, 1.0), (0, 0.9, 1.0), SIZE, 0.7)


def drawn(motion, frames, view=None, **changes):
    """`motion` at `frames` as a still camera sees it, with a frame's marks in the order of MARKERS."""
    seen = (view or camera()).project(motion.markers(MARKERS)[frames])
    visible = np.ones(seen.shape[:2], bool)
    return dataclasses.replace(Drawing(MARKERS, seen, visible, SIZE, limbs=LIMBS), **changes)


def view_of(motion, start, stop, **changes):
    """What the search would say for `camera`: it looks along -x, from the clip's left or right."""
    back = camera().position - (0, 0.9, 1.0)
    azimuth = float(np.degrees(np.arctan2(back[0], back[2])))
    return View(start, stop, azimuth, 5.0, **changes)


def test_a_clip_seen_by_a_still_camera_is_found_and_met(walk):
    frames = np.arange(40, 240, 5)
    drawing = drawn(walk, frames)
    alignment, retiming = align_drawing(drawing, walk, view_of(walk, 1, 300), np.ones(40), 24.0, AlignOptions(STILL))
    assert np.abs(alignment.times - frames).max() < 1.0
    assert np.median(alignment.errors) < 3
    np.testing.assert_allclose(alignment.cameras[0].position, camera().position, atol=0.4)
    for frame, view in enumerate(alignment.cameras):
        np.testing.assert_allclose(view.project(alignment.positions[frame]), drawing.markers[frame], atol=1e-6)
        np.testing.assert_allclose(view.depth(alignment.clip[frame]), alignment.depths[frame], atol=1e-6)
    assert not alignment.estimated.any()
    assert retiming.cost.shape == (40, len(retiming.moments))
    assert alignment.notes == alignment.warnings == ()


@pytest.mark.parametrize(("change", "view"), [(mirrored, {"mirrored": True}), (exchanged, {"swapped": True})])
def test_mirrored_and_exchanged_drawings_are_undone(walk, change, view):
    frames = np.arange(40, 240, 5)
    drawing = drawn(change(walk), frames)
    alignment, _ = align_drawing(drawing, walk, view_of(walk, 1, 300, **view), np.ones(40), 24.0, AlignOptions(STILL))
    assert np.median(alignment.errors) < 3
    assert np.abs(alignment.times - frames).max() < 1.0


def test_hidden_joints_are_guessed_from_the_clip_and_told(walk):
    frames = np.arange(40, 240, 5)
    whole = drawn(walk, frames)
    marks, visible = whole.markers.copy(), whole.visible.copy()
    hidden = [MARKERS.index("right_hand"), MARKERS.index("right_elbow")]
    visible[10:20, hidden] = False
    marks[10:20, hidden[0]] = np.nan
    drawing = dataclasses.replace(whole, markers=marks, visible=visible)
    alignment, _ = align_drawing(drawing, walk, view_of(walk, 1, 300), np.ones(40), 24.0, AlignOptions(STILL))
    assert np.argwhere(alignment.estimated).tolist() == [[f, m] for f in range(10, 20) for m in sorted(hidden)]
    away = np.linalg.norm(alignment.markers[10:20, hidden[0]] - whole.markers[10:20, hidden[0]], axis=1)
    assert away.max() < 8
    np.testing.assert_array_equal(alignment.markers[10:20, hidden[1]], marks[10:20, hidden[1]])
    assert np.isfinite(alignment.positions).all()


def test_markers_that_the_clip_lacks_go_with_their_limb(walk):
    frames = np.arange(40, 120, 5)
    whole = drawn(walk, frames)
    tail = whole.markers[:, [MARKERS.index("pelvis")]] + (20, 5)
    limb = dataclasses.replace(LIMBS[0], name="tail", start="pelvis", end="tail")
    drawing = dataclasses.replace(
        whole,
        names=(*MARKERS, "tail"),
        markers=np.concatenate([whole.markers, tail], axis=1),
        visible=np.ones((len(frames), len(MARKERS) + 1), bool),
        limbs=(*LIMBS, limb),
    )
    alignment, _ = align_drawing(drawing, walk, view_of(walk, 1, 200), np.ones(16), 24.0, AlignOptions(STILL))
    np.testing.assert_allclose(alignment.depths[:, -1], alignment.depths[:, MARKERS.index("pelvis")])
    assert np.isnan(alignment.clip[:, -1]).all()
    np.testing.assert_allclose(alignment.markers[:, -1], tail[:, 0])


def test_standing_feet_come_onto_the_floor(walk):
    frames = np.arange(40, 240, 5)
    high = PerspectiveCamera.look_at((4.5, 3.0, 1.0), (0, 0.9, 1.0), SIZE, 0.7)
    drawing = drawn(walk, frames, high)
    options = AlignOptions(STILL, ground=True)
    alignment, _ = align_drawing(drawing, walk, view_of(walk, 1, 300), np.ones(40), 24.0, options)
    feet = [MARKERS.index("left_foot"), MARKERS.index("right_foot")]
    assert alignment.grounded[:, feet].any(axis=0).all()
    assert not np.delete(alignment.grounded, feet, axis=1).any()
    for foot in feet:
        heights = alignment.positions[alignment.grounded[:, foot], foot, 1]
        assert np.ptp(heights) < 0.08


def test_a_clip_that_does_not_fit_is_told(walk):
    frames = np.arange(40, 120, 5)
    drawing = drawn(walk, frames)
    random = np.random.default_rng(0).normal(0, 60, drawing.markers.shape)
    wild = dataclasses.replace(drawing, markers=drawing.markers + random)
    alignment, _ = align_drawing(wild, walk, view_of(walk, 1, 200), np.ones(16), 24.0, AlignOptions(STILL))
    assert any("the clip does not fit" in warning for warning in alignment.warnings)


def test_too_few_markers_are_refused(walk):
    drawing = drawn(walk, np.arange(40, 60, 5))
    few = dataclasses.replace(
        drawing,
        names=("pelvis", "neck", "wing"),
        markers=drawing.markers[:, :3],
        visible=drawing.visible[:, :3],
        limbs=(),
    )
    with pytest.raises(ValueError, match="2 of the drawing's markers"):
        align_drawing(few, walk, view_of(walk, 1, 200), np.ones(4), 24.0, AlignOptions())


def short_legged(motion, frames):
    """`motion` with legs of half their length that swing half as far: what an artist draws is not a person."""
    body = Body(MARKERS, motion.markers(MARKERS)[frames], 24.0)
    legs = np.array([0.5 if kind in ("knee", "foot") else 1.0 for kind in body.kinds])
    return body.drawn(Proportions(legs, legs))


def seen_from(positions, points):
    """Azimuth and elevation of a camera from the figure, in degrees."""
    back = (positions - points.mean(axis=1)).mean(axis=0)
    return np.degrees([np.arctan2(back[0], back[2]), np.arcsin(back[1] / np.linalg.norm(back))])


@pytest.mark.parametrize("proportions", ["auto", "drawn"])
def test_short_legs_and_steps_do_not_turn_the_view(walk, proportions):
    frames = np.arange(40, 240, 5)
    points = short_legged(walk, frames)
    drawing = dataclasses.replace(drawn(walk, frames), markers=camera().project(points))
    truth = seen_from(np.repeat(camera().position[None], 40, axis=0), points)
    errors = {}
    for kind in (proportions, "clip"):
        options = AlignOptions(CameraOptions(mode="static", root="auto", proportions=kind))
        alignment, _ = align_drawing(drawing, walk, view_of(walk, 1, 300), np.ones(40), 24.0, options)
        found = seen_from(np.array([view.position for view in alignment.cameras]), alignment.clip)
        errors[kind] = np.abs(found - truth).max(), np.median(alignment.errors)
    assert errors[proportions][0] < 4 < errors["clip"][0]
    assert errors[proportions][1] < 0.3 * errors["clip"][1]


@pytest.mark.parametrize(
    ("folder", "clip", "view", "nearer"),
    [
        ("morevna_side_walk", "bvh/cmu_07_01.bvh", View(1, 317, 107.0, 12.0), "left"),
        ("kenney_male_person_walk", "asfamc/07_05-walk.amc", View(0, 300, 326.0, -7.0), "right"),
    ],
)
def test_near_limbs_of_drawn_walks_are_nearer(test_data, folder, clip, view, nearer):
    drawing = read_annotations(test_data / "annotated" / folder / "annotation.json")
    motion = read_motion(test_data / "mocap" / clip)
    count = len(drawing.markers)
    alignment, _ = align_drawing(drawing, motion, view, np.ones(count), 24.0 if count > 8 else 12.0, AlignOptions())
    left, right = (
        alignment.depths[:, [alignment.names.index(f"{side}_{j}") for j in ("hip", "knee", "shoulder")]]
        for side in ("left", "right")
    )
    is_nearer = left < right if nearer == "left" else right < left
    assert is_nearer.mean() > 0.8
    assert abs(seen_from(np.array([view.position for view in alignment.cameras]), alignment.clip)[1]) < 20
