import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import depth_composite, rim_depth
from tests.oracles import rim as oracle

# Wider than two blocks of the kernel.
sizes = st.tuples(st.integers(1, 9), st.integers(1, 150))
seeds = st.integers(0, 2**32 - 1)
kinds = st.sampled_from([np.uint8, np.float32])
shares = st.sampled_from([0.0, 0.005, 0.05, 0.5, 1.0])


def frame(seed, size, kind=np.uint8, share=0.05, mistakes=False):
    """A render whose samples have depth in a ``share`` of its samples, and coverage in half of them."""
    random = np.random.default_rng(seed)
    rendered = random.integers(0, 256, (*size, 4), dtype=np.uint8)
    rendered[random.random(size) < 0.5, 3] = 0
    depth = np.where(random.random(size) < share, random.choice([-1, 0.5, 1, 2, 7], size), np.inf).astype(np.float32)
    if mistakes:
        depth[random.random(size) < 0.1] = np.nan
        depth[random.random(size) < 0.1] = -np.inf
    return (rendered if kind == np.uint8 else (rendered / 255).astype(np.float32)), depth


@given(seeds, sizes, kinds, shares, st.booleans())
def test_equals_the_oracle(seed, size, kind, share, mistakes):
    rendered, depth = frame(seed, size, kind, share, mistakes)
    before = depth.copy()
    got, want = rim_depth(rendered, depth), oracle.rim_depth(rendered, depth)
    assert got.dtype == np.float32
    np.testing.assert_array_equal(got, want)
    np.testing.assert_array_equal(depth, before)
    assert (got is depth) == np.array_equal(want, depth, equal_nan=True)


@given(seeds, sizes, kinds)
def test_memory_order_and_kind_of_input_do_not_matter(seed, size, kind):
    case = frame(seed, size, kind)
    want = rim_depth(*case)
    assert np.array_equal(rim_depth(*map(np.asfortranarray, case)), want)
    assert np.array_equal(rim_depth(*(values.repeat(2, axis=0).repeat(3, axis=1)[::2, ::3] for values in case)), want)
    assert np.array_equal(rim_depth(*(values[::-1, ::-1].copy()[::-1, ::-1] for values in case)), want)
    assert np.array_equal(rim_depth(*(values.tolist() for values in case)), want)
    assert np.array_equal(rim_depth(case[0], case[1].astype(float)), want)


@pytest.mark.parametrize("value", [np.inf, 2.0])
def test_the_given_array_is_returned_where_nothing_is_to_be_filled(value):
    rendered = np.full((6, 130, 4), 128, np.uint8)
    for depth in (np.full((6, 130), value, np.float32), np.full((130, 6), value, np.float32).T):
        assert rim_depth(rendered, depth) is depth
    depth = np.full((6, 130), np.inf, np.float32)
    depth[:, 50:70] = 1
    assert rim_depth(rendered * 0, depth) is depth
    assert rim_depth(rendered * np.float32(np.nan), depth) is depth
    got = rim_depth(rendered, depth.astype(float))
    assert got.dtype == np.float32
    assert (got[:, 48:72] == 1).all()
    assert np.isinf(got[:, [47, 72]]).all()


@pytest.mark.parametrize("size", [(0, 0), (0, 7), (7, 0)])
def test_empty_maps_give_empty_maps(size):
    assert rim_depth(np.zeros((*size, 4), np.uint8), np.zeros(size, np.float32)).shape == size


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("rendered", np.zeros((3, 70), np.uint8)),
        ("rendered", np.zeros((3, 70, 3), np.uint8)),
        ("rendered", np.full((3, 70, 4), 256)),
        ("rendered", np.zeros((3, 70, 4), complex)),
        ("rendered", [[1], [1, 2]]),
        ("rendered_depth", np.zeros((70, 3))),
        ("rendered_depth", np.zeros((3, 70, 1))),
        ("rendered_depth", np.zeros((6, 140))),
        ("rendered_depth", "near"),
        ("rendered_depth", [[1], [1, 2]]),
    ],
)
def test_wrong_arguments_are_named(argument, value):
    case = {"rendered": np.zeros((3, 70, 4), np.uint8), "rendered_depth": np.zeros((3, 70), np.float32)}
    with pytest.raises(ValueError, match=f"^{argument}: "):
        rim_depth(**(case | {argument: value}))


def test_what_is_not_a_depth_is_left_for_the_composite_to_name():
    rendered, depth = frame(1, (3, 70))
    depth[1, 9] = np.nan
    filled = rim_depth(rendered, depth)
    assert np.isnan(filled[1, 9])
    with pytest.raises(ValueError, match="^rendered_depth: .* row 1, column 9"):
        depth_composite(np.zeros((3, 70, 3), np.uint8), np.ones((3, 70)), np.ones((3, 70)), rendered, filled)


DRAWN, RENDERED, SIZE = np.array([20, 60, 220]), np.array([240, 200, 30]), (70, 140)


def disc(place, radius, blur):
    """A disc as renderers give it: coverage filtered over ``blur`` pixels, depth at each pixel's centre."""
    fine = 16
    distance = lambda y, x: np.hypot(x - place[0], y - place[1])  # noqa: E731
    rows, columns = ((np.arange(n * fine) + 0.5) / fine - 0.5 for n in SIZE)
    inside = (distance(rows[:, None], columns) < radius).astype(float)
    box = np.ones(round(blur * fine)) / round(blur * fine)
    for axis in (0, 1):
        inside = np.apply_along_axis(np.convolve, axis, inside, box, "same")
    coverage = inside[fine // 2 :: fine, fine // 2 :: fine]
    depth = np.where(distance(*np.indices(SIZE)) < radius, 1.0, np.inf).astype(np.float32)
    return np.where(coverage > 1e-9, np.clip(coverage, 0, 1), 0), depth


@pytest.mark.parametrize("kind", [np.uint8, np.float32])
@pytest.mark.parametrize("blur", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("place", [(63.3, 31.8), (70.0, 35.0), (2.2, 66.6)])
def test_a_render_at_the_drawings_size_keeps_its_smooth_edge(kind, blur, place):
    coverage, depth = disc(place, 20.4, blur)
    rendered = np.empty((*SIZE, 4))
    rendered[..., :3], rendered[..., 3] = RENDERED, np.rint(255 * coverage)
    if kind == np.float32:
        rendered = np.concatenate([RENDERED / 255 * coverage[..., None], coverage[..., None]], axis=-1)
    rendered = rendered.astype(kind)
    drawing = np.broadcast_to(DRAWN.astype(np.uint8), (*SIZE, 3))
    planes = np.ones(SIZE, np.float32), np.full(SIZE, 2, np.float32)
    composite = lambda z: depth_composite(drawing, *planes, rendered, z, dtype=np.uint8)[..., :3]  # noqa: E731
    want = RENDERED * coverage[..., None] + DRAWN * (1 - coverage[..., None])
    assert np.abs(composite(rim_depth(rendered, depth)) - want).max() <= 1
    missed = (coverage > 0.1) & np.isinf(depth)
    assert missed.sum() > 10
    assert (np.abs(composite(depth) - want).max(axis=-1)[missed] > 10).all()


def test_an_opaque_backdrop_without_depth_frames_nothing():
    rendered = np.full((5, 5, 4), 255, np.uint8)
    depth = np.full((5, 5), np.inf, np.float32)
    depth[2, 2] = 2
    assert rim_depth(rendered, depth) is depth
    assert rim_depth(rendered / np.float32(255), depth) is depth
