import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pegbar import depth_composite, holdout_matte, visible_matte
from tests.oracles import composite as oracle

# Wider than a block of the kernel, so that whole blocks and short ones are met.
sizes = st.tuples(st.integers(1, 4), st.integers(1, 150))
seeds = st.integers(0, 2**32 - 1)
scales = st.integers(1, 3)
spaces = st.sampled_from(["display", "linear"])
kinds = st.sampled_from([np.uint8, np.float32])


def frame(seed, size, scale=1, channels=4, kind=np.uint8):
    """Random frames in which every special case is common: empty, opaque, no depth, equal depths, nothing rendered."""
    random = np.random.default_rng(seed)
    large = (size[0] * scale, size[1] * scale)
    drawing = random.integers(0, 256, (*size, channels), dtype=np.uint8)
    alpha = np.clip(random.uniform(-0.5, 1.5, size), 0, 1).astype(np.float32)
    depths = [random.choice([1, 1.5, 2, 2.5, np.inf], shape).astype(np.float32) for shape in (size, large)]
    rendered = random.integers(0, 256, (*large, 4), dtype=np.uint8)
    rendered[..., 3] = np.clip(random.integers(-120, 376, large), 0, 255)
    if kind != np.uint8:
        rendered = oracle.premultiplied(rendered).astype(np.float32)
    return [drawing, alpha, depths[0], rendered, depths[1]]


def assert_equals(got, want, levels=1):
    tolerance = levels if got.dtype == np.uint8 else 1e-5
    np.testing.assert_allclose(got.astype(float), want, rtol=0, atol=tolerance)


@given(seeds, sizes, scales, st.sampled_from([3, 4]), kinds, kinds, spaces, spaces)
def test_equals_the_oracle(seed, size, scale, channels, kind, dtype, rendered_space, space):
    case = frame(seed, size, scale, channels, kind)
    got = depth_composite(*case, rendered_space=rendered_space, space=space, dtype=dtype)
    want = oracle.depth_composite(*case, rendered_space, space, dtype)
    assert got.dtype == dtype
    assert_equals(got, want)


@given(seeds, sizes)
def test_colours_above_one_and_glow_without_coverage(seed, size):
    case = frame(seed, size, kind=np.float32)
    case[3][..., :3] = np.random.default_rng(seed).choice([0, 0.001, 0.5, 3, 70, 1e5], (*size, 3))
    for options in ({"space": "display"}, {"rendered_space": "linear"}):
        for dtype in (np.float32, np.uint8):
            got = depth_composite(*case, **options, dtype=dtype)
            want = oracle.depth_composite(*case, **options, dtype=dtype)
            assert np.isfinite(got.astype(float)).all()
            np.testing.assert_allclose(got, want, rtol=1e-5, atol=1 if dtype == np.uint8 else 1e-5)


@given(seeds, sizes, kinds)
def test_equations_16_and_17_as_printed_on_an_opaque_plate(seed, size, kind):
    case = frame(seed, size, kind=kind)
    case[3][..., 3] = 255 if kind == np.uint8 else 1
    case[2][np.isinf(case[2])] = 9
    got = depth_composite(*case)
    top = 255 if kind == np.uint8 else 1
    want = oracle.printed(case[0] * (top / 255), *case[1:])
    assert (got[..., 3] == top).all()
    np.testing.assert_allclose(got[..., :3], want, rtol=0, atol=0.5 + 1e-3 if kind == np.uint8 else 1e-6)


@given(seeds, sizes, kinds)
def test_nearer_wins(seed, size, kind):
    case = frame(seed, size, kind=kind)
    top = 255 if kind == np.uint8 else 1
    case[1][:], case[3][..., 3] = 1, top
    got = depth_composite(*case)[..., :3]
    drawing = case[0][..., :3] * (top / 255)
    front = (case[2] < case[4]) | np.isinf(case[2])
    np.testing.assert_allclose(got, np.where(front[..., None], drawing, case[3][..., :3]), rtol=0, atol=1e-6)


@given(seeds, sizes, kinds)
def test_nothing_drawn_leaves_the_render_and_nothing_rendered_the_drawing(seed, size, kind):
    case = frame(seed, size, kind=kind)
    case[1][:] = 0
    covered = case[3][..., 3:] > 0
    assert np.array_equal(depth_composite(*case), np.where(covered, case[3], 0))
    case = frame(seed, size, kind=kind)
    case[3][:] = 0
    want = np.concatenate([case[0][..., :3] / 255, case[1][..., None]], axis=-1)
    want[..., :3] *= case[1][..., None]
    want = oracle.straight_bytes(want) if kind == np.uint8 else want
    np.testing.assert_allclose(depth_composite(*case), want, rtol=0, atol=1e-6)


@given(seeds, sizes, scales)
def test_coverage_stays_within_zero_and_one(seed, size, scale):
    case = frame(seed, size, scale, kind=np.float32)
    case[3][..., 3] = np.random.default_rng(seed).uniform(-1, 3, case[4].shape)
    coverage = depth_composite(*case)[..., 3]
    assert coverage.min() >= 0
    assert coverage.max() <= 1
    assert_equals(coverage, oracle.depth_composite(*case)[..., 3])


