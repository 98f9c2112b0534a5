import math
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pegbar import DegenerateError, PerspectiveCamera, fit_pose, read_motion
from pegbar.scene.body import MARKERS
from tests.oracles import pose as oracle

SIZE = (1280, 720)
LOSSES = ("squared", "huber", "cauchy", "geman_mcclure")
#: The defaults, written out.
USUAL, SPREADS = math.radians(40), (0.35, math.radians(5), math.radians(30))


def poses(count, joints=12, seed=0):
    return np.random.default_rng(seed).normal(size=(count, joints, 3)) * (0.4, 0.6, 0.4)


def seen_from(pose, azimuth=0.7, elevation=0.2, field_of_view=0.7, distance=5.0, roll=0.0):
    direction = np.array(
        [math.sin(azimuth) * math.cos(elevation), math.sin(elevation), math.cos(azimuth) * math.cos(elevation)]
    )
    middle = np.add(pose.mean(axis=0), (0.1, -0.2, 0))
    level = PerspectiveCamera.look_at(middle + distance * direction, middle, SIZE, field_of_view)
    turn = np.array([[math.cos(roll), -math.sin(roll), 0], [math.sin(roll), math.cos(roll), 0], [0, 0, 1]])
    return PerspectiveCamera.from_parts(turn @ level.rotation, level.position, SIZE, field_of_view)


def noisy(camera, pose, noise=3.0, seed=1):
    return camera.project(pose) + np.random.default_rng(seed).normal(0, noise, (len(pose), 2))


@settings(max_examples=20)
@given(
    st.integers(0, 9), st.floats(-math.pi, math.pi), st.floats(-0.9, 0.9), st.floats(-0.4, 0.4), st.floats(0.35, 1.05)
)
def test_the_pose_that_was_drawn_and_its_camera_are_found(pose, azimuth, elevation, roll, field_of_view):
    clip = poses(10)
    camera = seen_from(clip[pose], azimuth, elevation, field_of_view, roll=roll)
    fit = fit_pose(
        camera.project(clip[pose]), clip, SIZE, field_of_view=field_of_view, roll_spread=10, elevation_spread=10
    )
    assert fit.pose == pose
    assert fit.error < 0.5
    np.testing.assert_allclose(fit.camera.position, camera.position, atol=0.02)
    np.testing.assert_allclose(fit.camera.rotation, camera.rotation, atol=0.01)


@pytest.mark.parametrize("loss", LOSSES)
def test_costs_errors_and_ranking_are_those_of_the_oracle(loss):
    clip = poses(9)
    joints = noisy(seen_from(clip[4]), clip[4])
    fit = fit_pose(joints, clip, SIZE, loss=loss, scale=8)
    for pose, camera in enumerate(fit.cameras):
        distances = np.linalg.norm(camera.project(clip[pose]) - joints, axis=1)
        np.testing.assert_allclose(fit.joint_errors[pose], distances, atol=1e-6)
        np.testing.assert_allclose(fit.errors[pose], np.sqrt(np.mean(distances**2)), atol=1e-6)
        residuals = oracle.residuals(
            oracle.unknowns_of(camera), joints, clip[pose], SIZE, loss=loss, scale=8, usual=USUAL, spreads=SPREADS
        )
        np.testing.assert_allclose(fit.costs[pose], np.sum(residuals**2), rtol=1e-6)
    assert fit.ranking.tolist() == np.argsort(fit.costs, kind="stable").tolist()
    assert fit.pose == fit.ranking[0] == 4
    assert fit.error == fit.errors[4]
    assert fit.camera == fit.cameras[4]
    assert "pose=4" in repr(fit)


