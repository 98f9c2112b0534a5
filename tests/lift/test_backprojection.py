import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import PerspectiveCamera, back_project
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
