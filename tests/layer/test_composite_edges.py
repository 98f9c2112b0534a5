"""Edges between drawing and render: no aliasing beyond what the samples allow, no dark or light fringe."""

import numpy as np
import pytest

from pegbar import depth_composite

SIZE = (12, 24)
DRAWN, RENDERED = np.array([20, 60, 220]), np.array([240, 200, 30])


def samples(scale):
    """Places of a render's samples in the drawing's pixels, (x, y)."""
    rows, columns = np.indices((SIZE[0] * scale, SIZE[1] * scale))
    return (columns - (scale - 1) / 2) / scale, (rows - (scale - 1) / 2) / scale


def composite(rendered, rendered_depth, alpha=1.0, depth=2.0):
    drawing = np.broadcast_to(DRAWN.astype(np.uint8), (*SIZE, 3))
    planes = [np.broadcast_to(np.float32(values), SIZE) for values in (alpha, depth)]
    return depth_composite(drawing, *planes, rendered, rendered_depth)


def plate(covered, color=RENDERED):
    """An opaque or soft render of one colour, straight bytes."""
    coverage = np.rint(255 * np.asarray(covered, float))[..., None]
    return np.concatenate([np.broadcast_to(color, (*coverage.shape[:2], 3)), coverage], axis=-1).astype(np.uint8)


def occluding_edge(scale, shift, angle):
    """A rendered half plane, hard in every sample, in front of a drawn limb."""
    x, y = samples(scale)
    inside = (x - 12 - shift) * np.cos(angle) + (y - 6) * np.sin(angle) < 0
    return composite(plate(inside), np.where(inside, 1.0, np.inf))


def interpenetration(scale, shift, angle):
    """A rendered plane that runs through the drawing's plane along a line."""
    x, y = samples(scale)
    along = (x - 12 - shift) * np.cos(angle) + (y - 6) * np.sin(angle)
    return composite(plate(np.ones_like(x)), 2.0 + 0.05 * along)


def errors(scene, scales):
    """Differences to 32 x 32 samples in levels, over the edge's pixels, for shifts by tenths and several slopes."""
    found = {scale: [] for scale in scales}
    for angle in (0.0, 0.2, np.pi / 4):
        for shift in np.arange(0, 1, 0.1) + 0.013:
            reference = scene(32, shift, angle).astype(float)
            edge = (reference[..., 0] != DRAWN[0]) & (reference[..., 0] != RENDERED[0])
            for scale in scales:
                difference = np.abs(scene(scale, shift, angle) - reference).max(axis=-1)
                found[scale].append(difference[edge])
    return {scale: np.concatenate(values) for scale, values in found.items()}


# Levels of 220, the largest difference of the two colours: mean and largest error of 1, 2 x 2 and 4 x 4 samples.
BOUNDS = {1: (54, 111), 2: (22, 56), 4: (9, 29)}


@pytest.mark.parametrize("scene", [occluding_edge, interpenetration])
def test_more_samples_alias_less(scene):
    found = errors(scene, BOUNDS)
    for scale, (mean, largest) in BOUNDS.items():
        assert found[scale].mean() < mean
        assert found[scale].max() < largest


@pytest.mark.parametrize("scene", [occluding_edge, interpenetration])
@pytest.mark.parametrize("scale", [1, 2, 4])
def test_the_composite_follows_the_edge_monotonically(scene, scale):
    for angle in (0.0, 0.2, np.pi / 4):
        frames = np.array([scene(scale, shift, angle)[..., 0] for shift in np.arange(-2, 2, 0.1)], int)
        steps = np.diff(frames, axis=0)
        assert (steps >= 0).all() if scene is occluding_edge else (steps >= 0).all() or (steps <= 0).all()
        assert (frames[-1] != frames[0]).any()


def over(result, background):
    """The result seen on a plate of one colour."""
    coverage = result[..., 3:] / 255
    return result[..., :3] * coverage + (1 - coverage) * background


def ramp(sharpness=4.0):
    """Coverage of an edge softened over a few pixels."""
    return np.clip(0.5 + (samples(1)[0] - 11.3) / sharpness, 0, 1)


@pytest.mark.parametrize("background", [0.0, 255.0])
@pytest.mark.parametrize("rendered_depth", [1.0, 3.0])
@pytest.mark.parametrize("drawn", [1.0, ramp()[:, ::-1], 0.5])
def test_soft_edges_leave_no_fringe(background, rendered_depth, drawn):
    covered = np.rint(255 * ramp()) / 255
    got = over(composite(plate(covered), np.full(SIZE, rendered_depth), drawn), background)
    a, c = np.broadcast_to(drawn, SIZE)[..., None], covered[..., None]
    near, far = ((RENDERED, c), (DRAWN, a)) if rendered_depth < 2 else ((DRAWN, a), (RENDERED, c))
    want = near[1] * near[0] + (1 - near[1]) * (far[1] * far[0] + (1 - far[1]) * background)
    # Straight bytes: half a level of colour and half a level of coverage.
    assert np.abs(got - want).max() <= 1.01


@pytest.mark.parametrize("rendered_depth", [1.0, 3.0])
def test_a_soft_edge_between_equal_colours_is_invisible(rendered_depth):
    got = composite(plate(ramp(), DRAWN), np.full(SIZE, rendered_depth))
    assert (got == [*DRAWN, 255]).all()


def test_a_limb_in_front_keeps_its_soft_outline_on_an_opaque_render():
    for direction in (1, -1):
        got = composite(plate(np.ones(SIZE)), np.full(SIZE, 3.0), ramp()[:, ::direction])
        steps = np.diff(got[..., :3].astype(int), axis=1) * np.sign(DRAWN - RENDERED) * direction
        assert (steps >= 0).all()
        assert (got[..., 3] == 255).all()