@pytest.mark.parametrize("loss", LOSSES)
def test_scipy_finds_nothing_better_from_there_nor_from_the_papers_starts(loss):
    clip = poses(4)
    joints = noisy(seen_from(clip[2]), clip[2])
    fit = fit_pose(joints, clip, SIZE, loss=loss, scale=8)
    options = {"loss": loss, "scale": 8, "usual": USUAL, "spreads": SPREADS}
    for unknowns in (oracle.unknowns_of(fit.camera), *(oracle.start(clip[2], a, SIZE, USUAL) for a in (0, math.pi))):
        cost = oracle.fit(unknowns, joints, clip[2], SIZE, **options)[1]
        assert cost > fit.costs[2] * (1 - 1e-6)


def test_one_start_may_stay_on_the_wrong_side_and_eight_do_not():
    clip = poses(1) * (0.25, 1, 1)
    joints = seen_from(clip[0], azimuth=math.pi).project(clip[0])
    one, eight = (fit_pose(joints, clip, SIZE, starts=starts) for starts in (1, 8))
    assert eight.error < 1
    assert one.errors[0] > 20


def test_outliers_spoil_a_squared_loss_only():
    clip = poses(1, joints=16)
    camera = seen_from(clip[0])
    joints = camera.project(clip[0])
    joints[[3, 9]] += [[30, 0], [0, -30]]
    turns = {}
    for loss in LOSSES:
        found = fit_pose(joints, clip, SIZE, loss=loss).camera
        turns[loss] = np.linalg.norm(found.rotation - camera.rotation)
    assert turns["huber"] < 0.6 * turns["squared"]
    assert max(turns["cauchy"], turns["geman_mcclure"]) < 0.3 * turns["squared"]


def test_what_is_switched_off_does_not_count_whatever_it_holds():
    clip = poses(5)
    joints = noisy(seen_from(clip[1]), clip[1])
    active = np.ones(12, bool)
    active[[0, 7]] = False
    want = fit_pose(joints[active], clip[:, active], SIZE)
    joints[0], joints[7], clip[:, 7], clip[2:, 0] = 9e9, np.nan, np.nan, np.nan
    got = fit_pose(joints, clip, SIZE, active=active)
    assert np.array_equal(got.matrices, want.matrices)
    assert np.array_equal(got.errors, want.errors)
    assert np.array_equal(got.joint_errors[:, active], want.joint_errors)
    assert np.isnan(got.joint_errors[:, ~active]).all()


def test_a_given_field_of_view_is_every_cameras_and_a_solved_one_is_near_the_usual():
    clip = poses(3)
    joints = noisy(seen_from(clip[0], field_of_view=0.9), clip[0], noise=1)
    given = fit_pose(joints, clip, SIZE, field_of_view=0.6)
    np.testing.assert_allclose([camera.field_of_view for camera in given.cameras], 0.6)
    narrow = fit_pose(joints, clip, SIZE, usual_field_of_view=0.4, focal_spread=0.01)
    assert narrow.camera.field_of_view == pytest.approx(0.4, rel=0.05)
    free = fit_pose(joints, clip, SIZE, focal_spread=math.inf, scale=1)
    assert abs(free.camera.field_of_view - 0.9) < abs(given.camera.field_of_view - 0.9)


def test_roll_and_elevation_are_held_only_as_far_as_asked():
    clip = poses(1)
    joints = seen_from(clip[0], elevation=0.5, roll=0.4).project(clip[0])
    loose, level = fit_pose(joints, clip, SIZE), fit_pose(joints, clip, SIZE, roll_spread=1e-4, elevation_spread=1e-4)
    assert abs(loose.camera.rotation[0, 1]) > 0.3
    assert loose.camera.rotation[2, 1] < -0.3
    np.testing.assert_allclose(level.camera.rotation[[0, 2], 1], 0, atol=1e-3)


