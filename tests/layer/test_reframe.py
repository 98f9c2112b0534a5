"""Pictures, coverage, depth and labels through a camera over the paper: oracles, copies, and what never mixes."""

import numpy as np
import pytest

from pegbar.layer.reframe import reframe_coverage, reframe_nearest, reframe_picture
from pegbar.scene.film_view import FilmView
from tests.oracles import reframe as oracle

PAPER = (14, 11)
CHANCE = np.random.default_rng(5)
ALPHA = CHANCE.uniform(0, 1, (11, 14, 1)).astype(np.float32)
FLOATS = np.concatenate([CHANCE.uniform(0, 2, (11, 14, 3)).astype(np.float32) * ALPHA, ALPHA], axis=2)
BYTES = CHANCE.integers(0, 256, (11, 14, 4), np.uint8)
BYTES[..., 3] = np.maximum(BYTES[..., 3], 1)
LABELS = CHANCE.integers(0, 4, (11, 14)).astype(np.uint8)
VIEWS = [
    FilmView(PAPER, (9, 8), 0.3, -0.7),
    FilmView(PAPER, (9, 8), 2.25, 1.5, 1.6, 33),
    FilmView(PAPER, (12, 10), -1, 0.5, 0.55, -70),
    FilmView(PAPER, (6, 5), 0.013, 0.007, 0.3),
    FilmView(PAPER, PAPER, 6, 4, 3, 181),
]


@pytest.mark.parametrize("view", VIEWS)
def test_it_is_the_filter_s_definition(view):
    expected = oracle.resample(FLOATS, view)
    np.testing.assert_allclose(reframe_picture(FLOATS, view), expected, atol=2e-6)
    np.testing.assert_allclose(reframe_coverage(ALPHA[..., 0], view), expected[..., 3], atol=2e-6)
    assert reframe_coverage(ALPHA[..., 0], view).max() <= 1


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("empty", [0, 3])
def test_labels_are_the_nearest_ones(view, empty):
    assert np.array_equal(reframe_nearest(LABELS, view, empty), oracle.nearest(LABELS, view, empty))


def test_a_pan_by_whole_pixels_copies():
    for picture in (BYTES, FLOATS):
        seen = reframe_picture(picture, FilmView(PAPER, (8, 7), 2, -1))
        assert seen.dtype == picture.dtype
        assert np.array_equal(seen, picture[1:8, 5:13])
    assert np.array_equal(reframe_nearest(LABELS, FilmView(PAPER, (8, 7), 2, -1), 0), LABELS[1:8, 5:13])


def test_a_pan_beyond_the_paper_is_transparent_there():
    seen = reframe_picture(BYTES, FilmView(PAPER, PAPER, 5, -2))
    assert np.array_equal(seen[2:, :9], BYTES[:9, 5:])
    assert not seen[:2].any()
    assert not seen[:, 9:].any()


@pytest.mark.parametrize(("degrees", "turns"), [(90, 1), (180, 2), (270, 3), (-90, 3), (450, 1)])
def test_quarter_turns_copy(degrees, turns):
    """A camera turned clockwise sees the drawing turned the other way."""
    size = PAPER[::-1] if turns % 2 else PAPER
    # The paper's middle: the frame's middle is on whole pixels left and up of it where their difference is odd.
    shift = (0.5, -0.5 + 1) if turns % 2 else (0, 0)
    view = FilmView(PAPER, size, *shift, 1, degrees)
    for picture in (BYTES, FLOATS):
        assert np.array_equal(reframe_picture(picture, view), np.rot90(picture, turns))
    assert np.array_equal(reframe_nearest(LABELS, view, 0), np.rot90(LABELS, turns))


def test_zoom_2_doubles_labels_and_depths():
    view = FilmView((6, 4), (12, 8), 0, 0, 2)
    labels = np.arange(1, 25, dtype=np.uint16).reshape(4, 6)
    assert np.array_equal(reframe_nearest(labels, view, 0), labels.repeat(2, axis=0).repeat(2, axis=1))


def test_depth_is_never_mixed_and_soft_edges_have_one():
    depth = np.full((40, 60), np.inf, np.float32)
    depth[10:30, 10:30], depth[10:30, 30:50] = 2, 5
    alpha = np.isfinite(depth).astype(np.float32)
    for view in (FilmView((60, 40), (60, 40), 0.4, 0.3, 1.3, 17), FilmView((60, 40), (24, 16), 0.4, 0, 0.4, 5)):
        seen, covered = reframe_nearest(depth, view, np.inf), reframe_coverage(alpha, view)
        assert set(np.unique(seen)) == {2, 5, np.inf}
        assert np.isfinite(seen[covered > 0.01]).all()


def test_flat_paper_stays_flat_and_opaque_to_its_edge():
    paper = np.full((20, 30, 4), (9, 200, 77, 255), np.uint8)
    view = FilmView((30, 20), (30, 20), 0.37, 0.21, 1.05, 0.5)
    assert view.beyond == 0
    assert (reframe_picture(paper, view) == (9, 200, 77, 255)).all()


def test_ink_gets_no_halo():
    paper = np.full((20, 30, 4), 255, np.uint8)
    paper[8:12, 5:25, :3] = 40
    seen = reframe_picture(paper, FilmView((30, 20), (30, 20), 0.3, 0.45, 1.4, 8))[..., :3]
    assert seen.min() == 40
    assert seen.max() == 255


def test_another_size_is_refused():
    with pytest.raises(ValueError, match="paper of 14 x 11 pixels, got 14 x 10"):
        reframe_picture(BYTES[:10], VIEWS[0])
