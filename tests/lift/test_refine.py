import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from pegbar import OrthographicCamera, PerspectiveCamera, _kernels, drawn_lengths, reconstruct_markers
from pegbar.scene.limb_tree import limb_tree
from tests.figures import LENGTHS, LIMBS, spans, swinging
from tests.oracles import signs as oracle

SIDE = OrthographicCamera.from_angles(45, 15, 300, (320, 240))
NEAR = PerspectiveCamera.look_at((2, 1.5, 4), (0, 0.9, 0), (1280, 720), 0.7)
seeds = st.integers(0, 2**32)


def refined(drawn, clip, camera, lengths=LENGTHS, limbs=LIMBS, **options):
    return reconstruct_markers(drawn, clip, camera, limbs, lengths, refine=True, **options)


def off(points, truth):
    return float(np.sqrt(np.mean(np.sum((points - truth) ** 2, axis=-1))))


def track(seed, frames):
    random = np.random.default_rng(seed)
    planar, clip, noise = (
        random.uniform(0, 0.42, frames),
        random.normal(0, 0.3, frames),
        random.uniform(0, 0.02, frames),
    )
    return planar, clip, noise, random.uniform(0.001, 0.1), random.uniform(0.05, 0.5)


def rows(planar, clip, noise, jolt, doubt):
    return planar[None], clip[None], noise[None], np.array([[jolt, doubt]])


@given(seeds, st.integers(1, 8))
def test_the_signs_are_the_best_of_all(seed, frames):
    one = track(seed, frames)
    lengths = 0.4 + 0.01 * np.arange(frames)
    got = _kernels.limb_depths(rows(*one), lengths[None])[0]
    planar, clip, noise, *scales = one
    variance = oracle.depth_variance(planar, noise, lengths)
    # The cost, not the signs: capped doubts can make two choices equal.
    assert oracle.sign_cost(got, variance, clip, *scales) == pytest.approx(oracle.best_depths(*one, lengths)[1])
    assert_allclose(np.abs(got), oracle.depth_sizes(planar, lengths), atol=1e-12)


@given(seeds, st.integers(1, 8))
def test_lengths_cost_what_the_slow_sum_says(seed, frames):
    one = track(seed, frames)
    candidates = np.array([0.35, 0.4, 0.5])
    got = _kernels.length_costs(rows(*one), candidates[None])[0]
    assert_allclose(got, [oracle.length_cost(*one, length) for length in candidates], atol=1e-9)


@pytest.mark.parametrize("camera", [SIDE, NEAR])
@pytest.mark.parametrize("noise", [0, None])
@pytest.mark.parametrize("seed", range(3))
def test_the_clips_own_picture_gives_the_clip_back(camera, noise, seed):
    clip = swinging(seed, 60)
    for lengths in (LENGTHS, np.tile(LENGTHS, (60, 1))):
        assert off(refined(camera.project(clip), clip, camera, lengths, noise=noise), clip) < (
            2e-3 if noise is None else 1e-6
        )


@pytest.mark.parametrize("camera", [SIDE, NEAR])
def test_lengths_and_a_rough_clip_give_the_drawn_figure(camera):
    truth = swinging(3, 90)
    clip = truth + 0.6 * (swinging(4, 90) - truth)
    drawn = camera.project(truth)
    assert off(refined(drawn, clip, camera), truth) < 0.15 * off(clip, truth)
    assert off(refined(drawn, clip, camera, None), truth) < 0.5 * off(clip, truth)
    assert_allclose(drawn_lengths(drawn, clip, camera, LIMBS), LENGTHS, rtol=0.08)


@settings(max_examples=20)
@given(seeds, st.floats(0, 5), st.sampled_from([SIDE, NEAR]), st.booleans())
def test_limbs_have_exactly_their_lengths(seed, noise, camera, own):
    truth, clip = swinging(seed, 20), swinging(seed + 1, 20)
    drawn = camera.project(truth) + noise * np.random.default_rng(seed).normal(size=(20, 11, 2))
    drawn[3:6, 4] = np.nan
    lengths = LENGTHS * (1 + 0.1 * np.sin(np.arange(20)))[:, None] if own else LENGTHS
    got = refined(drawn, clip, camera, lengths)
    assert_allclose(spans(got), np.broadcast_to(lengths, (20, 10)), atol=1e-9)
    free = spans(refined(drawn, clip, camera, None))
    assert_allclose(free, np.broadcast_to(free[0], free.shape), atol=1e-9)


def test_noise_is_smoothed_away():
    truth = swinging(5, 90)
    drawn = SIDE.project(truth) + np.random.default_rng(0).normal(size=(90, 11, 2)) * 3
    errors = {noise: off(refined(drawn, truth, SIDE, noise=noise), truth) for noise in (0, 3, None)}
    assert errors[None] < 0.7 * errors[0]
    assert errors[None] == pytest.approx(errors[3], rel=0.3)


