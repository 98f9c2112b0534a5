import math

import numpy as np
import pytest

from pegbar import DegenerateError, PerspectiveCamera, register_cameras
from pegbar.align.camera_choice import HeldOut, held_out_runs
from pegbar.align.root_motion import smoothed, travelling
from pegbar.sample.shot import make_scene

SIZE = (640, 360)


def figure(frames=12, marks=14, seed=0, walk=0.0):
    """A figure that changes its pose smoothly and walks along z."""
    rng = np.random.default_rng(seed)
    swing = np.sin(np.linspace(0, 2 * math.pi, frames)[:, None, None] + rng.uniform(0, 6, (marks, 1)))
    points = rng.normal(0, (0.3, 0.5, 0.25), (marks, 3)) + 0.15 * swing * rng.normal(size=(marks, 3))
    return points + [0, 0.9, 0] + np.linspace(-walk / 2, walk / 2, frames)[:, None, None] * [0, 0, 1]


def camera_at(azimuth, elevation=8.0, distance=5.0, fov=40.0, target=(0, 0.9, 0)):
    a, e = math.radians(azimuth), math.radians(elevation)
    toward = np.array([math.sin(a) * math.cos(e), math.sin(e), math.cos(a) * math.cos(e)])
    return PerspectiveCamera.look_at(target + distance * toward, target, SIZE, math.radians(fov))


def seen_by(cameras, points):
    return np.stack([camera.project(pose) for camera, pose in zip(cameras, points, strict=True)])


@pytest.mark.parametrize("mode", ["static", "pan", "free", "auto"])
@pytest.mark.parametrize("azimuth", [0, 50, 130, 180, 250, 310])
def test_a_still_camera_is_found_from_all_round(mode, azimuth):
    points, camera = figure(), camera_at(azimuth, elevation=-5 if azimuth == 130 else 20)
    track = register_cameras(seen_by([camera] * 12, points), points, SIZE, mode=mode, field_of_view=math.radians(40))
    for found in track.cameras:
        np.testing.assert_allclose(found.position, camera.position, atol=1e-4)
        np.testing.assert_allclose(found.rotation, camera.rotation, atol=1e-4)
    assert track.errors.max() < 0.01
    assert track.errors.shape == (12,)
    assert track.matrices.shape == (12, 3, 4)
    assert track.mode == ("static" if mode == "auto" else mode)
    assert set(track.trials) == ({"static", "free"} if mode == "auto" else set())
    np.testing.assert_allclose(np.linalg.norm(track.matrices[:, 2, :3], axis=1), 1)
    np.testing.assert_allclose(track.project(), seen_by(track.cameras, points), atol=1e-9)


def test_a_turning_and_a_travelling_camera_are_told_apart():
    points = figure(40, walk=3.0)
    middles = [(0, 0.9, z) for z in np.linspace(-1.5, 1.5, 40)]
    turning = [PerspectiveCamera.look_at((5, 1.2, 0), middle, SIZE, 0.7) for middle in middles]
    following = [PerspectiveCamera.look_at((5, 1.2, middle[2]), middle, SIZE, 0.7) for middle in middles]
    for cameras, mode in ((turning, "pan"), (following, "free")):
        noise = np.random.default_rng(1).normal(0, 1, (40, 14, 2))
        track = register_cameras(seen_by(cameras, points) + noise, points, SIZE, mode="auto", field_of_view=0.7)
        assert track.mode == mode
        gap = [np.linalg.norm(a.position - b.position) for a, b in zip(track.cameras, cameras, strict=True)]
        assert max(gap) < 0.15
        assert set(track.trials) == {"static", "pan", "free"}


def test_focal_length_is_solved_where_the_drawings_tell_it():
    points, camera = figure(30, walk=4.0), camera_at(20, distance=6, fov=55)
    track = register_cameras(seen_by([camera] * 30, points), points, SIZE, mode="static")
    assert math.degrees(track.cameras[0].field_of_view) == pytest.approx(55, abs=0.5)
    assert len({round(found.focal_length, 6) for found in track.cameras}) == 1