@given(seeds, sizes, scales, kinds, spaces)
def test_channels_are_treated_alike(seed, size, scale, kind, space):
    drawing, alpha, depth, rendered, rendered_depth = frame(seed, size, scale, kind=kind)
    order = [2, 0, 1, 3]
    got = depth_composite(drawing[..., order], alpha, depth, rendered[..., order], rendered_depth, space=space)
    assert np.array_equal(
        got, depth_composite(drawing, alpha, depth, rendered, rendered_depth, space=space)[..., order]
    )


@given(seeds, sizes, st.sampled_from([2, 3, 4]), kinds)
def test_a_render_enlarged_to_nearest_gives_the_same(seed, size, scale, kind):
    case = frame(seed, size, kind=kind)
    want = depth_composite(*case)
    case[3:] = [values.repeat(scale, axis=0).repeat(scale, axis=1) for values in case[3:]]
    assert_equals(depth_composite(*case), want)


@given(seeds, sizes, scales, kinds)
def test_memory_order_and_kind_of_input_do_not_matter(seed, size, scale, kind):
    case = frame(seed, size, scale, kind=kind)
    want = depth_composite(*case)
    assert np.array_equal(depth_composite(*map(np.asfortranarray, case)), want)
    wide = [values.repeat(2, axis=0).repeat(3, axis=1)[::2, ::3] for values in case]
    assert np.array_equal(depth_composite(*wide), want)
    assert np.array_equal(depth_composite(*(values.tolist() for values in case)), want)
    backwards = [values[::-1, ::-1].copy()[::-1, ::-1] for values in case]
    assert np.array_equal(depth_composite(*backwards), want)
    assert np.array_equal(depth_composite(*case[:1], *(values.astype(float) for values in case[1:3]), *case[3:]), want)


def test_the_drawings_own_alpha_is_not_used():
    case = frame(5, (3, 80))
    want = depth_composite(*case)
    case[0][..., 3] = 0
    assert np.array_equal(depth_composite(*case), want)
    assert np.array_equal(depth_composite(case[0][..., :3], *case[1:]), want)


def test_out_is_filled_and_returned():
    case = frame(6, (5, 70), 2)
    for dtype in (np.uint8, np.float32):
        out = np.full((5, 70, 4), 77, dtype)
        assert depth_composite(*case, out=out) is out
        assert np.array_equal(out, depth_composite(*case, dtype=dtype))


@pytest.mark.parametrize("size", [(0, 0), (0, 7), (7, 0)])
def test_empty_pictures_give_empty_pictures(size):
    for scale in (1, 2):
        assert depth_composite(*frame(1, size, scale)).shape == (*size, 4)
        assert holdout_matte(*frame(1, size, scale)[1:3], frame(1, size, scale)[4]).shape == size


def wrong(argument, value, scale=1, kind=np.float32, at=None):
    """A good case with one argument replaced, or one value of it."""
    names = ("drawing", "alpha", "drawing_depth", "rendered", "rendered_depth")
    case = dict(zip(names, frame(2, (3, 70), scale, 4, kind), strict=True))
    if at is None:
        case[argument] = value
    else:
        case[argument][at] = value
    return case


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("drawing", np.zeros((3, 70), np.uint8)),
        ("drawing", np.zeros((3, 70, 3))),
        ("drawing", np.full((3, 70, 3), 256)),
        ("drawing", [[1], [1, 2]]),
        ("alpha", np.zeros((70, 3))),
        ("alpha", "opaque"),
        ("drawing_depth", np.zeros((3, 69))),
        ("rendered", np.zeros((3, 70, 3))),
        ("rendered", np.zeros((3, 71, 4))),
        ("rendered", np.zeros((6, 70, 4))),
        ("rendered", np.zeros((7, 140, 4))),
        ("rendered", np.zeros((1, 35, 4))),
        ("rendered", np.zeros((3, 70, 4), np.uint16) + 256),
        ("rendered", np.zeros((3, 70, 4), complex)),
        ("rendered", [[1], [1, 2]]),
        ("rendered_depth", np.zeros((6, 140))),
        ("rendered_space", "srgb"),
        ("space", "rec709"),
        ("dtype", np.uint16),
        ("dtype", "paper"),
        ("out", np.zeros((3, 70, 3), np.uint8)),
        ("out", np.zeros((3, 70, 4), np.uint16)),
        ("out", np.zeros((70, 3, 4), np.uint8).swapaxes(0, 1)),
        ("out", [[0]]),
        ("out", np.broadcast_to(np.uint8(0), (3, 70, 4))),
    ],
)
def test_wrong_input_is_named(argument, value):
    with pytest.raises(ValueError, match=f"^{argument}: "):
        depth_composite(**wrong(argument, value))


