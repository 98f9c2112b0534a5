import numpy as np
import pytest

from pegbar import ContactNoise, PerspectiveCamera, ground_depths

NAMES = ("head", "left_knee", "left_foot", "right_foot")
CAMERA = PerspectiveCamera.look_at((5, 3, 5), (0, 0.5, 0), (960, 540), 0.8)


def walk(frames=48, ankle=0.08):
    """A figure of four markers that steps along z twice a second at 24 frames/s; and when its feet stand."""
    points = np.zeros((frames, 4, 3))
    standing = np.zeros((frames, 2), bool)
    time = np.arange(frames) / 24
    for side in range(2):
        phase = (time + side / 2) % 1
        swing = np.clip(phase * 2 - 1, 0, 1)
        step = np.floor(time + side / 2) + (1 - np.cos(np.pi * swing)) / 2
        points[:, 2 + side] = np.stack([0.2 - 0.4 * side + 0 * time, ankle + 0.2 * np.sin(np.pi * swing), step - 1], 1)
        standing[:, side] = phase <= 0.5
    points[:, 0] = np.stack([0 * time, 1.7 + 0 * time, time - 0.5], axis=1)
    points[:, 1] = (points[:, 0] + points[:, 2]) / 2
    return points, standing


def grounded(points, depths, **options):
    matrices = [CAMERA.matrix] * len(points)
    return ground_depths(CAMERA.project(points), matrices, depths, NAMES, 24.0, **options)


def test_standing_feet_are_found_in_the_drawing_and_their_depth_is_mended():
    points, standing = walk()
    truth = CAMERA.depth(points)
    wrong = np.add(truth, [0, 0.05, 0.1, -0.12])
    found = grounded(points, wrong, noise=ContactNoise(depth=1.0, height=1e-3, mark=0.1))
    assert (found.standing == standing).mean() > 0.9
    assert not (found.standing & ~standing).any()
    np.testing.assert_allclose(found.depths[:, 2:], truth[:, 2:], atol=0.01)
    np.testing.assert_array_equal(found.depths[:, 0], wrong[:, 0])
    np.testing.assert_allclose(found.depths[:, 1], truth[:, 1], atol=0.01)


def test_what_is_known_is_weighted():
    points, standing = walk()
    truth = CAMERA.depth(points)
    wrong = np.add(truth, [0, 0, 0.1, 0.1])
    sure, unsure = (grounded(points, wrong, standing=standing, noise=ContactNoise(depth=d)) for d in (10.0, 1e-4))
    np.testing.assert_allclose(sure.depths[:, 2:], truth[:, 2:], atol=1e-3)
    np.testing.assert_allclose(unsure.depths, wrong, atol=1e-3)
    half = grounded(points, wrong, standing=standing, noise=ContactNoise(depth=0.05))
    change = wrong[:, 2] - half.depths[:, 2]
    assert ((change > 0.01) & (change < 0.09)).all()


def test_a_step_has_one_correction_and_the_air_runs_between():
    points, _ = walk()
    standing = np.zeros((48, 2), bool)
    standing[10:14, 0] = standing[20:22, 0] = True
    depths = CAMERA.depth(points)
    depths[10:14, 2] += 0.1
    depths[20:22, 2] += 0.3
    points[:, 2] = points[10, 2]
    depths[:, 2] = CAMERA.depth(points[:, 2])
    depths[:12, 2] += 0.1
    depths[12:, 2] += 0.2
    found = grounded(points, depths, standing=standing, noise=ContactNoise(depth=100.0), knee=0.0)
    change = depths[:, 2] - found.depths[:, 2]
    np.testing.assert_allclose(change[:14], 0.15, atol=1e-3)
    np.testing.assert_allclose(change[20:], 0.2, atol=1e-3)
    np.testing.assert_allclose(change[13:21], np.linspace(0.15, 0.2, 8), atol=1e-3)
    np.testing.assert_array_equal(found.depths[:, [0, 1, 3]], depths[:, [0, 1, 3]])