@given(seeds, st.floats(0.1, 10), st.floats(-500, 500))
@settings(max_examples=10)
def test_the_pictures_unit_and_place_do_not_matter(seed, scale, shift):
    truth, clip = swinging(seed, 12), swinging(seed + 1, 12)
    drawn = SIDE.project(truth)
    other = OrthographicCamera(SIDE.rotation, SIDE.scale * scale, SIDE.center * scale + shift)
    for lengths in (LENGTHS, None):
        got = refined(drawn * scale + shift, clip, other, lengths)
        assert_allclose(got, refined(drawn, clip, SIDE, lengths), atol=1e-5)


@given(seeds, st.tuples(*[st.floats(-20, 20)] * 3))
@settings(max_examples=10)
def test_moving_everything_moves_the_answer(seed, step):
    truth, clip = swinging(seed, 12), swinging(seed + 1, 12)
    moved = SIDE.project(truth + step)
    assert_allclose(refined(moved, clip + step, SIDE), refined(SIDE.project(truth), clip, SIDE) + step, atol=1e-5)


def test_hidden_marks_follow_their_limbs():
    truth = swinging(6, 60)
    drawn = SIDE.project(truth)
    drawn[20:26, 4], drawn[:, 8] = np.nan, np.nan
    got = refined(drawn, truth, SIDE)
    assert np.isfinite(got).all()
    assert off(got[:, [4, 8]], truth[:, [4, 8]]) < 0.05
    assert off(got[:, :4], truth[:, :4]) < 0.01


def test_limbs_that_no_limb_joins_hang_on_what_is_stiffest():
    truth = swinging(7, 40)
    apart = LIMBS[[1, 3, 5, 7, 9]]
    levels = limb_tree(apart, truth, 0)
    links = [link for level in levels for link in level]
    assert {link[1] for link in links} == set(range(1, 11))
    assert sorted(limb for *_, limb in links) == [-1] * 5 + list(range(5))
    got = refined(SIDE.project(truth), truth, SIDE, LENGTHS[[1, 3, 5, 7, 9]], apart)
    assert off(got, truth) < 0.02


def test_rings_of_limbs_keep_all_their_lengths():
    points = swinging(8, 30, swing=0.2)
    square = np.array([(0, 7), (7, 9), (9, 0)])
    limbs = np.concatenate([LIMBS, [[7, 9]]])
    points[:, 9] = points[:, 0] + (points[:, 7] - points[:, 0]) * [-1, 1, 1] * LENGTHS[8] / LENGTHS[6]
    points[:, 10] = points[:, 9] + [0, -LENGTHS[9], 0]
    lengths = np.array([*LENGTHS, 0.35])
    got = refined(SIDE.project(points), points, SIDE, lengths, limbs)
    assert_allclose(spans(got, limbs), np.broadcast_to(lengths, (30, 11)), atol=1e-9)
    free = refined(SIDE.project(points), points, SIDE, None, limbs)
    assert_allclose(spans(free, square), np.broadcast_to(spans(free, square)[0], (30, 3)), atol=1e-9)


def test_planted_feet_stay_and_limbs_keep_their_lengths():
    truth, clip = swinging(9, 40, 0.3), swinging(10, 40, 0.3)
    planted = np.zeros((40, 11), bool)
    planted[5:15, 8] = planted[25:40, 10] = True
    drawn = SIDE.project(truth)
    got, free = (refined(drawn, clip, SIDE, planted=stands) for stands in (planted, None))
    for frames, foot in ((slice(5, 15), 8), (slice(25, 40), 10)):
        assert np.ptp(got[frames, foot], axis=0).max() < 1e-12
        assert_allclose(got[frames, foot].mean(axis=0), free[frames, foot].mean(axis=0), atol=1e-9)
    assert_allclose(spans(got), np.broadcast_to(LENGTHS, (40, 10)), atol=1e-6)
    assert_array_equal(got[20], free[20])
    assert np.abs(np.diff(got, axis=0)).max() < 3 * np.abs(np.diff(free, axis=0)).max()


def test_held_markers_are_where_they_are_put():
    truth = swinging(11, 20, 0.3)
    held = np.full((20, 11, 3), np.nan)
    held[8:10, 4] = truth[8:10, 4] + [0.02, -0.03, 0.01]
    got = refined(SIDE.project(truth), truth, SIDE, held=held)
    assert_array_equal(got[8:10, 4], held[8:10, 4])
    assert_allclose(spans(got), np.broadcast_to(LENGTHS, (20, 10)), atol=1e-6)


def test_a_limb_is_flipped_by_hand():
    truth = swinging(12, 30)
    drawn = SIDE.project(truth)
    plain, turned = (refined(drawn, truth, SIDE, noise=0, flips=flips) for flips in ((), [(3, 10, 20)]))
    depths = [SIDE.depth(points[:, 4]) - SIDE.depth(points[:, 3]) for points in (plain, turned)]
    assert_allclose(depths[1][10:20], -depths[0][10:20], atol=1e-9)
    assert_allclose(np.delete(depths[1], slice(10, 20)), np.delete(depths[0], slice(10, 20)), atol=1e-9)


