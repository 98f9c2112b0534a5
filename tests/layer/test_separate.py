"""Volumes moved apart in depth: markers stay on their rays, joined limbs may overlap, the order stays."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import DegenerateError, collision_volumes, separate_volumes
from pegbar.layer.separate import _free_pairs

NAMES = ("pelvis", "left_hip", "left_knee", "left_foot", "right_elbow", "right_hand")
LIMBS = np.array([[1, 2], [2, 3], [4, 5]])
CAMERA = np.array([[500.0, 0, 320, 0], [0, 500.0, 240, 0], [0, 0, 1, 0]])


def scene(frames=5, gap=0.05, turn=1.0):
    """A leg straight down and a forearm across it, `gap` metres behind its shin (negative: before)."""
    marks = np.zeros((frames, 6, 2))
    marks[:] = [[320, 100], [330, 110], [330, 220], [330, 330], [250, 270], [410, 280]]
    marks[:, 4:, 0] += 3 * np.arange(frames)[:, None]
    depths = np.full((frames, 6), 4.0)
    depths[:, 4:] += gap * turn
    boxes = np.empty((frames, 3, 4, 2))
    for limb, (a, b) in enumerate(LIMBS):
        axis = marks[:, b] - marks[:, a]
        left = np.stack([axis[:, 1], -axis[:, 0]], 1) / np.linalg.norm(axis, axis=1)[:, None] * 14
        boxes[:, limb] = np.stack([marks[:, a] + left, marks[:, b] + left, marks[:, b] - left, marks[:, a] - left], 1)
    return boxes, np.tile(CAMERA, (frames, 1, 1)), marks, depths


def overlap(volumes, first, second):
    """The deepest overlap of two limbs by brute force."""
    steps = np.linspace(0, 1, 60)[:, None]
    deepest = -np.inf
    for frame in range(len(volumes.start)):
        axes, radii = [], []
        for limb in (first, second):
            a, b = volumes.start[frame, limb], volumes.end[frame, limb]
            axes.append(a + steps * (b - a))
            ra, rb = volumes.start_radius[frame, limb], volumes.end_radius[frame, limb]
            radii.append(ra + steps[:, 0] * (rb - ra))
        away = np.linalg.norm(axes[0][:, None] - axes[1], axis=2)
        deepest = max(deepest, (radii[0][:, None] + radii[1] - away).max())
    return deepest


def placed(boxes, matrices, marks, depths):
    points = np.stack([(marks[..., 0] - 320) / 500, (marks[..., 1] - 240) / 500, np.ones(depths.shape)], 2)
    return collision_volumes(boxes, matrices, points * depths[..., None], LIMBS)


@given(st.floats(0.005, 0.2), st.sampled_from([1.0, -1.0]))
def test_limbs_that_cross_are_put_behind_each_other_in_their_order(gap, turn):
    boxes, matrices, marks, depths = scene(gap=gap, turn=turn)
    found = separate_volumes(boxes, matrices, marks, depths, LIMBS, NAMES)
    before, after = placed(boxes, matrices, marks, depths), placed(boxes, matrices, marks, found.depths)
    assert found.before.max() == pytest.approx(max(overlap(before, 1, 2), 0), abs=0.02)
    assert found.after.max() < 2e-3
    assert overlap(after, 1, 2) < 0.01
    side = (found.depths[:, 5] - found.depths[:, 3]) * turn
    assert (side > 0).all()


def test_what_does_not_overlap_stays_to_the_bit():
    boxes, matrices, marks, depths = scene(gap=0.5)
    found = separate_volumes(boxes, matrices, marks, depths, LIMBS, NAMES)
    np.testing.assert_array_equal(found.depths, depths)
    assert not found.before.any()


def test_measuring_moves_nothing():
    boxes, matrices, marks, depths = scene()
    found = separate_volumes(boxes, matrices, marks, depths, LIMBS, NAMES, measure_only=True)
    np.testing.assert_array_equal(found.depths, depths)
    np.testing.assert_array_equal(found.after, found.before)
    assert found.before.max() > 0.1


def test_clearance_leaves_room_for_cloth():
    boxes, matrices, marks, depths = scene(gap=0.25)
    tight = separate_volumes(boxes, matrices, marks, depths, LIMBS, NAMES)
    roomy = separate_volumes(boxes, matrices, marks, depths, LIMBS, NAMES, clearance=0.05)
    np.testing.assert_array_equal(tight.depths, depths)
    assert overlap(placed(boxes, matrices, marks, roomy.depths), 1, 2) < -0.04
    assert not roomy.before.any()
    with pytest.raises(ValueError, match="clearance"):
        separate_volumes(boxes, matrices, marks, depths, LIMBS, NAMES, clearance=-1)


def test_the_order_does_not_flip_while_limbs_touch():
    boxes, matrices, marks, depths = scene(frames=9, gap=0.03)
    depths[4, 4:] = 3.98
    found = separate_volumes(boxes, matrices, marks, depths, LIMBS, NAMES)
    assert (found.depths[:, 4:].mean(axis=1) > found.depths[:, 3]).all()
    assert np.abs(np.diff(found.depths, axis=0)).max() < 0.1


def test_limbs_on_the_same_joint_may_overlap():
    first, second = _free_pairs(LIMBS, NAMES)
    assert list(zip(first.tolist(), second.tolist(), strict=True)) == [(0, 2), (1, 2)]
    names = ("pelvis", "neck", "left_hip", "left_knee", "right_hip", "right_knee", "left_shoulder", "left_elbow")
    first, second = _free_pairs(np.array([[1, 0], [2, 3], [4, 5], [6, 7]]), names)
    assert list(zip(first.tolist(), second.tolist(), strict=True)) == [(1, 3), (2, 3)]


def test_unknown_limbs_push_nothing_and_wrong_boxes_are_named():
    boxes, matrices, marks, depths = scene()
    boxes[:, 2] = np.nan
    found = separate_volumes(boxes, matrices, marks, depths, LIMBS, NAMES)
    np.testing.assert_array_equal(found.depths, depths)
    boxes, matrices, marks, depths = scene()
    boxes[1, 0] = boxes[1, 0, [0, 2, 1, 3]]
    with pytest.raises(DegenerateError, match="frame 1, limb 0"):
        separate_volumes(boxes, matrices, marks, depths, LIMBS, NAMES)


def test_a_long_shot_is_measured_like_its_parts_in_little_memory():
    boxes, matrices, marks, depths = scene(frames=160)
    depths = depths + 0.1 * np.sin(np.arange(160))[:, None]
    whole = separate_volumes(boxes, matrices, marks, depths, LIMBS, NAMES, measure_only=True)
    parts = [
        separate_volumes(*(value[part] for value in (boxes, matrices, marks, depths)), LIMBS, NAMES, measure_only=True)
        for part in (slice(0, 63), slice(63, 65), slice(65, 160))
    ]
    assert whole.before.max() > 0.02
    np.testing.assert_array_equal(whole.before, np.concatenate([part.before for part in parts]))

    def peak(frames):
        many = scene(frames=frames)
        tracemalloc.start()
        separate_volumes(*many, LIMBS, NAMES, measure_only=True)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    # What is compared of one pair in one drawing takes 9 * 9 places of 3 numbers: 2 kB, and there is one pair.
    assert peak(384) - peak(128) < 256 * 2500