@pytest.mark.parametrize("at", [(0, 0), (2, 69), (1, 64)])
@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("alpha", np.nan),
        ("alpha", -0.001),
        ("alpha", 1.001),
        ("drawing_depth", np.nan),
        ("drawing_depth", -np.inf),
        ("rendered_depth", np.nan),
        ("rendered_depth", -np.inf),
        ("rendered", np.nan),
        ("rendered", np.inf),
        ("rendered", -np.inf),
    ],
)
def test_wrong_values_are_named_with_row_and_column(argument, value, at):
    place = rf"^{argument}: .* at row {at[0]}, column {at[1]}$"
    for scale in (1, 2):
        case = wrong(argument, value, scale, at=(*at, at[0]) if argument == "rendered" else at)
        with pytest.raises(ValueError, match=place):
            depth_composite(**case)
    if argument != "rendered":
        matte = {name: case[name] for name in ("alpha", "drawing_depth", "rendered_depth")}
        with pytest.raises(ValueError, match=place):
            holdout_matte(**matte)


def test_the_first_of_many_faults_is_named_whatever_the_threads():
    case = wrong("rendered_depth", np.nan, at=...)
    case["alpha"] = np.full((3, 70), np.nan)
    for _ in range(20):
        with pytest.raises(ValueError, match=r"^alpha: .* row 0, column 0$"):
            depth_composite(**case)


def test_out_must_not_be_an_input():
    case = frame(3, (3, 70))
    with pytest.raises(ValueError, match="^out: shares memory"):
        depth_composite(*case, out=case[3])
    with pytest.raises(ValueError, match="^out: want .* float32, got"):
        depth_composite(*case, out=np.zeros((3, 70, 4), np.uint8), dtype=np.float32)


DIGEST = """
import hashlib
from pegbar import depth_composite, holdout_matte
from tests.layer.test_composite import frame
digest = hashlib.sha256()
for scale in (1, 2, 3):
    case = frame(scale, (67, 301), scale, kind="f4")
    for options in ({}, {"rendered_space": "linear", "dtype": "u1"}, {"rendered_space": "linear", "space": "linear"}):
        digest.update(depth_composite(*case, **options))
    digest.update(holdout_matte(*case[1:3], case[4]))
print(digest.hexdigest())
"""


def test_the_number_of_threads_does_not_change_a_bit():
    def digest(threads):
        settings = os.environ | {"RAYON_NUM_THREADS": threads}
        run = subprocess.run([sys.executable, "-c", DIGEST], env=settings, capture_output=True, text=True, check=True)
        return run.stdout

    assert len(digest("1").strip()) == hashlib.sha256().digest_size * 2
    assert digest("1") == digest("2")


@given(seeds, sizes, scales)
def test_mattes_equal_their_definition(seed, size, scale):
    _, alpha, depth, rendered, rendered_depth = frame(seed, size, scale, kind=np.float32)
    np.testing.assert_allclose(
        holdout_matte(alpha, depth, rendered_depth), oracle.matte(alpha, depth, None, rendered_depth), atol=1e-6
    )
    covered = rendered[..., 3] * 2 - 0.5
    np.testing.assert_allclose(
        visible_matte(alpha, depth, covered, rendered_depth),
        oracle.matte(alpha, depth, covered, rendered_depth),
        atol=1e-6,
    )


@given(seeds, sizes)
def test_mattes_do_the_composite_again(seed, size):
    drawing, alpha, depth, rendered, rendered_depth = case = frame(seed, size, kind=np.float32)
    want = depth_composite(*case)
    hue = np.concatenate([drawing[..., :3] / 255, np.ones((*size, 1))], axis=-1)
    holdout = holdout_matte(alpha, depth, rendered_depth)[..., None]
    visible = visible_matte(alpha, depth, rendered[..., 3], rendered_depth)[..., None]
    np.testing.assert_allclose(rendered * (1 - holdout) + hue * visible, want, atol=1e-6)
    rendered_depth[rendered[..., 3] == 0] = np.inf
    holdout = holdout_matte(alpha, depth, rendered_depth)[..., None]
    again = rendered * (1 - holdout) + hue * holdout
    whole = np.isin(rendered[..., 3], (0, 1))
    np.testing.assert_allclose(again[whole], depth_composite(*case)[whole], atol=1e-6)


def test_matte_sizes_are_named():
    for name, arguments in (
        ("alpha", ([1.0], [[1.0]], [[1.0]], [[1.0]])),
        ("drawing_depth", ([[1.0]], [[1.0, 1.0]], [[1.0]], [[1.0]])),
        ("rendered_alpha", ([[1.0]], [[1.0]], [[1.0, 1.0]], [[1.0]])),
        ("rendered_alpha", ([[1.0]], [[1.0]], [[np.nan]], [[1.0]])),
        ("rendered_depth", ([[1.0]], [[1.0]], [[1.0, 1.0]], [[1.0, 1.0]])),
    ):
        with pytest.raises(ValueError, match=f"^{name}: "):
            visible_matte(*arguments)
