import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import DegenerateError, PerspectiveCamera, back_project
from tests.oracles import backprojection as oracle


def shot(seed, frames, count, *, moving=True):
    """Random marks of a figure about 5 m before a camera that moves: markers, matrices, depths."""
    random = np.random.default_rng(seed)
    matrices = []
    for _ in range(frames):
        place = [0, 1, 5] + random.uniform(-0.2, 0.2, 3) * moving
        camera = PerspectiveCamera.look_at(place, [0, 1, 0], (960, 540), 0.8)
        matrices.append(camera.matrix)
    return random.uniform([300, 100], [660, 440], (frames, count, 2)), matrices, random.uniform(4, 6, (frames, count))


def project(points, matrices):
    return np.stack([PerspectiveCamera(m, (960, 540)).project(p) for m, p in zip(matrices, points, strict=True)])


def depth(points, matrices):
    return np.stack([PerspectiveCamera(m, (960, 540)).depth(p) for m, p in zip(matrices, points, strict=True)])


def roughness(points, matrices):
    """Squared second differences along the middle frame's ray, summed over time, for each marker."""
    eyes = np.array([PerspectiveCamera(m, (960, 540)).position for m in matrices])[1:-1, None]
    rays = points[1:-1] - eyes
    rays /= depth(points[1:-1], matrices[1:-1])[..., None]
    return ((np.diff(points, n=2, axis=0) * rays).sum(axis=2) ** 2 / (rays**2).sum(axis=2) ** 2).sum(axis=0)


@given(st.integers(0, 10**6), st.integers(0, 5), st.integers(0, 3))
def test_without_smoothing_drawing_and_depth_are_met_exactly(seed, frames, count):
    markers, matrices, depths = shot(seed, frames, count)
    matrices = np.reshape(matrices, (frames, 3, 4))
    points = back_project(markers, matrices, depths)
    assert points.shape == (frames, count, 3)
    if frames:
        np.testing.assert_allclose(project(points, matrices), markers, atol=1e-9)
        np.testing.assert_allclose(depth(points, matrices), depths, atol=1e-12)


@given(st.integers(0, 10**6), st.integers(3, 9), st.floats(1e-3, 1e6))
def test_smoothing_meets_the_drawing_and_never_roughens_depth(seed, frames, smoothing):
    markers, matrices, depths = shot(seed, frames, 2)
    points = back_project(markers, matrices, depths, smoothing=smoothing)
    np.testing.assert_allclose(project(points, matrices), markers, atol=1e-8)
    plain = back_project(markers, matrices, depths)
    assert (roughness(points, matrices) <= roughness(plain, matrices) * (1 + 1e-9)).all()


@pytest.mark.parametrize("smoothing", [0.01, 1.0, 300.0])
def test_smoothing_is_its_oracle(smoothing):
    markers, matrices, depths = shot(3, 9, 3)
    seen = np.random.default_rng(1).random((9, 3)) > 0.15
    want = oracle.along_rays(markers, matrices, depths, seen, smoothing)
    np.testing.assert_allclose(
        back_project(markers, matrices, depths, smoothing=smoothing, visible=seen), want, atol=1e-9
    )


@pytest.mark.parametrize("smoothing", [0.01, 1.0, 300.0])
def test_printed_form_is_equations_7_and_8(smoothing):
    markers, matrices, depths = shot(4, 6, 2)
    want = oracle.stacked(markers, matrices, depths, smoothing)
    got = back_project(markers, matrices, depths, smoothing=smoothing, form="printed")
    np.testing.assert_allclose(got, want, atol=1e-6)


def test_time_runs_either_way():
    markers, matrices, depths = shot(5, 12, 3)
    for form in ("ray", "printed"):
        there = back_project(markers, matrices, depths, smoothing=4.0, form=form)
        back = back_project(markers[::-1], matrices[::-1], depths[::-1], smoothing=4.0, form=form)[::-1]
        np.testing.assert_allclose(there, back, atol=1e-9)


@pytest.mark.parametrize("form", ["ray", "printed"])
def test_every_marker_is_for_itself(form):
    markers, matrices, depths = shot(6, 10, 4)
    together = back_project(markers, matrices, depths, smoothing=2.0, form=form)
    alone = [back_project(markers[:, [n]], matrices, depths[:, [n]], smoothing=2.0, form=form) for n in range(4)]
    np.testing.assert_array_equal(together, np.concatenate(alone, axis=1))


def test_endless_smoothing_leaves_steady_motion_in_depth():
    _, matrices, depths = shot(7, 20, 1, moving=False)
    markers = np.full((20, 1, 2), [300.0, 200.0])
    points = back_project(markers, matrices, depths, smoothing=1e9)
    line = np.polynomial.Polynomial.fit(np.arange(20), depths[:, 0], 1)
    np.testing.assert_allclose(depth(points, matrices)[:, 0], line(np.arange(20)), atol=1e-4)


def test_a_smooth_trajectory_is_left_and_the_period_that_is_halved_is_as_documented():
    frames = np.arange(200)
    matrices = [PerspectiveCamera.look_at([0, 1, 5], [0, 1, 0], (960, 540), 0.8).matrix] * 200
    markers = np.full((200, 1, 2), [700.0, 100.0])
    steady = (4 + 0.01 * frames)[:, None]
    np.testing.assert_allclose(depth(back_project(markers, matrices, steady, smoothing=16.0), matrices), steady)
    wave = 0.1 * np.sin(2 * np.pi * frames / (2 * np.pi * 16**0.25))[:, None]
    left = depth(back_project(markers, matrices, steady + wave, smoothing=16.0), matrices) - steady
    np.testing.assert_allclose(left[50:150], wave[50:150] / 2, atol=2e-3)