def test_a_picture_upside_down_is_not_seen_by_an_upside_down_camera():
    clip = poses(1)
    joints = SIZE - seen_from(clip[0], elevation=0).project(clip[0])
    spreads = ({"roll_spread": spread, "elevation_spread": spread} for spread in (1e-3, math.inf))
    held, free = (fit_pose(joints, clip, SIZE, **spread) for spread in spreads)
    assert held.camera.rotation[1, 1] < -0.9
    assert held.error > 20
    assert free.camera.rotation[1, 1] > 0.9
    assert free.error < 5


def test_a_worse_scale_is_taken_where_no_pose_fits():
    clip = poses(6)
    joints = noisy(seen_from(clip[0]), clip[0], noise=60)
    fit = fit_pose(joints, clip, SIZE)
    first = fit_pose(joints, clip, SIZE, scale=0.015 * float(np.linalg.norm(np.ptp(joints, axis=0))))
    second = fit_pose(joints, clip, SIZE, scale=float(np.median(first.joint_errors[first.pose])))
    assert np.array_equal(fit.costs, second.costs)
    assert fit.costs.min() < first.costs.min() / 2


def test_a_pose_on_one_line_is_ranked_last_and_has_no_camera():
    clip = poses(3)
    joints = seen_from(clip[2]).project(clip[2])
    clip[0] = np.arange(12)[:, None] * [0.1, 0.2, 0.3]
    fit = fit_pose(joints, clip, SIZE)
    assert fit.pose == 2
    assert fit.ranking[-1] == 0
    assert math.isinf(fit.errors[0])
    assert fit.cameras[0] is None
    assert np.isnan(fit.matrices[0]).all()


def test_marks_may_lie_outside_the_picture_and_one_pose_will_do():
    clip = poses(1)
    camera = seen_from(clip[0])
    around = PerspectiveCamera.from_parts(camera.rotation, camera.position, (200, 100), 0.1)
    joints = around.project(clip[0])
    assert (joints < 0).any()
    assert (joints > 200).any()
    assert fit_pose(joints, clip, (200, 100), field_of_view=0.1).error < 0.5


def test_memory_order_and_kind_of_input_do_not_matter():
    clip, joints = poses(4).astype(np.float32), np.rint(noisy(seen_from(poses(4)[0]), poses(4)[0]))
    want = fit_pose(joints, clip, SIZE).matrices
    assert np.array_equal(fit_pose(joints.astype(int).tolist(), np.asfortranarray(clip), list(SIZE)).matrices, want)
    wide = np.repeat(clip.astype(float), 2, axis=1)[:, ::2]
    assert np.array_equal(fit_pose(np.asfortranarray(joints), wide, SIZE, active=[True] * 12).matrices, want)


@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_the_unit_and_place_of_the_poses_do_not_matter(unit):
    clip = poses(4)
    joints = noisy(seen_from(clip[1]), clip[1])
    want, got = fit_pose(joints, clip, SIZE), fit_pose(joints, unit * np.add(clip, (3, 1, -40)), SIZE)
    np.testing.assert_allclose(got.costs, want.costs, rtol=1e-6)
    np.testing.assert_allclose(got.camera.position / unit - (3, 1, -40), want.camera.position, atol=1e-4)


def test_threads_do_not_change_a_bit():
    code = (
        "import numpy as np, pegbar, hashlib; r = np.random.default_rng(0); p = r.normal(size=(61, 9, 3));"
        "f = pegbar.fit_pose(p[5, :, :2] * 90 + 300, p, (640, 480));"
        "print(hashlib.sha256(f.matrices.tobytes() + f.costs.tobytes()).hexdigest())"
    )
    digests = {
        subprocess.run(
            [sys.executable, "-c", code],
            env=os.environ | {"RAYON_NUM_THREADS": threads},
            capture_output=True,
            check=True,
        ).stdout
        for threads in ("1", "3")
    }
    assert len(digests) == 1


def changed(values, index, value):
    values = np.array(values)
    values[index] = value
    return values


GOOD = seen_from(poses(2)[0]).project(poses(2)[0])