def test_the_picture_may_be_larger_and_the_world_turned():
    points, camera = figure(walk=1.0), camera_at(35)
    marks = seen_by([camera] * 12, points) + np.random.default_rng(0).normal(0, 2, (12, 14, 2))
    options = {"mode": "free", "field_of_view": math.radians(40)}
    one = register_cameras(marks, points, SIZE, **options)
    three = register_cameras(3 * marks + 1, points, (1920, 1080), **options)
    turn = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    turned = register_cameras(marks, points @ turn.T + [3, 0, -2], SIZE, **options)
    for a, b, c in zip(one.cameras, three.cameras, turned.cameras, strict=True):
        np.testing.assert_allclose(a.position, b.position, atol=1e-3)
        np.testing.assert_allclose(turn @ a.position + [3, 0, -2], c.position, atol=1e-3)


def test_hidden_marks_do_not_count_and_wild_ones_little():
    points, camera = figure(20), camera_at(60)
    marks = seen_by([camera] * 20, points)
    visible = np.random.default_rng(3).random((20, 14)) > 0.3
    hidden = np.where(visible[..., None], marks, np.nan)
    track = register_cameras(hidden, points, SIZE, visible=visible, mode="static", field_of_view=math.radians(40))
    np.testing.assert_allclose(track.cameras[0].position, camera.position, atol=1e-4)
    marks += np.random.default_rng(1).normal(0, 1, marks.shape)
    marks[:, [2, 9]] += 60
    options = {"mode": "static", "field_of_view": math.radians(40)}
    robust, plain = (register_cameras(marks, points, SIZE, robust=on, **options) for on in (True, False))
    gaps = [np.linalg.norm(track.cameras[0].position - camera.position) for track in (robust, plain)]
    assert 2 * gaps[0] < gaps[1]


def test_frames_without_marks_are_bridged_on_request():
    points = figure(30)
    cameras = [camera_at(azimuth) for azimuth in np.linspace(20, 50, 30)]
    visible = np.ones((30, 14), bool)
    visible[12:16] = False
    marks = seen_by(cameras, points)
    with pytest.raises(DegenerateError, match="frame 12 "):
        register_cameras(marks, points, SIZE, visible=visible)
    track = register_cameras(marks, points, SIZE, visible=visible, bridge=True, field_of_view=math.radians(40))
    assert np.isnan(track.errors[12:16]).all()
    assert np.isfinite(track.errors[:12]).all()
    for found, want in zip(track.cameras, cameras, strict=True):
        assert np.linalg.norm(found.position - want.position) < 0.3


def test_the_window_and_the_weights_smooth():
    points, rng = figure(40), np.random.default_rng(5)
    cameras = [camera_at(azimuth) for azimuth in np.linspace(20, 40, 40)]
    marks = seen_by(cameras, points) + rng.normal(0, 2, (40, 14, 2))

    def shake(**options):
        track = register_cameras(marks, points, SIZE, field_of_view=math.radians(40), **options)
        return np.abs(np.diff([camera.position for camera in track.cameras], n=2, axis=0)).mean()

    assert shake(window=21) < 0.5 * shake(window=9) < 0.25 * shake(window=3)
    assert shake(weights={"smooth": 0}) > 5 * shake()