def test_smoothing_does_not_pull_to_the_camera():
    random = np.random.default_rng(8)
    _, matrices, _ = shot(8, 60, 3, moving=False)
    markers = [480, 270] + 100 * np.sin(np.arange(60) / 4)[:, None, None] + random.normal(0, 2, (60, 3, 2))
    depths = 5 + random.normal(0, 0.05, (60, 3))
    points = back_project(markers, matrices, depths, smoothing=1e4)
    np.testing.assert_allclose(depth(points, matrices).mean(axis=0), depths.mean(axis=0), atol=0.02)


def test_hidden_markers_are_nan_and_nobody_looks_at_them():
    markers, matrices, depths = shot(9, 8, 2)
    visible = np.ones((8, 2), bool)
    visible[[0, 3, 7], 1] = False
    ways = [{"smoothing": 0.0}, {"smoothing": 3.0}, {"smoothing": 3.0, "form": "printed"}]
    wants = [back_project(markers, matrices, depths, visible=visible, **way) for way in ways]
    markers[~visible], depths[~visible] = np.nan, np.inf
    for way, want in zip(ways, wants, strict=True):
        points = back_project(markers, matrices, depths, visible=visible, **way)
        np.testing.assert_array_equal(np.isnan(points).any(axis=2), ~visible)
        np.testing.assert_array_equal(points, want)
    # A frame alone between hidden ones has nothing to be smoothed with.
    visible[:, 0] = np.arange(8) % 2 == 0
    for way in ways:
        points = back_project(markers, matrices, depths, visible=visible, **way)[visible[:, 0], 0]
        exact = back_project(markers, matrices, depths, visible=visible)[visible[:, 0], 0]
        np.testing.assert_allclose(points, exact, atol=1e-12)


@pytest.mark.parametrize("scale", [-3.0, 0.01])
@pytest.mark.parametrize("form", ["ray", "printed"])
def test_cameras_of_any_scale_give_the_same(scale, form):
    markers, matrices, depths = shot(10, 5, 2)
    want = back_project(markers, matrices, depths, smoothing=1.0, form=form)
    np.testing.assert_allclose(
        back_project(markers, np.multiply(matrices, scale), depths, smoothing=1.0, form=form), want, atol=1e-9
    )


@pytest.mark.parametrize("form", ["ray", "printed"])
def test_the_pixels_origin_does_not_matter(form):
    markers, matrices, depths = shot(11, 5, 2)
    shift = np.array([[1, 0, 5000], [0, 1, -800], [0, 0, 1.0]])
    want = back_project(markers, matrices, depths, smoothing=1.0, form=form)
    got = back_project(np.add(markers, [5000, -800]), shift @ np.array(matrices), depths, smoothing=1.0, form=form)
    np.testing.assert_allclose(got, want, atol=1e-9)


def test_lists_and_other_orders_give_the_same():
    markers, matrices, depths = shot(12, 3, 2)
    want = back_project(markers, matrices, depths, smoothing=1.0)
    np.testing.assert_array_equal(
        back_project(np.asfortranarray(markers), [m.tolist() for m in matrices], depths.tolist(), smoothing=1.0), want
    )


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"markers": np.zeros((3, 2, 3))}, ValueError, "^markers: want shape"),
        ({"matrices": np.zeros((2, 3, 4))}, ValueError, "^matrices: want shape"),
        ({"matrices": np.zeros((3, 3, 4))}, DegenerateError, "^matrices: frame 0 is singular"),
        ({"depths": np.ones((3, 1))}, ValueError, "^depths: want shape"),
        ({"depths": [[1, 1], [1, 0], [1, 1]]}, DegenerateError, "^depths: frame 1, right_hand is not in front"),
        ({"depths": [[1, 1], [1, 1], [-2, 1]]}, DegenerateError, "^depths: frame 2, head is not in front"),
        ({"depths": [[1, 1], [1, 1], [np.inf, 1]]}, ValueError, "^depths: frame 2, head has no finite depth"),
        ({"markers": np.full((3, 2, 2), np.nan)}, ValueError, "^markers: frame 0, head has no position"),
        ({"visible": [[True, True]]}, ValueError, "^visible: want shape"),
        ({"smoothing": -1}, ValueError, "^smoothing: "),
        ({"smoothing": np.nan}, ValueError, "^smoothing: "),
        ({"form": "exact"}, ValueError, "^form: "),
        ({"names": ["head"]}, ValueError, "^names: want 2, got 1"),
    ],
)
def test_wrong_arguments_are_named(change, error, message):
    markers, matrices, depths = shot(13, 3, 2)
    good = {"markers": markers, "matrices": matrices, "depths": depths, "names": ["head", "right_hand"]}
    with pytest.raises(error, match=message):
        back_project(**good | change)


def test_a_marker_without_a_name_is_named_by_number():
    markers, matrices, depths = shot(14, 1, 2)
    depths[0, 1] = -1
    with pytest.raises(DegenerateError, match="frame 0, marker 1"):
        back_project(markers, matrices, depths)
