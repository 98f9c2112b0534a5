import math

import numpy as np
import pytest

from pegbar import DegenerateError, PerspectiveCamera, collision_volumes
from tests.oracles import volumes as oracle

SIZE = (640, 480)


def shot(frames=3, limbs=4, seed=1):
    """Cameras, markers and boxes about limbs of random places and widths."""
    random = np.random.default_rng(seed)
    cameras = [
        PerspectiveCamera.look_at((2 * math.sin(0.2 * frame), 1.2, 5), (0, 1, 0), SIZE, 0.8) for frame in range(frames)
    ]
    points = random.uniform((-1, 0, -1), (1, 2, 1), (frames, 2 * limbs, 3))
    pairs = np.arange(2 * limbs).reshape(limbs, 2)
    boxes = np.empty((frames, limbs, 4, 2))
    for frame, camera in enumerate(cameras):
        a, b = np.moveaxis(camera.project(points[frame])[pairs], 1, 0)
        across = (b - a)[:, ::-1] * (1, -1) / np.linalg.norm(b - a, axis=1)[:, None]
        first, second = random.uniform(4, 30, (2, limbs, 1))
        boxes[frame] = np.stack([a + first * across, b + second * across, b - second * across, a - first * across], 1)
    return boxes, np.stack([camera.matrix for camera in cameras]), points, pairs


def test_cylinders_are_those_of_the_equations():
    boxes, matrices, points, pairs = shot()
    boxes += np.random.default_rng(2).uniform(-2, 2, boxes.shape)
    found = collision_volumes(boxes, matrices, points, pairs)
    for frame in range(3):
        for limb, (a, b) in enumerate(pairs):
            wanted = oracle.cylinder(boxes[frame, limb], matrices[frame], points[frame, a], points[frame, b])
            got = (array[frame, limb] for array in (found.start, found.end, found.start_radius, found.end_radius))
            for ours, theirs in zip(got, wanted, strict=True):
                np.testing.assert_allclose(ours, theirs, atol=1e-9)


def test_end_caps_project_onto_their_boxes_and_axes_through_symmetric_ones():
    boxes, matrices, points, pairs = shot()
    found = collision_volumes(boxes, matrices, points, pairs)
    np.testing.assert_allclose(found.start, points[:, pairs[:, 0]], atol=1e-9)
    np.testing.assert_allclose(found.end, points[:, pairs[:, 1]], atol=1e-9)
    camera = PerspectiveCamera(matrices[0], SIZE)
    for limb in range(len(pairs)):
        width = camera.focal_length * 2 * found.start_radius[0, limb] / camera.depth(found.start[0, limb])
        assert width == pytest.approx(np.linalg.norm(boxes[0, limb, 0] - boxes[0, limb, 3]), abs=1e-6)


def test_the_scale_of_a_matrix_does_not_matter():
    boxes, matrices, points, pairs = shot()
    want, got = (collision_volumes(boxes, matrices * scale, points, pairs) for scale in (1, -7))
    np.testing.assert_allclose(got.end_radius, want.end_radius)
    np.testing.assert_allclose(got.start, want.start)


def test_unknown_boxes_stay_unknown():
    boxes, matrices, points, pairs = shot()
    boxes[1, 2] = np.nan
    points[2, 0] = np.nan
    found = collision_volumes(boxes, matrices, points, pairs)
    assert np.argwhere(np.isnan(found.start_radius)).tolist() == [[1, 2], [2, 0]]
    assert np.isfinite(found.end[0]).all()


def test_impossible_limbs_are_named():
    boxes, matrices, points, pairs = shot()
    crossed = boxes.copy()
    crossed[1, 3] = crossed[1, 3, [0, 2, 1, 3]]
    with pytest.raises(DegenerateError, match="frame 1, limb 3: its box is inside out"):
        collision_volumes(crossed, matrices, points, pairs)
    thin = boxes.copy()
    thin[2, 1] = thin[2, 1, [0, 1, 1, 0]]
    with pytest.raises(DegenerateError, match="frame 2, limb 1: its box has no width"):
        collision_volumes(thin, matrices, points, pairs)
    behind = points.copy()
    behind[0, 5] = (0, 1, 9)
    with pytest.raises(DegenerateError, match="frame 0, limb 2: a marker lies behind"):
        collision_volumes(boxes, matrices, behind, pairs)


@pytest.mark.parametrize("limbs", [[[0, 8]], [[-1, 0]], [[0.5, 1]]])
def test_limbs_must_name_markers(limbs):
    boxes, matrices, points, _ = shot()
    with pytest.raises(ValueError, match="limbs"):
        collision_volumes(boxes[:, :1], matrices, points, limbs)
