import numpy as np
import pytest

from pegbar.puppet.clip_poses import clip_times, continued
from pegbar.puppet.performance import Direction, perform
from tests.puppets import arm_puppet, clip, turned_poses


def arm_clip(puppet, degrees, frame_rate=30.0):
    return clip(turned_poses(puppet, degrees), frame_rate=frame_rate)


def test_the_recognised_frame_is_the_picture():
    puppet = arm_puppet().changed(pose_frame=3)
    made = perform(puppet, arm_clip(puppet, [50, 30, 15, 0, -20.0]), Direction(inflation=0))
    assert len(made) == 5
    assert np.allclose(made.meshes[3], puppet.vertices, atol=1e-6)
    assert np.abs(made.meshes[0] - puppet.vertices).max() > 20
    assert made.notes == ()
    handles = puppet.joint_handles
    assert np.allclose(made.meshes[:, puppet.handles[handles]], puppet.camera.project(made.poses), atol=1e-6)


def test_a_transition_begins_as_drawn_and_ends_in_the_clip():
    puppet = arm_puppet()
    motion = arm_clip(puppet, np.linspace(0, 0, 5) + 60)
    puppet = puppet.changed(pose=puppet.pose)
    plain, led = (perform(puppet, motion, Direction(keep="never", transition=time)) for time in (0.0, 0.5))
    assert len(led) == len(plain) + 16
    assert np.allclose(led.poses[0], puppet.pose)
    assert np.allclose(led.poses[16:], plain.poses)
    steps = np.linalg.norm(np.diff(led.poses[:18], axis=0), axis=2).max(axis=1)
    assert steps.max() < 3 * steps.mean()
    assert steps[0] < steps.mean() / 4


def test_clips_in_a_row_go_on_where_the_last_one_ended():
    puppet = arm_puppet()
    first = turned_poses(puppet, [0, 10, 20.0])
    second = turned_poses(puppet, [40, 30.0]) + np.array([5, 2, 7.0])
    made = perform(puppet, [clip(first), clip(second)], Direction(between=0.2, travel="travelling"))
    assert len(made) == 3 + 6 + 2
    assert np.linalg.norm(np.diff(made.poses, axis=0), axis=2).max() < 0.25
    with pytest.raises(ValueError, match="several clips"):
        perform(puppet, [clip(first), clip(second)], Direction(first=0))
    with pytest.raises(ValueError, match="at least one clip"):
        perform(puppet, [])


def test_a_clip_is_continued_on_the_same_floor():
    puppet = arm_puppet()
    before, after = turned_poses(puppet, [0, 10.0]), turned_poses(puppet, [40.0]) + np.array([5, 2, 7.0])
    moved = continued(puppet, after, before)
    assert np.allclose(moved[0, 0, [0, 2]], before[-1, 0, [0, 2]])
    assert moved[..., 1].min() == pytest.approx(before[..., 1].min())


def test_a_following_camera_moves_what_stands_still():
    puppet = arm_puppet()
    poses = np.repeat(puppet.pose[None], 90, axis=0)
    poses[:, :, 0] += np.linspace(0, 1.5, 90)[:, None]
    still, following = (
        perform(puppet, clip(poses), Direction(travel="travelling", camera=camera)) for camera in ("still", "following")
    )
    assert (still.shift == 0).all()
    assert still.meshes[-1, :, 0].mean() - still.meshes[0, :, 0].mean() == pytest.approx(300, rel=0.01)
    assert abs(following.meshes[-1, :, 0].mean() - following.meshes[0, :, 0].mean()) < 40
    assert following.shift[-1, 0] < -260
    with pytest.raises(ValueError, match="want camera of"):
        perform(puppet, clip(poses), Direction(camera="shaky"))


def test_a_loop_is_shorter_and_its_ends_meet():
    puppet = arm_puppet()
    degrees = 30 * np.sin(2 * np.pi * np.arange(70) / 30)
    made = perform(puppet, arm_clip(puppet, degrees), Direction(loop=True))
    assert len(made) == 60
    seam = np.abs(made.meshes[0] - made.meshes[-1]).max()
    assert seam < 1.5 * np.abs(np.diff(made.meshes, axis=0)).max()


def test_times_of_the_pictures():
    puppet = arm_puppet()
    motion = arm_clip(puppet, np.zeros(121), frame_rate=120.0)
    times, rate = clip_times(motion, None, None, None)
    assert (rate, len(times), times[1]) == (30, 31, 4)
    times, rate = clip_times(motion, 10, 20, 24.0)
    assert times.tolist() == [10, 15, 20]
    assert rate == 24
    with pytest.raises(ValueError, match="want a range within 1-121, got 6-122"):
        clip_times(motion, 5, 121, None)
    with pytest.raises(ValueError, match="frame_rate"):
        clip_times(motion, None, None, -1.0)


def test_missing_markers_are_bridged_or_named():
    puppet = arm_puppet()
    poses = turned_poses(puppet, [0, 10, 20, 30.0])
    poses[1:3, 2] = np.nan
    made = perform(puppet, clip(poses))
    assert np.isfinite(made.meshes).all()
    poses[:, 2] = np.nan
    with pytest.raises(ValueError, match="left_hand in any frame"):
        perform(puppet, clip(poses))