def test_the_camera_stays_above_ground_and_level():
    points, low = figure(), camera_at(40, elevation=-25)
    marks = seen_by([low] * 12, points)
    assert low.position[1] < -0.5
    options = {"mode": "static", "field_of_view": math.radians(40)}
    free = register_cameras(marks, points, SIZE, ground=None, **options)
    held = register_cameras(marks, points, SIZE, weights={"ground": 100}, **options)
    deeper = register_cameras(marks, points, SIZE, ground=-2.0, **options)
    assert free.cameras[0].position[1] == pytest.approx(low.position[1], abs=1e-3)
    assert held.cameras[0].position[1] > -0.05
    assert deeper.cameras[0].position[1] == pytest.approx(low.position[1], abs=1e-3)
    high = seen_by([camera_at(40, elevation=50)] * 12, points)
    lower = register_cameras(high, points, SIZE, weights={"level": 1.0}, **options).cameras[0]
    assert -lower.rotation[2, 1] < 0.8 * math.sin(math.radians(50))
    tilt = math.radians(10)
    turn = np.array([[math.cos(tilt), -math.sin(tilt)], [math.sin(tilt), math.cos(tilt)]])
    middle = (np.array(SIZE) - 1) / 2
    rolled = (seen_by([camera_at(40)] * 12, points) - middle) @ turn.T + middle
    level, as_drawn = (register_cameras(rolled, points, SIZE, weights={"roll": w}, **options) for w in (30, 0))
    assert abs(level.cameras[0].rotation[0, 1]) < 0.02
    assert abs(as_drawn.cameras[0].rotation[0, 1]) == pytest.approx(math.sin(tilt), abs=3e-3)


def test_given_cameras_are_measured():
    points, camera = figure(), camera_at(75)
    marks = seen_by([camera] * 12, points)
    marks[4] += [3, 4]
    for cameras in (camera, camera.matrix, [camera] * 12, np.stack([camera.matrix * 2] * 12)):
        track = register_cameras(marks, points, SIZE, mode="given", cameras=cameras)
        np.testing.assert_allclose(track.errors, np.where(np.arange(12) == 4, 5, 0), atol=1e-9)
        np.testing.assert_allclose(track.matrices[3], camera.matrix)
    with pytest.raises(ValueError, match="^cameras: "):
        register_cameras(marks, points, SIZE, mode="given")
    with pytest.raises(ValueError, match="^cameras: "):
        register_cameras(marks, points, SIZE, cameras=camera)
    with pytest.raises(ValueError, match="^cameras: "):
        register_cameras(marks, points, SIZE, mode="given", cameras=np.zeros((3, 3, 4)))


@pytest.mark.parametrize(("share", "name"), [(0.0, "in_place"), (0.5, "scaled"), (1.0, "travel")])
def test_how_far_the_figure_travels_is_found(share, name):
    points, camera = figure(40, walk=3.0), camera_at(70, distance=6)
    noise = np.random.default_rng(2).normal(0, 1, (40, 14, 2))
    marks = seen_by([camera] * 40, travelling(points, 36, share)) + noise
    track = register_cameras(marks, points, SIZE, mode="auto", root="auto", field_of_view=math.radians(40))
    assert (track.mode, track.root) == ("static", name)
    assert track.travel == pytest.approx(share, abs=0.05)
    assert np.linalg.norm(track.cameras[0].position - camera.position) < 0.3
    np.testing.assert_allclose(track.points, travelling(points, 36, track.travel))
    assert bool(track.notes) == (share < 1)
    told = register_cameras(marks, points, SIZE, mode="static", root=share, field_of_view=math.radians(40))
    assert told.error < 1.6


def test_travel_is_taken_out_smoothly_and_sway_stays():
    frames = np.arange(48)
    sway = 0.05 * np.sin(frames * 2 * math.pi / 6)
    points = np.zeros((48, 3, 3)) + np.stack([sway, 0 * frames, 0.1 * frames], axis=1)[:, None]
    points[5, 1] = np.nan
    still = travelling(points, 18, 0.0)
    assert np.ptp(still[:, 0, 2]) < 1e-9
    np.testing.assert_allclose(still[5:43, 0, 0], sway[5:43], atol=0.01)
    assert np.isnan(still[5, 1]).all()
    straight = np.arange(10.0)[:, None] * [1, 2]
    np.testing.assert_allclose(smoothed(straight, 9), straight, atol=1e-9)
    dense = np.diff(np.eye(7), n=2, axis=0)
    path = np.random.default_rng(0).normal(size=(7, 2))
    want = np.linalg.solve(np.eye(7) + (5 / 2.78) ** 4 * dense.T @ dense, path)
    np.testing.assert_allclose(smoothed(path, 5), want, atol=1e-12)


