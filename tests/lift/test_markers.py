import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from pegbar import DegenerateError, OrthographicCamera, PerspectiveCamera, reconstruct_markers
from tests.oracles import lift as oracle

LIMBS = [(0, 1), (1, 2), (2, 3), (1, 4), (4, 5)]
SCALE, CENTER = 3.0, (1.0, 2.0)
SIDE = OrthographicCamera.from_angles(45, 15, SCALE, CENTER)
FRONT = PerspectiveCamera.look_at((3, 2, 9), (0, 1, 0), (640, 480), 0.7)


def scene(seed, frames=3):
    random = np.random.default_rng(seed)
    drawn, clip = random.normal(size=(frames, 6, 2)), random.normal(size=(frames, 6, 3))
    return drawn, clip, random.uniform(0.3, 2, len(LIMBS)), random.normal(size=(30, 6, 3))


def orthographic_rows(drawn):
    return [oracle.eq6_orthographic(points, SIDE.rotation, SCALE, CENTER) for points in drawn]


weights = st.floats(0, 3), st.floats(0.05, 3)


@given(st.integers(0, 2**32), *weights)
def test_free_poses_are_equation_11(seed, limb_weight, prior_weight):
    drawn, clip, lengths, _ = scene(seed)
    got = reconstruct_markers(drawn, clip, SIDE, LIMBS, lengths, limb_weight=limb_weight, prior_weight=prior_weight)
    wanted = oracle.reconstruct(orthographic_rows(drawn), clip, LIMBS, lengths, limb_weight, prior_weight)
    assert_allclose(got, wanted, atol=1e-8)


@given(st.integers(0, 2**32), *weights, st.integers(1, 20))
def test_poses_of_components_are_equation_16(seed, limb_weight, prior_weight, components):
    drawn, clip, lengths, training = scene(seed)
    options = {"limb_weight": limb_weight, "prior_weight": prior_weight, "components": components}
    got = reconstruct_markers(drawn, clip, SIDE, LIMBS, lengths, training=training, **options)
    rows = orthographic_rows(drawn)
    wanted = oracle.reconstruct(rows, clip, LIMBS, lengths, limb_weight, prior_weight, training, components)
    assert_allclose(got, wanted, atol=1e-8)


def test_the_printed_weights_are_the_defaults_and_few_poses_have_few_components():
    drawn, clip, lengths, training = scene(5)
    for poses in (None, training, training[:4]):
        got = reconstruct_markers(drawn, clip, SIDE, LIMBS, lengths, training=poses)
        wanted = oracle.reconstruct(orthographic_rows(drawn), clip, LIMBS, lengths, 1e-3, 0.1, poses, 20)
        assert_allclose(got, wanted, atol=1e-8)


@given(st.integers(0, 2**32))
def test_perspective_residuals_are_pixels_times_depth_over_focal_length(seed):
    drawn, clip, lengths, _ = scene(seed)
    drawn = FRONT.project(clip) + 5 * drawn
    rows = [oracle.eq6_perspective(points, FRONT.matrix, FRONT.focal_length) for points in drawn]
    wanted = oracle.reconstruct(rows, clip, LIMBS, lengths, 1e-3, 0.1)
    assert_allclose(reconstruct_markers(drawn, clip, FRONT, LIMBS, lengths), wanted, atol=1e-8)


@pytest.mark.parametrize("camera", [SIDE, FRONT, [SIDE, FRONT, FRONT.scaled(2)]])
def test_the_clips_own_picture_gives_the_clip_back(camera):
    _, clip, _, _ = scene(6)
    clip[:] = clip[0] + np.arange(3)[:, None, None] * 0.1
    spans = np.linalg.norm([clip[0, i] - clip[0, j] for i, j in LIMBS], axis=1)
    cameras = camera if isinstance(camera, list) else [camera] * 3
    drawn = np.stack([one.project(pose) for one, pose in zip(cameras, clip, strict=True)])
    for training in (None, clip[:3]):
        assert_allclose(reconstruct_markers(drawn, clip, camera, LIMBS, spans, training=training), clip, atol=1e-9)
    assert_allclose(reconstruct_markers(drawn, clip, camera, LIMBS, None), clip, atol=1e-9)