@pytest.mark.parametrize(
    ("message", "arguments", "options"),
    [
        ("joints: want shape", (GOOD[:, :1], poses(2), SIZE), {}),
        ("joints: .*joint 3", (changed(GOOD, (3, 1), np.nan), poses(2), SIZE), {}),
        ("joints: want finite", (changed(GOOD, 3, np.inf), poses(2), SIZE), {}),
        ("poses: want shape", (GOOD, poses(2, joints=11), SIZE), {}),
        ("poses: .*one pose or more", (GOOD, np.zeros((0, 12, 3)), SIZE), {}),
        ("poses: .*pose 1, joint 5", (GOOD, changed(poses(2), (1, 5, 0), np.nan), SIZE), {}),
        ("image_size", (GOOD, poses(2), (0, 5)), {}),
        ("active: want shape", (GOOD, poses(2), SIZE), {"active": [True] * 11}),
        ("active: want true or false", (GOOD, poses(2), SIZE), {"active": [1] * 12}),
        ("field_of_view", (GOOD, poses(2), SIZE), {"field_of_view": math.pi}),
        ("field_of_view", (GOOD, poses(2), SIZE), {"field_of_view": math.nan}),
        ("usual_field_of_view", (GOOD, poses(2), SIZE), {"usual_field_of_view": 0}),
        ("loss", (GOOD, poses(2), SIZE), {"loss": "l1"}),
        ("scale", (GOOD, poses(2), SIZE), {"scale": 0}),
        ("starts", (GOOD, poses(2), SIZE), {"starts": 0}),
        ("focal_spread", (GOOD, poses(2), SIZE), {"focal_spread": 0}),
        ("roll_spread", (GOOD, poses(2), SIZE), {"roll_spread": math.nan}),
        ("elevation_spread", (GOOD, poses(2), SIZE), {"elevation_spread": -1}),
    ],
)
def test_wrong_arguments_are_named(message, arguments, options):
    with pytest.raises(ValueError, match=message):
        fit_pose(*arguments, **options)


@pytest.mark.parametrize(
    ("message", "arguments", "options"),
    [
        ("active: .*got 3", (GOOD, poses(2), SIZE), {"active": [True] * 3 + [False] * 9}),
        ("active: .*got 0", (GOOD, poses(2), SIZE), {"active": [False] * 12}),
        ("joints: want four joints or more, got 3", (GOOD[:3], poses(2)[:, :3], SIZE), {}),
        ("joints: .*one line", (np.arange(12)[:, None] * [3.0, 7.0], poses(2), SIZE), {}),
        ("joints: .*one place", (np.full((12, 2), 50.0), poses(2), SIZE), {}),
        ("poses: .*every pose", (GOOD, np.arange(12)[:, None] * [1.0, 2, 3] + np.zeros((3, 1, 1)), SIZE), {}),
        ("poses: .*every pose", (GOOD, np.ones((1, 12, 3)), SIZE), {}),
    ],
)
def test_geometry_without_an_answer_is_refused(message, arguments, options):
    with pytest.raises(DegenerateError, match=message):
        fit_pose(*arguments, **options)


def test_a_real_pose_seen_from_anywhere_is_found_again(test_data):
    motion = read_motion(test_data / "mocap" / "bvh" / "cmu_05_13.bvh")
    clip = motion.markers(MARKERS)[1::4]
    random = np.random.default_rng(0)
    for _ in range(6):
        pose = random.integers(len(clip))
        azimuth, elevation, view = random.uniform([-3, -0.5, 0.35], [3, 0.5, 1.05])
        camera = seen_from(clip[pose], azimuth, elevation, view, distance=1.25 / math.tan(view / 2))
        fit = fit_pose(noisy(camera, clip[pose]), clip, SIZE)
        assert abs(fit.pose - pose) <= 2 or fit.error <= 1.05 * fit.errors[pose]
        assert fit.camera.rotation[2] @ camera.rotation[2] > 0.98
