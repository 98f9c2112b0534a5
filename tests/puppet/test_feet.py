import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import label

from pegbar.io.motion import read_motion
from pegbar.io.puppet_input import read_puppet_input
from pegbar.puppet.clip_poses import clip_markers, clip_times
from pegbar.puppet.drawn_pose import drawn_pose
from pegbar.puppet.feet import held, standing_feet, standing_legs
from pegbar.puppet.make import make_puppet
from pegbar.puppet.performance import Direction, perform, root_joint
from pegbar.puppet.retarget import body_scale
from pegbar.puppet.root_path import horizontal_path
from tests.figures import animal, clip, figure


@pytest.fixture(scope="module", params=[("char1", "cmu_35_01"), ("char4", "cmu_07_01")], ids=lambda pair: pair[0])
def walking(request, test_data):
    name, walk = request.param
    source = read_puppet_input(test_data / "drawings" / "animated_drawings" / name / "texture.png")
    motion = read_motion(test_data / "mocap" / "bvh" / f"{walk}.bvh")
    return make_puppet(source, motion, field_of_view=np.radians(20), completion="flat"), motion


def slides(puppet, motion, direction):
    """By how many pixels each standing foot leaves the place on the moving ground that it has on the whole."""
    made = perform(puppet, motion, direction)
    times, _ = clip_times(motion, None, None, direction.frame_rate)
    markers, rest, root = clip_markers(puppet, motion, times), drawn_pose(puppet), root_joint(puppet)
    reference = clip_markers(puppet, motion, [puppet.pose_frame])[0]
    scale = body_scale(puppet, rest, reference)
    gone, way = (
        horizontal_path(markers[:, root], reference[root], scale, travel) for travel in ("travelling", direction.travel)
    )
    stands = standing_feet(motion)[np.rint(times).astype(int)]
    found = []
    for leg in standing_legs(puppet):
        runs, count = label(stands[:, leg.side])
        for run in range(1, count + 1):
            frames = np.flatnonzero(runs == run)
            ground = (gone - way)[frames]
            place = np.median(made.poses[frames, leg.foot] + ground, axis=0)
            feet = puppet.camera.project(made.poses[frames, leg.foot])
            found.append(np.linalg.norm(feet - puppet.camera.project(place - ground), axis=1).max())
    return found


@pytest.mark.parametrize("travel", ["in-place", "travelling"])
def test_standing_feet_do_not_slide(walking, travel):
    locked, free = (slides(*walking, Direction(frame_rate=24, travel=travel, feet=feet)) for feet in ("locked", "free"))
    assert len(locked) == len(free) > 3
    assert max(locked) < 0.5
    assert np.mean(free) > 5


def test_locked_legs_keep_their_length_and_move_smoothly(walking):
    puppet, motion = walking
    made, rest = perform(puppet, motion, Direction(frame_rate=30, travel="in-place")), drawn_pose(puppet)
    assert np.isfinite(made.meshes).all()
    lengths = np.linalg.norm(np.diff(made.poses[:, puppet.bones], axis=2)[:, :, 0], axis=2)
    drawn = np.linalg.norm(np.diff(rest[puppet.bones], axis=1)[:, 0], axis=1)
    # Only shoulders and hips, which keep their places in the picture, may be a little nearer to the spine.
    across = np.array([puppet.names[child].endswith(("_shoulder", "_hip")) for child in puppet.bones[:, 1]])
    wanted = np.broadcast_to(drawn, lengths.shape)
    np.testing.assert_allclose(lengths[:, ~across], wanted[:, ~across], rtol=1e-6)
    np.testing.assert_allclose(lengths[:, across], wanted[:, across], rtol=0.05)
    # Twice the speed of the clip's own feet in the figure's scale is no jump.
    feet = [leg.foot for leg in standing_legs(puppet)]
    assert (np.linalg.norm(np.diff(made.poses[:, feet], axis=0), axis=2) * 30).max() < 5
    # A walk's body rises and sinks little.
    assert np.ptp(made.poses[:, root_joint(puppet), 1]) < 0.1 * np.ptp(rest[:, 1])


def test_a_figure_that_stands_as_in_the_clip_stays_as_drawn():
    puppet, motion = make_puppet(figure(), clip(), completion="flat"), clip()
    assert standing_feet(motion).all()
    made = perform(puppet, motion, Direction(frame_rate=30, inflation=0))
    np.testing.assert_allclose(made.meshes[puppet.pose_frame], puppet.vertices, atol=0.5)


def test_feet_are_free_where_legs_are_none_of_the_clips(test_data):
    assert standing_legs(make_puppet(animal(), clip(), completion="flat")) == ()
    walk = read_motion(test_data / "mocap" / "bvh" / "cmu_35_01.bvh")
    puppet = make_puppet(figure(), walk, completion="flat")
    always, free = (perform(puppet, walk, Direction(keep="always", feet=feet)).poses for feet in ("locked", "free"))
    np.testing.assert_array_equal(always, free)
    names = [name for name in clip().names if not name.endswith("foot")]
    assert standing_feet(clip(names=names)) is None
    with pytest.raises(ValueError, match=r"want feet of locked, free, got 'glued'"):
        perform(puppet, walk, Direction(feet="glued"))


def test_a_second_clip_of_fewer_frames_is_stood_on_as_well(walking):
    puppet, motion = walking
    short = motion.slice(200, 240)
    made = perform(puppet, [motion, short], Direction(frame_rate=24))
    assert np.isfinite(made.meshes).all()
    feet = [leg.foot for leg in standing_legs(puppet)]
    low = made.poses[:, feet, 1].min(axis=1)
    assert low[-8:].min() == pytest.approx(low[:-16].min(), abs=0.05)


@given(st.lists(st.booleans(), min_size=1, max_size=40), st.integers(0, 999))
def test_held_feet_stay_in_each_run_and_ease_between(stands, seed):
    stands = np.array(stands)
    places = np.random.default_rng(seed).normal(size=(len(stands), 3))
    moves = held(places, stands)
    runs, count = label(stands)
    for run in range(1, count + 1):
        assert np.ptp((places + moves)[runs == run], axis=0).max() < 1e-9
    if not count:
        assert not moves.any()
        return
    known = np.flatnonzero(stands)
    assert (moves[: known[0]] == moves[known[0]]).all()
    assert (moves[known[-1] :] == moves[known[-1]]).all()
    for first, second in itertools.pairwise(known):
        low, high = np.sort(moves[[first, second]], axis=0)
        assert ((low - 1e-9 <= moves[first : second + 1]) & (moves[first : second + 1] <= high + 1e-9)).all()