def test_feet_in_the_air_and_in_place_are_left_alone():
    points, _ = walk()
    hanging = points.copy()
    hanging[:, 2:] = [[0.2, 1.0, 0], [-0.2, 1.0, 0]]
    sliding = points.copy()
    sliding[:, 2:] = [[0.2, 0.08, 0], [-0.2, 0.08, 0]]
    sliding[:, 2:, 2] += (np.arange(48) / 24 * 1.2)[:, None]
    for case in (hanging, sliding):
        depths = CAMERA.depth(case)
        found = grounded(case, depths)
        assert not found.standing.any()
        np.testing.assert_array_equal(found.depths, depths)


def test_a_ray_that_misses_the_floor_and_a_hidden_mark_say_nothing():
    points, standing = walk()
    level = PerspectiveCamera.look_at((5, 0.0, 0), (0, 0.0, 0), (960, 540), 0.8)
    depths = level.depth(points)
    marks = level.project(points)
    found = ground_depths(marks, [level.matrix] * 48, depths, NAMES, 24.0, standing=standing)
    np.testing.assert_array_equal(found.depths, depths)
    marks = CAMERA.project(points)
    marks[:, 2] = np.nan
    found = ground_depths(marks, [CAMERA.matrix] * 48, depths, NAMES, 24.0)
    assert not found.standing[:, 0].any()
    np.testing.assert_array_equal(found.depths[:, 2], depths[:, 2])


@pytest.mark.parametrize("frames", [0, 1, 2])
def test_short_shots(frames):
    points, _ = walk(frames)
    found = grounded(points, CAMERA.depth(points))
    assert found.depths.shape == (frames, 4)
    assert np.isfinite(found.depths).all()


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("markers", {"markers": np.zeros((2, 3, 2))}),
        ("depths", {"depths": np.zeros((2, 3))}),
        ("matrices", {"matrices": np.zeros((1, 3, 4))}),
        ("standing", {"standing": [[True, True]]}),
        ("names", {"names": ("head", "neck", "left_knee", "left_foot")}),
        ("frame_rate", {"frame_rate": 0}),
        ("ankle_height", {"ankle_height": np.nan}),
        ("ankle_height", {"ankle_height": [0.1, 0.1, 0.1]}),
    ],
)
def test_wrong_arguments_are_named(name, change):
    points, _ = walk(2)
    good = {
        "markers": CAMERA.project(points),
        "matrices": [CAMERA.matrix] * 2,
        "depths": CAMERA.depth(points),
        "names": NAMES,
        "frame_rate": 24.0,
    }
    with pytest.raises(ValueError, match=f"^{name}: "):
        ground_depths(**good | change)


@pytest.mark.parametrize("distance", [2.0, 15.0])
@pytest.mark.parametrize(("speed", "stands"), [(0.2, True), (0.32, False), (0.5, False)])
def test_speed_counts_in_metres_at_any_distance(distance, speed, stands):
    camera = PerspectiveCamera.look_at((0, distance, distance), (0, 0, 0), (960, 540), 0.8)
    points = np.tile([0, 0.08, 0], (24, 4, 1))
    points[:, 2:, 0] += (np.arange(24) - 12)[:, None] * speed / 24
    depths = camera.depth(points)
    found = ground_depths(camera.project(points), [camera.matrix] * 24, depths, NAMES, 24.0)
    assert found.standing.all() if stands else not found.standing.any()


def test_a_mark_above_the_horizon_meets_no_floor():
    camera = PerspectiveCamera.look_at((0, 2, 5), (0, 2, 0), (960, 540), 0.8)
    points = np.tile([0, 2.5, 0], (6, 4, 1))
    depths = camera.depth(points)
    standing = np.ones((6, 2), bool)
    found = ground_depths(camera.project(points), [camera.matrix] * 6, depths, NAMES, 24.0, standing=standing)
    np.testing.assert_array_equal(found.depths, depths)