def test_modes_are_judged_by_frames_held_out():
    for frames in (3, 8, 48, 300):
        runs = held_out_runs(frames, 9)
        held = np.concatenate(runs)
        assert len(set(held.tolist())) == len(held)
        assert min(held) > 0
        assert max(held) < frames - 1
    same = HeldOut(5.0, 4.0)
    assert same.gain_of(HeldOut(4.0, 4.0)) == 1.25
    assert same.gain_of(HeldOut(5.0, 2.0)) == 2


def test_one_frame_is_enough_and_marks_may_lie_outside():
    points, camera = figure(1), camera_at(20, distance=2.0)
    marks = seen_by([camera], points) + np.array([400, 0])
    assert marks.max() > 640
    for mode in ("static", "pan", "free", "auto"):
        track = register_cameras(marks, points, SIZE, mode=mode, field_of_view=math.radians(40))
        assert track.errors[0] < 25


def bad(**change):
    points = figure()
    marks = seen_by([camera_at(30)] * 12, points)
    arguments = {"markers": marks, "points": points, "image_size": SIZE, **change}
    return register_cameras(**arguments)


def test_what_is_wrong_is_named():
    points = figure()
    marks = seen_by([camera_at(30)] * 12, points)
    hidden = np.ones((12, 14), bool)
    hidden[7, 3:] = False
    with pytest.raises(DegenerateError, match=r"frame 7 has only \[0, 1, 2\]"):
        bad(visible=hidden)
    with pytest.raises(DegenerateError, match="frame 0 has only"):
        bad(visible=np.zeros((12, 14), bool))
    with pytest.raises(DegenerateError, match="0 visible joints in all frames"):
        bad(visible=np.zeros((12, 14), bool), mode="static")
    line = points.copy()
    line[2] = np.linspace(0, 1, 14)[:, None] * [0.2, 1, 0.1]
    with pytest.raises(DegenerateError, match="points: the visible joints of frame 2 lie on one line"):
        bad(points=line)
    flat = marks.copy()
    flat[5] = np.linspace(0, 100, 14)[:, None] * [1, 2]
    with pytest.raises(DegenerateError, match="markers: the visible joints of frame 5 lie on one line"):
        bad(markers=flat)
    for name, values in (("markers", marks), ("points", points)):
        broken = values.copy()
        broken[4, 6, 1] = np.nan
        with pytest.raises(ValueError, match=f"^{name}: .*frame 4, joint 6"):
            bad(**{name: broken})
    for name, value in (
        ("markers", marks[:, :, :1]),
        ("points", points[:5]),
        ("image_size", (640,)),
        ("visible", hidden[:3]),
        ("window", 0),
        ("field_of_view", 4.0),
        ("mode", "zoom"),
        ("root", "somewhere"),
        ("root", math.nan),
        ("ground", math.inf),
        ("weights", {"smoth": 1}),
        ("weights", {"smooth": -1}),
    ):
        with pytest.raises(ValueError, match=f"^{name}: "):
            bad(**{name: value})
    with pytest.raises(ValueError, match="^markers: "):
        bad(markers=np.zeros((0, 14, 2)), points=np.zeros((0, 14, 3)))


def test_the_samples_camera_and_depth_order():
    scene = make_scene((960, 540), 48)
    marks, clip = seen_by(scene.cameras, scene.dance.drawn), scene.dance.clip.positions
    track = register_cameras(marks, clip, scene.size, mode="auto", field_of_view=math.radians(40))
    assert track.mode == "free"
    want = np.stack([view.depth(pose) for view, pose in zip(scene.cameras, scene.dance.drawn, strict=True)])
    got = np.stack([view.depth(pose) for view, pose in zip(track.cameras, clip, strict=True)])
    first, second = np.triu_indices(want.shape[1], 1)
    apart, ours = want[:, first] - want[:, second], got[:, first] - got[:, second]
    assert np.mean((apart * ours > 0)[abs(apart) > 0.05]) > 0.98
    place = [np.linalg.norm(a.position - b.position) for a, b in zip(track.cameras, scene.cameras, strict=True)]
    assert max(place) < 0.9
