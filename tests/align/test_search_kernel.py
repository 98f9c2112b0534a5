import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pegbar import OrthographicCamera, _kernels
from pegbar.align.candidates import views
from pegbar.align.refine import cheapest_path
from tests.oracles import search as oracle


@st.composite
def cases(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    frames, limbs, length = draw(st.integers(1, 4)), draw(st.integers(1, 3)), draw(st.integers(1, 14))
    vectors = rng.normal(size=(length, limbs, 3))
    angles = rng.uniform(-np.pi, np.pi, (2, frames, limbs))
    weights = rng.uniform(0, 1, (2, frames, limbs))
    low = rng.integers(0, 3, frames)
    steps = np.stack([low, low + rng.integers(0, 3, frames)], axis=1)
    return vectors, angles, weights, steps


@given(cases(), st.integers(1, 9), st.floats(0, 360), st.floats(-80, 80))
def test_equals_the_oracle(case, block, azimuth, elevation):
    vectors, angles, weights, steps = case
    axes, _ = views([azimuth, azimuth + 50], [elevation])
    frames = angles.shape[1]
    costs, ends = _kernels.search_clips(
        np.ascontiguousarray(vectors.transpose(1, 2, 0), np.float32),
        np.array([[0, len(vectors)]], np.uint64),
        axes,
        (
            angles.astype(np.float32),
            weights.astype(np.float32),
            np.arange(frames, dtype=np.uint32)[None],
            np.ascontiguousarray(steps[None], np.uint32),
        ),
        block,
    )
    for view, (right, down) in enumerate(axes.astype(float)):
        for which in range(2):
            table = oracle.mean_angles(angles[which], weights[which], vectors.astype(np.float32), right, down)
            by_end = oracle.cheapest_path(table, steps)
            for row, start in enumerate(range(0, len(vectors), block)):
                want = by_end[start : start + block].min()
                np.testing.assert_allclose(costs[row, 2 * view + which], want, atol=2e-4)
                if np.isfinite(want):
                    assert by_end[ends[row, 2 * view + which]] <= want + 2e-4
            first = np.where(np.arange(frames)[:, None] > 0, steps, 0).astype(np.uint32)
            path, total = cheapest_path(np.split(table, [block % (frames + 1)]), first, len(vectors))
            np.testing.assert_allclose(total, by_end.min(), rtol=1e-9)
            if np.isfinite(total):
                assert np.isclose(table[np.arange(frames), path].sum(), total)
                apart = np.diff(path.astype(int))
                assert ((apart >= steps[1:, 0]) & (apart <= steps[1:, 1])).all()


@given(st.floats(-720, 720), st.floats(-90, 90))
def test_views_are_the_orthographic_cameras(azimuth, elevation):
    axes, places = views([azimuth], [elevation])
    assert places == [(azimuth, elevation)]
    want = OrthographicCamera.from_angles(azimuth, elevation).rotation[:2]
    np.testing.assert_allclose(axes[0], want, atol=1e-6)
