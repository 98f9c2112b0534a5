import numpy as np
import pytest

from pegbar import OrthographicCamera
from pegbar.align.descriptor import limb_trust, pose_descriptor, pose_distance
from pegbar.scene.body import MARKERS
from pegbar.shot import retiming
from pegbar.shot.retiming import FINE, DrawnLimbs, Marks

SPACING = 0.25


@pytest.fixture
def walk():
    """Poses (G, N, 3) of a clip at ``moments``, and marks of 60 drawings at uneven times of it."""
    chance = np.random.default_rng(3)
    moments = np.arange(0, 80, SPACING)
    waves = chance.normal(0, 0.4, (2, len(MARKERS), 3))
    rest = chance.normal(0, 1, (len(MARKERS), 3))
    phase = moments[:, None, None] * np.linspace(0.03, 0.3, len(MARKERS))[:, None]
    poses = rest + waves[0] * np.sin(phase) + waves[1] * np.cos(phase / 2)
    times = np.linspace(5, 70, 60) + np.sin(np.arange(60) / 5)
    columns = times / SPACING
    seen = OrthographicCamera.from_angles(30, 5).project(poses)
    places = np.stack(
        [
            np.stack([np.interp(columns, np.arange(len(poses)), seen[:, n, a]) for a in (0, 1)], -1)
            for n in range(len(MARKERS))
        ],
        1,
    )
    marks = Marks(100 * places, np.ones(places.shape[:2], bool), MARKERS, np.ones(60), (640, 480))
    return marks, poses, moments, columns


def turned(poses):
    """What drawings see that look from ever farther round: how long a limb is seen differs from one to the next."""
    return lambda row, which: OrthographicCamera.from_angles(20 + row / 4, 5).project(poses[which])


def every_cost(drawn, look, count):
    """All drawings against all poses, whose limbs are trusted by the longest of all: what looks about a time only."""
    costs = []
    for row in range(len(drawn.angles)):
        seen = look(row, slice(None))
        trust = limb_trust(seen, drawn.limbs)
        angles = pose_descriptor(seen, drawn.limbs)
        costs.append(pose_distance(drawn.angles[[row]], angles, a_trust=drawn.trust[[row]], b_trust=trust)[0])
    return np.array(costs)


def test_looking_about_a_time_finds_what_comparing_all_poses_does(walk):
    marks, poses, moments, columns = walk
    drawn, look = DrawnLimbs.of(marks), turned(poses)
    costs = every_cost(drawn, look, len(poses))
    begin = columns + np.random.default_rng(0).uniform(-2, 2, len(columns))
    found = drawn.retimed(look, moments, begin)
    settled = retiming._smoothly_cheap(costs, np.zeros(60, np.intp), len(poses) - 1, begin, marks.holds)
    np.testing.assert_allclose(found.times, settled * SPACING, atol=1e-9)
    np.testing.assert_allclose(found.cost, costs[:, ::FINE], atol=1e-9)
    assert found.thinned == (1, 1)
    np.testing.assert_allclose(found.warp.times, settled / FINE, atol=1e-9)
    np.testing.assert_array_equal(found.warp.frames, np.rint(settled / FINE))
    assert found.warp.cost == pytest.approx(costs[np.arange(60), FINE * found.warp.frames].sum())
    np.testing.assert_array_equal(found.moments, moments[::FINE])


def test_a_long_shots_drawings_each_see_few_poses(walk, monkeypatch):
    marks, poses, moments, columns = walk
    drawn, look, asked = DrawnLimbs.of(marks), turned(poses), []

    def counted(row, which):
        seen = look(row, which)
        asked.append(len(seen))
        return seen

    exact = drawn.retimed(look, moments, columns)
    monkeypatch.setattr(retiming, "_POSES", 40)
    monkeypatch.setattr(retiming, "_SHOWN", 25)
    found = drawn.retimed(counted, moments, columns)
    assert sum(asked) <= 60 * (40 + 2 * FINE + 3 + 1) + 25 * 25
    assert np.abs(found.times - exact.times).max() < 0.1
    assert found.thinned == (3, 4)
    assert found.cost.shape == (20, 20)
    assert np.abs(found.cost - exact.cost[::3, ::4]).max() < 0.2


def test_all_drawings_that_look_one_way_are_settled_together(walk):
    marks, poses, _, columns = walk
    drawn, seen = DrawnLimbs.of(marks), OrthographicCamera.from_angles(30, 5).project(poses)
    found = drawn.settled(seen, columns + np.random.default_rng(0).uniform(-2, 2, len(columns)))
    assert np.abs(found - columns).mean() < 0.25


def test_a_warp_finds_the_drawings_in_the_clip_or_says_that_it_is_too_short(walk):
    marks, poses, moments, columns = walk
    drawn, seen = DrawnLimbs.of(marks), OrthographicCamera.from_angles(30, 5).project(poses)
    assert np.abs(drawn.warped(seen, moments) - columns).max() < 2 * FINE
    with pytest.raises(ValueError, match="frames 0 to 18 are too few for 60 drawings"):
        drawn.warped(seen[: 18 * FINE + 1], moments[: 18 * FINE + 1])


@pytest.mark.parametrize("poses", [1, 4, 999, 2000, 2001, 4000, 4001, 8000, 8001, 10_000, 100_003])
def test_what_is_compared_is_bounded_and_what_is_shown_is_among_it(poses):
    spread, (rows, columns) = retiming._thinned(2500, poses)
    assert -(-poses // spread) <= 2000
    assert FINE * columns % spread == 0
    assert -(-poses // (FINE * columns)) <= 1000
    assert rows == 3
    assert poses > 2000 or (spread, columns) == (1, 1)
