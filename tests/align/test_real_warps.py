import numpy as np
import pytest

from pegbar import film_times, read_motion, retime, root_speeds, sample_markers, time_warp
from tests.align.walks import clip, distances, from_the_side

PAIRS = [("07_01", "35_01"), ("35_01", "07_01"), ("07_01", "02_01"), ("02_01", "35_01")]


@pytest.fixture(scope="module")
def walk(test_data):
    return clip(test_data, "07_01")


def test_a_walk_warped_to_itself_stays(walk):
    seen = from_the_side(walk)
    warp = time_warp(distances(seen, seen))
    assert warp.cost == 0
    np.testing.assert_allclose(warp.times, np.arange(len(seen)), atol=1e-3)


@pytest.mark.parametrize("speed", [0.4, 1.0, 2.5])
def test_the_times_of_a_piece_at_another_speed_are_recovered(walk, speed):
    truth = 100.3 + speed * np.arange(60)
    seen = from_the_side(walk)
    drawn = sample_markers(np.pad(seen, ((0, 0), (0, 0), (0, 1))), truth)[..., :2]
    warp = time_warp(distances(drawn, seen), open_begin=True, open_end=True)
    assert abs(warp.times - truth).max() < 1
    assert abs(warp.frames - truth).max() < 1.5


def test_a_piece_on_twos_is_found_and_held(walk):
    clip = walk.slice(None, None, 10)
    seen = from_the_side(clip)
    warp = time_warp(distances(seen[8:20], seen), open_begin=True, open_end=True)
    np.testing.assert_array_equal(warp.frames, np.arange(8, 20))
    held = retime(clip, film_times(warp.frames, [2] * 12), frame_rate=24)
    assert len(held.positions) == 24
    np.testing.assert_allclose(held.positions[::2], walk.positions[80:200:10], atol=1e-9)
    np.testing.assert_array_equal(held.positions[::2], held.positions[1::2])


def test_uneven_holds_are_played_back_at_the_clips_own_pace(walk):
    film = from_the_side(walk.slice(None, None, 5))
    holds = np.array([1, 2, 2, 3, 1, 1, 2, 3, 2, 2, 1, 2, 2])
    shown = 12 + np.cumsum(holds) - holds
    warp = time_warp(distances(film[shown], film), open_begin=True, open_end=True, holds=holds, stiffness=1000)
    assert abs(warp.frames - shown).max() <= 1
    running = film_times(warp.times, holds, stepped=False)
    assert abs(running[: -holds[-1]] - np.arange(12, 12 + len(running) - holds[-1])).max() < 1
    blind = time_warp(distances(film[shown], film), open_begin=True, open_end=True, stiffness=1000)
    paces = [np.diff(times) / holds[:-1] for times in (warp.times, blind.times)]
    assert paces[0].std() < paces[1].std() / 2


@pytest.mark.parametrize(("drawn", "used"), PAIRS)
def test_a_walk_warped_to_another_does_not_stutter(test_data, drawn, used):
    walks = [clip(test_data, name, step=5) for name in (drawn, used)]
    cost = distances(*map(from_the_side, walks))
    warp = time_warp(cost, open_begin=True, open_end=True, slope_limit=2)
    root = walks[1].markers(["pelvis"])[:, 0]
    speeds = root_speeds(root, warp, clip_rate=24, drawn_rate=24)
    assert speeds.warped.min() == 0
    assert speeds.warped.max() > 1.15 * speeds.clip.max()
    assert speeds.smoothed.min() > 0.35 * speeds.clip.min()
    assert speeds.smoothed.max() < 1.15 * speeds.clip.max()
    accelerations = [24 * np.diff(each).std() for each in speeds]
    assert accelerations[2] < 1.5 * accelerations[0] < accelerations[1] / 2


def test_bones_of_a_retimed_clip_keep_their_lengths(test_data):
    whole = read_motion(test_data / "mocap" / "bvh" / "cmu_07_01.bvh")
    assert whole.rest_frame == 0
    got = retime(whole, np.linspace(0, 300, 77), frame_rate=24)
    boned = np.flatnonzero(np.array(whole.parents) >= 0)
    above = np.array(whole.parents)[boned]
    want, bones = (np.linalg.norm(m.positions[:, boned] - m.positions[:, above], axis=2) for m in (whole, got))
    np.testing.assert_allclose(bones, np.tile(want[0], (77, 1)), atol=1e-6)
    np.testing.assert_allclose(got.positions[0], whole.positions[1], atol=1e-9)
    straight = sample_markers(whole.positions, np.linspace(1, 300, 60))
    assert np.abs(retime(whole, np.linspace(1, 300, 60), frame_rate=24).positions - straight).max() < 2e-3