@given(st.integers(0, 2**32), st.floats(0.1, 100), st.floats(-50, 50))
def test_the_pictures_unit_and_place_do_not_matter(seed, scale, shift):
    drawn, clip, lengths, _ = scene(seed)
    other = OrthographicCamera(SIDE.rotation, SCALE * scale, np.multiply(CENTER, scale) + shift)
    got = reconstruct_markers(drawn * scale + shift, clip, other, LIMBS, lengths)
    assert_allclose(got, reconstruct_markers(drawn, clip, SIDE, LIMBS, lengths), atol=1e-9)


@given(st.integers(0, 2**32), st.tuples(*[st.floats(-20, 20)] * 3))
def test_moving_everything_moves_the_answer(seed, step):
    drawn, clip, lengths, training = scene(seed)
    moved = drawn + SIDE.scale * (SIDE.rotation[:2] @ step)
    for poses, further in ((None, None), (training, training + step)):
        base = reconstruct_markers(drawn, clip, SIDE, LIMBS, lengths, training=poses)
        got = reconstruct_markers(moved, clip + step, SIDE, LIMBS, lengths, training=further)
        assert_allclose(got, base + step, atol=1e-7)


def test_a_hidden_marker_follows_limbs_and_clip():
    drawn, clip, lengths, _ = scene(7)
    drawn[1, 2] = np.nan
    got = reconstruct_markers(drawn, clip, SIDE, LIMBS, lengths, limb_weight=0)
    assert_allclose(got[1, 2], clip[1, 2])
    assert not np.allclose(got[1, 3], clip[1, 3])


def test_frames_have_their_own_lengths_and_cameras():
    drawn, clip, lengths, _ = scene(8)
    own = np.stack([lengths, lengths * 2, lengths / 2])
    cameras = [SIDE, FRONT, SIDE]
    together = reconstruct_markers(drawn, clip, cameras, LIMBS, own, limb_weight=1)
    for frame in range(3):
        one = slice(frame, frame + 1)
        alone = reconstruct_markers(drawn[one], clip[one], cameras[frame], LIMBS, own[frame], limb_weight=1)
        assert_array_equal(together[one], alone)


def test_without_a_prior_weight_what_is_open_is_the_clips():
    drawn, clip, lengths, _ = scene(9)
    got = reconstruct_markers(drawn, clip, SIDE, LIMBS, lengths, limb_weight=0, prior_weight=0)
    assert_allclose(SIDE.project(got), drawn, atol=1e-6)
    assert_allclose(SIDE.depth(got), SIDE.depth(clip), atol=1e-6)


def change(**changes):
    drawn, clip, lengths, training = scene(10)
    call = {"aligned": drawn, "prior": clip, "camera": SIDE, "limbs": LIMBS, "lengths": lengths, "training": training}
    return reconstruct_markers(**{**call, **changes})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"aligned": np.zeros((3, 5, 2))}, "aligned: want shape"),
        ({"prior": np.full((3, 6, 3), np.nan)}, "prior: want finite"),
        ({"camera": None}, "camera: want a camera"),
        ({"camera": [SIDE, SIDE]}, "camera: .*3.*got 2"),
        ({"camera": [1, 2, 3]}, "camera: want a camera"),
        ({"limbs": [(0, 6)]}, "limbs: "),
        ({"lengths": [1.0]}, "lengths: want shape"),
        ({"lengths": [1, 1, 1, 1, -1]}, "lengths: .*-1"),
        ({"limb_weight": -1}, "limb_weight"),
        ({"prior_weight": np.nan}, "prior_weight"),
        ({"components": 0}, "components"),
        ({"training": np.zeros((1, 6, 3))}, "training: want at least 2 poses"),
        ({"training": np.zeros((4, 5, 3))}, "training: want shape"),
    ],
)
def test_wrong_arguments_are_named(changes, message):
    with pytest.raises(ValueError, match=message):
        change(**changes)


def test_equal_poses_and_figures_hardly_marked_are_degenerate():
    pose = scene(11)[1][0]
    with pytest.raises(DegenerateError, match="training: all poses are equal"):
        change(training=np.stack([pose] * 9))
    drawn = scene(10)[0]
    drawn[1, :2] = np.nan
    assert change(aligned=drawn).shape == (3, 6, 3)
    drawn[1, 2] = np.nan
    with pytest.raises(DegenerateError, match="frame 1: 3 visible markers"):
        change(aligned=drawn)