def test_squash_and_stretch_are_kept_or_removed():
    truth = swinging(13, 40)
    pulled = truth.copy()
    pulled[:, 4] += (1.3 - 1) * (truth[:, 4] - truth[:, 3])
    pulled[:, :, 1] *= (1 + 0.1 * np.sin(np.arange(40) / 5))[:, None]
    for camera in (SIDE, NEAR):
        drawn = camera.project(pulled)
        assert_allclose(camera.project(refined(drawn, truth, camera, stretch=True)), drawn, atol=1e-6)
        assert_allclose(spans(refined(drawn, truth, camera)), np.broadcast_to(LENGTHS, (40, 10)), atol=1e-9)


@pytest.mark.parametrize("lengths", [LENGTHS, None])
def test_a_figure_that_squashes_is_believed_less_where_it_foreshortens(lengths):
    clip = swinging(15, 60)
    squashed = clip[:, :1] + (clip - clip[:, :1]) * (1 + 0.07 * np.sin(np.arange(60) / 4))[:, None, None]
    drawn = SIDE.project(squashed)
    soft, hard = (off(refined(drawn, clip, SIDE, lengths, noise=noise), squashed) for noise in (None, 0))
    assert soft < 0.05
    assert soft < 0.7 * hard


@pytest.mark.parametrize("frames", [0, 1, 2, 3, 4, 5])
def test_short_sequences(frames):
    clip = swinging(14, frames)
    drawn = SIDE.project(clip)
    for lengths in (LENGTHS, None):
        got = refined(drawn, clip, SIDE, lengths)
        assert got.shape == clip.shape
        assert_allclose(got, clip, atol=5e-2)
    assert drawn_lengths(drawn, clip, SIDE, LIMBS).shape == (10,)


def test_a_limb_without_length_keeps_its_ends_together():
    clip = swinging(15, 20)
    clip[:, 2] = clip[:, 1]
    for lengths in (np.where(np.arange(10) == 1, 0, LENGTHS), None):
        got = refined(SIDE.project(clip), clip, SIDE, lengths)
        assert_allclose(got[:, 2], got[:, 1], atol=1e-12)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"planted": np.zeros((20, 11))}, "planted: want true"),
        ({"planted": np.zeros((20, 10), bool)}, "planted: want shape"),
        ({"held": np.zeros((20, 11, 2))}, "held: want shape"),
        ({"flips": [(10, 0, 5)]}, "flips: .*limb below 10"),
        ({"flips": [(0, 5, 21)]}, r"flips: .*0..20, got \[0, 5, 21\]"),
        ({"flips": [(0, 6, 5)]}, "flips"),
        ({"noise": -1.0}, "noise"),
        ({"root": 11}, "root"),
        ({"limbs": [(1, 1)]}, "limbs: limb 0 joins a marker to itself"),
    ],
)
def test_wrong_options_are_named(options, message):
    clip = swinging(16, 20)
    call = {"limbs": LIMBS, "lengths": None, **options}
    with pytest.raises(ValueError, match=message):
        refined(SIDE.project(clip), clip, SIDE, **call)


@pytest.mark.parametrize("options", [{"stretch": True}, {"flips": [(0, 1, 2)]}, {"noise": 0.0}])
def test_options_of_refine_need_it(options):
    clip = swinging(17, 5)
    with pytest.raises(ValueError, match="refine=True"):
        reconstruct_markers(SIDE.project(clip), clip, SIDE, LIMBS, LENGTHS, **options)


def test_cartoon_proportions_are_noticed():
    clip = swinging(18, 80, 0.5)
    short = clip.copy()
    scales = np.where(LIMBS[:, 1] > 6, 0.45, 1.0)
    for limb, (first, second) in enumerate(LIMBS):
        short[:, second] = short[:, first] + scales[limb] * (clip[:, second] - clip[:, first])
    drawn = SIDE.project(short)
    assert_allclose(drawn_lengths(drawn, clip, SIDE, LIMBS), scales * LENGTHS, rtol=0.06)
    assert off(refined(drawn, clip, SIDE, None), short) < 0.05


def test_where_limbs_stretch_the_clip_counts_more():
    clip = swinging(19, 80, 0.5)
    pulled = clip.copy()
    for limb, (first, second) in enumerate(LIMBS):
        change = 1 + 0.1 * np.sin(np.arange(80) / 6 + limb)
        pulled[:, second] = pulled[:, first] + change[:, None] * (clip[:, second] - clip[:, first])
    drawn = SIDE.project(pulled)
    kept, rigid = (off(refined(drawn, clip, SIDE, None, stretch=stretch), pulled) for stretch in (True, False))
    assert kept < 0.6 * off(clip, pulled)
    assert kept < 0.5 * rigid


def test_a_track_of_cameras_is_taken():
    clip = swinging(20, 12)
    cameras = [
        PerspectiveCamera.look_at((2, 1.5, 4 + frame / 10), (0, 0.9, 0), (1280, 720), 0.7) for frame in range(12)
    ]
    drawn = np.stack([camera.project(pose) for camera, pose in zip(cameras, clip, strict=True)])
    track = type("Track", (), {"cameras": tuple(cameras)})()
    got = refined(drawn, clip, track, noise=0)
    assert off(got, clip) < 1e-6
    assert_array_equal(got, refined(drawn, clip, cameras, noise=0))
